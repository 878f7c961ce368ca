"""The least that explains what is between a model and its controller.

Explanations are fitted in order of what they ask for: nothing; orientations, units or joints read otherwise; a tool or
a base; rows misread; one or two entries of the table; small corrections of all. What leaves no more than digits
explains.
Of several, the one is chosen whose squares plus ``PRICE`` times its cost are least.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from er3a.comparison.entries import Entry
from er3a.confirmation.fit import Explanation, Fitter, Place, Solution, State
from er3a.confirmation.screen import Near, joined, nearest, plain, single_readings
from er3a.geometry.transforms import inverted, nearest_rotations, posed
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot

EXPLAINED = 4.0
"""Squares per degree of freedom: what is left is less than twice what digits explain."""
PRICE = 20.0  # squares that a fault has to save: 1 in 10 000 do by chance
COST = {
    "form": 1.0,
    "unit": 1.0,
    "row": 1.5,
    "joints_in": 1.0,
    "zero_elsewhere": 3.2,
    "base": 2.0,
    "tool": 2.0,
    "zero": 3.0,
    "entry": 4.0,
    "small": 9.0,
}
OF_JOINTS = 3.0  # any other way of reading joints
UNITS = {"m": 1e3, "km": 1e6, "um": 1e-3, "in": 25.4, "cm": 10.0, "m_as_in": 1e3 / 25.4, "in_as_m": 0.0254, "ft": 304.8}
UNIT_NEAR, UNIT_RIGHT = 0.3, 0.3
FAR_TURN, FAR_AWAY = 0.01, 0.01  # rad and m, beyond which pairs of ways of reading are tried
CANDIDATES, BY_TURN, TRIED = 5, 3, 3
SINGLES, PAIRS, STATES, MOST = 6, 8, 3, 4
INDEPENDENT = 1e-3
MOST_ROWS, ROW_OFF, ROUNDS = 0.2, 9.0, 12  # share of rows that may be misread; squares of one of its numbers
PLACES: tuple[tuple[Place, ...], ...] = ((), ("tool",), ("base",), ("base", "tool"))
BOTH: tuple[Place, ...] = ("base", "tool")


def parts_of(solution: Solution, named: Sequence[str] = ()) -> list[tuple[str, object]]:
    """What an explanation is made of: of each part the kind, and which one it is.

    Parameters
    ----------
    named : forms of orientation that the columns' names allow, which are no part
    """
    found = solution.explanation
    parts: list[tuple[str, object]] = [(each.code, each) for each in found.joints.faults]
    if found.form not in named:
        parts.append(("form", found.form))
    if found.factor != 1:
        parts.append(("unit", found.factor))
    parts += [(place, place) for place in found.free]
    parts += [("zero" if each.column == "offset" else "entry", each.name) for each in found.entries]
    if found.small:
        parts.append(("small", None))
    return parts + [("row", None)] * int((~solution.rows).sum())


def cost(solution: Solution, named: Sequence[str]) -> float:
    """What an explanation asks for.

    Parameters
    ----------
    named : forms of orientation that the columns' names allow
    """
    return sum(COST.get(kind, OF_JOINTS) for kind, _ in parts_of(solution, named))


@dataclass
class Attempts:
    """What was fitted, and what is chosen of it."""

    fitter: Fitter
    found: list[Solution]

    @property
    def named(self) -> tuple[str, ...]:
        """Forms of orientation that the columns' names allow."""
        return self.fitter.pairs.forms[: self.fitter.pairs.named]

    def total(self, solution: Solution) -> float:
        """What decides between solutions, the lower the better."""
        return solution.chi2 + PRICE * cost(solution, self.named)

    def explained(self) -> list[Solution]:
        """Solutions that leave no more than digits, the best first."""
        every = (each for each in self.found if each.per_freedom <= EXPLAINED and each.plausible)
        return sorted(every, key=self.total)

    def add(self, explanation: Explanation, near: State | Robot, weights: Reals | None = None) -> Solution:
        """Fit an explanation and keep it."""
        self.found.append(self.fitter.fit(explanation, near, weights))
        return self.found[-1]


def search(fitter: Fitter) -> Attempts:
    """Fit explanations until one explains.

    Parameters
    ----------
    fitter : with the pairs that are to be explained, some dozens

    Returns
    -------
    search : with all that was fitted
    """
    robot, found = fitter.robot, Attempts(fitter, [])
    for form in found.named:
        found.add(Explanation(plain(robot), form), robot)
    if found.explained():
        return found
    candidates = _candidates(fitter, found)
    starts = [pair for near in candidates for pair in _with_frames(found, near)]
    if found.explained():
        return found
    for solution in _nearest_of(found, 2 * TRIED):
        _without_rows(found, solution)
    if found.explained():
        return found
    states: list[Solution] = []
    starts.sort(key=lambda pair: pair[1].chi2 ** 0.5 * 1.2 ** cost(pair[1], found.named))
    for pair in starts[:TRIED]:
        here = [state for start in pair for state in _with_entries(found, [start])]
        _with_small(found, pair, here)
        if found.explained():
            return found
        states += here
    _with_entries(found, sorted(states, key=lambda each: each.chi2)[:STATES])
    for solution in _nearest_of(found, TRIED) if not found.explained() else []:
        _without_rows(found, solution)
    return found


def _candidates(fitter: Fitter, found: Attempts) -> list[Near]:
    """Ways of reading joints and orientations that come near."""
    readings = [plain(fitter.robot), *single_readings(fitter.robot)]
    near = nearest(fitter, readings, fitter.pairs.forms)
    if near[0].turned > FAR_TURN or near[0].away > FAR_AWAY:
        two = [joined(a, b) for a, b in combinations(readings[1:], 2) if a.faults[0].code != "zero_elsewhere"]
        near += nearest(fitter, two, found.named)

    def asked(each: Near) -> float:
        return 0.1 * (
            sum(COST.get(fault.code, OF_JOINTS) for fault in each.joints.faults) + (each.form not in found.named)
        )

    by_score = sorted(near, key=lambda each: each.score + asked(each))
    by_turn = sorted(near, key=lambda each: np.log10(max(each.turned, 2e-4)) + asked(each))
    chosen = {id(each): each for each in (*by_score[:CANDIDATES], *by_turn[:BY_TURN])}
    return list(chosen.values())


def _factors(near: Near) -> list[float]:
    """Units of positions that could be meant: their size, and that which brings them near."""
    right = [1.0] if abs(near.factor - 1) < UNIT_RIGHT else []
    other = [size for size in UNITS.values() if abs(near.factor / size - 1) < UNIT_NEAR]
    return right or other[:1] or [1.0]


def _with_frames(found: Attempts, near: Near) -> Iterator[tuple[Solution, Solution]]:
    """Fit a way of reading with no frame, a tool, a base, and both; what is found with none and with both, for each
    unit."""
    fitter = found.fitter
    robot, pairs = fitter.robot, fitter.pairs
    F = fitter.flanges([near.joints])[0]
    for factor in _factors(near):
        for free in PLACES:
            Y, X = near.Y, near.X
            if pairs.turns:
                C = posed(pairs.turns[near.form], factor * pairs.xyz)
                if free == ("tool",):
                    X = _middle(inverted(robot.base @ F) @ C)
                if free == ("base",):
                    Y = _middle(C @ inverted(F @ robot.tool))
            found.add(Explanation(near.joints, near.form, factor, free), robot.replace(base=Y, tool=X))
        yield found.found[-len(PLACES)], found.found[-1]


def _middle(T: Reals) -> Reals:
    """The transform in the middle of some (N, 4, 4), medians of positions."""
    return posed(nearest_rotations(T[:, :3, :3].mean(axis=0)), np.median(T[:, :3, 3], axis=0))


def _nearest_of(found: Attempts, most: int) -> list[Solution]:
    """Solutions that leave least for what they ask."""
    robust = sorted(found.found, key=lambda each: float(np.median(each.by_row)) + PRICE * cost(each, found.named))
    return robust[:most]


def _without_rows(found: Attempts, solution: Solution) -> None:
    """The same explanation without the rows that don't fit, if these are few."""
    count = len(solution.by_row)
    most, numbers = int(max(1, MOST_ROWS * count)), found.fitter.dimensions
    if count < 5:
        return
    for _ in range(ROUNDS):
        size = max(float(np.median(solution.by_row)), 2.0 * numbers)
        weights = 1 / np.sqrt(1 + solution.by_row / size)
        last, solution = solution, found.fitter.fit(solution.explanation, solution, weights)
        if (np.abs(last.by_row - solution.by_row) < 0.1 + 0.01 * solution.by_row).all():
            break
    bad = solution.by_row > ROW_OFF * numbers
    if 0 < bad.sum() <= most:
        found.add(solution.explanation, solution, np.where(bad, 0.0, 1.0))


def _with_entries(found: Attempts, states: Iterable[Solution]) -> list[Solution]:
    """Solutions with one or two entries more, the nearest first."""
    reached = []
    for state in states:
        for more in _promising(found.fitter, state):
            entries = (*state.explanation.entries, *more)
            if len(entries) <= MOST:
                solution = found.add(replace(state.explanation, entries=entries), state)
                reached.append(_with_fewer_frames(found, solution))
    return sorted(reached, key=lambda each: each.chi2)[:STATES]


def _with_fewer_frames(found: Attempts, solution: Solution) -> Solution:
    """A solution that explains, with one frame less if it still does."""
    if solution.per_freedom <= EXPLAINED and solution.explanation.free == BOTH:
        for free in PLACES[:3]:
            found.add(replace(solution.explanation, free=free), solution)
    return solution


def _promising(fitter: Fitter, state: Solution) -> list[tuple[Entry, ...]]:
    """Entries, alone and in pairs, that reduce the squares most, to first order."""
    own = set(state.explanation.entries)
    every = [each for each in fitter.every if each not in own and each.column != "beta"]
    derivatives, E, left = fitter.effects(state, every)
    size = np.linalg.norm(E, axis=0)
    seen = size > INDEPENDENT * np.maximum(np.linalg.norm(derivatives, axis=0), 1e-12)
    E, numbers = E[:, seen] / size[seen], np.flatnonzero(seen)
    b, G = E.T @ left, E.T @ E
    singles = [(every[numbers[k]],) for k in np.argsort(-(b**2), kind="stable")[:SINGLES]]
    i, j = np.triu_indices(len(b), 1)
    rest_of_two = 1 - G[i, j] ** 2
    gain = np.where(
        rest_of_two > INDEPENDENT**2,
        (b[i] ** 2 - 2 * G[i, j] * b[i] * b[j] + b[j] ** 2) / np.maximum(rest_of_two, 1e-9),
        0,
    )
    two = [(every[numbers[i[k]]], every[numbers[j[k]]]) for k in np.argsort(-gain, kind="stable")[:PAIRS]]
    return [*singles, *two]


def _with_small(found: Attempts, starts: Sequence[Solution], states: Sequence[Solution]) -> None:
    """Small corrections of all entries, with the entries that are off by more free."""
    for start in [*starts, *sorted(states, key=lambda each: each.chi2)[: 2 * STATES]]:
        solution = found.add(replace(start.explanation, small=True), start)
        for _ in range(MOST):
            if solution.plausible:
                break
            own = solution.explanation.entries
            largest = len(own) + int(np.abs(solution.amounts[len(own) :]).argmax())  # it may be off by any amount
            entries = (*own, solution.entries[largest])
            solution = found.add(replace(solution.explanation, entries=entries), solution)
        if solution.per_freedom <= EXPLAINED:
            _with_fewer_frames(found, solution)
            _with_fewer_entries(found, solution)


def _with_fewer_entries(found: Attempts, solution: Solution) -> None:
    """The solution with its large corrections alone, and with one of them small as the others."""
    own = solution.explanation.entries
    if own:
        alone = replace(solution.explanation, small=False)
        _with_fewer_frames(found, found.add(alone, solution))
    for entry in own:
        others = tuple(each for each in own if each != entry)
        found.add(replace(solution.explanation, entries=others), solution)
