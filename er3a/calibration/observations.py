"""What was measured, and what tables say of it: coordinates of points, or of quantities of a reference set."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
import scipy.sparse
from scipy.spatial import cKDTree

from er3a.calibration.outcomes import FixedName, PlacementName
from er3a.calibration.parameters import DEPENDENT, MM, PARALLEL_RAD, Parameter, moved, placed
from er3a.errors import InputError
from er3a.kinematics.chain import row_values
from er3a.kinematics.table_batch import frames_of, join, tables_of
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.references.predict import predict_tables
from er3a.references.quantities import (
    COORDINATES,
    ZERO_POSE,
    CarriedCoordinate,
    PointCoordinate,
    Pose,
    Quantity,
    SectionCoordinate,
)
from er3a.references.reference import ReferenceSet, expected_of, quantities_of
from er3a.robots.joint_limits import meant, shown
from er3a.robots.robot import Robot

LIMIT_SLACK = 0.01  # deg, mm
SAME_POSE = 1e-4  # rad, m: by which joints may read otherwise at one pose
PLACEMENTS: tuple[PlacementName, ...] = ("base", "tool")
HALF_WIDTH_TO_DEVIATION = 1 / np.sqrt(3)
RICH_POSES = 64
TouchKind = Literal["place", "plane", "pair", "bar"]
MIN_LENGTH = 1e-9
SOCKET_STEPS = 50
SOCKET_STEP = 1e-13  # m
TILT = 1e-5  # rad
AT_ONCE = 8_000  # poses of tables whose frames are held at once


@dataclass(frozen=True)
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
    pair : the name that two measurements share whose points are ``length_mm`` apart (a scale bar, touched at both ends)
    bar : the name of a ball bar, whose other end is in a fixed socket of which nobody knows where it is
    length_mm : distance of a pair's points; from the socket, None if it is unknown and the same for all of a bar
    """

    row: int
    pose: tuple[float, ...]
    point: Literal["flange", "tool"]
    xyz_mm: tuple[float | None, float | None, float | None]
    deviation_mm: float | None = None
    place: str | None = None
    plane: str | None = None
    pair: str | None = None
    bar: str | None = None
    length_mm: float | None = None

    @property
    def touched(self) -> tuple[TouchKind, str] | None:
        """What was touched, or a distance's kind, and its name; None where coordinates were measured."""
        named: list[tuple[TouchKind, str | None]] = [
            ("place", self.place), ("plane", self.plane), ("pair", self.pair), ("bar", self.bar)
        ]  # fmt: skip
        return next(((kind, name) for kind, name in named if name), None)


@dataclass(frozen=True, eq=False)
class QuantityObservations:
    """Coordinates of a reference set, in the frame of the arm's base by definition.

    Attributes
    ----------
    quantities : n coordinates at poses
    values_mm, deviation_mm : (n,), what was measured, and its standard deviation
    """

    quantities: tuple[Quantity, ...]
    values_mm: Reals
    deviation_mm: Reals
    free: tuple[PlacementName, ...] = ()
    deviation_known: bool = True

    def __len__(self) -> int:
        return len(self.quantities)

    @property
    def poses(self) -> int:
        """Number of poses."""
        return len({quantity.arm_pose for quantity in self.quantities})

    def predict(self, robot: Robot, parameters: Sequence[Parameter], amounts: Reals) -> Reals:
        """Values (H, n), mm, by the robot's table with each row of amounts (H, p), in m and rad, added."""
        tables = moved(join([tables_of(robot)] * len(amounts)), parameters, amounts)
        return predict_tables(tables, robot, self.quantities)

    def rich(self, robot: Robot) -> QuantityObservations:
        """The same points at poses all over the joint range."""
        points = dict.fromkeys(
            replace(quantity, coordinate=c, pose=ZERO_POSE)
            if isinstance(quantity, CarriedCoordinate | PointCoordinate)
            else PointCoordinate(ZERO_POSE, "wrist_centre", c)
            for quantity in self.quantities
            for c in COORDINATES
        )
        return self._of(tuple(replace(point, pose=pose) for pose in spread(robot) for point in points))

    def flange_at(self, robot: Robot, poses: Sequence[Pose]) -> QuantityObservations:
        """The flange at poses."""
        return self._of(tuple(PointCoordinate(pose, "flange", c) for pose in poses for c in COORDINATES))

    def independent(self, _robot: Robot) -> tuple[scipy.sparse.csr_array, Integers]:
        """As of :class:`PointObservations`: each alone."""
        every = np.arange(len(self))
        return scipy.sparse.csr_array((np.ones(len(every)), (every, every))), every

    def _of(self, quantities: tuple[Quantity, ...]) -> QuantityObservations:
        deviation = np.full(len(quantities), np.median(self.deviation_mm))
        return QuantityObservations(quantities, np.zeros(len(quantities)), deviation)


@dataclass(frozen=True)
class Touched:
    """A place, plane, pair or bar.

    Attributes
    ----------
    poses : at which it is touched; a pair's two are one
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


@dataclass(frozen=True, eq=False)
class PointObservations:
    """Measured coordinates of points that the flange carries.

    Attributes
    ----------
    row_values : (P, m), rad or m, what the rows of the table move by
    on_tool : (P,) bool, whether the tool's point was measured
    seen : (P, 3) bool, the n coordinates that were measured
    values_mm, deviation_mm : (n,), what was measured, and its standard deviation (1 if unknown)
    deviation_known : whether the deviations were stated
    lines : (P,), of the file
    free : what is placed by the measurements, too
    touched : (P,), number of the place, plane, pair or bar; -1 where coordinates were measured. What is observed of a
        place's points is their offset from their mean; the rest has one coordinate: of a plane's points their distance
        from the plane that fits them best, of a pair the distance of its points (with the first of them), of a bar's
        points their distance from the socket that fits them best, beside its mean if the length is unknown. Place,
        plane, socket and unknown length drop out
    kinds, names : of each number
    axes : (3, 3), rows are the directions in which coordinates are observed
    flat : whether the table moves all points in the plane of the first two, while no coordinates are measured. What is
        across it is not observed then, because such a table lets points meet there however the arm's axes are tilted,
        and a socket may be on either side; planes are seen as lines
    lifted : (P, h), how tilts of a flat arm's axes lift its points; a plane that is oblique to the arm's takes an
        unknown share of that, which drops out, too
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
    kinds: tuple[TouchKind, ...] = ()
    names: tuple[str, ...] = ()
    axes: Reals = field(default_factory=lambda: np.eye(3))
    flat: bool = False
    lifted: Reals | None = None

    def __len__(self) -> int:
        return len(self.values_mm)

    def groups(self) -> list[tuple[TouchKind, Integers]]:
        """Of each place, plane, pair and bar its kind and points."""
        numbers = np.unique(self.touched[self.touched >= 0])
        return [(self.kinds[number], np.flatnonzero(self.touched == number)) for number in numbers]

    def unknown_bars(self) -> list[tuple[str, PointObservations]]:
        """Of each bar of unknown length its name and points."""
        return [
            (self.names[self.touched[rows[0]]], self.take(np.isin(np.arange(len(self.touched)), rows)))
            for kind, rows in self.groups()
            if kind == "bar" and not self.lengths_mm(rows).any()
        ]

    @property
    def all_touched(self) -> bool:
        """Whether no coordinates were measured."""
        return bool((self.touched >= 0).all())

    @property
    def dropped(self) -> int:
        """How many numbers of places, planes and bars drop out, at most as many as there are of them."""
        return sum(each.coordinates * min(each.poses, each.unknown) for each in self.things())

    def things(self) -> list[Touched]:
        """What is touched, and how often; the poses of a pair are one."""
        return [
            Touched(
                kind,
                self.names[self.touched[rows[0]]],
                len(self.seen[rows, 0].nonzero()[0]),
                self._unknowns(kind, rows),
                int(self.seen[rows].sum(axis=1).max()),
            )
            for kind, rows in self.groups()
        ]

    def _unknowns(self, kind: TouchKind, rows: Integers) -> int:
        """How many numbers of each coordinate drop out: how many poses say nothing."""
        bar = 3 + (not self.lengths_mm(rows).any())
        return {"place": 1, "plane": 3 - self.flat + len(self._lifted(rows).T), "pair": 0, "bar": bar}[kind]

    @property
    def has_scale(self) -> bool:
        """Whether coordinates or lengths were measured, which set the scale of the arm. A bar's points in the plane of
        a flat arm may be on any circle about its socket."""
        return bool((self.touched < 0).any()) or any(
            (kind == "pair" or (kind == "bar" and not self.flat)) and self.lengths_mm(rows).any()
            for kind, rows in self.groups()
        )

    def varied(self) -> Reals:
        """By how much measured lengths of bars differ from their mean (n,), mm."""
        found = np.zeros(self.seen.shape)
        for kind, rows in self.groups():
            if kind == "bar":
                found[rows, 0] = self.lengths_mm(rows) - self.lengths_mm(rows).mean()
        own: Reals = found[self.seen]
        return own

    def lengths_mm(self, rows: Integers) -> Reals:
        """Measured lengths of a pair or bar; 0 if they are unknown."""
        lengths = np.zeros(self.seen.shape)
        lengths[self.seen] = self.values_mm
        found: Reals = lengths[rows, 0]
        return found

    def _from_socket(self, rows: Integers) -> Reals:
        """A bar's measured lengths, m, 0 if they are unknown or say nothing: the points of a flat arm whose distance
        is one length are on a circle of any radius, as the socket may be beside their plane. A table that is too large
        would have them on a circle wider than the length, which no socket allows."""
        lengths: Reals = self.lengths_mm(rows) / MM
        return np.zeros(len(lengths)) if self.flat and np.ptp(lengths) < MIN_LENGTH else lengths

    def lifted_bars(self) -> Reals:
        """(n, k), each times an unknown amount: how tilts of a flat arm's axes change the distances of bars whose
        sockets lie beside its plane."""
        found: list[Reals] = []
        for kind, rows in self.groups():
            for lifted in self._lifted(rows).T if kind == "bar" else ():
                own = np.zeros(self.seen.shape)
                own[rows, 0] = lifted
                found.append(own[self.seen])
        return np.stack(found, axis=1) if found else np.empty((len(self), 0))

    def _lifted(self, rows: Integers) -> Reals:
        return np.empty((len(rows), 0)) if self.lifted is None else self.lifted[rows]

    def _along_axes(self, xyz: Reals) -> Reals:
        """Coordinates (..., 3) along ``axes``, 0 across the plane if the arm is flat."""
        found: Reals = xyz @ self.axes.T
        if self.flat:
            found[..., 2] = 0.0
        return found

    def relative(self, xyz: Reals) -> Reals:
        """What is observed of points (P, 3), m: see ``touched``."""
        found = self._along_axes(xyz)
        if not self.kinds:
            return found
        for kind, rows in self.groups():
            own = found[rows]
            if kind == "place":
                found[rows] = own - own.mean(axis=0)
            elif kind == "plane":
                normal, inside = self.plane(own)
                off = (own - own.mean(axis=0)) @ normal
                basis = np.hstack([np.ones((len(rows), 1)), inside, self._lifted(rows)])
                found[rows, 0] = off - basis @ np.linalg.lstsq(basis, off, rcond=None)[0]
            elif kind == "pair":
                found[rows, 0] = np.linalg.norm(own[0] - own[-1])
            else:
                stated, lengths = self.lengths_mm(rows) / MM, self._from_socket(rows)
                found[rows, 0] = np.linalg.norm(own - socket(own, lengths), axis=1)
                if not lengths.any():
                    found[rows, 0] += stated.mean() - found[rows, 0].mean()
        return found

    def relative_shift(self, shift: Reals, around: Reals) -> Reals:
        """By how much small shifts (P, 3) of points ``around`` change what is observed, m."""
        found = self._along_axes(shift)
        for kind, rows in self.groups():
            along, basis = self._dropping(kind, rows, around)
            own = found[rows] - found[rows[::-1]] if kind == "pair" else found[rows]
            own = own if kind == "place" else np.einsum("pi,pi->p", along, own)[:, None]
            found[rows, : own.shape[1]] = own - basis @ np.linalg.lstsq(basis, own, rcond=None)[0]
        return found

    def plane(self, xyz: Reals) -> tuple[Reals, Reals]:
        """Normal (3,) of the plane that fits points (P, 3) along ``axes`` best, and where they are in it, (P, 2); of
        the line, (P, 1), that fits the first two coordinates best, if the arm is flat."""
        wide = 2 - self.flat
        here = (xyz - xyz.mean(axis=0)) * (np.arange(3) <= wide)
        axes = np.linalg.svd(np.linalg.qr(here, mode="r"))[2]
        return axes[wide] * np.sign(axes[wide][np.abs(axes[wide]).argmax()]), here @ axes[:wide].T

    def _dropping(self, kind: TouchKind, rows: Integers, around: Reals) -> tuple[Reals, Reals]:
        """For points ``around``: the directions (k, 3) in which those of a plane, pair or bar are observed, and what
        drops out, (k, r), the same for each coordinate of a place."""
        here, every = self._along_axes(around[rows]), np.ones((len(rows), 1))
        if kind == "place":
            return here, every
        if kind == "plane":
            normal, inside = self.plane(here)
            return every * normal, np.hstack([every, inside, self._lifted(rows)])
        if kind == "pair":
            return directions(here - here[::-1])[0], every[:, :0]
        lengths = self._from_socket(rows)
        along = directions(here - socket(here, lengths))[0]
        return along, along if lengths.any() else np.hstack([along, every])

    def independent(self, robot: Robot) -> tuple[scipy.sparse.csr_array, Integers]:
        """What is observed without what drops out, in standard deviations, near to a robot's table.

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
            for every in at[rows].T:
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

    def predict(self, robot: Robot, parameters: Sequence[Parameter], amounts: Reals) -> Reals:
        """Values (H, n), mm, by the robot with each row of amounts (H, p), in m and rad, added to its table, base and
        tool."""
        own, base_inverse, points = tables_of(robot), np.linalg.inv(robot.base), self.points(robot)
        placing = np.array([not parameter.joint for parameter in parameters], dtype=bool)
        step = max(1, AT_ONCE // max(len(self.row_values), 1))
        values = np.empty((len(amounts), len(self)))
        for start in range(0, len(amounts), step):
            part = amounts[start : start + step]
            tables = moved(own[np.zeros(len(part), dtype=np.int64)], parameters, part)
            T = frames_of(tables, robot, self.row_values)[:, :, -1]
            S, shift = np.tile(np.eye(4), (len(part), 1, 1)), np.zeros((len(part), 3))
            for k in np.flatnonzero(part[:, placing].any(axis=1)):
                S[k], shift[k] = placed(parameters, part[k])
            world = robot.base @ S @ base_inverse
            xyz = points + self.on_tool[:, None] * shift[:, None]
            xyz = np.einsum("hpij,hpj->hpi", T[..., :3, :3], xyz) + T[..., :3, 3]
            xyz = xyz @ world[:, :3, :3].swapaxes(1, 2) + world[:, None, :3, 3]
            seen = [self.relative(each) for each in xyz] if self.kinds else self._along_axes(xyz)
            values[start : start + step] = MM * np.asarray(seen)[:, self.seen]
        return values

    def positions(self, robot: Robot) -> Reals:
        """Measured points (P, 3), m, by a robot's table, in its base frame."""
        T = frames_of(tables_of(robot), robot, self.row_values)[0][:, -1]
        found: Reals = np.einsum("pij,pj->pi", T[:, :3, :3], self.points(robot)) + T[:, :3, 3]
        return found

    def turns(self, robot: Robot) -> Reals:
        """How a robot's table turns the tool, (P, 3, 3); 0 where the flange's point was measured."""
        T = frames_of(tables_of(robot), robot, self.row_values)[0][:, -1]
        return np.where(self.on_tool[:, None, None], T[:, :3, :3], 0.0)

    def points(self, robot: Robot) -> Reals:
        """Where the measured points are in the flange's frame (P, 3), m."""
        return np.where(self.on_tool[:, None], robot.tool[:3, 3], 0.0)

    def slid(self, robot: Robot) -> Reals:
        """By how much joints that slide have changed what is observed (n,), mm; what drops out with a place doesn't
        count."""
        T = frames_of(tables_of(robot), robot, self.row_values)[0]
        ways = np.where(robot.sliding, robot.direction * self.row_values, 0.0)
        shift = np.einsum("pmi,pm->pi", T[:, :-1, :3, 2], ways)
        found: Reals = MM * self.relative_shift(shift, self.positions(robot))[self.seen]
        return found

    def take(self, used: Flags) -> PointObservations:
        """Those of some points (P,)."""
        own = used[self.pose_of]
        return replace(
            self,
            row_values=self.row_values[used],
            on_tool=self.on_tool[used],
            seen=self.seen[used],
            values_mm=self.values_mm[own],
            deviation_mm=self.deviation_mm[own],
            lines=self.lines[used],
            touched=self.touched[used],
            lifted=None if self.lifted is None else self.lifted[used],
        )

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
        """Readings of one point, or of one place, plane, bar or pair, at one pose as one, their mean: what a model
        misses there is the same each time, so that repeated readings don't tell it from what it has to find."""
        pose, partner = self.same_pose, np.full(len(self.touched), -1)
        thing = self.touched.copy()
        for kind, rows in self.groups():
            if kind == "pair":
                partner[rows], thing[rows] = pose[rows[::-1]], [-2, -3]
        keys = np.column_stack([pose, partner, thing, self.on_tool])
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
            lifted=None if self.lifted is None else self.lifted[own],
        )

    def shifted(self, amounts: Reals) -> PointObservations:
        """With amounts (P, m), rad or m, added to what the rows move by."""
        return replace(self, row_values=self.row_values + amounts)

    def with_deviation(self, deviation_mm: float) -> PointObservations:
        """With one standard deviation, estimated from what a fit leaves."""
        return replace(self, deviation_mm=np.full(len(self), deviation_mm))

    def rich(self, robot: Robot) -> PointObservations:
        """The same points, with the coordinates that were measured of any, at poses all over the joint range."""
        points = np.unique(self.on_tool)
        every = self._at(robot, np.repeat(np.array(spread(robot)), len(points), axis=0), np.tile(points, RICH_POSES))
        seen = np.broadcast_to(self.seen[self.touched < 0].any(axis=0), every.seen.shape)
        return replace(every, seen=seen, values_mm=np.zeros(seen.sum()), deviation_mm=every.deviation_mm[: seen.sum()])

    def flange_at(self, robot: Robot, poses: Sequence[Pose]) -> PointObservations:
        """The flange at poses."""
        return self._at(robot, np.array(poses), np.zeros(len(poses), dtype=bool))

    def as_coordinates(self) -> PointObservations:
        """The same points as if their coordinates were measured."""
        return self._coordinates(self.row_values, self.on_tool)

    def _at(self, robot: Robot, poses: Reals, on_tool: Flags) -> PointObservations:
        return self._coordinates(row_values(robot, meant(robot, poses)), on_tool)

    def _coordinates(self, row_values: Reals, on_tool: Flags) -> PointObservations:
        count = len(row_values)
        return replace(
            self,
            row_values=row_values,
            on_tool=on_tool,
            seen=np.ones((count, 3), dtype=bool),
            values_mm=np.zeros(3 * count),
            deviation_mm=np.full(3 * count, np.median(self.deviation_mm)),
            lines=np.zeros(count, dtype=np.int64),
            touched=np.full(count, -1),
            axes=np.eye(3),
            flat=False,
            lifted=None,
        )


def _innovations(basis: Reals) -> Reals:
    """Orthonormal rows (k - r, k) beside a basis (k, r), each with no part in one more of the last places than the row
    before it."""
    outside = np.linalg.qr(basis, mode="complete")[0][:, basis.shape[1] :].T
    found: Reals = np.asarray(np.linalg.qr(outside[:, ::-1], mode="r"))[:, ::-1]
    return found


def directions(apart: Reals) -> tuple[Reals, Reals]:
    """Unit vectors (P, 3) of vectors, and their lengths (P,)."""
    size = np.maximum(np.linalg.norm(apart, axis=1), MIN_LENGTH)
    return apart / size[:, None], size


def socket(xyz: Reals, lengths: Reals) -> Reals:
    """The point (3,), m, from which points (P, 3) are nearest to lengths (P,), or to one length if they are all 0: a
    sphere by linear least squares, then Gauss-Newton steps. Beside points in one plane it is on the side to which the
    largest component of the normal points."""
    middle = xyz.mean(axis=0)
    here = xyz - middle
    unknown = not lengths.any()
    squares = (here**2).sum(axis=1) - lengths**2
    sphere = np.linalg.lstsq(np.column_stack([2 * here, np.ones(len(here))]), squares, DEPENDENT)[0]
    centre: Reals = sphere[:3]
    sizes, axes = np.linalg.svd(here, full_matrices=False)[1:]
    if len(sizes) == 3 and sizes[2] < DEPENDENT * sizes[0] and not unknown:
        height = np.sqrt(max(-sphere[3] - centre @ centre, 0.0))
        centre = centre + height * axes[2] * np.sign(axes[2][np.abs(axes[2]).argmax()])
    for _ in range(SOCKET_STEPS):
        along, size = directions(here - centre)
        off = size - lengths
        if unknown:
            along, off = along - along.mean(axis=0), off - off.mean()
        step = np.linalg.lstsq(along, off, DEPENDENT)[0]
        centre = centre + step
        if np.abs(step).max() < SOCKET_STEP:
            break
    found: Reals = middle + centre
    return found


Observations = QuantityObservations | PointObservations


def observed(
    measurements: Sequence[Measurement] | ReferenceSet, robot: Robot, fixed: Sequence[FixedName] = ()
) -> Observations:
    """Measurements coordinate by coordinate, or a reference set's coordinates at single poses.

    Of a set, official, CAD and export data count, if there are any; a standard deviation is the half-width over root 3,
    as for a value that may lie anywhere within (GUM 4.3.7).

    Parameters
    ----------
    fixed : what of base and tool is where the robot's file has it; the tool is free only if its point was measured

    Raises
    ------
    InputError
        for measurements outside the joint limits, or of an arm with another number of joints
    """
    if isinstance(measurements, ReferenceSet):
        stated = [r for r in measurements.checkable if isinstance(r.quantity, PointCoordinate | SectionCoordinate)]
        stated = [r for r in stated if r.is_authoritative] or stated
        expected, uncertainty = expected_of(stated)
        return QuantityObservations(quantities_of(stated), expected, HALF_WIDTH_TO_DEVIATION * uncertainty)
    check_poses(measurements, robot)
    xyz = np.array([each.xyz_mm for each in measurements], dtype=float).reshape(-1, 3)
    names = [each.touched for each in measurements]
    numbers = {name: k for k, name in enumerate(dict.fromkeys(name for name in names if name))}
    touched = np.array([numbers[name] if name else -1 for name in names], dtype=np.int64)
    begun: set[str] = set()
    for k, each in enumerate(measurements):
        if each.touched:
            lone = each.touched[0] == "place"
            xyz[k] = (
                (0.0, *([0.0 if lone else np.nan] * 2)) if each.length_mm is None else (each.length_mm, np.nan, np.nan)
            )
        if each.pair:
            xyz[k, 0] = np.nan if each.pair in begun else xyz[k, 0]
            begun.add(each.pair)
    seen = np.isfinite(xyz)
    on_tool = np.array([each.point == "tool" for each in measurements], dtype=bool)
    known = all(each.deviation_mm is not None for each in measurements)
    deviation = np.array([each.deviation_mm if known else 1.0 for each in measurements], dtype=float)
    poses = np.array([each.pose for each in measurements], dtype=float).reshape(-1, robot.joints)
    found = PointObservations(
        row_values=row_values(robot, meant(robot, poses)),
        on_tool=on_tool,
        seen=seen,
        values_mm=xyz[seen],
        deviation_mm=np.broadcast_to(deviation[:, None], seen.shape)[seen],
        deviation_known=known,
        lines=np.array([each.row for each in measurements], dtype=np.int64),
        free=tuple(
            name for name in PLACEMENTS if name not in fixed and (on_tool if name == "tool" else touched < 0).any()
        ),
        touched=touched,
        kinds=tuple(kind for kind, _ in numbers),
        names=tuple(name for _, name in numbers),
    )
    axes = _flat_axes(robot, found) if found.all_touched else None
    if axes is None:
        return found
    seen[:, 2] = False
    by_point = np.broadcast_to(deviation[:, None], seen.shape)[seen]
    lifted = _lifted(robot, found, axes)
    return replace(found, seen=seen, values_mm=xyz[seen], deviation_mm=by_point, axes=axes, flat=True, lifted=lifted)


def _flat_axes(robot: Robot, points: PointObservations) -> Reals | None:
    """Two directions of the plane in which the joints that move take all points by a robot's table, and its normal;
    None if there is no such plane."""
    mixed = np.column_stack([np.roll(column, k) for k, column in enumerate(points.row_values.T)])
    x = replace(points, row_values=mixed).positions(robot)
    if len(x) < len(COORDINATES):
        return None
    sizes, axes = np.linalg.svd(x - x.mean(axis=0), full_matrices=False)[1:]
    return axes if sizes[2] < PARALLEL_RAD * sizes[1] else None


def _lifted(robot: Robot, points: PointObservations, axes: Reals) -> Reals:
    """Orthonormal columns (P, h): how tilts of joint axes lift points off the plane of a flat arm, apart from what
    tilts the whole arm."""
    x, turns = points.positions(robot), TILT * np.eye(robot.rows)
    tilted = [robot.replace(**{name: getattr(robot, name) + turn}) for name in ("alpha", "beta") for turn in turns]
    ways = np.column_stack([(points.positions(each) - x) @ axes[2] for each in tilted]) / TILT
    whole = np.linalg.qr(np.column_stack([np.ones(len(x)), x @ axes[:2].T]))[0]
    found, sizes, _ = np.linalg.svd(ways - whole @ (whole.T @ ways), full_matrices=False)
    return found[:, sizes > DEPENDENT * np.linalg.norm(x - x.mean(axis=0))]


def check_poses(measurements: Sequence[Measurement], robot: Robot, path: str | Path | None = None) -> None:
    """Refuse poses of another arm, or outside the joint limits: :class:`InputError` naming row and joint."""
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
    """Poses all over the joint range, in whole multiples of 5 deg or mm, or at a limit."""
    low, high = shown(robot, robot.lower), shown(robot, robot.upper)
    rows = np.clip(np.round(quasi_random_points(low, high, RICH_POSES) / 5) * 5, low, high) + 0.0
    return [tuple(row) for row in rows.tolist()]
