"""Flange poses with orientation, in every way of writing one, and what they settle of the last joint."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import er3a
from er3a.errors import InputError
from er3a.files.reference_sets import check_reference_file, load_references
from er3a.files.robot_library import load_robot
from er3a.geometry.transforms import rot_x, rot_z, translation
from er3a.identifiability.evidence import evidence_of
from er3a.references.predict import predict
from er3a.references.reference import expected_of
from er3a.references.rows import PositionRow

HEADER = "name,point,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm,uncertainty_mm,"
BEHIND = "source,grade,origin"
TURN = Rotation.from_euler("xyz", [12.3, -45.6, 78.9], degrees=True)
WRITTEN = {
    "roll_deg,pitch_deg,yaw_deg": TURN.as_euler("xyz", degrees=True),
    "qw,qx,qy,qz": TURN.as_quat(scalar_first=True),
    "rx_deg,ry_deg,rz_deg": TURN.as_rotvec(degrees=True),
    "nx,ny,nz,ox,oy,oz,ax,ay,az": TURN.as_matrix().T.ravel(),
}


def one_row(folder: Path, columns: str, values: str, point: str = "flange") -> Path:
    path = folder / "positions.csv"
    row = f"key,{point},10,20,30,40,50,60,,,,0.1,{values},s,official,sheet"
    path.write_text(f"{HEADER}{columns},{BEHIND}\n{row}\n", encoding="utf-8")
    return path


def write_poses(arm: er3a.Robot, folder: Path, columns: str = "qw,qx,qy,qz", count: int = 4) -> None:
    """Flange poses of an arm, with orientation, as a document says them."""
    rows, n = [], arm.joints
    for k in range(count):
        q = np.random.default_rng(k).uniform(-90, 90, n).round(2)
        T = er3a.forward(arm, np.radians(q))
        turn = Rotation.from_matrix(T[:3, :3])
        ways = turn.as_euler("xyz", True), turn.as_quat(scalar_first=True), turn.as_rotvec(True), T[:3, :3].T.ravel()
        values = [*q, *1000 * T[:3, 3], 0.05, *dict(zip(WRITTEN, ways))[columns], 0.02]
        rows.append(f"p{k},flange,{','.join(f'{v:.8f}' for v in values)},s,official,sheet")
    joints = ",".join(f"q{joint}_deg" for joint in range(1, n + 1))
    header = f"name,point,{joints},x_mm,y_mm,z_mm,uncertainty_mm,{columns},uncertainty_deg,{BEHIND}"
    (folder / "positions.csv").write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    (folder / "documents.csv").write_text("name,title,publisher,derived_from\nsheet,Sheet,KUKA,\n", encoding="utf-8")


@pytest.mark.parametrize("columns", WRITTEN)
def test_every_way_of_writing_an_orientation_is_the_same(tmp_path, columns):
    (row,) = check_reference_file(one_row(tmp_path, columns, ",".join(f"{v:.6f}" for v in WRITTEN[columns])))
    assert isinstance(row, PositionRow)
    apart = Rotation.from_matrix(row.orientation) * TURN.inv()
    assert apart.magnitude() < 1e-5
    assert 0 < row.uncertainty_deg < 1e-3
    assert {each.unit for each in row.references()} == {"deg"}


@pytest.mark.parametrize("columns", WRITTEN)
def test_poses_of_ten_joints_are_compared_however_they_are_written(tmp_path, columns):
    arm = some_arm(10)
    write_poses(arm, tmp_path, columns)
    stated = load_references(tmp_path, arm).checkable
    expected, uncertainty = expected_of(stated)
    assert np.all(np.abs(predict(arm, stated) - expected) <= uncertainty)
    offset = arm.offset + np.radians(1.0) * (np.arange(10) == 9)
    missed = np.abs(predict(arm.replace(offset=offset), stated) - expected) > uncertainty
    assert any(each.unit == "deg" for each, own in zip(stated, missed) if own)


@pytest.mark.parametrize(
    ("columns", "values", "point", "text"),
    [
        ("qw,qx,qy,qz", "1,1,0,0", "flange", "column qw: the quaternion's length is 1.41421"),
        ("qw,qx,qy,qz", "1,,0,0", "flange", "column qx: empty"),
        ("nx,ny,nz,ox,oy,oz,ax,ay,az", "1,0,0,0,1,0,0,0,-1", "flange", "column nx: the matrix is "),
        ("roll_deg,pitch_deg,yaw_deg", "10,20,30", "wrist_centre", "column point: an orientation of the wrist_centre"),
        ("roll_deg,pitch_deg,yaw_deg,qw,qx,qy,qz", "10,20,30,1,0,0,0", "flange", "written in two ways"),
    ],
)
def test_an_orientation_that_is_none_is_one_clear_error(tmp_path, columns, values, point, text):
    with pytest.raises(InputError, match=text):
        check_reference_file(one_row(tmp_path, columns, values, point))


def some_arm(joints: int, sliding: tuple[int, ...] = ()) -> er3a.Robot:
    random = np.random.default_rng(joints)
    slides = np.isin(np.arange(joints), sliding)
    return er3a.Robot(
        name="arm",
        title="arm",
        convention="standard",
        a=random.uniform(0.1, 0.4, joints),
        alpha=random.choice([-1.5, 0.7, 1.2], joints),
        d=random.uniform(0.1, 0.3, joints),
        offset=random.uniform(-1, 1, joints),
        direction=random.choice([-1.0, 1.0], joints),
        lower=np.where(slides, 0.0, -2.5),
        upper=np.where(slides, 0.4, 2.0),
        sliding=slides,
        base=translation(0.1, 0.2, 0.3) @ rot_x(0.4),
        flange=rot_z(0.3) @ translation(0, 0.1, 0.1),
    )


@pytest.mark.long
def test_the_last_offset_and_alpha_are_settled_or_contradicted_like_others(tmp_path):
    right = load_robot("lbr_iiwa_14").without_tool()
    write_poses(right, tmp_path, count=6)
    found = load_references(tmp_path, right)
    names = ["offset7", "alpha7", "direction7"]
    sound = evidence_of(right, found.references, found.documents, only=names)
    assert [sound[name].status for name in names] == ["settled"] * 3
    wrong = {column: getattr(right, column) + 0.5 * (np.arange(7) == 6) for column in ("offset", "alpha")}
    diagnosis = er3a.diagnose(right.replace(offset=wrong["offset"]), found)[0]
    assert diagnosis.explains
    for column, corrected in (("offset", diagnosis.corrected), ("alpha", right)):
        robot = right.replace(**{column: wrong[column]})
        name = f"{column}7"
        evidence = evidence_of(robot, found.references, found.documents, only=[name], corrected=[corrected])
        assert evidence[name].status == "contradicted"
