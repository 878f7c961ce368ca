"""Tables behind the drawings: joint axes, key poses, and the section of the workspace drawing."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from er3a.kinematics.forward import frames
from er3a.pipeline.stages.validation.model import Axes, KeyPoses, Section
from er3a.pipeline.stages.validation.validation_findings import KeyPose, NamedPose
from er3a.references.circle_points import CirclePoints
from er3a.references.quantities import (
    MM,
    AxisDistance,
    Extreme,
    Extremity,
    Point,
    Pose,
    SectionExtent,
    angle_between,
    nearest_on_axis,
    nearest_on_line,
    point_of,
    section_of,
)
from er3a.references.reference import ReferenceSet, expected_of
from er3a.references.rows import AxisRow, EnvelopeRow, PositionRow
from er3a.references.subjects import DrawingCorner, DrawingExtent, Reach
from er3a.robots.robot import Grade, Robot

SECTION_STEPS = 60
EXTREMITIES: tuple[Extremity, ...] = ("greatest", "least")

Vector = NDArray[np.float64]
Extremes = Mapping[Extreme, tuple[float, Vector]]


def axes_table(circles: CirclePoints, sets: list[ReferenceSet]) -> Axes:
    """Each stated axis line beside the model's, as its circles show it."""
    rows = []
    for references in sets:
        for row in references.of(AxisRow):
            stated = np.array(row.point_mm)
            direction = circles.axes.direction[row.joint - 1]
            nearest = nearest_on_line(direction, circles.axes.point_mm[row.joint - 1], stated)
            angle = float(angle_between(direction, np.array(row.direction), row.signed))
            distance = float(np.linalg.norm(nearest - stated))
            head = (references.name, row.source, row.grade, row.joint, row.direction, row.point_mm)
            rows.append((*head, direction, nearest, angle, distance, row.uncertainty_deg, row.uncertainty_mm))
    return Axes.of_rows(rows)


@dataclass(frozen=True)
class _Look:
    """A pose at which a source looks at the arm; ``stated`` gives the point from the model's and the frames."""

    source: str
    grade: Grade
    group: str
    name: KeyPose
    point: Point
    pose: Pose
    stated: Callable[[Vector, Vector], Vector]


def key_poses_table(robot: Robot, sets: list[ReferenceSet], extremes: Extremes) -> KeyPoses:
    """The poses at which references look at the arm, with their point and the model's; the zero pose comes first."""
    rows = []
    for references in sets:
        for look in (*_positions(references), *_corners(references), *_extremes(references, extremes)):
            T = frames(robot, np.radians(np.array(look.pose)))
            model = point_of(T, look.point)
            stated = look.stated(model, T)
            head = (references.name, look.source, look.grade, look.group, look.name, look.point, look.pose)
            rows.append((*head, stated, model, float(np.linalg.norm(model - stated))))
    table = KeyPoses.of_rows(rows)
    return table.take(np.argsort((table.q_deg != 0).any(axis=1), kind="stable"))


def section_table(robot: Robot, extremes: Extremes) -> Section:
    """The wrist centre in the side view over a grid of joints 2 and 3 within their limits, and which points lie where
    the region can end: at a limit, or with the elbow straight or folded."""
    elbow = [extremes[AxisDistance("wrist_centre", extreme, 2)][1][2] for extreme in EXTREMITIES]
    q2 = np.linspace(robot.lower[1], robot.upper[1], SECTION_STEPS + 1)
    q3 = np.unique(np.concatenate([np.linspace(robot.lower[2], robot.upper[2], SECTION_STEPS + 1), elbow]))
    grid2, grid3 = np.meshgrid(q2, q3, indexing="ij")
    q = np.zeros((*grid2.shape, 6))
    q[..., 1], q[..., 2] = grid2, grid3
    points = section_of(frames(robot, q))
    return Section(
        q2_deg=np.degrees(grid2).ravel(),
        q3_deg=np.degrees(grid3).ravel(),
        x_mm=points[..., 0].ravel(),
        z_mm=points[..., 1].ravel(),
        on_q2_line=((grid2 == q2[0]) | (grid2 == q2[-1])).ravel(),
        on_q3_line=np.isin(grid3, [q3[0], q3[-1], *elbow]).ravel(),
    )


def _positions(references: ReferenceSet) -> Iterator[_Look]:
    for row in references.of(PositionRow):
        given = np.array([np.nan if value is None else value for value in row.xyz_mm])

        def stated(model: Vector, T: Vector, given: Vector = given) -> Vector:
            return given if np.isnan(given).all() else np.where(np.isnan(given), model, given)

        yield _Look(row.source, row.grade, row.group, NamedPose(row.name), row.point, row.pose, stated)


def _corners(references: ReferenceSet) -> Iterator[_Look]:
    corners: dict[tuple[str, tuple[float, float]], list[EnvelopeRow]] = {}
    for row in references.of(EnvelopeRow):
        if row.corner_deg is not None:
            corners.setdefault((row.source, row.corner_deg), []).append(row)
    for (source, (q2, q3)), rows in corners.items():
        labels = {row.quantity[-1]: (row.value_mm, row.quantity == "abs_x") for row in rows}

        def stated(model: Vector, T: Vector, labels: dict[str, tuple[float, bool]] = labels) -> Vector:
            origin = np.array([T[0, 0, 3], 0.0, T[1, 2, 3]]) * MM
            point = model.copy()
            for coordinate, (value, unsigned) in labels.items():
                k = "xyz".index(coordinate)
                sign = np.sign(model[k] - origin[k]) if unsigned else 1.0
                point[k] = origin[k] + sign * value
            return point

        pose = (0.0, q2, q3, 0.0, 0.0, 0.0)
        yield _Look(source, rows[0].grade, "envelope", DrawingCorner(q2, q3, None), "wrist_centre", pose, stated)


def _extremes(references: ReferenceSet, extremes: Extremes) -> Iterator[_Look]:
    for reference, expected in zip(references.checkable, expected_of(references.checkable)[0]):
        subject, quantity = reference.subject, reference.quantity
        if isinstance(subject, Reach | DrawingExtent) and isinstance(quantity, AxisDistance | SectionExtent):
            value, q = extremes[quantity]
            stated = partial(_extreme_as_stated, quantity, float(expected), value)
            pose = tuple(np.degrees(q).tolist())
            yield _Look(reference.source, reference.grade, reference.group, subject, quantity.point, pose, stated)


def _extreme_as_stated(
    quantity: AxisDistance | SectionExtent, expected: float, value: float, model: Vector, T: Vector
) -> Vector:
    """The model's point shifted to where its extreme would be the stated one."""
    if isinstance(quantity, SectionExtent):
        shift = np.zeros(3)
        shift["xyz".index(quantity.coordinate)] = 1.0
        return model + shift * (expected - value)
    foot = nearest_on_axis(T, quantity.axis, model)
    return foot + (model - foot) * (expected / value) if value > 0 else model
