"""References about joint 7: limits, axis, and poses that turn it; one about a joint that an arm lacks is one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import er3a
from er3a.errors import InputError
from er3a.files.reference_sets import load_references
from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import frames
from er3a.references.predict import predict
from er3a.references.reference import expected_of

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


def test_joints_that_an_arm_lacks_are_one_clear_error(tmp_path):
    folder = write_set(tmp_path / "seven", load_robot("lbr_iiwa_14"))
    with pytest.raises(InputError, match=r"axes.csv: row 2, column joint: there is no joint 7. er3_600 has 6 joints"):
        load_references(folder, load_robot("er3_600"))
    (folder / "axes.csv").unlink()
    (folder / "limits.csv").unlink()
    with pytest.raises(InputError, match=r"positions.csv: row 2, column q7_deg: the pose has 7 joints"):
        load_references(folder, load_robot("er3_600"))
