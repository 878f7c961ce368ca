"""The set of pairs with a swap, a unit, a sign, a shift or the other convention in them, against a second list of such
mistakes with kinematics of its own: every two of them, and every one of them with every number scanned."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations, permutations

import numpy as np
import pytest

from er3a.diagnosis.diagnose import diagnosis_of
from er3a.diagnosis.faults import Fault, entry_of
from er3a.files.robot_library import load_robot
from er3a.finding import Finding
from er3a.numerics.arrays import Reals
from testing.flange_positions import HALF_WIDTH_MM, flange_mm, references_to

pytestmark = pytest.mark.long

A, D, ALPHA, OFFSET, DIRECTION = range(5)
COLUMNS = ("a", "d", "alpha", "offset", "direction")
WORTH_A_CLOSER_LOOK = 400.0  # half-widths, next to a place of the scan
Arm = tuple[Reals, bool]
"""Columns (5, 6) in m and rad, and whether the rows are modified ones."""
Change = Callable[[Arm], Arm]


def on_columns(change: Callable[[Reals], None]) -> Change:
    """A change of a copy of the columns."""

    def apply(arm: Arm) -> Arm:
        columns = arm[0].copy()
        change(columns)
        return columns, arm[1]

    return apply


def scaled(rows: list[int], factor: float) -> Change:
    def change(c: Reals) -> None:
        c[rows] *= factor

    return on_columns(change)


def reordered(rows: list[int], order: list[int]) -> Change:
    def change(c: Reals) -> None:
        c[rows] = c[rows][:, order]

    return on_columns(change)


def a_for_d(joints: list[int]) -> Change:
    def change(c: Reals) -> None:
        c[np.ix_([A, D], joints)] = c[np.ix_([D, A], joints)]

    return on_columns(change)


def negated(row: int, joint: int) -> Change:
    def change(c: Reals) -> None:
        c[row, joint] *= -1

    return on_columns(change)


def mistakes() -> dict[str, Change]:
    """What undoes each mistake without a number."""
    found: dict[str, Change] = {"convention": lambda arm: (arm[0], not arm[1])}
    for name, rows in (("a", [A]), ("d", [D]), ("lengths", [A, D])):
        found |= {f"{name} x {factor:g}": scaled(rows, factor) for factor in (1000.0, 0.001)}
    for name, rows in (("alpha", [ALPHA]), ("offset", [OFFSET]), ("angles", [ALPHA, OFFSET])):
        found |= {f"{name} in rad": scaled(rows, 180 / np.pi), f"{name} in deg": scaled(rows, np.pi / 180)}
    for j in range(6):
        found |= {f"alpha{j + 1}": negated(ALPHA, j), f"direction{j + 1}": negated(DIRECTION, j)}
        found[f"a for d of {j + 1}"] = a_for_d([j])
    found["a for d of None"] = a_for_d(list(range(6)))
    for i, j in combinations(range(6), 2):
        order = list(range(6))
        order[i], order[j] = j, i
        found[f"rows {i + 1} and {j + 1}"] = reordered([A, D, ALPHA], order)
    for name, rows in (("rows", [A, D, ALPHA]), ("a", [A]), ("alpha", [ALPHA]), ("d", [D])):
        found[f"{name} down"] = reordered(rows, [1, 2, 3, 4, 5, 0])
        found[f"{name} up"] = reordered(rows, [5, 0, 1, 2, 3, 4])
    return found


def name_of(fault: Fault) -> str | None:
    """What this file calls a fault; None for those of limits, which no position shows."""
    match fault:
        case Finding(code="wrong_unit", entries=entries, misread=misread):
            names = {"metres_as_millimetres": "x 1000", "millimetres_as_metres": "x 0.001"}
            names |= {"radians_as_degrees": "in rad", "degrees_as_radians": "in deg"}
            return None if entries == "limits" else f"{entries} {names[misread]}"
        case Finding(code="swapped_entries", joint=joint):
            return f"a for d of {joint}"
        case Finding(code="swapped_rows", first=first, second=second):
            return f"rows {first} and {second}"
        case Finding(code="shifted_rows", entries=entries, toward=toward):
            return f"{entries} {toward}"
        case Finding(code="wrong_convention"):
            return "convention"
        case Finding(code="wrong_scale"):
            return "scale"
    return entry_of(fault)


def differ(one: Arm, other: Arm) -> bool:
    return one[1] != other[1] or bool(np.abs(one[0] - other[0]).max() > 1e-9)


class Search:
    """Every pair of which one is a mistake without a number."""

    def __init__(self, given: Arm, base: Reals, stated: Reals):
        self.given, self.base, self.stated = given, base, stated
        different = {name: undo(given) for name, undo in mistakes().items()}
        self.single = {name: arm for name, arm in different.items() if differ(arm, given)}

    def greatest(self, columns: Reals, modified: bool) -> Reals:
        """The greatest residual (V,) in half-widths."""
        return np.abs(flange_mm(columns, modified, self.base) - self.stated).max(axis=1) / HALF_WIDTH_MM

    def without_number(self) -> dict[frozenset[str], list[Arm]]:
        """Names of the pairs of mistakes without a number that explain, in either order, with the arms they lead to."""
        undo, found = mistakes(), dict[frozenset[str], list[Arm]]()
        for first, second in permutations(self.single, 2):
            arm = undo[second](self.single[first])
            if self.greatest(arm[0][None], arm[1])[0] <= 1:
                found.setdefault(frozenset((first, second)), []).append(arm)
        return found

    def with_number(self) -> set[frozenset[str]]:
        """Names of the pairs that explain of which one has a number."""
        return {
            frozenset((name, number))
            for name, arm in self.single.items()
            for number in self._numbers(arm)
            if number != name
        }

    def _numbers(self, arm: Arm) -> list[str]:
        """Numbers of which some value makes an arm meet all that is stated."""
        found = []
        for k, name in enumerate(COLUMNS[:4]):
            reach = np.linspace(-1.5, 1.5, 601) if k in (A, D) else np.linspace(-np.pi, np.pi, 601)
            for j in range(6):
                if self._meets(
                    arm, lambda c, by, k=k, j=j: c[:, k].__setitem__((slice(None), j), c[:, k, j] + by), reach
                ):
                    found.append(f"{name}{j + 1}")
        if self._meets(
            arm, lambda c, by: c.__setitem__(np.s_[:, :2], c[:, :2] * np.exp(by)[:, None, None]), reach * 2.5
        ):
            found.append("scale")
        return found

    def _meets(self, arm: Arm, change: Callable[[Reals, Reals], None], reach: Reals) -> bool:
        def height(amounts: Reals) -> Reals:
            columns = np.repeat(arm[0][None], len(amounts), axis=0)
            change(columns, amounts)
            return self.greatest(columns, arm[1])

        heights, width = height(reach), reach[1] - reach[0]
        lowest = reach[np.argsort(heights)[:4]]
        if heights.min() > WORTH_A_CLOSER_LOOK:
            return False
        while width > 1e-9:
            near = (lowest[:, None] + np.linspace(-width, width, 21)).reshape(-1)
            rows = height(near).reshape(len(lowest), -1)
            if rows.min() <= 1:
                return True
            lowest, width = near.reshape(rows.shape)[np.arange(len(rows)), rows.argmin(axis=1)], width / 6
        return False


CORRUPTED: list[tuple[str, list[str], dict[tuple[int, int], float]]] = [
    ("er3_600", ["rows 2 and 3"], {(D, 3): 0.03}),
    ("er3a_c60", ["convention", "direction3"], {}),
]


@pytest.mark.parametrize(("name", "wrong", "numbers"), CORRUPTED)
def test_the_pairs_in_the_verdict_are_all_that_explain(name, wrong, numbers):
    robot = load_robot(name).without_tool()
    right = np.stack([getattr(robot, column) for column in COLUMNS]), False
    stated = flange_mm(right[0][None], False, robot.base)[0].round(1)
    given = right[0].copy(), False
    for place, by in numbers.items():
        given[0][place] += by
    for each in wrong:
        given = mistakes()[each](given)
    changed = robot.replace(**dict(zip(COLUMNS, given[0])), convention="modified" if given[1] else "standard")
    best = diagnosis_of(changed, references_to(stated))[0]
    assert best.explains
    assert len(best.faults) == 2
    sets = [{name_of(fault) for fault in faults} for faults in (best.faults, *best.indistinguishable_from)]
    search = Search(given, robot.base, stated)
    in_verdict = {frozenset(str(each) for each in own) for own in sets if own & set(search.single)}
    discrete, continuous = search.without_number(), search.with_number()
    assert in_verdict <= set(discrete) | continuous
    assert continuous <= in_verdict
    arms = [arm for pair in in_verdict for arm in discrete.get(pair, [])]
    for pair, others in discrete.items():  # the same arm may be told in several ways: one of them will do
        assert pair in in_verdict or all(any(not differ(arm, each) for each in arms) for arm in others), pair
