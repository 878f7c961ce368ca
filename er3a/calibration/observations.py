"""What was measured, and what tables say of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import scipy.sparse
from scipy.spatial import cKDTree

from er3a.by_value import by_identity, frozen
from er3a.calibration.parameters import PARALLEL_RAD, FixedName, PlacementName, placements_of
from er3a.comparison.entries import Entry
from er3a.errors import InputError
from er3a.geometry.transforms import log_rotation, nearest_rotations, transposed
from er3a.kinematics.chain import row_values
from er3a.kinematics.table_batch import frames_of, tables_of
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.references.quantities import COORDINATES, MM, Pose, Rotation3
from er3a.robots.joint_limits import meant, shown
from er3a.robots.robot import Robot

LIMIT_SLACK = 0.01  # deg, mm
SAME_POSE = 1e-4  # rad, m: by which joints may read otherwise at one pose
PLACEMENTS: tuple[PlacementName, ...] = ("base", "tool")
RICH_POSES, FEW = 64, 6  # joint vectors all over the range; places and planes that are looked at there
OF_POINTS = "row_values", "on_tool", "seen", "lines", "touched", "orientations"  # arrays by point
IN_LINE = 1e-9  # m, of points that no plane is seen from
TouchKind = Literal["place", "plane"]
UNKNOWN: dict[TouchKind, int] = {"place": 1, "plane": 3}
"""How many numbers of each coordinate drop out, because nobody knows where a thing is."""


@frozen
class Measurement:
    """Where a point was seen.

    Attributes
    ----------
    row : line of the file
    pose : one value for each joint, deg, or mm of those that slide
    point : flange or tool (the origin of the robot's tool frame)
    xyz_mm : base frame; None for coordinates that weren't measured
    deviation_mm : standard deviation of each coordinate; None if it is unknown
    place, plane : the name of a fixed point (a ball in a socket, a tip) or of a plane that was touched there, of which
        nobody knows where it is; no coordinate is measured then
    turn : rotation of flange or tool in the base frame, rows; None if it wasn't measured
    """

    row: int
    pose: tuple[float, ...]
    point: Literal["flange", "tool"]
    xyz_mm: tuple[float | None, float | None, float | None]
    deviation_mm: float | None = None
    place: str | None = None
    plane: str | None = None
    turn: Rotation3 | None = None

    @property
    def touched(self) -> tuple[TouchKind, str] | None:
        """What was touched, and its name; None where coordinates were measured."""
        return ("place", self.place) if self.place else ("plane", self.plane) if self.plane else None


@frozen
class Touched:
    """A place or plane.

    Attributes
    ----------
    poses : at which it is touched
    unknown : how many of these say nothing, because nobody knows where it is
    coordinates : how many numbers one more pose gives
    """

    kind: TouchKind
    name: str
    poses: int
    unknown: int
    coordinates: int

    @property
    def numbers(self) -> int:
        """Number of independent values that its poses give."""
        return self.coordinates * max(self.poses - self.unknown, 0)


@by_identity
class PointObservations:
    """Measured coordinates of points that the flange carries, and orientations.

    Of an orientation it is observed by how much the model's is turned from the measured one: a rotation vector, in
    mrad, which counts as coordinates in mm do, being what a lever of a metre moves.

    Attributes
    ----------
    row_values : (P, m), rad or m, what the rows of the table move by
    on_tool : (P,) bool, whether the tool's point was measured
    seen : (P, 6) bool, the n values that were measured: three coordinates, three of the rotation vector
    values_mm, deviation_mm : (n,), what was measured, and its standard deviation (1 if unknown)
    orientations : (P, 3, 3), in the base frame; identity where none was measured
    deviation_known : whether the deviations were stated
    lines : (P,), of the file
    free : what is placed by the measurements, too
    touched : (P,), number of the place or plane; -1 where coordinates were measured. What is observed of a place's
        points is their offset from their mean; of a plane's points their distance from the plane that fits them best,
        as one coordinate. Place and plane drop out
    kinds, names : of each number
    """

    row_values: Reals
    on_tool: Flags
    seen: Flags
    values_mm: Reals
    deviation_mm: Reals
    deviation_known: bool
    lines: Integers
    free: tuple[PlacementName, ...]
    touched: Integers
    orientations: Reals
    kinds: tuple[TouchKind, ...] = ()
    names: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.values_mm)

    @property
    def is_length(self) -> Flags:
        """(n,), which of the values are coordinates, and no parts of orientations."""
        return np.nonzero(self.seen)[1] < 3

    @property
    def oriented(self) -> bool:
        """Whether orientations were measured."""
        return bool(self.seen[:, 3:].any())

    @property
    def placements(self) -> tuple[Entry, ...]:
        """The parameters of base and tool, as far as they are free."""
        return placements_of(self.free, self.oriented)

    def rms_mm(self, off: Reals) -> float:
        """Root mean square of the coordinates among differences.

        Parameters
        ----------
        off : (n,), mm and mrad
        """
        return float(np.sqrt(np.mean(off[self.is_length] ** 2)))

    def groups(self) -> list[tuple[TouchKind, Integers]]:
        """Places and planes that are touched.

        Returns
        -------
        groups : of each its kind, and its points (k,), numbers from 0 to P - 1
        """
        numbers = np.unique(self.touched[self.touched >= 0])
        return [(self.kinds[number], np.flatnonzero(self.touched == number)) for number in numbers]

    @property
    def all_touched(self) -> bool:
        """Whether no coordinates were measured."""
        return bool((self.touched >= 0).all())

    @property
    def dropped(self) -> int:
        """How many numbers of places and planes drop out, at most as many as there are of them."""
        return sum(each.coordinates * min(each.poses, each.unknown) for each in self.things())

    def things(self) -> list[Touched]:
        """What is touched, and how often.

        Returns
        -------
        things : places and planes, in the order of :meth:`groups`
        """
        return [
            Touched(
                kind,
                self.names[self.touched[rows[0]]],
                len(self.seen[rows, 0].nonzero()[0]),
                UNKNOWN[kind],
                int(self.seen[rows].sum(axis=1).max()),
            )
            for kind, rows in self.groups()
        ]

    def relative(self, xyz: Reals) -> Reals:
        """What is observed of points: coordinates, offsets from a place's mean, distances from a plane.

        Parameters
        ----------
        xyz : (P, 3), m, base frame

        Returns
        -------
        observed : (P, 3), m; of a plane only the first column counts
        """
        return self.relative_shift(np.pad(xyz, ((0, 0), (0, 3))), xyz)[:, :3] if self.kinds else xyz

    def gathered(self, xyz: Reals) -> Reals:
        """Points with those of one place together, at their mean, so that what turns all of them shows in none.

        Parameters
        ----------
        xyz : (P, 3), m, base frame

        Returns
        -------
        gathered : (P, 3), m
        """
        found = xyz.copy()
        for kind, rows in self.groups():
            if kind == "place":
                found[rows] = xyz[rows].mean(axis=0)
        return found

    def relative_shift(self, shift: Reals, around: Reals) -> Reals:
        """By how much small shifts of points change what is observed, to first order.

        Parameters
        ----------
        shift : (P, 6, ...), m and rad, base frame
        around : (P, 3), m, where the points are

        Returns
        -------
        change : (P, 6, ...), m and rad, columns as of :meth:`relative`
        """
        found = shift.copy()
        for kind, rows in self.groups():
            along, basis = self._dropping(kind, rows, around)
            own = shift[rows] if kind == "place" else np.einsum("pi,pi...->p...", along, shift[rows, :3])[:, None]
            flat = own.reshape(len(rows), -1)
            found[rows, : own.shape[1]] = own - (basis @ np.linalg.lstsq(basis, flat, rcond=None)[0]).reshape(own.shape)
        return found

    def _dropping(self, kind: TouchKind, rows: Integers, around: Reals) -> tuple[Reals, Reals]:
        """For points ``around``: the directions (k, 3) in which those of a plane are observed, and what drops out,
        (k, r), the same for each coordinate of a place."""
        here, every = around[rows], np.ones((len(rows), 1))
        if kind == "place":
            return here, every
        normal, inside = plane(here)
        return every * normal, np.hstack([every, inside])

    def independent(self, robot: Robot) -> tuple[scipy.sparse.csr_array, Integers]:
        """What is observed without what drops out, in standard deviations, near to a robot's table.

        Parameters
        ----------
        robot : whose table says where the points are

        Returns
        -------
        rows : (c, n), orthonormal; they take n observed values to as many as are independent of each other
        last : (c,), the last of the observed values that each is made of
        """
        at, around = np.full(self.seen.shape, -1), self.positions(robot)
        at[self.seen] = np.arange(len(self))
        alone = np.flatnonzero((self.touched < 0)[self.pose_of])
        parts = [(np.arange(len(alone)), alone, np.ones(len(alone)))]
        last = [alone]
        for kind, rows in self.groups():
            basis = self._dropping(kind, rows, around)[1]
            for every in at[rows, :3].T:
                own = every[every >= 0]
                known = _innovations(basis[every >= 0] / self.deviation_mm[own, None])
                first = sum(len(part) for part in last)
                parts.append(
                    (np.repeat(first + np.arange(len(known)), len(own)), np.tile(own, len(known)), known.ravel())
                )
                last.append(own[len(own) - len(known) :][::-1])
        row, column, values = (np.concatenate(part) for part in zip(*parts))
        latest = np.concatenate(last)
        return scipy.sparse.csr_array((values, (row, column)), shape=(len(latest), len(self))), latest

    @property
    def poses(self) -> int:
        """Number of poses."""
        return len(np.unique(self.same_pose))

    @property
    def pose_of(self) -> Integers:
        """(n,), the place of each coordinate's point among the P."""
        return np.nonzero(self.seen)[0]

    def predict(self, robot: Robot) -> Reals:
        """Observed values by a robot.

        Parameters
        ----------
        robot : with any base and tool

        Returns
        -------
        values : (n,), mm, and mrad from the measured orientations
        """
        tool = np.where(self.on_tool[:, None, None], robot.tool[:3, :3], np.eye(3))
        turned = log_rotation(self.turns(robot) @ tool @ transposed(self.orientations))
        return MM * np.hstack([self.relative(self.positions(robot)), turned])[self.seen]

    def positions(self, robot: Robot) -> Reals:
        """Measured points by a robot's table.

        Parameters
        ----------
        robot : with any base and tool

        Returns
        -------
        xyz : (P, 3), m, base frame
        """
        T = frames_of(tables_of(robot), robot, self.row_values)[0][:, -1]
        found: Reals = np.einsum("pij,pj->pi", T[:, :3, :3], self.points(robot)) + T[:, :3, 3]
        return found

    def turns(self, robot: Robot) -> Reals:
        """How a robot's table turns the flange.

        Parameters
        ----------
        robot : with any base

        Returns
        -------
        R : (P, 3, 3)
        """
        found: Reals = frames_of(tables_of(robot), robot, self.row_values)[0][:, -1, :3, :3]
        return found

    def points(self, robot: Robot) -> Reals:
        """Where the measured points are in the flange's frame.

        Parameters
        ----------
        robot : whose tool places the tool's point

        Returns
        -------
        xyz : (P, 3), m; 0 for the flange's own point
        """
        return np.where(self.on_tool[:, None], robot.tool[:3, 3], 0.0)

    def slid(self, robot: Robot) -> Reals:
        """By how much joints that slide have changed what is observed; what drops out with a place doesn't count.

        Parameters
        ----------
        robot : whose axes the joints slide along

        Returns
        -------
        change : (n,), mm
        """
        T = frames_of(tables_of(robot), robot, self.row_values)[0]
        ways = np.where(robot.sliding, robot.direction * self.row_values, 0.0)
        shift = np.einsum("pmi,pm->pi", T[:, :-1, :3, 2], ways)
        shift = np.pad(shift, ((0, 0), (0, 3)))  # what slides turns nothing
        return MM * self.relative_shift(shift, self.positions(robot))[self.seen]

    def take(self, used: Flags) -> PointObservations:
        """Observations of some points.

        Parameters
        ----------
        used : (P,) bool

        Returns
        -------
        observations : in the same order
        """
        of_points = {name: getattr(self, name)[used] for name in OF_POINTS}
        of_values = {name: getattr(self, name)[used[self.pose_of]] for name in ("values_mm", "deviation_mm")}
        return replace(self, **of_points, **of_values)

    @property
    def same_pose(self) -> Integers:
        """(P,), the first of the points whose pose is the same: all joints within ``SAME_POSE``."""
        if not len(self.row_values):
            return np.zeros(0, dtype=np.int64)
        tree, first = cKDTree(self.row_values), np.full(len(self.row_values), -1)
        for k, near in enumerate(tree.query_ball_point(self.row_values, SAME_POSE, p=np.inf)):
            if first[k] < 0:
                own = np.array(near)
                first[own[first[own] < 0]] = k
        return first

    def merged(self) -> PointObservations:
        """Readings of one point, place or plane at one pose as one, their mean.

        What a model misses there is the same each time, so repeated readings don't distinguish it from what it has to
        find.

        Returns
        -------
        observations : with the root mean square of the readings' standard deviations, not divided by their number
        """
        keys = np.column_stack([self.same_pose, self.touched, self.on_tool])
        first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)[1:]
        order = np.argsort(first)
        number = np.argsort(order)[number.ravel()]
        if len(first) == len(keys):
            return self
        values, variance = np.zeros((2, *self.seen.shape))
        values[self.seen], variance[self.seen] = self.values_mm, self.deviation_mm**2
        readings = scipy.sparse.csr_array((np.ones(len(number)), (number, np.arange(len(number)))))
        counts = readings @ self.seen.astype(float)
        seen, counts = counts > 0, np.maximum(counts, 1)
        own = np.sort(first)
        return replace(
            self,
            row_values=readings @ self.row_values / readings.sum(axis=1)[:, None],
            on_tool=self.on_tool[own],
            seen=seen,
            values_mm=(readings @ values / counts)[seen],
            deviation_mm=np.sqrt(readings @ variance / counts)[seen],
            lines=self.lines[own],
            touched=self.touched[own],
            orientations=nearest_rotations((readings @ self.orientations.reshape(-1, 9)).reshape(-1, 3, 3)),
        )

    def shifted(self, amounts: Reals) -> PointObservations:
        """Observations with other moves of the rows.

        Parameters
        ----------
        amounts : (P, m), rad or m, added to what the rows move by

        Returns
        -------
        observations : with the same values
        """
        return replace(self, row_values=self.row_values + amounts)

    def with_deviation(self, deviation_mm: Reals | float) -> PointObservations:
        """Observations with other standard deviations, estimated from what a fit leaves.

        Parameters
        ----------
        deviation_mm : of each value (n,), or of all, mm and mrad

        Returns
        -------
        observations : with the same values
        """
        return replace(self, deviation_mm=np.full(len(self), deviation_mm))

    def rich(self, robot: Robot) -> PointObservations:
        """The same points at poses all over the joint range, to see what could be determined.

        They needn't touch anything: what touches can tell apart shows at any poses, points of a place together.

        Parameters
        ----------
        robot : whose limits the poses keep

        Returns
        -------
        observations : ``RICH_POSES`` poses of each point, with the coordinates that were measured of any, or of the
            first ``FEW`` things if all points touch one; values are 0
        """
        numbers = np.unique(self.touched)[:FEW] if self.all_touched else np.array([-1])
        kinds = [(point, number) for point in np.unique(self.on_tool) for number in numbers]
        seen = [self.seen[self.touched == number].any(axis=0) for _, number in kinds]
        x = row_values(robot, meant(robot, np.array(spread(robot))))
        on_tool, touched = np.repeat(np.array(kinds), len(x), axis=0).T
        return self._imagined(np.tile(x, (len(kinds), 1)), on_tool > 0, np.repeat(seen, len(x), axis=0), touched)

    def as_coordinates(self) -> PointObservations:
        """The same points as if their coordinates were measured.

        Returns
        -------
        observations : P points, nothing touched
        """
        count = len(self.row_values)
        return self._imagined(self.row_values, self.on_tool, np.tile(np.arange(6) < 3, (count, 1)), np.full(count, -1))

    def _imagined(self, row_values: Reals, on_tool: Flags, seen: Flags, touched: Integers) -> PointObservations:
        """Values that are 0, of points that could have been measured."""
        count, lengths = len(row_values), self.is_length
        usual = [np.median(self.deviation_mm[own]) if own.any() else 1.0 for own in (lengths, ~lengths)]
        return replace(
            self,
            row_values=row_values,
            on_tool=on_tool,
            seen=seen,
            values_mm=np.zeros(seen.sum()),
            deviation_mm=np.broadcast_to(np.repeat(usual, 3), seen.shape)[seen],
            lines=np.zeros(count, dtype=np.int64),
            touched=touched,
            orientations=np.tile(np.eye(3), (count, 1, 1)),
        )


def _innovations(basis: Reals) -> Reals:
    """Orthonormal rows (k - r, k) beside a basis (k, r), each with no part in one more of the last places than the row
    before it."""
    outside = np.linalg.qr(basis, mode="complete")[0][:, basis.shape[1] :].T
    return np.asarray(np.linalg.qr(outside[:, ::-1], mode="r"))[:, ::-1]


def plane(xyz: Reals) -> tuple[Reals, Reals]:
    """The plane that fits points best, by singular values.

    Parameters
    ----------
    xyz : (P, 3), m

    Returns
    -------
    normal, within : (3,), unit vector whose largest component is positive, 0 for points in one line, and (P, 2), m,
        where the points are in it
    """
    here = xyz - xyz.mean(axis=0)
    _, sizes, axes = np.linalg.svd(np.linalg.qr(here, mode="r"))
    sense = np.sign(axes[2][np.abs(axes[2]).argmax()])
    return axes[2] * sense * (sizes[1] > IN_LINE), here @ axes[:2].T


def observed(measurements: Sequence[Measurement], robot: Robot, fixed: Sequence[FixedName] = ()) -> PointObservations:
    """Measurements coordinate by coordinate.

    Parameters
    ----------
    measurements : in mm, and joint values in deg, or mm of joints that slide
    fixed : what of base and tool is where the robot's file has it; the tool is free only if its point was measured

    Returns
    -------
    observations : one point for each measurement

    Raises
    ------
    InputError
        for measurements outside the joint limits, of an arm with another number of joints, or, where no coordinates
        are measured, of joints that take all points in one plane
    """
    check_poses(measurements, robot)
    names = [each.touched for each in measurements]
    numbers = {name: k for k, name in enumerate(dict.fromkeys(name for name in names if name))}
    touched = np.array([numbers[name] if name else -1 for name in names], dtype=np.int64)
    values = np.array([_values(each) for each in measurements], dtype=float).reshape(-1, 6)
    seen = np.isfinite(values)
    on_tool = np.array([each.point == "tool" for each in measurements], dtype=bool)
    known = all(each.deviation_mm is not None for each in measurements)
    deviation = np.array([each.deviation_mm if known else 1.0 for each in measurements], dtype=float)
    poses = np.array([each.pose for each in measurements], dtype=float).reshape(-1, robot.joints)
    found = PointObservations(
        row_values=row_values(robot, meant(robot, poses)),
        on_tool=on_tool,
        seen=seen,
        values_mm=values[seen],
        deviation_mm=np.broadcast_to(deviation[:, None], seen.shape)[seen],
        deviation_known=known,
        lines=np.array([each.row for each in measurements], dtype=np.int64),
        free=tuple(
            name for name in PLACEMENTS if name not in fixed and (on_tool if name == "tool" else touched < 0).any()
        ),
        touched=touched,
        orientations=np.array([each.turn or np.eye(3) for each in measurements], dtype=float).reshape(-1, 3, 3),
        kinds=tuple(kind for kind, _ in numbers),
        names=tuple(name for _, name in numbers),
    )
    if found.all_touched and _is_flat(robot, found):
        problem = (
            "the joints that move take all points in one plane, where touches and distances don't show tilted axes"
        )
        raise InputError(None, "measurements", problem, "Move more joints, or measure coordinates")
    return found


def _values(seen: Measurement) -> tuple[float | None, ...]:
    """What is observed: three coordinates, in mm, 0 of what was touched, and the turn from the measured orientation."""
    xyz = (0.0, 0.0, 0.0) if seen.place else (0.0, None, None) if seen.plane else seen.xyz_mm
    return (*xyz, *(None if seen.turn is None else 0.0 for _ in COORDINATES))


def _is_flat(robot: Robot, points: PointObservations) -> bool:
    """Whether the joints that move take all points in one plane by a robot's table."""
    mixed = np.column_stack([np.roll(column, k) for k, column in enumerate(points.row_values.T)])
    x = replace(points, row_values=mixed).positions(robot)
    sizes = np.linalg.svd(x - x.mean(axis=0), compute_uv=False)
    return len(x) >= len(COORDINATES) and bool(sizes[2] < PARALLEL_RAD * sizes[1])


def check_poses(measurements: Sequence[Measurement], robot: Robot, path: str | Path | None = None) -> None:
    """Refuse poses of another arm, or outside the joint limits.

    Parameters
    ----------
    measurements : poses in deg, or mm of joints that slide
    path : file that they were read from, for the message

    Raises
    ------
    InputError
        naming row and joint of the first such pose
    """
    lower, upper = shown(robot, robot.lower), shown(robot, robot.upper)
    units = ["mm" if slides else "deg" for slides in robot.slides]
    for measurement in measurements:
        if (count := len(measurement.pose)) != robot.joints:
            column = f"q{max(count, robot.joints)}_{'deg' if count > robot.joints else units[-1]}"
            problem = f"{count} joint values; {robot.name} has {robot.joints} joints"
            raise InputError(path, f"row {measurement.row}, column {column}", problem, f"Give {robot.joints}")
        for joint, value in enumerate(measurement.pose):
            if robot.continuous[joint] or lower[joint] - LIMIT_SLACK <= value <= upper[joint] + LIMIT_SLACK:
                continue
            problem = (
                f"{value:g} {units[joint]} is outside the limits {lower[joint]:g} .. {upper[joint]:g} of joint "
                f"{joint + 1}"
            )
            remedy = "Check the value, its sign and its unit, or the robot's limits"
            raise InputError(path, f"row {measurement.row}, column q{joint + 1}_{units[joint]}", problem, remedy)


def spread(robot: Robot) -> list[Pose]:
    """Poses all over the joint range, from a quasi-random sequence.

    Parameters
    ----------
    robot : whose limits they keep

    Returns
    -------
    poses : ``RICH_POSES`` of them, deg, or mm of joints that slide, in whole multiples of 5, or at a limit
    """
    low, high = shown(robot, robot.lower), shown(robot, robot.upper)
    rows = np.clip(np.round(quasi_random_points(low, high, RICH_POSES) / 5) * 5, low, high) + 0.0
    return [tuple(row) for row in rows.tolist()]
