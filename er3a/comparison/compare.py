"""Whether two tables describe one arm; if not, which entries differ and which mistake explains them.

The result has layers. Units come first: columns that agree in another unit than they were read in. All else is said of
the tables in the right units. Geometry is what no choice of base, flange, zeros and directions changes; only if it
differs does the other table describe another arm (:mod:`er3a.comparison.mechanism`). The other layers are conventions.
They matter for commanding joints and for placing the base.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import replace
from functools import cache, partial
from typing import Any, Literal, get_args

import numpy as np
import scipy

from er3a.by_value import ByValue, Displayed, frozen
from er3a.comparison import mechanism
from er3a.comparison.mechanism import TOLERANCE_DEG, TOLERANCE_MM
from er3a.comparison.slips import SIDES, Cause, CauseCode, Explained, explain, row_of
from er3a.errors import RobotError
from er3a.geometry.transforms import (
    exp_rotation,
    nearest_rotations,
    posed,
    rot_x,
    rot_z,
    rotation_angle,
    skew_part,
    translation,
)
from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.chain import row_values
from er3a.kinematics.forward import forward, forward_of_rows
from er3a.numerics.arrays import Reals
from er3a.numerics.peaks import PEAK_STEPS, box_points, peak
from er3a.robots.joint_limits import size_of
from er3a.robots.robot import CombinedLimit, Robot, Source

VerdictWord = Literal["equal", "in_doubt", "same_arm", "other_arm", "other_joint_count"]
Uncompared = Literal[
    "limits", "speeds", "limits_on_sums", "tool", "envelopes", "pair_rules", "inertia", "drives", "wrist_load", "weight"
]
Columns = dict[str, Reals | str]
ALIGN_POSES, ALIGNED, STEPS = 100, 20, {"maxiter": 5}  # of the first round; rounds, and steps in each
CLIMB = 10  # steps to a worst pose in each round
SAME_FOUND = 1 + 1e-3  # of the worst distance in an alignment, when a search ends
SLOPE_STEP = 1e-7  # m, rad, between alignments of which a slope is the difference
NEAR_WORST = 0.8  # of it, from which on a pose is kept
SAME_RATIO = 0.005  # relative difference of speeds, and of lengths in two units, that counts as none
NO_TURN, HALF_TURN = 1e-9, np.pi - 1e-4  # rad, below and above which an axis has no sense
NO_OFFSET = 1e-6  # m, of a row from an axis; sine of its tilt; entry of a coupling; largest distance worth a search
NEAR_ROW = 1e-5  # m, and of a turn, by which base or flange may miss what a row of the table can hold
ROUNDED = 4  # decimals of mm and deg in a corrected table
SHOWN = 6  # of differences
LENGTH_UNITS = {"mm": 1.0, "cm": 10.0, "dm": 100.0, "m": 1000.0, "in": 25.4, "ft": 304.8}  # mm
RAD = math.degrees(1.0)
ANGLE_UNITS = {"deg": 1.0, "rad": RAD, "π/180 deg": 1 / RAD, "180/π rad": RAD**2}
"""In deg; the last two are those of angles that were converted once too often."""
LENGTH_FACTORS = {own / read for own, read in itertools.permutations(LENGTH_UNITS.values(), 2)}
ANGLE_FACTORS = RAD, 1 / RAD, RAD**2
"""What takes values from the unit they were read in to their own."""
NEAR_FACTOR = math.log(1.35)  # of a ratio, as one wrong entry may change it
USUAL_SUMS = {2: (0.25, 4.0), 1: (0.1, 2.5)}  # m, of the lengths a and d of an arm's table, and of one of both
LEAST_SUM = 0.02  # m, of one of both, where two units are as near as cm and mm
NEAR_UNITS = math.log(20.0)
STRANGER = math.log(1.5)  # how much farther outside of these a table has to be than another to be the one in error
LEAST_ANGLE, MOST_ANGLE = 6.3, 361.0
"""Between which (deg) the widest of a table's angles is: no radians, and not converted once too often."""
SAME_FACTOR = 1e-6
TINY = 0.01  # m, of all lengths of two arms that are both in another unit
FINEST = 5e-3  # by which part of all its lengths such an arm may differ


@frozen
class Difference:
    """An entry of the table that the other arm has otherwise.

    ``entry``: column and row as A's table has them (``d4``); ``a``, ``b``: its value in A, and what it would have to be
    for B's arm; ``unit``: mm or deg; ``alike``: entries that no data can tell from this one.
    """

    entry: str
    a: float | str
    b: float | str
    difference: float
    unit: str
    alike: tuple[str, ...] = ()


@frozen
class UnitLayer:
    """``causes``: columns in another unit than they were read in, and what takes their values to it."""

    same: bool
    causes: tuple[Cause, ...] = ()


@frozen
class GeometryLayer:
    """``worst_mm`` and ``worst_deg``: the largest gap of all ``invariants`` that were compared.

    ``differences``: entries that differ; those that a cause about whole rows or columns explains are not among them.
    """

    same: bool
    worst_mm: float
    worst_deg: float
    differences: tuple[Difference, ...] = ()
    invariants: int = 0
    unexplained_mm: float = 0.0


@frozen
class ZeroLayer:
    """By row what B's offset is more than A's (deg; mm of joints that slide); 0 of the first and the last row, whose
    zeros can't be distinguished from base and flange."""

    same: bool
    offsets_deg: tuple[float, ...]


@frozen
class DirectionLayer:
    """Numbers of the rows that B moves the other way."""

    same: bool
    reversed: tuple[int, ...]


@frozen
class Turn:
    """A turn by ``deg`` about a unit ``axis``."""

    deg: float
    axis: tuple[float, float, float]


@frozen
class PlacementLayer:
    """Pose of B's base (flange) in A's base (flange) frame once joint axes agree.

    ``entries``: those of A's first (last) row that can hold all of it.
    """

    same: bool
    shift_mm: tuple[float, float, float]
    turn: Turn
    entries: tuple[Difference, ...] = ()


@frozen
class RangeDifference:
    """A limit or speed of a joint: ``a``, and ``b`` in A's zero and direction; None for a joint without limits."""

    joint: int
    entry: Literal["lower", "upper", "speed"]
    a: float | None
    b: float | None
    unit: str


@frozen
class RangeLayer:
    """Limits or speeds; ``same`` is None where one side gives none, or nothing differs but some are not given."""

    same: bool | None
    differences: tuple[RangeDifference, ...] = ()


@frozen
class CouplingLayer:
    """Couplings: what rows move by; ``rows`` are those that B couples otherwise."""

    same: bool
    rows: tuple[int, ...] = ()


@frozen
class Alignment(ByValue):
    """What brings B's flange nearest to A's: ``base`` and ``flange`` (4, 4), m, as in :class:`mechanism.Match`, and of
    each row ``zeros`` (m,), rad or m, and ``signs`` (m,), +1 or -1."""

    base: Reals
    flange: Reals
    zeros: Reals
    signs: Reals


@frozen
class Comparison(ByValue, Displayed):
    """What :func:`compare` found.

    Attributes
    ----------
    verdict : equal; same_arm (geometry agrees, something else differs); other_arm; other_joint_count; in_doubt (equal
        numbers, of files whose units are in doubt: er3a.compare, which is given SI, never says it)
    causes : the fewest slips of a pen that explain what differs
    units, geometry, zero, directions, base, flange, coupling, limits, speeds : the layers, of what differs once causes
        are undone; None if joints can't be paired
    as_printed_mm : largest distance between the two flanges over the joint ranges that was found, for equal joint
        values; the true one may be larger
    aligned_mm : the same, after base, flange, zeros and directions of B are aligned with A's as well as can be
    as_printed_deg, aligned_deg : the same of the angle between the flanges' orientations
    corrected : A's table with all differing entries corrected, so that it describes B's arm; None if the numbers of
        joints differ
    alignment : what aligns B with A so
    not_examined : what the verdict leaves out: limits and speeds that are not all given, and groups of the robot file
        that both arms give and no layer compares
    """

    verdict: VerdictWord
    causes: tuple[Cause, ...] = ()
    units: UnitLayer | None = None
    geometry: GeometryLayer | None = None
    zero: ZeroLayer | None = None
    directions: DirectionLayer | None = None
    base: PlacementLayer | None = None
    flange: PlacementLayer | None = None
    coupling: CouplingLayer | None = None
    limits: RangeLayer | None = None
    speeds: RangeLayer | None = None
    joints: tuple[int, int] = (0, 0)
    corrected: Robot | None = None
    alignment: Alignment | None = None
    not_examined: tuple[Uncompared, ...] = ()
    as_printed_mm: float | None = None
    aligned_mm: float | None = None
    as_printed_deg: float | None = None
    aligned_deg: float | None = None

    @property
    def different_entries(self) -> int:
        """How many entries of geometry differ: less is a better fit; 1000 if joints can't be paired."""
        return len(self.geometry.differences) if self.geometry else 1000


def compare(
    robot_a: Robot, robot_b: Robot, *, tolerance_mm: float = TOLERANCE_MM, tolerance_deg: float = TOLERANCE_DEG
) -> Comparison:
    """Compare two arms: units, geometry, zero, directions, base, flange, couplings, then limits and speeds.

    Parameters
    ----------
    robot_a : the table to test; differences are named by its entries
    robot_b : the table to compare with
    tolerance_mm, tolerance_deg : entries that differ by at most this are equal

    Returns
    -------
    comparison : the verdict with its layers, lengths in mm and angles in deg

    Raises
    ------
    RobotError
        if a tolerance is not positive
    """
    if not (tolerance_mm > 0 and tolerance_deg > 0):
        problem = f"the tolerances are {tolerance_mm} mm and {tolerance_deg} deg; both have to be above 0"
        raise RobotError(robot_a.name, problem)
    return _compared(robot_a, robot_b, mechanism.Tolerances(tolerance_mm / 1000, math.radians(tolerance_deg)))


def _compared(robot_a: Robot, robot_b: Robot, tolerances: mechanism.Tolerances, explained: bool = True) -> Comparison:
    """What :func:`compare` finds; without causes, the best alignment and distances if they are not asked for."""
    counts = robot_a.joints, robot_b.joints
    beside = given_by_both(beside_the_table(robot_a), beside_the_table(robot_b))
    if counts[0] != counts[1] or robot_a.rows != robot_b.rows:
        return Comparison("other_joint_count", joints=counts, not_examined=beside)
    if (kinds := robot_a.sliding != robot_b.sliding).any():
        differs = _other_kinds(robot_a, kinds)
        return Comparison("other_arm", geometry=differs, joints=counts, not_examined=beside)
    printed = robot_a, robot_b
    size = max(map(size_of, printed))
    if 0 < size < TINY:
        tolerances = replace(tolerances, length=min(tolerances.length, FINEST * size))
    slips = _unit_slips(robot_a, robot_b, tolerances, explained)
    robot_a, robot_b = in_units(robot_a, slips, "a"), in_units(robot_b, slips, "b")
    plain = mechanism.match(mechanism.mechanism_of(robot_a), mechanism.mechanism_of(robot_b), tolerances)
    same = not plain.differences and plain.unexplained == 0
    in_right_units = robot_a, robot_b
    known = explain(robot_a, robot_b, plain, tolerances) if explained else Explained((), robot_a, robot_b, plain)
    robot_a, robot_b, found = known.one, known.other, known.found
    geometry = GeometryLayer(
        same,
        1000 * plain.worst_length,
        math.degrees(plain.worst_angle),
        () if same else (*_undone(in_right_units[0], known), *(_named(robot_a, each) for each in found.differences)),
        plain.invariants,
        1000 * found.unexplained,
    )
    moved = tolerances.exceeded(found.zeros, robot_a.sliding)
    scale = np.where(robot_a.sliding, 1000.0, np.degrees(1.0))
    zero = ZeroLayer(not moved.any(), tuple((scale * found.zeros).tolist()))
    reverses, coupled = _joints_paired(robot_a, robot_b, found)
    reversed_rows = tuple((np.flatnonzero(found.reverses) + 1).tolist())
    directions = DirectionLayer(not reversed_rows, reversed_rows)
    at_ends = _ends_as_entries(robot_a, rows_at_ends(robot_a, found, tolerances))
    base, flange = (_placement(T, entries, tolerances) for T, entries in zip((found.base, found.flange), at_ends))
    joint_zeros = _joint_zeros(robot_a, found)
    limits, speeds = _limits(robot_a, robot_b, reverses, joint_zeros, tolerances), _speeds(robot_a, robot_b)
    units = UnitLayer(not slips, slips)
    agree = zero.same and directions.same and base.same and flange.same and coupled.same
    agree = agree and units.same and not known.slips and limits.same is not False and speeds.same is not False
    verdict: VerdictWord = "equal" if same and agree else "same_arm" if same else "other_arm"
    alignment, off = _aligned(printed, in_right_units, plain, same) if explained else (_alignment(plain), ())
    corrected = _corrected(robot_a, robot_b, found, tolerances, limits, signs=reverses, joint_zeros=joint_zeros)
    layers = known.slips, units, geometry, zero, directions, base, flange, coupled, limits, speeds
    missing: list[Uncompared] = ["limits"] if limits.same is None else []
    missing += ["speeds"] if speeds.same is None else []
    missing += ["limits_on_sums"] if robot_a.combined or robot_b.combined else []
    return Comparison(verdict, *layers, counts, corrected, alignment, (*missing, *beside), *off)


def beside_the_table(robot: Robot) -> frozenset[Uncompared]:
    """Groups of a robot file that an arm gives and a comparison does not look at.

    Parameters
    ----------
    robot : an identity tool, and masses that are not there, count as not given

    Returns
    -------
    groups : their names, such as ``tool`` or ``inertia``
    """
    masses = robot.masses
    given: dict[Uncompared, bool] = {
        "tool": not np.array_equal(robot.tool, np.eye(4)),
        "envelopes": bool(robot.envelopes or robot.hulls or robot.meshes),
        "pair_rules": bool(robot.pair_rules),
        "inertia": bool(masses.links),
        "drives": masses.drives is not None,
        "wrist_load": masses.wrist is not None,
        "weight": not math.isnan(masses.weight),
    }
    return frozenset(group for group, there in given.items() if there)


def given_by_both(one: Set[Uncompared], other: Set[Uncompared]) -> tuple[Uncompared, ...]:
    """Groups that two arms give.

    Parameters
    ----------
    one, other : as of :func:`beside_the_table`

    Returns
    -------
    groups : in the order of ``Uncompared``
    """
    return tuple(group for group in get_args(Uncompared) if group in one and group in other)


def best_of(
    robot: Robot,
    others: Mapping[str, Robot],
    *,
    tolerance_mm: float = TOLERANCE_MM,
    tolerance_deg: float = TOLERANCE_DEG,
) -> list[tuple[str, Comparison]]:
    """A robot compared with several, the one that fits best first.

    One wrong entry is nearer than several; of several, those that differ slightly count for a part of one. Causes are
    searched for in the best one alone.

    Parameters
    ----------
    others : by name
    tolerance_mm, tolerance_deg : by how much lengths (mm) and angles (deg) may differ and still agree

    Returns
    -------
    found : names and comparisons, all of ``others``
    """
    tolerances = mechanism.Tolerances(tolerance_mm / 1000, math.radians(tolerance_deg))
    found = [(name, _compared(robot, other, tolerances, explained=False)) for name, other in others.items()]
    found.sort(key=lambda pair: _misfit(pair[1]))
    for best, _ in found[:1]:
        found[0] = best, compare(robot, others[best], tolerance_mm=tolerance_mm, tolerance_deg=tolerance_deg)
    return found


def _misfit(found: Comparison) -> tuple[float, ...]:
    """Less is a better fit."""
    if found.geometry is None:
        return (3.0,)
    gaps = [(abs(each.difference), SLIGHT.get(each.unit, 0.0)) for each in found.geometry.differences]
    wrong = sum(gap / (gap + slight) for gap, slight in gaps)
    return {"equal": 0, "same_arm": 1}.get(found.verdict, 2), min(len(gaps), 2), wrong, found.geometry.worst_mm


SLIGHT = {"mm": 2.0, "deg": 0.3}
"""A difference of so much counts half: more than tables are rounded by, less than arms differ by."""


def _other_kinds(robot: Robot, kinds: Reals) -> GeometryLayer:
    words = {False: "revolute", True: "prismatic"}
    rows = np.flatnonzero(kinds).tolist()
    kind = [(k, bool(robot.sliding[k])) for k in rows]
    found = tuple(Difference(f"type{k + 1}", words[own], words[not own], 1.0, "") for k, own in kind)
    return GeometryLayer(False, 0.0, 0.0, found)


ANGLES = "alpha", "beta", "theta"


def _difference(name: str, one: float, other: float, alike: tuple[str, ...] = ()) -> Difference:
    """A difference of an entry's values in m or rad, rounded in its unit."""
    scale, unit = (1000.0, "mm") if name[0] in "ad" and name[:2] != "al" else (RAD, "deg")
    own, there = (round(scale * value, SHOWN) + 0.0 for value in (one, other))
    return Difference(name, own, there, there - own, unit, alike)


def _named(robot: Robot, found: mechanism.EntryDifference) -> Difference:
    """A difference by its name in A's own table."""
    alike = tuple(_name(robot, *each) for each in found.alike)
    return _difference(_name(robot, found.column, found.link), found.one, found.other, alike)


def _name(robot: Robot, column: str, link: int) -> str:
    return f"{column}{row_of(robot, column, link) + 1}"


def _undone(robot: Robot, known: Explained) -> Iterator[Difference]:
    """The entries of A that slips of single numbers, or in single rows, have changed."""
    for name in (name for cause in known.slips for name in cause.entries if cause.side == "a"):
        column, row = name.rstrip("0123456789"), int(name.lstrip("abdefhlopst")) - 1
        own, meant = (float(getattr(each, column)[row]) for each in (robot, known.one))
        found = _difference(name, own, meant)
        if found.difference:
            yield found


def _placement(T: Reals, entries: tuple[Difference, ...], tolerances: mechanism.Tolerances) -> PlacementLayer:
    x, y, z = (1000 * T[:3, 3]).tolist()
    R = T[:3, :3]
    angle = float(rotation_angle(np.eye(3), R))
    axis = np.linalg.eigh(R + R.T)[1][:, -1] if angle > NO_TURN else np.array([0.0, 0.0, 1.0])
    axis *= np.sign(axis[np.abs(axis).argmax()] if angle > HALF_TURN or angle <= NO_TURN else axis @ skew_part(R))
    u, v, w = (axis + 0.0).tolist()
    about = Turn(math.degrees(angle), (u, v, w))
    return PlacementLayer(mechanism.is_identity(T, tolerances), (x, y, z), about, entries)


# Joints ---------------------------------------------------------------------------------------------------------------


def _joints_paired(robot_a: Robot, robot_b: Robot, found: mechanism.Match) -> tuple[Reals, CouplingLayer]:
    """+1 or -1 for each joint (n,), -1 where B's pendant counts in the other direction, and whether couplings agree."""
    rows = np.where(found.reverses, -1.0, 1.0)
    own, other = robot_a.joint_to_row, robot_b.joint_to_row
    turned = rows[:, None] * other  # what A's rows would move by for B's joints
    with_same, with_other = np.abs(turned - own).sum(axis=0), np.abs(turned + own).sum(axis=0)
    signs = np.where(with_other < with_same, -1.0, 1.0)
    wrong = np.flatnonzero((np.abs(turned * signs - own) > NO_OFFSET).any(axis=1))
    return signs, CouplingLayer(not wrong.size, tuple((wrong + 1).tolist()))


def _joint_zeros(robot: Robot, found: mechanism.Match) -> Reals:
    """What A's joints (n,) show, rad or m, where B's show 0."""
    rows = found.zeros * robot.direction
    if robot.coupling is None:
        return rows
    return np.asarray(np.linalg.lstsq(robot.coupling, rows, rcond=None)[0])


def _limits(robot_a: Robot, robot_b: Robot, signs: Reals, zeros: Reals, tolerances: mechanism.Tolerances) -> RangeLayer:
    if not (robot_a.states("limits") and robot_b.states("limits")):
        return RangeLayer(None)
    ends = signs * robot_b.lower + zeros, signs * robot_b.upper + zeros  # as A's joints show them
    lower, upper = np.minimum(*ends), np.maximum(*ends)
    found = []
    for j in range(robot_a.joints):
        slides, ends = bool(robot_a.slides[j]), (robot_a.continuous[j], robot_b.continuous[j])
        scale, tolerance = (1000.0, tolerances.length) if slides else (math.degrees(1.0), tolerances.angle)
        for entry, own, other in (("lower", robot_a.lower[j], lower[j]), ("upper", robot_a.upper[j], upper[j])):
            if ends[0] != ends[1] or (not any(ends) and abs(own - other) > tolerance):
                unit = "mm" if slides else "deg"
                one, there = (None if free else scale * end for free, end in zip(ends, (own, other)))
                found.append(RangeDifference(j + 1, entry, one, there, unit))  # type: ignore[arg-type]
    return RangeLayer(not found, tuple(found))


def _sums_of_b(robot: Robot, signs: Reals, zeros: Reals) -> tuple[CombinedLimit, ...]:
    """B's limits on sums as A's joints show them."""
    found = []
    for limit in robot.combined:
        factors = signs * np.array(limit.factors)
        off = float(factors @ zeros)
        found.append(CombinedLimit(tuple(factors.tolist()), limit.lower + off, limit.upper + off))
    return tuple(found)


def _speeds(robot_a: Robot, robot_b: Robot) -> RangeLayer:
    both = np.isfinite(robot_a.speed) & np.isfinite(robot_b.speed)
    if not both.any() or not (robot_a.states("speeds") and robot_b.states("speeds")):
        return RangeLayer(None)
    found = []
    for j in np.flatnonzero(both).tolist():
        slides = bool(robot_a.slides[j])
        scale, unit = (1000.0, "mm/s") if slides else (math.degrees(1.0), "deg/s")
        own, other = scale * float(robot_a.speed[j]), scale * float(robot_b.speed[j])
        if abs(own - other) > SAME_RATIO * max(abs(own), abs(other)):
            found.append(RangeDifference(j + 1, "speed", own, other, unit))
    return RangeLayer(False if found else True if both.all() else None, tuple(found))


# How far the flange is off --------------------------------------------------------------------------------------------


def _alignment(found: mechanism.Match) -> Alignment:
    return Alignment(found.base, found.flange, found.zeros, np.where(found.reverses, -1.0, 1.0))


def _aligned(
    as_printed: tuple[Robot, Robot], in_right_units: tuple[Robot, Robot], found: mechanism.Match, same: bool
) -> tuple[Alignment, tuple[float, ...]]:
    """What aligns B with A; largest distances (mm), then angles (deg), of the flanges that were found, each as printed
    and aligned.

    Unless both are the ``same`` mechanism, base, flange and zeros are moved from where the match has them until the
    largest distance over the joint ranges is least: a minimax problem, solved by exchange [1]_. Of some poses the
    largest distance is made least, by sequential quadratic programming; then those where it is largest now are added.
    What is least for some poses bounds from below what is for all, near this minimum. The search ends when the best
    that it has found is that near its bound. Between rounds numbers are rounded, so that a last bit, which can depend
    on the number of threads, does not grow. At last the flange is turned, by least squares.

    References
    ----------
    .. [1] R. Hettich, K. O. Kortanek, "Semi-infinite programming: theory, methods, and applications", SIAM Review 35
       (1993).
    """
    (first, second), (a, b) = ([robot.without_tool() for robot in pair] for pair in (as_printed, in_right_units))
    best = start = _alignment(found)
    q = np.random.default_rng(0).uniform(a.lower, a.upper, (ALIGN_POSES, a.joints))
    x, least, bound = np.zeros(8 + a.rows), np.inf, NO_OFFSET

    def moved(x: Reals) -> Alignment:
        """Turned (rad) and shifted (m) at the base, shifted at the flange, other zeros after the first; x (..., p)."""
        plain = np.broadcast_to(np.eye(3), (*x.shape[:-1], 3, 3))
        base, flange = posed(exp_rotation(x[..., :3]), x[..., 3:6]), posed(plain, x[..., 6:9])
        zeros = start.zeros + np.concatenate([0 * x[..., :1], x[..., 9:]], axis=-1)
        return Alignment(base @ start.base, start.flange @ flange, zeros, start.signs)

    def brought(by: Alignment, u: Reals) -> Reals:
        """B's flanges at A's rows u (k, m) as one alignment or several of them, (..., k, 4, 4), bring them."""
        rows = by.signs * (u - (by.zeros * a.direction)[..., None, :])
        there = forward_of_rows(b, rows.reshape(-1, b.rows)).reshape(*rows.shape[:-1], 4, 4)
        return by.base[..., None, :, :] @ there @ np.linalg.inv(by.flange)[..., None, :, :]

    def flanges(by: Alignment, poses: Reals) -> tuple[Reals, Reals]:
        """A's flanges (k, 4, 4), and those of B, aligned."""
        u = row_values(a, poses)
        return forward_of_rows(a, u), brought(by, u)

    def room(y: Reals) -> Reals:
        """By how much the distance at each pose is below the bound, the last of y (..., p + 1)."""
        return y[..., -1:] - shift_between(own, brought(moved(y[..., :-1]), u))

    def slopes(y: Reals) -> Reals:
        there, *near = room(np.vstack([y, y + SLOPE_STEP * np.eye(len(y))]))
        return np.transpose(near - there) / SLOPE_STEP

    search: Any = {"jac": lambda y: np.eye(len(y))[-1], "constraints": {"type": "ineq", "fun": room, "jac": slopes}}
    for _ in range(1 if same else ALIGNED):
        off, ends = worst_poses(shift_between, partial(flanges, moved(x)), a, PEAK_STEPS if same else CLIMB)
        if off[0] < least:
            best, least = moved(x), off[0]
        if least <= bound * SAME_FOUND:
            break
        q = np.r_[q, ends]
        u = row_values(a, q)
        own = forward_of_rows(a, u)
        y = scipy.optimize.minimize(lambda y: y[-1], np.r_[x, off[0]], options=STEPS, **search).x.round(SHOWN)
        x, bound = y[:-1], y[-1]
        q = q[room(y) < (1 - NEAR_WORST) * bound]
    one, other = (each[:, :3, :3] for each in flanges(best, q))
    turn = nearest_rotations(np.einsum("kjl,kji->li", one, other))
    best = replace(best, flange=posed(turn, np.zeros(3)) @ best.flange)
    pairs = lambda q: (forward(first, q), forward(second, q)), lambda q: flanges(best, q)
    turns = [worst_poses(turn_between, each, a)[0][0] for each in pairs]
    return best, (1000 * worst_poses(shift_between, pairs[0], a)[0][0], 1000 * least, *map(math.degrees, turns))


def shift_between(one: Reals, other: Reals) -> Reals:
    """Distances between origins.

    Parameters
    ----------
    one, other : (..., k, 4, 4), m

    Returns
    -------
    shift : (..., k), m
    """
    shift: Reals = np.linalg.norm(one[..., :3, 3] - other[..., :3, 3], axis=-1)
    return shift


def turn_between(one: Reals, other: Reals) -> Reals:
    """Angles between orientations.

    Parameters
    ----------
    one, other : (k, 4, 4)

    Returns
    -------
    turn : (k,), rad
    """
    return rotation_angle(one[:, :3, :3], other[:, :3, :3])


def worst_poses(
    off: Callable[[Reals, Reals], Reals],
    flanges: Callable[[Reals], tuple[Reals, Reals]],
    robot: Robot,
    steps: int = PEAK_STEPS,
) -> tuple[list[float], Reals]:
    """Where two flanges are most off over an arm's joint ranges, as far as :func:`peak` finds it.

    Parameters
    ----------
    off : of poses (k, 4, 4) of both, what is sought (k,)
    flanges : the two at joint values (k, n)
    robot : whose ranges count
    steps : of each climb, at most

    Returns
    -------
    largest : k of them, the largest first, which is no bound: the true one may be a little larger
    q : (k, n), rad or m, where they were found
    """
    lower, upper = np.sort([robot.lower, robot.upper], axis=0)
    q, largest = peak(lambda q: off(*flanges(q)), lower, upper, box_points(lower, upper), steps=steps)
    return largest.tolist(), q


# Units ----------------------------------------------------------------------------------------------------------------


def in_units(robot: Robot, slips: Iterable[Cause], side: Literal["a", "b"]) -> Robot:
    """A robot with the columns that were read in another unit taken to their own.

    Parameters
    ----------
    slips : of units, with their columns and factors
    side : which of the two compared robots it is; slips without a side are the first one's

    Returns
    -------
    robot : SI
    """
    columns: dict[str, Reals] = {}
    for slip in slips:
        for column in slip.entries if (slip.side or "a") == side else ():
            columns[column] = getattr(robot, column) * slip.amount
    return robot.replace(**columns) if columns else robot


def _unit_slips(robot_a: Robot, robot_b: Robot, tolerances: mechanism.Tolerances, explain: bool) -> tuple[Cause, ...]:
    """The columns a, d, alpha and offset that, in another unit, make two tables agree; of several sets the one that
    leaves the fewest conventions different, then the smallest. If geometry agrees with none, and it is to be explained,
    one that leaves less than half of the entries different."""
    twists, offsets = (_angle_slips(robot_a, robot_b, column) for column in ("alpha", "offset"))
    sets = [(*lengths, *angles) for lengths, angles in itertools.product(_length_slips(robot_a, robot_b), twists)]

    def arms(slips: tuple[Cause, ...]) -> tuple[Robot, Robot]:
        return in_units(robot_a, slips, "a"), in_units(robot_b, slips, "b")

    def same(slips: tuple[Cause, ...]) -> bool:
        a, b = (mechanism.mechanism_of(robot, ends=False) for robot in arms(slips))
        return mechanism.is_same_mechanism(a, b, tolerances)

    @cache
    def rank(slips: tuple[Cause, ...]) -> tuple[float, int, int]:
        one, other = map(mechanism.mechanism_of, arms(slips))
        found = mechanism.match(one, other, tolerances)
        return found.rank[0], found.layers, sum(len(each.entries) for each in slips)

    fits = [slips for slips in sets if same(slips)] if len(sets) * len(offsets) > 1 else [()]
    if not fits and explain and len(sets) > 1:
        nearest = min(sets, key=rank)
        fits = [nearest] if 2 * rank(nearest)[0] < rank(())[0] else []
    every = [(*slips, *more) for slips in fits for more in offsets]
    return _merged(min(every, key=rank) if len(every) > 1 else every[0] if every else ())


def _merged(slips: tuple[Cause, ...]) -> tuple[Cause, ...]:
    """Columns of one table in one unit as one cause."""
    found: dict[tuple[object, ...], Cause] = {}
    for each in slips:
        key = each.code, each.side, each.amount
        found[key] = replace(each, entries=(*found[key].entries, *each.entries)) if key in found else each
    return tuple(found.values())


def _length_slips(robot_a: Robot, robot_b: Robot) -> list[tuple[Cause, ...]]:
    """Ways in which a and d of two tables can be in different units: none, both, or one of them."""
    pair = [mechanism.mechanism_of(each, ends=False) for each in (robot_a, robot_b)]
    factors: set[float] = set()
    used = [column for column in ("a", "d") if getattr(robot_a, column).any() and getattr(robot_b, column).any()]
    for column, (one, other) in itertools.product(used, (pair, (robot_a, robot_b))):
        sums = [float(np.abs(getattr(each, column)).sum()) for each in (one, other)]
        if min(sums) > 0:
            factors |= _likely_factor(sums[1] / sums[0])
    alone = [
        _length_cause(robot_a, robot_b, (column,), factor)
        for column, factor in itertools.product(used, sorted(factors))
        if _bears_out(getattr(robot_a, column), getattr(robot_b, column), factor)
    ]
    both = [_length_cause(robot_a, robot_b, tuple(used), factor) for factor in sorted(factors)] if len(used) > 1 else []
    return [(), *((each,) for each in (*both, *alone))]


def _bears_out(one: Reals, other: Reals, factor: float) -> bool:
    """Whether two or more lengths of a column (n,) agree times a factor, and more than without: one alone is an entry
    that is wrong."""
    before, after = (((one != 0) & np.isclose(abs(one) * by, abs(other), 1e-3)).sum() for by in (1.0, factor))
    return bool(after > max(before, 1))


def _likely_factor(ratio: float) -> set[float]:
    """The factor between two units that is nearest a ratio, within 2, if 1 is not nearer; and those about as near."""
    off = {factor: abs(math.log(ratio / factor)) for factor in (1.0, *LENGTH_FACTORS)}
    near = min(off, key=off.__getitem__)
    if near == 1.0 or off[near] > math.log(2):
        return set()
    return {near, *(factor for factor in LENGTH_FACTORS if off[factor] < NEAR_FACTOR)}


def _length_cause(robot_a: Robot, robot_b: Robot, columns: tuple[str, ...], factor: float) -> Cause:
    """That columns of A, times a factor, are those of B: a slip of the table whose lengths no arm has. Of two that arms
    have it can be either's."""

    least, most = USUAL_SUMS[len(columns)]
    if len(columns) == 1 and abs(math.log(factor)) < NEAR_UNITS:
        least = LEAST_SUM

    def strange(robot: Robot) -> float:
        size = sum(float(np.abs(getattr(robot, column)).sum()) for column in columns)
        return max(math.log(least / size), math.log(size / most), 0.0)

    stranger = strange(robot_b) - strange(robot_a)
    if stranger > STRANGER:
        return _of_unit("unit", "b", columns, 1 / factor)
    return _of_unit("unit", "a" if stranger < -STRANGER else None, columns, factor)


def _of_unit(
    code: CauseCode, side: Literal["a", "b"] | None, columns: tuple[str, ...], factor: float, heading: str = ""
) -> Cause:
    """Columns in another unit than their heading's (mm or deg, if it is not given), and what takes them to it."""
    units, heading = (ANGLE_UNITS, heading or "deg") if code == "angle_unit" else (LENGTH_UNITS, heading or "mm")
    own = units[heading] * factor
    name = min(units, key=lambda each: abs(math.log(units[each] / own)))
    if abs(math.log(units[name] / own)) > SAME_FACTOR:
        name = f"{factor:.6g} {heading}"
    return Cause(code, side, columns, factor, f"{heading} → {name}")


def by_headings(found: Comparison, a: Mapping[str, str], b: Mapping[str, str]) -> Comparison:
    """A comparison whose causes name units as the tables' headings do.

    Parameters
    ----------
    found : read in the headings' units
    a, b : unit of each column of the two tables, such as ``{"alpha": "rad"}``; mm and deg of those that are not named

    Returns
    -------
    found : each column's unit as "heading's → the one that its numbers are in"
    """
    if found.units is None:
        return found

    def named(slip: Cause) -> Cause:
        factor, columns = slip.amount or 1.0, slip.entries
        own = _of_unit(slip.code, slip.side, columns, factor, (b if slip.side == "b" else a).get(columns[0], ""))
        other = _of_unit(slip.code, None, columns, 1 / factor, b.get(columns[0], ""))
        return other if slip.side is None and _is_named(other) and not _is_named(own) else own

    return replace(found, units=replace(found.units, causes=tuple(map(named, found.units.causes))))


def _is_named(slip: Cause) -> bool:
    """Whether what a slip's columns are in is a unit, and no multiple of their heading's."""
    return slip.unit.rpartition("→ ")[2] in (*LENGTH_UNITS, *ANGLE_UNITS)


def _angle_slips(robot_a: Robot, robot_b: Robot, column: str) -> list[tuple[Cause, ...]]:
    """Ways in which angles of two tables can be in another unit: none, and for either those that make them usual."""
    found: list[tuple[Cause, ...]] = [()]
    for side, robot in zip(SIDES, (robot_a, robot_b)):
        widest = math.degrees(np.abs(getattr(robot, column)).max(initial=0.0))
        usual = LEAST_ANGLE < widest < MOST_ANGLE
        for factor in () if usual else ANGLE_FACTORS:
            if LEAST_ANGLE < widest * factor < MOST_ANGLE:
                found.append((_of_unit("angle_unit", side, (column,), factor),))
    return found


# The corrected table --------------------------------------------------------------------------------------------------


def _corrected(
    robot_a: Robot,
    robot_b: Robot,
    found: mechanism.Match,
    tolerances: mechanism.Tolerances,
    limits: RangeLayer,
    *,
    signs: Reals,
    joint_zeros: Reals,
) -> Robot:
    """A's table with what differs taken from B, rounded; what agrees stays as it is printed."""
    named = "a", "alpha", "beta", "d", "offset", "direction"
    columns: dict[str, Any] = {key: np.array(getattr(robot_a, key)) for key in named}
    for each in found.differences:
        angle = each.column in ANGLES
        column = "offset" if each.column == "theta" else each.column
        columns[column][row_of(robot_a, column, each.link)] = _rounded(each.other, angle)
    moved = tolerances.exceeded(found.zeros, robot_a.sliding)
    columns["direction"] = np.where(found.reverses, -1.0, 1.0) * robot_a.direction
    for k in np.flatnonzero(moved).tolist():
        column = "d" if robot_a.sliding[k] else "offset"
        columns[column][k] = _rounded(columns[column][k] + found.zeros[k], column == "offset")
    base, flange = _ends_corrected(robot_a, found, tolerances, columns)
    # Corrected zeros and directions make A's joint values those of B.
    ends = np.sort([signs * (end - joint_zeros) for end in (robot_a.lower, robot_a.upper)], axis=0)
    lower, upper, continuous = ends[0], ends[1], robot_a.continuous
    combined = _sums_of_b(robot_a, signs, -signs * joint_zeros)
    if limits.same is False or (robot_b.states("limits") and not robot_a.states("limits")):
        lower, upper, continuous, combined = robot_b.lower, robot_b.upper, robot_b.continuous, robot_b.combined
    speed = np.where(np.isfinite(robot_b.speed), robot_b.speed, robot_a.speed)
    placed = {"base": base is not robot_a.base, "flange": flange is not robot_a.flange}
    sources = _sources_of_both(robot_a, robot_b, [group for group, changed in placed.items() if changed])
    return Robot(
        name=robot_a.name,
        title=f"{robot_a.title}, corrected",
        convention=robot_a.convention,
        lower=lower,
        upper=upper,
        continuous=continuous,
        combined=combined,
        speed=speed,
        base=base,
        flange=flange,
        sliding=robot_a.sliding,
        coupling=robot_a.coupling,
        zero_pose=robot_b.zero_pose,
        sources=sources,
        **columns,
    )


Row = tuple[tuple[str, int, float], ...]
"""Columns, rows (from 0) and values, m and rad, of entries that change."""


def rows_at_ends(robot: Robot, found: mechanism.Match, tolerances: mechanism.Tolerances) -> tuple[Row, Row]:
    """The entries of the first row that hold what base differs by, and of the last row what flange does.

    Of a standard table the first row's ``Rz Tz`` and all of the last can, of a modified one the reverse.

    Parameters
    ----------
    robot : the first of two arms
    found : their match
    tolerances : m and rad; what differs by less is left as it is

    Returns
    -------
    rows : of each end columns, rows (from 0) and values, m and rad; empty where they can't hold it
    """
    before = np.linalg.inv(robot.base) @ np.linalg.inv(found.base) @ robot.base
    behind = robot.flange @ found.flange @ np.linalg.inv(robot.flange)
    standard, rows = robot.convention == "standard", []
    for k, T in ((0, before), (robot.rows - 1, behind)):
        near = rot_z(robot.offset[k]) @ translation(0, 0, robot.d[k])
        across = translation(robot.a[k], 0, 0) @ rot_x(robot.alpha[k])
        if (k == 0 and standard) or (k and not standard):
            changed, whole = _of_row(T @ near if k == 0 else near @ T, 1), False
        elif standard:
            changed, whole = _of_row(near @ across @ T, 1), True
        else:
            changed, whole = _of_row(np.array(np.linalg.inv(T @ across @ near), float), -1), True
        fits = changed is not None and not robot.beta[k] and (whole or max(map(abs, changed[2:])) < NEAR_ROW)
        values = zip(("offset", "d", "a", "alpha"), changed if changed and fits else ())
        rows.append(tuple(_changes(robot, k, values if whole else itertools.islice(values, 2), tolerances)))
    return rows[0], rows[1]


def _changes(
    robot: Robot, row: int, values: Iterable[tuple[str, float]], tolerances: mechanism.Tolerances
) -> Iterator[tuple[str, int, float]]:
    for column, value in values:
        own = float(getattr(robot, column)[row])
        angle = column in ("offset", "alpha")
        gap = abs(float(wrap_to_pi(np.array(value - own)))) if angle else abs(value - own)
        if gap > (tolerances.angle if angle else tolerances.length):
            yield column, row, _rounded(value, angle)


def _of_row(M: Reals, sign: int) -> tuple[float, float, float, float] | None:
    """theta, d, a, alpha (times ``sign``) with ``M = Rz(theta) Tz(d) Tx(a) Rx(alpha)``, if there are any."""
    theta = math.atan2(M[1, 0], M[0, 0])
    across = math.cos(theta) * M[1, 3] - math.sin(theta) * M[0, 3]
    if max(abs(M[2, 0]), abs(across)) > NEAR_ROW:
        return None
    a = math.cos(theta) * M[0, 3] + math.sin(theta) * M[1, 3]
    return sign * theta, sign * float(M[2, 3]), sign * a, sign * math.atan2(M[2, 1], M[2, 2])


def _ends_as_entries(robot: Robot, rows: tuple[Row, Row]) -> list[tuple[Difference, ...]]:
    return [
        tuple(_difference(f"{column}{k + 1}", float(getattr(robot, column)[k]), value) for column, k, value in row)
        for row in rows
    ]


def _ends_corrected(
    robot: Robot, found: mechanism.Match, tolerances: mechanism.Tolerances, columns: dict[str, Any]
) -> tuple[Reals, Reals]:
    """Base and flange as the other arm has them; where the first or last row can hold the difference, that is changed
    in ``columns`` instead."""
    rows = rows_at_ends(robot, found, tolerances)
    base, flange = robot.base, robot.flange
    if not (rows[0] or mechanism.is_identity(found.base, tolerances)):
        base = _rounded_pose(np.linalg.inv(found.base) @ robot.base)
    if not (rows[1] or mechanism.is_identity(found.flange, tolerances)):
        flange = _rounded_pose(robot.flange @ found.flange)
    for column, k, value in (*rows[0], *rows[1]):
        columns[column][k] = value
    return base, flange


def _sources_of_both(robot_a: Robot, robot_b: Robot, changed: Sequence[str]) -> dict[str, Source]:
    """Sources of A's groups, with the grades of B for what is B's; groups that are ``changed`` are inferred."""
    text = f"{robot_a.name}, corrected by {robot_b.name}"
    sources = {group: Source(text, source.grade) for group, source in robot_a.sources.items()}
    for group, source in robot_b.sources.items():
        if group in ("limits", "speeds", "base", "flange"):
            sources[group] = Source(text, source.grade)
    for group in changed:
        sources.setdefault(group, Source(text, "inferred"))
    return sources


def _rounded(value: float, angle: bool) -> float:
    """A length (m) or an angle (rad), rounded as a table prints it."""
    scale = math.degrees(1.0) if angle else 1000.0
    return float(np.round(value * scale, ROUNDED) / scale)


def _rounded_pose(T: Reals) -> Reals:
    rounded = T.copy()
    rounded[:3, 3] = np.round(T[:3, 3] * 1000, ROUNDED) / 1000
    return rounded
