"""Target files: each form of a pose against SciPy or by hand, and every way to get one wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from er3a.errors import DoubtfulUnit, InputError
from er3a.files.robot_library import load_robot
from er3a.files.target_file import TargetEntry, load_targets, read_targets
from er3a.kinematics.forward import forward
from testing.arms import made_of

ROBOT = load_robot("er3_600")
DATA = Path(__file__).parents[1] / "data" / "targets"
PLACE = {"name": "a", "xyz_mm": [400, 0, 300]}
TURNED = PLACE | {"rpy_deg": [0, 90, 0]}
angles = st.lists(st.integers(-180, 180).map(float), min_size=3, max_size=3)


class PlainDumper(yaml.SafeDumper):
    """Writes repeated values out in full."""

    def ignore_aliases(self, data):
        return True


def pose(**changes) -> np.ndarray:
    return TargetEntry(**(PLACE | changes)).target(ROBOT).T


@given(angles)
def test_roll_pitch_yaw_turns_about_fixed_x_then_y_then_z(rpy):
    expected = Rotation.from_euler("xyz", rpy, degrees=True).as_matrix()
    np.testing.assert_allclose(pose(rpy_deg=rpy)[:3, :3], expected, atol=1e-12)


@given(angles)
def test_zyz_turns_about_its_own_axes(zyz):
    expected = Rotation.from_euler("ZYZ", zyz, degrees=True).as_matrix()
    np.testing.assert_allclose(pose(zyz_deg=zyz)[:3, :3], expected, atol=1e-12)


@given(angles)
def test_quaternion_and_matrix_give_the_same_rotation(rpy):
    rotation = Rotation.from_euler("xyz", rpy, degrees=True)
    x, y, z, w = rotation.as_quat()
    by_quaternion = pose(quaternion_wxyz=[w, x, y, z])
    np.testing.assert_allclose(by_quaternion, pose(matrix=rotation.as_matrix().tolist()), atol=1e-12)
    np.testing.assert_allclose(by_quaternion, pose(rpy_deg=rpy), atol=1e-12)


def test_quaternion_half_turn_about_x_points_the_tool_down():
    np.testing.assert_allclose(pose(quaternion_wxyz=[0, 1, 0, 0])[:3, :3], np.diag([1, -1, -1]), atol=1e-15)


def test_rounded_matrix_becomes_an_exact_rotation():
    c, s = 0.8660254, 0.5  # seven digits
    R = pose(matrix=[[c, -s, 0], [s, c, 0], [0, 0, 1]])[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(R[0, 0], np.cos(np.pi / 6), atol=1e-7)


def test_position_is_in_metres_inside():
    np.testing.assert_array_equal(pose(rpy_deg=[0, 0, 0])[:3, 3], [0.4, 0, 0.3])


def test_joint_angles_give_the_pose_of_forward_kinematics():
    q_deg = [0, 45, -30, 0, 60, 0]
    np.testing.assert_array_equal(TargetEntry(name="a", q_deg=q_deg).target(ROBOT).T, forward(ROBOT, np.radians(q_deg)))


def test_reference_is_zeros_unless_given():
    assert not TargetEntry(**TURNED).target(ROBOT).q_ref.any()
    np.testing.assert_allclose(TargetEntry(**TURNED, q_ref_deg=[180, 0, 0, 0, 0, 0]).target(ROBOT).q_ref[0], np.pi)


@pytest.mark.parametrize("name", ["er3a_c60", "er3a_c60_article", "er3_600"])
def test_shipped_files_hold_the_article_target(name):
    targets = {target.name: target for target in read_targets(DATA / f"{name}.yaml")}
    T = targets["article_target"].target(load_robot(name)).T
    np.testing.assert_allclose(T[:3, 3], [0.5, 0.2, 0.7], atol=1e-15)
    np.testing.assert_allclose(T[:3, :3], Rotation.from_euler("ZYX", [0, 90, 0], degrees=True).as_matrix(), atol=1e-15)
    np.testing.assert_array_equal(targets["article_example"].q_deg, [0, 45, -30, 0, 60, 0])


BAD = {
    "empty list": ([], "targets", "the list is empty"),
    "duplicate name": ([TURNED, TURNED], "targets[1].name", "also that of targets[0]"),
    "name with a slash": ([TURNED | {"name": "../a"}], "targets[0].name", "refused"),
    "empty name": ([TURNED | {"name": ""}], "targets[0].name", "refused"),
    "note of two lines": ([TURNED | {"note": "one\ntwo"}], "targets[0].note", "refused"),
    "NaN": ([PLACE | {"rpy_deg": [0, float("nan"), 0]}], "targets[0].rpy_deg[1]", "not a finite number"),
    "infinite position": ([TURNED | {"xyz_mm": [float("inf"), 0, 0]}], "targets[0].xyz_mm[0]", "not a finite number"),
    "text for a number": ([TURNED | {"xyz_mm": ["400", 0, 0]}], "targets[0].xyz_mm[0]", "'400' is refused"),
    "two numbers": ([TURNED | {"xyz_mm": [400, 0]}], "targets[0].xyz_mm", "2 items where at least 3"),
    "no orientation": ([PLACE], "targets[0]", "the orientation is missing"),
    "two orientations": ([TURNED | {"zyz_deg": [0, 90, 0]}], "targets[0]", "rpy_deg and zyz_deg"),
    "no position": ([{"name": "a", "rpy_deg": [0, 90, 0]}], "targets[0]", "the position is missing"),
    "joints and a position": ([TURNED | {"q_deg": [0] * 6}], "targets[0]", "q_deg and xyz_mm"),
    "metres": ([TURNED | {"xyz_mm": [0.5, 0.2, 0.7]}], "targets[0].xyz_mm", "0.5, 0.2, 0.7 mm can only be metres"),
    "micrometres": ([TURNED | {"xyz_mm": [500_000, 0, 0]}], "targets[0].xyz_mm", "more than 100 m"),
    "many turns": ([TURNED | {"q_ref_deg": [0, 0, 0, 0, 0, 100001]}], "targets[0].q_ref_deg", "ten turns"),
    "long quaternion": ([PLACE | {"quaternion_wxyz": [1, 1, 0, 0]}], "targets[0].quaternion_wxyz", "length is 1.41"),
    "short quaternion": ([PLACE | {"quaternion_wxyz": [0.998, 0, 0, 0]}], "targets[0].quaternion_wxyz", "length is"),
    "zero quaternion": ([PLACE | {"quaternion_wxyz": [0, 0, 0, 0]}], "targets[0].quaternion_wxyz", "length is 0"),
    "skew matrix": ([PLACE | {"matrix": [[1, 0.01, 0], [0, 1, 0], [0, 0, 1]]}], "targets[0].matrix", "not a rotation"),
    "mirror": ([PLACE | {"matrix": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}], "targets[0].matrix", "left-handed"),
    "two rows": ([PLACE | {"matrix": [[1, 0, 0], [0, 1, 0]]}], "targets[0].matrix", "2 items where at least 3"),
    "unknown Euler order": ([PLACE | {"xyz_deg": [0, 90, 0]}], "targets[0].xyz_deg", "this order of Euler angles"),
    "words for an Euler order": ([PLACE | {"euler_order": "XZX"}], "targets[0].euler_order", "this order of Euler"),
}


@pytest.mark.parametrize("case", BAD)
def test_wrong_file_is_refused_with_file_and_field(case, tmp_path):
    targets, field, words = BAD[case]
    path = tmp_path / "wrong.yaml"
    content = {"kind": "targets", "targets": targets}
    path.write_text(yaml.dump(content, Dumper=PlainDumper), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_targets(path)
    assert caught.value.file == str(path)
    assert caught.value.field == field
    assert words in str(caught.value)


def test_joints_that_slide_far_are_mm_and_those_that_turn_stay_within_ten_turns(tmp_path):
    rail = made_of([("P", 0, 90, 0, -20_000, 20_000), ("R", 400, 0, 0, -180, 180)])
    path = tmp_path / "far.yaml"
    for values, problem in (([-11_017, -139], None), ([500, 3601], "3601 deg of joint 2 is more than ten turns")):
        path.write_text(yaml.dump({"kind": "targets", "targets": [{"name": "a", "q_deg": values}]}), encoding="utf-8")
        if problem is None:
            (target,) = load_targets(path, rail)
            # the slide is along z, the link behind it lies in the plane that its turn by 90 deg sets
            at = np.radians(-139)
            np.testing.assert_allclose(target.T[:3, 3], [0.4 * np.cos(at), 0, -11.017 + 0.4 * np.sin(at)], atol=1e-12)
            continue
        with pytest.raises(InputError) as caught:
            load_targets(path, rail)
        assert caught.value.file == str(path)
        assert "a: q_deg" in caught.value.field
        assert problem in str(caught.value)


@pytest.mark.parametrize("rpy", [[0, 0, 0], [0.5, 90, 0], [0, 5, 0], [0, 3, 6], [0, 0.1, 0], [-180, 6.2, 180]])
def test_small_angles_that_are_degrees_pass(rpy):
    assert TargetEntry(**PLACE, rpy_deg=rpy).rpy_deg == rpy


@pytest.mark.parametrize("rpy", [[0, 1.5708, 0], [3.14, 0, 0], [0, 0, -0.7854], [0.52, -0.31, 1.2], [0, 1.047, 6]])
def test_small_angles_that_look_like_radians_are_doubted(rpy):
    with pytest.warns(DoubtfulUnit, match="may be radians"):
        TargetEntry(**PLACE, rpy_deg=rpy)


def test_target_at_the_origin_passes():
    assert TargetEntry(name="a", xyz_mm=[0, 0, 0], rpy_deg=[0, 0, 0]).xyz_mm == [0, 0, 0]


TABLE = "name,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg,note\na,400,0,300,0,90,0,first\nb,400,50,300,10,20,30,\n"


@pytest.fixture
def table(tmp_path):
    def write(text: str) -> Path:
        path = tmp_path / "targets" / "some.csv"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_table_holds_the_same_targets_as_yaml(table):
    first, second = read_targets(table(TABLE))
    assert first == TargetEntry(**TURNED, note="first")
    assert second == TargetEntry(name="b", xyz_mm=[400.0, 50, 300], rpy_deg=[10.0, 20, 30])


@pytest.mark.parametrize(
    ("form", "header", "values"),
    [
        ("zyz_deg", "z1_deg,y_deg,z2_deg", [10.0, 20, 30]),
        ("quaternion_wxyz", "qw,qx,qy,qz", [0.0, 1, 0, 0]),
        ("matrix", "r11,r12,r13,r21,r22,r23,r31,r32,r33", [0.0, -1, 0, 1, 0, 0, 0, 0, 1]),
    ],
)
def test_table_takes_each_form_of_orientation(table, form, header, values):
    reference = ",".join(f"q{joint}_ref_deg" for joint in range(1, 7))
    text = f"name,x_mm,y_mm,z_mm,{header},{reference}\na,400,0,300,{','.join(map(str, values))},1,2,3,4,5,60\n"
    (target,) = load_targets(table(text), ROBOT)
    expected = [values[0:3], values[3:6], values[6:9]] if form == "matrix" else values
    np.testing.assert_allclose(target.T, pose(**{form: expected}))
    assert target.q_ref_deg == (1, 2, 3, 4, 5, 60)


def test_a_table_says_in_a_column_that_its_small_angles_are_degrees(table):
    header, *rows = TABLE.replace("0,90,0,", "0,1.5708,0,").splitlines()
    with pytest.warns(DoubtfulUnit, match=r"some\.csv: targets\[0\]\.rpy_deg: \[0, 1\.5708, 0\] deg may be radians"):
        read_targets(table("\n".join([header, *rows])))
    confirmed = [f"{header},units_checked", *(f"{row},yes" for row in rows)]
    assert read_targets(table("\n".join(confirmed)))[0].rpy_deg == [0, 1.5708, 0]


@pytest.mark.parametrize(
    ("old", "new", "where", "what"),
    [
        ("b,400,50,300", "b,0.4,0.05,0.3", "row 3, column x_mm, y_mm, z_mm", "mm can only be metres"),
        ("b,400,50", "b,nan,50", "row 3, column x_mm", "not a finite number"),
        ("b,400,50", "b,,50", "row 3, column x_mm", "empty"),
        ("b,400", "a,400", "row 3, column name", "'a' is also that of row 2"),
        ("x_mm", "x_m", "column x_m", "not a unit"),
        ("roll_deg,pitch_deg,yaw_deg", "rx,ry,rz", "header", "no orientation that is known, but rx, ry, rz"),
        ("note", "qw", "header", "two forms of orientation"),
    ],
)
def test_bad_table_names_row_and_column(table, old, new, where, what):
    path = table(TABLE.replace(old, new))
    with pytest.raises(InputError, match=what) as caught:
        read_targets(path)
    assert caught.value.field == where
    assert str(caught.value).startswith(f"{path}: {where}: ")


def test_table_with_quaternion_off_unit_length_names_its_row(table):
    path = table("name,x_mm,y_mm,z_mm,qw,qx,qy,qz\na,400,0,300,1,0,0,0\nb,400,0,300,1,1,0,0\n")
    with pytest.raises(InputError, match=r"row 3, column qw, qx, qy, qz: the quaternion's length is 1.41421"):
        read_targets(path)


def test_table_with_more_rows_than_a_file_may_have_is_refused(table, monkeypatch):
    monkeypatch.setattr("er3a.files.target_file.MAX_TARGETS", 2)
    assert len(read_targets(table(TABLE))) == 2
    with pytest.raises(InputError, match=r"rows: 3 targets are too many"):
        read_targets(table(TABLE + "c,400,50,300,0,90,0,\n"))


def test_table_without_rows_is_refused(table):
    with pytest.raises(InputError, match=r"some\.csv: rows: the list is empty"):
        read_targets(table(TABLE.splitlines()[0] + "\n"))
    with pytest.raises(InputError, match=r"some\.csv: header: the file is empty"):
        read_targets(table(""))
    assert read_targets(table(TABLE.replace(",", ";"))) == read_targets(table(TABLE))
