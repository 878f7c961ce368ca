"""The first set of a diagnosis against a refit of every entry by other means, on an arm that the project doesn't hold.

The oracle has kinematics of its own and looks for values by brute force: no derivatives, no least squares.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

import er3a
from er3a.diagnosis.diagnose import Hypothesis, diagnosis_of
from er3a.diagnosis.faults import entry_of, rounded
from er3a.diagnosis.ranking import usable
from er3a.files.reference_sets import load_references
from er3a.files.robot_library import load_robot
from er3a.finding import fact, is_one
from er3a.numerics.arrays import Reals
from er3a.references.quantities import COORDINATES, LimitExcess, PointCoordinate
from er3a.references.reference import Reference
from testing.reference_subjects import point_at_pose, pose_excess

POSES = (
    (0, 0, 0, 0, 0, 0),
    (40, -60, 50, 20, 35, 10),
    (-75, -20, -95, 110, -40, 60),
    (130, -100, 30, -65, 80, -20),
    (10, 35, 75, -15, -100, 90),
)
HALF_WIDTH_MM = 0.2
COLUMNS = ("a", "d", "alpha", "offset", "direction")


@pytest.fixture(scope="module")
def arm() -> er3a.Robot:
    """Negative lengths, no spherical wrist, two joints reversed, a lifted base."""
    base = np.eye(4)
    base[:3, 3] = 0.0, 0.0, 0.35
    return load_robot("er3_600").replace(
        a=np.array([0.0, -0.425, -0.392, 0.0, 0.0, 0.0]),
        alpha=np.radians([90, 0, 0, 90, -90, 0]),
        d=np.array([0.089, 0.0, -0.02, 0.109, 0.095, 0.082]),
        offset=np.radians([15, -90, 0, -90, 0, 0]),
        direction=np.array([-1.0, 1, 1, -1, 1, 1]),
        base=base,
    )


Rows = dict[str, Reals]
"""Columns of V tables, (V, 6) each."""


def flange_mm(rows: Rows, base: Reals, pose: tuple[float, ...]) -> Reals:
    """Standard rows multiplied out, (V, 3)."""
    T = np.broadcast_to(base, (len(rows["a"]), 4, 4))
    for j, q in enumerate(np.radians(pose)):
        a, d, alpha = (rows[name][:, j] for name in ("a", "d", "alpha"))
        t = rows["direction"][:, j] * q + rows["offset"][:, j]
        ct, st, ca, sa, none = np.cos(t), np.sin(t), np.cos(alpha), np.sin(alpha), np.zeros(len(a))
        row = [
            [ct, -st * ca, st * sa, a * ct],
            [st, ct * ca, -ct * sa, a * st],
            [none, sa, ca, d],
            [none] * 3 + [none + 1],
        ]
        T = T @ np.moveaxis(np.array(row), -1, 0)
    return 1000 * T[:, :3, 3]


def rows_of(robot: er3a.Robot, entry: str = "a1", by: Reals | None = None) -> Rows:
    """The robot's table with each of V amounts added to one entry, in m or rad; a direction is reversed."""
    by = np.zeros(1) if by is None else by
    column, joint = entry[:-1], int(entry[-1]) - 1
    rows = {name: np.tile(getattr(robot, name), (len(by), 1)) for name in COLUMNS}
    rows[column][:, joint] = -rows[column][:, joint] if column == "direction" else rows[column][:, joint] + by
    return rows


def stated_of(robot: er3a.Robot, half_width_mm: float = HALF_WIDTH_MM) -> tuple[Reference, ...]:
    """The flange's positions, rounded to 0.1 mm as a document would."""
    return tuple(
        Reference(
            point_at_pose(f"pose {i}", "flange", coordinate),
            "key_poses",
            PointCoordinate(pose, "flange", coordinate),
            round(float(value), 1),
            half_width_mm,
            "a drawing",
            "official",
        )
        for i, pose in enumerate(POSES)
        for coordinate, value in zip(COORDINATES, flange_mm(rows_of(robot), robot.base, pose)[0])
    )


def changed(robot: er3a.Robot, entry: str, by: float) -> er3a.Robot:
    """One entry with something added to it, in m or rad; a direction is reversed."""
    column = entry[:-1]
    return robot.replace(**{column: rows_of(robot, entry, np.array([by]))[column][0]})


@dataclass
class Oracle:
    """Whether some value of an entry meets all references: the greatest residual along the entry, looked for on grids
    that close in on its lowest places."""

    stated: tuple[Reference, ...]

    def greatest(self, robot: er3a.Robot, entry: str = "a1", by: Reals | None = None) -> Reals:
        """The greatest residual (V,) in half-widths, for each amount added to an entry."""
        rows = rows_of(robot, entry, by)
        predicted = np.concatenate([flange_mm(rows, robot.base, pose) for pose in POSES], axis=1)
        expected = np.array([r.expected for r in self.stated])
        return np.abs(predicted - expected).max(axis=1) / self.stated[0].uncertainty

    def explains(self, robot: er3a.Robot, entry: str) -> bool:
        if entry.startswith("direction"):
            return bool(self.greatest(robot, entry)[0] <= 1)
        span = np.linspace(-np.pi, np.pi, 361) if entry[:-1] in ("alpha", "offset") else np.linspace(-1.5, 1.5, 361)
        width = span[1] - span[0]
        lowest = span[np.argsort(self.greatest(robot, entry, span))[:6]]
        while width > 1e-9:
            near = (lowest[:, None] + np.linspace(-width, width, 41)).reshape(-1)
            heights = self.greatest(robot, entry, near).reshape(len(lowest), -1)
            if heights.min() <= 1:
                return True
            lowest = near.reshape(len(lowest), -1)[np.arange(len(lowest)), heights.argmin(axis=1)]
            width /= 10
        return False

    def explaining(self, robot: er3a.Robot) -> set[str]:
        return {f"{c}{j}" for c in COLUMNS for j in range(1, 7) if self.explains(robot, f"{c}{j}")}


def entries_of(hypothesis: Hypothesis) -> list[set[str | None]]:
    """The entries of each member of a set."""
    members = (hypothesis.faults, *hypothesis.indistinguishable_from)
    return [{entry_of(fault) for fault in faults} for faults in members]


@pytest.mark.long
@pytest.mark.parametrize(
    ("entry", "by"),
    [
        ("d1", -0.03),
        pytest.param("a2", 0.25, marks=pytest.mark.long),
        ("a3", 0.0006),
        pytest.param("d3", 0.004, marks=pytest.mark.long),
        pytest.param("offset1", np.radians(-20), marks=pytest.mark.long),
        ("offset5", np.radians(0.2)),
        pytest.param("alpha2", np.radians(7), marks=pytest.mark.long),
        ("direction1", 0.0),
    ],
)
def test_the_first_set_is_all_single_entries_that_explain_and_no_more(arm, entry, by):
    stated = stated_of(arm)
    faulty = changed(arm, entry, by)
    first = er3a.diagnose(faulty, stated)[0]
    named = set().union(*(each for each in entries_of(first) if len(each) == 1))
    assert first.explains
    assert named - {None} == Oracle(stated).explaining(faulty)
    assert entry in named


@pytest.mark.long
@pytest.mark.parametrize(
    "wrong",
    [
        {"d5": 0.05, "a3": -0.03},
        {"alpha2": np.radians(5), "d4": -0.04},
        {"offset2": np.radians(-35), "alpha3": np.radians(50)},
        {"direction1": 0.0, "offset5": np.radians(-70)},
    ],
)
def test_pairs_are_solved_for(arm, wrong):
    stated, faulty = stated_of(arm), arm
    for entry, by in wrong.items():
        faulty = changed(faulty, entry, by)
    first = er3a.diagnose(faulty, stated)[0]
    assert first.explains
    assert Oracle(stated).greatest(first.corrected) <= 1
    assert set(wrong) in entries_of(first)


def test_a_right_table_is_left_alone(arm):
    stated = stated_of(arm)
    conclusion = diagnosis_of(arm, stated).conclusion
    assert is_one(conclusion, "met")


def test_a_limit_that_only_a_pose_contradicts(arm):
    pose = (0.0, 60.0, 0.0, 0.0, 0.0, 0.0)
    shown = Reference(pose_excess("parked"), "key_poses", LimitExcess(pose), 0.0, 1e-3, "a photograph", "official")
    narrow = arm.replace(upper=np.where(np.arange(6) == 1, np.radians(30), arm.upper))
    first = er3a.diagnose(narrow, (*stated_of(arm), shown))[0]
    named = [rounded(faults[0]) for faults in (first.faults, *first.indistinguishable_from)]
    assert fact("wrong_limit", joint=2, side="upper", given_deg=30.0, fits_deg=60.0) in named
    assert all(is_one(fault, "swapped_limits", "wrong_limits", "wrong_limit", "wrong_unit") for fault in named)
    assert first.explains


@pytest.mark.long
def test_what_explains_comes_before_what_does_not():
    """A length off by six half-widths: an angle comes near, but leaves a reference missed."""
    robot = load_robot("er3a_c60")
    ranked = er3a.diagnose(changed(robot, "a3", 0.0003), "er3a_c60")
    explains = [hypothesis.explains for hypothesis in ranked]
    assert explains == sorted(explains, reverse=True)
    assert entries_of(ranked[0]) == [{"a3"}]
    assert ranked[0].half_widths <= 1 < ranked[1].half_widths


def test_the_whole_set_stands_in_the_conclusion():
    conclusion = diagnosis_of(
        changed(load_robot("er3a_c60"), "direction5", 0.0), load_references("er3a_c60")
    ).conclusion
    assert is_one(conclusion, "named")
    members = [conclusion.faults, *conclusion.alternatives]
    assert {entry_of(fault) for faults in members for fault in faults} == {"offset4", "direction5"}
    assert (fact("reversed_direction", joint=5),) in members


@pytest.mark.long
def test_a_fault_beside_references_that_are_off_is_named_as_what_leaves_least(arm):
    """Two references are wrong by more than they own up to: nothing explains them, the fault explains the rest."""
    stated = list(stated_of(arm))
    for place, by in ((4, 0.6), (10, -0.5)):
        stated[place] = replace(stated[place], expected=stated[place].expected + by)
    conclusion = diagnosis_of(changed(arm, "d4", 0.15), stated).conclusion
    assert is_one(conclusion, "mostly")
    members = [conclusion.faults, *conclusion.alternatives]
    assert {entry_of(fault) for faults in members for fault in faults} == {"d2", "d3", "d4"}  # parallel axes


@pytest.mark.long
@pytest.mark.parametrize("name", ["er3a_c60"])
def test_a_missed_reference_is_never_put_down_to_noise(name):
    """One reference moved beyond its half-width: the table can't meet it, so something is said about it."""
    robot, stated = load_robot(name), list(usable(load_references(name)))
    place = next(i for i, r in enumerate(stated) if r.unit == "mm")
    stated[place] = replace(stated[place], expected=stated[place].expected + 3 * stated[place].uncertainty)
    found = diagnosis_of(robot, stated)
    assert not is_one(found.conclusion, "met")
    assert all(h.half_widths <= 1 + 1e-6 for h in found if h.explains)


@pytest.mark.long
def test_few_references_leave_a_set_without_end_that_is_still_said_whole(arm):
    """Two coordinates, both wrong: whatever moves the flange in two directions explains them."""
    stated = stated_of(arm)[:2]
    faulty = changed(changed(arm, "offset3", 0.8), "d1", 0.1)
    found = diagnosis_of(faulty, [replace(each, expected=each.expected + 60 * i) for i, each in enumerate(stated)])
    first = found[0]
    assert first.explains
    assert is_one(found.conclusion, "named")
    members = [first.faults, *first.indistinguishable_from]
    assert len(members) > 5
    assert len(members) == len({tuple(map(rounded, faults)) for faults in members})
    assert not any(is_one(fault, "wrong_scale") and fault.factor <= 0 for faults in members for fault in faults)


@pytest.mark.long
def test_equal_input_gives_equal_output(arm):
    faulty, stated = changed(changed(arm, "alpha2", 0.1), "d4", -0.04), stated_of(arm)
    once, again = er3a.diagnose(faulty, stated), er3a.diagnose(faulty, stated)
    assert [(h.faults, h.score, h.residual_after) for h in once] == [
        (h.faults, h.score, h.residual_after) for h in again
    ]
