"""Any number of zeros, directions, bases and flanges that are defined otherwise is no fault of another kind; what no
reference reacts to is named."""

from __future__ import annotations

import numpy as np
import pytest

import er3a
from er3a.diagnosis.faults import CONVENTIONS, entry_of
from er3a.finding import fact, is_one
from er3a.geometry.transforms import rot_z, translation
from er3a.references.quantities import MM, Limit, LimitExcess, PointCoordinate
from er3a.references.reference import Reference
from testing.reference_subjects import joint_limit, point_at_pose, pose_excess


def other_conventions(robot: er3a.Robot, seed: int) -> er3a.Robot:
    random = np.random.default_rng(seed)
    offset, direction = robot.offset.copy(), robot.direction.copy()
    zeros, reversed_joints = (random.permutation(4)[: random.integers(2, 5)] + 1 for _ in range(2))
    offset[zeros] += np.radians(random.choice([90.0, -90.0, 37.0, 12.5], len(zeros)))
    direction[reversed_joints] *= -1
    base = robot.base @ translation(0.1, 0, -0.33) @ rot_z(random.choice([0.0, 0.7]))
    return robot.replace(offset=offset, direction=direction, base=base)


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 4, 5))])
@pytest.mark.parametrize("name", ["er3a_c60", "er3_600"])
def test_conventions_are_named_whatever_their_number(name, seed):
    right = er3a.load_robot(name)
    best = er3a.diagnose(other_conventions(right, seed), name)[0]
    assert best.explains
    assert all(
        is_one(fault, "wrong_offset", "reversed_direction", "base_elsewhere", "flange_elsewhere", "counted_from_ground")
        for fault in best.faults
    )
    assert any(is_one(fault, "base_elsewhere") for fault in best.faults)
    if name == "er3_600":
        return  # whose documents leave the directions of joints 1, 4, 5 and 6 open
    q = np.random.default_rng(1).uniform(right.lower, right.upper, (50, 6))
    stated = er3a.forward(right, q)[:, :3, 3] * MM
    assert np.abs(er3a.forward(best.corrected, q)[:, :3, 3] * MM - stated).max() < 1.0


@pytest.mark.long
@pytest.mark.parametrize("shift_mm", [(15, 0, 0), pytest.param((0, 20, 100), marks=pytest.mark.long)])
def test_a_flange_defined_elsewhere_is_no_wrong_last_row(shift_mm):
    right = er3a.to_standard(er3a.load_robot("er3_600"))
    flange = right.flange @ translation(*np.array(shift_mm) / MM)
    (fault,) = er3a.diagnose(right.replace(flange=flange), "er3_600")[0].faults
    assert is_one(fault, "flange_elsewhere")
    assert fault.shift_mm == pytest.approx([-c for c in shift_mm], abs=0.1)


@pytest.mark.long
def test_poses_that_are_shown_outside_of_limits_are_a_matter_of_limits():
    right = er3a.load_robot("er3_600")
    upper = right.upper.copy()
    upper[2] -= 1.0
    shown = (LimitExcess(tuple(np.degrees(right.upper).round(3).tolist())), 0.0, 0.001, "manual", "official", "manual")
    pose = Reference(pose_excess("p"), "key_poses", *shown)
    wrong = other_conventions(right, 0).replace(upper=upper)
    best = er3a.diagnose(wrong, [*er3a.load_references("er3_600").references, pose])[0]
    assert best.explains
    assert {each.code for each in best.faults if not is_one(each, *CONVENTIONS)} == {"wrong_limit"}


@pytest.mark.long
@pytest.mark.parametrize(
    ("column", "rows", "amount"),
    [
        ("alpha", [1, 3], 0.6),
        *(pytest.param(*each, marks=pytest.mark.long) for each in (("a", [1], 0.03), ("d", [3], 0.02))),
    ],
)
def test_another_geometry_is_no_convention(column, rows, amount):
    right = er3a.load_robot("er3_600")
    values = getattr(right, column).copy()
    values[rows] += amount
    best = er3a.diagnose(other_conventions(right, 0).replace(**{column: values}), "er3_600")[0]
    assert best.explains
    assert {
        entry_of(fault)
        for fault in best.faults
        if not is_one(
            fault, "wrong_offset", "reversed_direction", "base_elsewhere", "flange_elsewhere", "counted_from_ground"
        )
    } == {f"{column}{row + 1}" for row in rows}


def test_an_empty_list_says_what_it_says_nothing_about():
    right = er3a.load_robot("er3_600")
    offset, alpha = right.offset.copy(), right.alpha.copy()
    offset[5], alpha[5] = 0.6, 1.0
    found = er3a.diagnose(right.replace(offset=offset, alpha=alpha), "er3_600")
    assert found == []
    assert {"offset6", "alpha6"} <= set(found.not_examined)
    assert not {"a2", "d4", "alpha3", "offset2"} & set(found.not_examined)
    assert "not examined" in str(found)
    assert {"a1", "offset6", "direction3"} <= set(er3a.diagnose(right, []).not_examined)


def test_reach_on_a_data_sheet_counts():
    right = er3a.load_robot("er3a_c60")
    stated = er3a.load_references("er3a_c60").references
    reach = [each for each in stated if each.group == "reach"]
    assert er3a.diagnose(right, reach).missed == ()
    longer = right.replace(a=right.a + np.array([0, 0.5, 0, 0, 0, 0]))
    found = er3a.diagnose(longer, reach)
    assert found == []
    assert found.missed


@pytest.mark.long
@pytest.mark.parametrize(("name", "joint", "sign"), [("er3_600", 3, 1), ("lbr_iiwa_14", 4, -1)])
def test_a_sheet_that_counts_a_joint_from_the_ground_is_named(name, joint, sign):
    right, stated = er3a.load_robot(name), []
    for k in range(4):
        q = np.random.default_rng(k).uniform(-40, 40, right.joints).round()
        x = er3a.forward(right.without_tool(), np.radians(q))[:3, 3] * MM
        q[joint - 1] -= sign * q[1]
        for c, value in zip("xyz", x):
            about = point_at_pose(f"p{k}", "flange", c), "key_poses", PointCoordinate(tuple(q), "flange", c)
            stated.append(Reference(*about, float(value), 0.1, "sheet", "official", "sheet"))
    assert er3a.diagnose(right, stated)[0].faults == (fact("counted_from_ground", joint=joint, along=(2,), sign=sign),)
    lower, upper = np.degrees(right.lower), np.degrees(right.upper)
    ends = (lower[1], upper[1]) if sign < 0 else (-upper[1], -lower[1])
    for side, value in (("lower", lower[joint - 1] + ends[0]), ("upper", upper[joint - 1] + ends[1])):
        about = joint_limit(joint, side), "limits", Limit(joint, side)
        stated.append(Reference(*about, float(value), 0.5, "sheet", "official", "sheet"))
    assert er3a.diagnose(right, stated)[0].faults == (fact("counted_from_ground", joint=joint, along=(2,), sign=sign),)
    other = Reference(*about, float(value) - 30, 0.5, "sheet", "official", "sheet")  # as the linkage has it
    best = er3a.diagnose(right, [*stated[:-1], other])[0]
    assert best.explains
    assert best.faults[0] == fact("counted_from_ground", joint=joint, along=(2,), sign=sign)
    limits_alone = er3a.diagnose(right, stated[-2:])[0]
    assert (fact("counted_from_ground", joint=joint, along=(2,), sign=sign),) in (
        limits_alone.faults,
        *limits_alone.indistinguishable_from,
    )
