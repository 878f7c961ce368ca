"""Does a model agree with its controller? The answer, from joint values and the poses that the controller shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from er3a.by_value import ByValue, Displayed, Sheet, frozen
from er3a.calibration.parameters import placements_of
from er3a.comparison.entries import Entry
from er3a.confirmation.fit import Fitter, Place, Solution
from er3a.confirmation.layers import EXPLAINED, PRICE, Attempts, cost, parts_of, search
from er3a.confirmation.pairs import Pairs, spread
from er3a.confirmation.poses import read_pairs
from er3a.errors import ArgumentError, Er3aError
from er3a.finding import Finding, fact
from er3a.geometry.transforms import check_poses, rpy_of
from er3a.kinematics.chain import row_values
from er3a.kinematics.forward import checked_joints
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.references.quantities import MM
from er3a.references.reference import INTERVAL_95
from er3a.robots.robot import Robot, Source

Layer = Literal["reading", "frames", "joints", "small", "another"]
Verdict = Literal["agrees", "reading", "frames", "joints", "small", "another", "open"]
LAYERS: tuple[Layer, ...] = ("reading", "frames", "joints", "small", "another")
LAYER_OF: dict[str, Layer] = {
    "form": "reading",
    "unit": "reading",
    "row": "reading",
    "joints_in": "reading",
    "base": "frames",
    "tool": "frames",
    "small": "small",
    "entry": "another",
}
"""Of parts of an explanation; of all others it is ``joints``."""
SEARCHED, FITTED = 40, 300  # rows with which explanations are sought, and with which the chosen one is fitted
LEAST, LEAST_POSITIONS = 4, 8  # distinct poses with orientations, and without
ALIKE = 45.0  # squares and price by which another explanation may be worse and is named
MOST_NOISE, NOISE_SHARE = 5e-4, 0.2  # m that an arm that moved a little may leave, and share of what was before
OPEN_M, OPEN_RAD = 1e-3, float(np.radians(0.1))
FOLDS, HELD_OUT = 5, 8
DIGIT_M, DIGIT_RAD = 1e-9, 1e-9  # of poses that are given as arrays


@frozen
class FoundEntry:
    """An entry of the table that is other: mm or deg, with half its 95 % interval."""

    entry: Entry
    given: float
    found: float
    half_width: float


UPRIGHT_DEG = 90.0


@frozen
class Placed(ByValue):
    """Base or tool of the controller, (4, 4), m, with half of its 95 % intervals, mm and deg."""

    T: Reals
    half_width_mm: float
    half_width_deg: float

    @property
    def xyz_mm(self) -> Reals:
        """(3,), mm."""
        return MM * self.T[:3, 3]

    @property
    def rpy_deg(self) -> Reals:
        """(3,), roll, pitch and yaw, deg; where the pitch is upright, within its interval, all else is roll."""
        roll, pitch, yaw = np.degrees(rpy_of(self.T))
        if UPRIGHT_DEG - abs(pitch) <= self.half_width_deg:
            roll, yaw = (roll - np.sign(pitch) * yaw + 180) % 360 - 180, 0.0
        return np.array([roll, pitch, yaw])


@frozen
class Confirmation(ByValue, Displayed):
    """Whether a model agrees with its controller, and what is between them.

    Attributes
    ----------
    verdict : the heaviest of ``layers``; ``agrees`` without any, ``open`` if nothing explains the poses
    layers : what was found between model and controller, of ``LAYERS``
    form, factor : the orientations' form that fits, and by how much positions are larger than the model's
    renamed : whether the columns' names say another form
    joints : what is other in the joints, as findings
    base, tool : of the controller, where they are other than the robot file's
    entries : of the table that are other; small : corrections of all others, mm or deg, the largest first
    corrected : the robot as the controller has it
    left_mm, left_deg : (N,), what is left of each pose; before_mm, before_deg : by the model as it is
    digits_mm, digits_deg : what rounding explains of these, one standard deviation
    fits : (N,) bool, whether a row fits; lines : (N,), where it was read
    noise : how many times more than digits is left, 1 if they explain it
    held_out_mm : root mean square at poses left out of the fit, for small corrections
    alike : other explanations that fit as well, as findings
    not_settled : entries that could be off by 1 mm or 0.1 deg without a trace in these poses
    taken_up : entries that act as the base or tool does that was found
    notes : what was assumed in reading
    oriented : whether orientations were given
    """

    verdict: Verdict
    layers: tuple[Layer, ...]
    form: str
    renamed: bool
    factor: float
    joints: tuple[Finding, ...]
    base: Placed | None
    tool: Placed | None
    entries: tuple[FoundEntry, ...]
    small: tuple[FoundEntry, ...]
    corrected: Robot
    left_mm: Reals
    left_deg: Reals
    before_mm: Reals
    before_deg: Reals
    digits_mm: float
    digits_deg: float
    fits: Flags
    lines: Integers
    noise: float
    held_out_mm: float | None
    alike: tuple[Finding, ...]
    not_settled: tuple[str, ...]
    taken_up: tuple[str, ...]
    notes: tuple[tuple[str, str], ...]
    oriented: bool

    def sheet(self) -> Sheet:
        """Verdict and what is left at each pose, for printing.

        Returns
        -------
        sheet : one row for each pose
        """
        columns = ("line", "mm before", "mm", "deg")
        rows = zip(self.lines.tolist(), self.before_mm, self.left_mm, self.left_deg)
        return Sheet.of_table(f"Confirmation: {self.verdict}", columns, rows, self.layers)

    def __bool__(self) -> bool:
        raise TypeError("a confirmation is neither true nor false; read its verdict")


def confirm(
    robot: Robot,
    poses: str | Path | Reals | Pairs,
    T: Reals | None = None,
    *,
    angles: str | None = None,
    units: str | None = None,
) -> Confirmation:
    """Whether a model agrees with its controller, and if not, the least that explains the difference.

    Agreement says nothing about the arm's accuracy: a controller's poses repeat the controller's own model.

    Parameters
    ----------
    poses : a file of joint values and poses (:mod:`er3a.confirmation.poses`), or joint values (N, n), rad or m
    T : (N, 4, 4), m, the controller's poses for joint values
    angles : the form of orientations, if columns leave it open: ``rpy``, ``abc``, ``zyz``, ``xyz``, ``rotation_vector``
    units : of positions without one: ``mm``, ``m``, ``in``, ``cm``

    Returns
    -------
    found : verdict, what is between model and controller, and what is left

    Raises
    ------
    InputError
        for a file that can't be read, and for too few poses
    """
    if isinstance(poses, str | Path):
        pairs = read_pairs(poses, robot, angles=angles, units=units)
    elif isinstance(poses, Pairs):
        pairs = poses
    elif T is None:
        raise ArgumentError("T", T, "the controller's poses, (N, 4, 4) in m")
    else:
        q, T = np.atleast_2d(checked_joints(robot, poses)), check_poses(T).reshape(-1, 4, 4)
        digits = np.full(robot.joints, DIGIT_RAD), np.full(3, DIGIT_M), DIGIT_RAD
        pairs = Pairs(q, T[:, :3, 3], {"matrix": T[:, :3, :3]}, 1, *digits, np.arange(1, len(q) + 1))
    least = LEAST if pairs.turns else LEAST_POSITIONS
    if len(pairs) < least:
        without = "" if pairs.turns else " without orientations"
        raise Er3aError(f"{len(pairs)} distinct poses{without}; {least} at least are needed")
    return _answer(robot, pairs)


def _answer(robot: Robot, pairs: Pairs) -> Confirmation:
    found = search(Fitter(robot, pairs.some(spread(len(pairs), SEARCHED))))
    chosen, noise = _chosen(found)
    fitter = Fitter(robot, pairs.some(spread(len(pairs), FITTED)))
    fitter.widen = noise
    final = _on_more(fitter, chosen)
    whole = Fitter(robot, pairs)
    at_all = whole.at(final)
    (before_mm, before_deg), (left_mm, left_deg) = map(_sizes, (whole.at(found.found[0]), at_all))
    explained = final.per_freedom <= EXPLAINED
    layers = _layers(final, found.named) if explained else ()
    misread = (at_all.by_row > 9.0 * noise**2 * whole.dimensions) & explained
    if misread.any() and "reading" not in layers:
        layers = ("reading", *layers)
    sd = whole.expected(at_all)
    half = dict(zip(final.free, (INTERVAL_95 * final.errors).tolist()))
    entries, small = _entries(robot, final, half)
    unseen, taken_up = _unseen(fitter, final) if explained else ((), ())
    return Confirmation(
        verdict=(layers[-1] if layers else "agrees") if explained else "open",
        layers=layers,
        form=final.explanation.form,
        renamed=final.explanation.form not in found.named,
        factor=final.explanation.factor,
        joints=final.explanation.joints.faults,
        base=_placed(final, "base", half),
        tool=_placed(final, "tool", half),
        entries=entries,
        small=small,
        corrected=_corrected(robot, final, len(pairs)),
        left_mm=left_mm,
        left_deg=left_deg,
        before_mm=before_mm,
        before_deg=before_deg,
        digits_mm=MM * sd[0],
        digits_deg=float(np.degrees(sd[1])),
        fits=~misread,
        lines=pairs.lines,
        noise=noise,
        held_out_mm=_held_out(fitter, final) if final.explanation.small else None,
        alike=_alike(found, chosen) if explained else (),
        not_settled=unseen,
        taken_up=taken_up,
        notes=pairs.notes,
        oriented=bool(pairs.turns),
    )  # fmt: skip


def _sizes(solution: Solution) -> tuple[Reals, Reals]:
    """How far (N,) poses are off, mm and deg."""
    away, turned = (np.linalg.norm(part, axis=1) for part in np.split(solution.left, 2, axis=1))
    return MM * away, np.degrees(turned)


def _chosen(found: Attempts) -> tuple[Solution, float]:
    """What explains best, and how many times the digits it leaves; of nothing that explains, what leaves least."""
    if explained := found.explained():
        return explained[0], 1.0
    best = min(found.found, key=lambda each: each.per_freedom)
    if best.rms < min(MOST_NOISE, NOISE_SHARE * found.found[0].rms):
        noise = best.per_freedom**0.5
        near = [each for each in found.found if each.per_freedom <= EXPLAINED * noise**2]
        return min(near, key=lambda each: each.chi2 / noise**2 + PRICE * cost(each, found.named)), noise
    return min(found.found, key=lambda each: each.chi2**0.5 * 1.1 ** cost(each, found.named)), 1.0


def _on_more(fitter: Fitter, chosen: Solution) -> Solution:
    """The chosen explanation fitted to more rows, without those that don't fit."""
    solution = fitter.fit(chosen.explanation, chosen)
    bad = fitter.at(chosen).by_row > 9.0 * fitter.dimensions
    if solution.per_freedom > EXPLAINED and 0 < bad.sum() <= 0.2 * len(bad):
        solution = fitter.fit(chosen.explanation, chosen, np.where(bad, 0.0, 1.0))
    return solution


def _layers(solution: Solution, named: Sequence[str]) -> tuple[Layer, ...]:
    found = {LAYER_OF.get(kind, "joints") for kind, _ in parts_of(solution, named)}
    return tuple(layer for layer in LAYERS if layer in found)


def _placed(solution: Solution, place: Place, half: Mapping[Entry, float]) -> Placed | None:
    """Base or tool with half its intervals, if it was fitted."""
    placing = placements_of((place,), solution.seen.oriented)
    own = {each: half[each] * each.in_unit for each in placing if each in half}
    if not own:
        return None
    mm, deg = (max((own[each] for each in own if each.unit == unit), default=np.inf) for unit in ("mm", "deg"))
    return Placed(getattr(solution.arm, place), mm, deg)


def _entries(
    robot: Robot, solution: Solution, half: Mapping[Entry, float]
) -> tuple[tuple[FoundEntry, ...], tuple[FoundEntry, ...]]:
    """Entries that are other, and small corrections, the largest first."""
    every = []
    for each, amount in zip(solution.entries, solution.amounts.tolist()):
        given = each.value(robot)
        every.append(FoundEntry(each, given, given + amount * each.in_unit, half[each] * each.in_unit))
    own = len(solution.explanation.entries)
    by_size = sorted(
        every[own:], key=lambda each: -abs(each.found - each.given) / (each.entry.scale * each.entry.in_unit)
    )
    return tuple(every[:own]), tuple(by_size)


def _corrected(robot: Robot, solution: Solution, count: int) -> Robot:
    """The robot as the controller has it: table, joints, base and tool."""
    found = solution.arm
    factors, shift = solution.explanation.joints.factors, solution.explanation.joints.shift
    if solution.explanation.joints.faults:
        sizes = np.abs(factors).max(axis=1)
        factors = factors / np.where(np.abs(sizes - 1) > 0.01, sizes, 1.0)[:, None]
        moved = robot.direction * row_values(robot, shift)
        found = found.replace(
            offset=found.offset + np.where(robot.sliding, 0.0, moved), d=found.d + np.where(robot.sliding, moved, 0.0)
        )
        if robot.coupling is None and np.array_equal(np.abs(factors), np.eye(robot.joints)):
            sign = np.diag(factors)
            ends = np.sort(np.stack([sign * (robot.lower - shift), sign * (robot.upper - shift)]), axis=0)
            found = found.replace(direction=found.direction * sign, lower=ends[0], upper=ends[1])
        else:
            found = found.replace(coupling=robot.joint_to_row @ factors)
    if not (solution.entries or solution.explanation.free or solution.explanation.joints.faults):
        return found
    source = Source(f"Fitted to {count} poses of the controller, starting from {robot.name}", "inferred")
    named = ("dh", "zero", *solution.explanation.free)
    return found.replace(sources={**robot.sources, **dict.fromkeys(named, source)})


def _held_out(fitter: Fitter, solution: Solution) -> float | None:
    """Root mean square of positions (mm) at poses that were left out, in turns."""
    rows = np.flatnonzero(solution.rows)
    if len(rows) < HELD_OUT:
        return None
    squares = []
    for fold in range(FOLDS):
        out = rows[fold::FOLDS]
        weights = solution.rows.astype(float)
        weights[out] = 0.0
        left = fitter.fit(solution.explanation, solution, weights)
        squares += (left.left[out, :3] ** 2).sum(axis=1).tolist()
    return float(MM * np.sqrt(np.mean(squares)))


def _alike(found: Attempts, chosen: Solution) -> tuple[Finding, ...]:
    """Other explanations that fit as well, and are none with more of the same."""
    seen, named = [set(parts_of(chosen))], []
    for each in found.explained():
        parts = set(parts_of(each))
        if found.total(each) > found.total(chosen) + ALIKE or any(before <= parts for before in seen):
            continue
        seen.append(parts)
        joints, places = each.explanation.joints.faults, each.explanation.free
        zeros = tuple(entry.joint for entry in each.explanation.entries if entry.column == "offset")
        entries = tuple(entry.name for entry in each.explanation.entries if entry.column != "offset")
        named.append(fact("explains_too", joints=joints, places=places, zeros=zeros, entries=entries))
    return tuple(named)


def _unseen(fitter: Fitter, solution: Solution) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Entries that could be off by 1 mm or 0.1 deg: without a trace, and because base or tool acts alike."""
    every = [each for each in fitter.every if each not in solution.entries]
    own, rest, _ = fitter.effects(solution, every)
    least = INTERVAL_95 / np.array([OPEN_M if each.unit == "mm" else OPEN_RAD for each in every])
    unseen = np.linalg.norm(own, axis=0) < least
    taken = ~unseen & (np.linalg.norm(rest, axis=0) < least)
    by_kind = [tuple(each.name for each, holds in zip(every, flags) if holds) for flags in (unseen, taken)]
    return by_kind[0], by_kind[1]
