"""References about joint 7, and about slides, whose limits are in mm; rows about what an arm lacks are set aside."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import er3a
from er3a.errors import InputError
from er3a.files.reference_sets import load_references
from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import frames
from er3a.references.predict import predict, read, state_of
from er3a.references.reference import expected_of
from er3a.references.seen import SeenMotion

Q_DEG = (10, 20, 30, 40, 50, 60, 70)
POSE = ",".join(f"q{joint}_deg" for joint in range(1, 8))


def write_set(folder: Path, robot: er3a.Robot) -> Path:
    folder.mkdir()
    arm = robot.without_tool()
    x, y, z = er3a.forward(arm, np.radians(Q_DEG))[:3, 3] * 1000
    T = frames(arm, np.zeros(7))[6]
    axis, on_axis = T[:3, 2] * robot.direction[6], T[:3, 3] * 1000
    line = ",".join(map(repr, [*axis.tolist(), *on_axis.tolist()]))
    tables = {
        "documents.csv": "name,title,publisher,derived_from\nsheet,Sheet,KUKA,",
        "limits.csv": "joint,lower_deg,upper_deg,uncertainty_deg,source,grade,origin\n7,-175,175,0.5,s,official,sheet",
        "axes.csv": "joint,direction_x,direction_y,direction_z,x_mm,y_mm,z_mm,signed,uncertainty_mm,uncertainty_deg,"
        f"source,grade,origin\n7,{line},yes,0.05,0.05,s,official,sheet",
        "positions.csv": f"name,point,{POSE},x_mm,y_mm,z_mm,uncertainty_mm,source,grade,origin\n"
        f"key,flange,{','.join(map(str, Q_DEG))},{x},{y},{z},0.01,s,official,sheet\n"
        "zero,flange,0,0,0,0,0,0,0,,,,0.01,s,official,sheet",
    }
    for name, text in tables.items():
        (folder / name).write_text(text + "\n", encoding="utf-8")
    return folder


def test_limits_axis_and_poses_of_joint_7_are_compared(tmp_path):
    robot = load_robot("lbr_iiwa_14")
    references = load_references(write_set(tmp_path / "seven", robot), robot).references
    expected, uncertainty = expected_of(references)
    assert np.all(np.abs(predict(robot, references) - expected) <= uncertainty)
    assert {getattr(each.quantity, "joint", None) for each in references} >= {7}
    turned = robot.replace(upper=robot.upper - 0.1, offset=robot.offset + 0.1)
    assert np.any(np.abs(predict(turned, references) - expected) > uncertainty)


def test_rows_about_joints_that_an_arm_lacks_are_set_aside(tmp_path):
    folder = write_set(tmp_path / "seven", load_robot("lbr_iiwa_14"))
    with pytest.warns(er3a.InputWarning) as warned:
        found = load_references(folder, load_robot("er3_600"))
    lines = {f"{name}.csv: row 2 is set aside: er3_600 has 6 joints" for name in ("axes", "limits", "positions")}
    assert {str(each.message).removeprefix(f"{folder}/") for each in warned} == lines
    assert {why for _, why in found.set_aside} == {"no_such_joint"}
    assert predict(load_robot("er3_600"), found.checkable) == pytest.approx([0.0])


LIMITS = "joint,lower_deg,upper_deg,uncertainty_deg,lower_mm,upper_mm,uncertainty_mm,source,grade,origin\n"
SPEEDS = "joint,speed_deg_s,uncertainty_deg_s,speed_mm_s,source,grade,origin\n"


def test_limits_and_speeds_of_slides_are_in_mm(tmp_path):
    arm = load_robot("lbr_iiwa_14")
    slide = arm.replace(sliding=np.arange(7) == 2, lower=arm.lower * 0 - 0.1, upper=arm.upper * 0 + 0.25)
    (tmp_path / "documents.csv").write_text("name,title,publisher,derived_from\nsheet,Sheet,KUKA,\n")
    (tmp_path / "limits.csv").write_text(f"{LIMITS}3,,,,-100.0,250.0,,s,official,sheet\n2,-5,14,,,,,s,official,sheet\n")
    (tmp_path / "speeds.csv").write_text(f"{SPEEDS}3,,,1200,s,official,sheet\n")
    found = load_references(tmp_path, slide.replace(speed=np.full(7, 1.2)))
    assert [each.unit for each in found.references] == ["mm", "mm", "deg", "deg", "mm/s"]
    assert [each.uncertainty for each in found.references] == [0.05, 0.05, 0.5, 0.5, 0.5]
    assert predict(slide.replace(speed=np.full(7, 1.2)), found.references)[[0, 1, 4]] == pytest.approx(
        [-100, 250, 1200]
    )
    (tmp_path / "speeds.csv").unlink()
    with pytest.warns(er3a.InputWarning, match="limits.csv: row 2 is set aside: the joint turns"):
        assert [why for _, why in load_references(tmp_path, arm).set_aside] == ["joint_turns"]
    (tmp_path / "limits.csv").write_text(f"{LIMITS}3,1,2,,-100.0,250.0,,s,official,sheet\n")
    with pytest.raises(InputError, match="row 2, column lower_deg: given beside millimetres"):
        load_references(tmp_path, slide)
    (tmp_path / "limits.csv").write_text(f"{LIMITS}3,,,,-0.1,0.25,,s,official,sheet\n")
    with pytest.raises(InputError, match="which can only be metres"):
        load_references(tmp_path, slide)


def test_what_is_seen_of_slides_and_coupled_joints_is_the_motion_itself():
    arm = load_robot("lbr_iiwa_14")
    coupling = np.eye(7)
    coupling[3, 1] = -1
    arm = arm.replace(sliding=np.arange(7) == 2, coupling=coupling)
    q, pose = arm.lower * 0 + 0.3, (*np.degrees([0.3, 0.3]).tolist(), 300.0, *np.degrees([0.3] * 4).tolist())
    for joint in range(1, 7):
        step = 1e-6 * (np.arange(7) == joint - 1)
        moved = er3a.forward(arm, q + step)[:3, 3] - er3a.forward(arm, q - step)[:3, 3]
        seen = SeenMotion(pose, joint, "flange", "up")
        angle = np.degrees(np.arccos(moved[2] / np.linalg.norm(moved)))
        assert read([seen], state_of(arm, [seen]))[0] == pytest.approx(angle, abs=1e-4)


@pytest.mark.parametrize("joint", range(1, 7))
def test_a_point_is_seen_to_move_as_it_does_by_joints_before_it_only(joint):
    arm, q, step = load_robot("ur5e"), np.radians([10, -70, 80, 30, 50, 60]), 1e-6 * (np.arange(6) == joint - 1)
    moved = frames(arm, q + step)[4, :3, 3] - frames(arm, q - step)[4, :3, 3]
    length = np.linalg.norm(moved)
    expected = np.degrees(np.arccos(moved[0] / length)) if length > 1e-9 else 90.0
    seen = SeenMotion(tuple(np.degrees(q).tolist()), joint, "wrist_centre", "forward")
    assert read([seen], state_of(arm, [seen]))[0] == pytest.approx(expected, abs=1e-3)
