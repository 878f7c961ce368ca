"""Paths as CSV tables: what they may hold, and every way to get one wrong."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.errors import DoubtfulUnit, InputError
from er3a.files.path_file import read_path_table
from er3a.files.robot_library import load_robot
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.programs.motion_table import write_csv
from er3a.robots.joint_limits import joint_columns

RPY = "x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg"
POSES = [[300, -50, 250, 175, 5, 10], [320, 0, 250, 180, 10, 20], [300, 50, 260, 175, 0, 40]]


def write(folder, header, *rows):
    file = folder / "path.csv"
    file.write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n")
    return file


def test_every_form_of_orientation_gives_the_same_poses(tmp_path):
    T = np.array([transform(np.array(row[:3]) / 1000, np.radians(row[3:])) for row in POSES])
    turns = Rotation.from_matrix(T[:, :3, :3])
    forms = {
        "roll_deg,pitch_deg,yaw_deg": [row[3:] for row in POSES],
        "z1_deg,y_deg,z2_deg": turns.as_euler("ZYZ", degrees=True).tolist(),
        "qw,qx,qy,qz": turns.as_quat(scalar_first=True).tolist(),
        "r11,r12,r13,r21,r22,r23,r31,r32,r33": T[:, :3, :3].reshape(3, 9).tolist(),
    }
    for columns, values in forms.items():
        table = read_path_table(
            write(tmp_path, "x_mm,y_mm,z_mm," + columns, *(row[:3] + part for row, part in zip(POSES, values)))
        )
        np.testing.assert_allclose(table.poses, T, atol=1e-12)
        assert table.times is None
        assert table.joints is None
        assert not table.repeated.any()


def test_joint_angles_and_times(tmp_path):
    header = "t_s," + ",".join(f"q{j}_deg" for j in range(1, 7))
    table = read_path_table(write(tmp_path, header, [0, *[0.0] * 6], [1.5, 10, 20, 30, 40, 50, 60]))
    np.testing.assert_allclose(table.joints[1], np.radians([10, 20, 30, 40, 50, 60]))
    np.testing.assert_array_equal(table.times, [0, 1.5])


def test_a_table_of_motion_that_er3a_has_written_is_read_by_its_joints(tmp_path):
    robot = load_robot("er3a_c60")
    times, q_deg = np.array([0.0, 0.5, 1.5]), np.array([[0, -10, -10, 0, -70, 0], [9, -8, -7, 6, -50, 4], [20.0] * 6])
    poses = forward(robot, np.radians(q_deg))
    (tmp_path / "a.csv").write_text(write_csv(times, q_deg, poses, ("er3a: path a", "er3a: b"), joint_columns(robot)))
    table = read_path_table(tmp_path / "a.csv")
    np.testing.assert_allclose(table.joints, np.radians(q_deg), atol=1e-8)
    np.testing.assert_allclose(table.times, times)
    assert table.rows.tolist() == [4, 5, 6]  # as an editor numbers them


def test_joints_that_look_like_radians_are_doubted_unless_a_column_confirms_them(tmp_path):
    header, rows = "q1_deg,q2_deg,q3_deg", [[0, -1.03, 0.45], [0, -1.03, 0]]
    with pytest.warns(DoubtfulUnit, match=r"path\.csv: row 2, column q1_deg, q2_deg, q3_deg: .* may be radians"):
        read_path_table(write(tmp_path, header, *rows))
    table = read_path_table(write(tmp_path, f"{header},units_checked", *([*row, "yes"] for row in rows)))
    np.testing.assert_allclose(table.joints, np.radians(rows))


ROS = {
    "joint_names": ["joint_3", "joint_1", "joint_2"],
    "points": [
        {"positions": [0.3, 0.1, 0.2], "velocities": [0, 0, 0], "time_from_start": {"sec": 0, "nanosec": 0}},
        {
            **{"positions": [0.6, 0.4, 0.5], "velocities": [3, 1, 2], "accelerations": [6, 4, 5], "effort": []},
            "time_from_start": {"secs": 1, "nsecs": 500_000_000},
        },
        {"positions": [0.6, 0.4, 0.5], "time_from_start": 2},
    ],
}


@pytest.mark.parametrize("name", ["move.json", "move.yaml"])
@pytest.mark.parametrize("wrapped", [False, True])
def test_a_trajectory_of_ros_is_a_timed_table_in_the_order_of_its_joints(tmp_path, name, wrapped):
    ros = ROS | {"header": {"frame_id": "base"}}
    content = {"joint_trajectory": ros, "multi_dof_joint_trajectory": {}} if wrapped else ros
    (tmp_path / name).write_text(json.dumps(content))
    table = read_path_table(tmp_path / name)
    np.testing.assert_array_equal(table.joints, [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.4, 0.5, 0.6]])
    np.testing.assert_allclose(table.times, [0, 1.5, 2], rtol=1e-15)
    assert not table.repeated.any()  # the motion goes through all points at their times
    np.testing.assert_array_equal(table.rates.velocities, [[0, 0, 0], [1, 2, 3], [np.nan] * 3])
    np.testing.assert_array_equal(table.rates.accelerations, [[np.nan] * 3, [4, 5, 6], [np.nan] * 3])


@pytest.mark.parametrize("prefix", ["", "left_"])
def test_joints_of_universal_robots_are_known_by_their_words(tmp_path, prefix):
    """``joint_states`` has them by the alphabet."""
    parts = ("elbow", "shoulder_lift", "shoulder_pan", "wrist_1", "wrist_2", "wrist_3")
    rows = [{"positions": [3 + k, 2, 1, 4, 5, 6], "time_from_start": {"sec": k, "nanosec": 0}} for k in range(2)]
    ros = {"joint_names": [f"{prefix}{part}_joint" for part in parts], "points": rows}
    (tmp_path / "move.json").write_text(json.dumps(ros))
    np.testing.assert_array_equal(read_path_table(tmp_path / "move.json").joints[0], [1, 2, 3, 4, 5, 6])
    names = ros["joint_names"]
    for other in (["right_elbow_joint", *names[1:]], [*names[1:], "rail"]):
        (tmp_path / "move.json").write_text(json.dumps(ros | {"joint_names": other}))
        with pytest.raises(InputError, match="joint_names: joints can't be identified"):
            read_path_table(tmp_path / "move.json")


def changed(**more):
    return ROS | more


def point(**more):
    return changed(points=[ROS["points"][0], ROS["points"][1] | more])


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ({"kind": "paths"}, "kind: unknown key"),
        ({"joint_trajectory": ROS, "multi_dof_joint_trajectory": {"points": [{}]}}, "more than the arm's joints"),
        (changed(joint_names=["shoulder", "elbow", "wrist"]), "joint_names: joints can't be identified"),
        (changed(joint_names=["j1", "j1", "j2"]), "joint_names: joints can't be identified"),
        (changed(joint_names=["joint_2", "joint_3", "joint_4"]), "joint_names: joints can't be identified"),
        (changed(joint_names=["left_1", "left_2", "right_3"]), "joint_names: joints can't be identified"),
        (changed(joint_names=["j1_a3", "j2_a2", "j3_a1"]), "joint_names: joints can't be identified"),
        (changed(points=ROS["points"][:1]), "points: a list of 1 items"),
        (point(positions=[1, 2]), r"points\[1\].positions: not 3 numbers"),
        (point(positions=[1, 2, True]), r"points\[1\].positions\[2\]: True is refused"),
        (point(positions=[90, -45, 0]), "more than ten turns"),
        (point(time_from_start=None), r"points\[1\].time_from_start: "),
        (point(time_from_start={"seconds": 1}), r"points\[1\].time_from_start.seconds: unknown key"),
        (point(time_from_start=0), "not later than 0 s"),
        (point(velocities=[1, 2]), r"points\[1\].velocities: not 3 numbers"),
        (point(velocities=[]), r"points\[1\].accelerations: accelerations without velocities"),
        (point(velocity=[0, 0, 0]), r"points\[1\].velocity: unknown key"),
        (changed(speed_scaling=0.5), "speed_scaling: unknown key"),
        ({"joint_trajectory": ROS, "return_trajectory": ROS}, "return_trajectory: unknown key"),
        ({"joint_trajectory": ROS, "trajectory_start": {}}, "trajectory_start: unknown key"),
        ({"joint_trajectory": changed(more=1)}, r"joint_trajectory\.more: unknown key"),
        (changed(joint_trajectory=ROS), "(joint_names|points): unknown key"),
    ],
)
def test_what_is_no_trajectory_of_ros_is_one_clear_error(tmp_path, content, told):
    (tmp_path / "move.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match=told):
        read_path_table(tmp_path / "move.json")


def test_rows_that_repeat_the_point_before_are_marked(tmp_path):
    table = read_path_table(write(tmp_path, RPY, POSES[0], POSES[0], POSES[1], POSES[1], POSES[0]))
    np.testing.assert_array_equal(table.repeated, [False, True, False, True, False])
    np.testing.assert_array_equal(table.rows, [2, 3, 4, 5, 6])


def test_small_angles_are_admitted_where_the_table_also_has_larger_ones(tmp_path):
    rows = [[300, 0, 250, 0.5, 0.25, 0.125], [300, 50, 250, 0.7, 0.1, 90]]
    assert read_path_table(write(tmp_path, RPY, *rows)).poses.shape == (2, 4, 4)


BAD = {
    "NaN": (RPY, [POSES[0], [300, "nan", 250, 180, 0, 0]], "row 3, column y_mm", "not a finite number"),
    "empty field": (RPY, [POSES[0], [300, "", 250, 180, 0, 0]], "row 3, column y_mm", "empty"),
    "word": (RPY, [POSES[0], [300, "left", 250, 180, 0, 0]], "row 3, column y_mm", "is not a number"),
    "one point": (RPY, [POSES[0]], None, "fewer than two points"),
    "no point": (RPY, [], None, "fewer than two points"),
    "same points": (RPY, [POSES[0]] * 3, None, "all 3 points are the same"),
    "time stands": ("t_s," + RPY, [[0, *POSES[0]], [1, *POSES[1]], [1, *POSES[2]]], "row 4, column t_s", "not later"),
    "time falls": ("t_s," + RPY, [[0, *POSES[0]], [-1, *POSES[1]]], "row 3, column t_s", "not later"),
    "time starts late": ("t_s," + RPY, [[1, *POSES[0]], [2, *POSES[1]]], "row 2, column t_s", "Start at 0"),
    "milliseconds": ("t_s," + RPY, [[0, *POSES[0]], [50000, *POSES[1]]], "row 3, column t_s", "not ms"),
    "no orientation": ("x_mm,y_mm,z_mm", [[1, 2, 3]] * 2, "header", "no orientation"),
    "nothing known": ("a,b", [[1, 2]] * 2, "header", "neither joint angles nor poses"),
    "two forms": (RPY + ",qw,qx,qy,qz", [POSES[0] + [1, 0, 0, 0]], "header", "two forms of orientation"),
    "joints and poses": (RPY + ",q1_deg", [POSES[0] + [0]], "header", "both joint angles and poses"),
    "metres in the name": (RPY.replace("x_mm", "x_m"), [POSES[0]], "column x_m", "not a unit"),
    "metres": (RPY, [[0.3, 0, 0.25, 180, 0, 0], [0.4, 0, 0.25, 180, 0, 0]], "columns x_mm", "only be metres"),
    "quaternion": (
        "x_mm,y_mm,z_mm,qw,qx,qy,qz",
        [[300, 0, 250, 1, 0, 0, 0], [310, 0, 250, 1, 0, 0, 0.1]],
        "row 3, column qw",
        "length is 1.004",
    ),
    "mirror": (
        "x_mm,y_mm,z_mm,r11,r12,r13,r21,r22,r23,r31,r32,r33",
        [[300, 0, 250, 1, 0, 0, 0, 1, 0, 0, 0, -1]] * 2,
        "row 2, column r11",
        "left-handed",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_tables_are_refused_by_row_and_column(tmp_path, case):
    header, rows, field, words = BAD[case]
    file = write(tmp_path, header, *rows)
    with pytest.raises(InputError) as caught:
        read_path_table(file)
    assert caught.value.file == str(file)
    assert (caught.value.field or "").startswith(field or "")
    assert words in str(caught.value)


def test_missing_table_is_named(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_path_table(tmp_path / "none.csv")
