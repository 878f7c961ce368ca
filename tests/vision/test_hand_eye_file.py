"""Calibration sets as files: what is wrong is said in one line, with the sample."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from er3a.errors import InputError
from er3a.files.hand_eye_file import load_hand_eye
from er3a.files.kept_files import ROOT
from er3a.files.robot_library import load_robot
from er3a.files.robot_writer import write_robot
from er3a.files.vision_file import load_vision
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.pipeline.cli import app
from er3a.pipeline.messages.scope import assumed_text, gap_text
from er3a.pipeline.scope import Open
from er3a.pipeline.stages.vision.entry import vision_files
from er3a.robots.joint_limits import joint_columns
from testing import camera_cells
from testing.arms import scara
from testing.hand_eye_sets import X_TRUE, Y_TRUE, flange_poses, noisy, seen

POSITION = ("x_mm", "y_mm", "z_mm")
POINT_NAMES = [f"{part}_{c}_mm" for part in ("seen", "touched") for c in "xyz"]
HEAD = "kind: hand_eye\ntitle: made\nsource: a test\nsetup: {setup}\nsamples: samples.csv\n"


def columns(T: np.ndarray, stream: str, form: str) -> dict[str, np.ndarray]:
    found = {f"{stream}_{name}": 1000 * T[:, k, 3] for k, name in enumerate(POSITION)}
    R = Rotation.from_matrix(T[:, :3, :3])
    if form == "quaternion":
        q = R.as_quat(scalar_first=True)
        return found | {f"{stream}_q{c}": q[:, k] for k, c in enumerate("wxyz")}
    if form == "rpy":
        rpy = R.as_euler("xyz", degrees=True)
        return found | {f"{stream}_{name}_deg": rpy[:, k] for k, name in enumerate(("roll", "pitch", "yaw"))}
    if form == "vector":
        return found | {f"{stream}_r{c}_rad": R.as_rotvec()[:, k] for k, c in enumerate("xyz")}
    return found | {f"{stream}_r{r + 1}{c + 1}": T[:, r, c] for r in range(3) for c in range(3)}


def write(folder: Path, table: dict[str, np.ndarray], head: str = HEAD.format(setup="eye_in_hand")) -> Path:
    with (folder / "samples.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(table)
        writer.writerows(zip(*table.values()))
    (folder / "set.yaml").write_text(head)
    return folder / "set.yaml"


@pytest.fixture
def poses() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(1)
    flange = flange_poses(random, 8)
    return flange, noisy(seen("eye_in_hand", flange), random)


@pytest.mark.parametrize("form", ["quaternion", "rpy", "matrix", "vector"])
def test_every_form_of_orientation_gives_the_poses(tmp_path, poses, form):
    flange, target = poses
    found = load_hand_eye(write(tmp_path, columns(flange, "flange", form) | columns(target, "target", form)))
    np.testing.assert_allclose(found.flange, flange, atol=1e-9)
    np.testing.assert_allclose(found.target, target, atol=1e-9)


def test_joint_angles_become_poses_by_the_robots_own_table(tmp_path, poses):
    robot = load_robot("er3a_c60")
    q = np.random.default_rng(2).uniform(-40, 40, (8, 6))
    table = {f"q{j + 1}_deg": q[:, j] for j in range(6)} | columns(poses[1], "target", "quaternion")
    found = load_hand_eye(write(tmp_path, table), robot)
    np.testing.assert_allclose(found.flange, forward(robot.without_tool(), np.radians(q)), atol=1e-12)
    with pytest.raises(InputError, match="need a robot's table"):
        load_hand_eye(tmp_path / "set.yaml")


@pytest.mark.long
def test_what_a_controller_gives_is_placed_by_the_robots_base(tmp_path):
    """Joint angles, and flange poses and touched points as the controller has them, are of one arm on a pedestal."""
    robot = load_robot("er3a_c60")
    placed = robot.replace(base=transform(np.array([0.0, 0.1, 0.06]), np.array([0.0, 0.0, 0.3])))
    random = np.random.default_rng(2)
    q = random.uniform(-40, 40, (8, 6))
    at_zero = forward(robot.without_tool(), np.radians(q))
    target = columns(noisy(seen("eye_to_hand", at_zero), random), "target", "quaternion")
    points = random.uniform(-300, 300, (4, 6))
    rows = [POINT_NAMES, *(map(str, row) for row in points.tolist())]
    (tmp_path / "touched.csv").write_text("\n".join(map(",".join, rows)))
    head = HEAD.format(setup="eye_to_hand") + "touched: touched.csv\n"
    by_joints = {f"q{j + 1}_deg": q[:, j] for j in range(6)}
    sets = [
        load_hand_eye(write(tmp_path, table | target, head), placed)
        for table in (by_joints, columns(at_zero, "flange", "quaternion"))
    ]
    np.testing.assert_allclose(sets[0].flange, placed.base @ at_zero, atol=1e-12)
    np.testing.assert_allclose(sets[1].flange, sets[0].flange, atol=1e-9)
    for each in sets:
        np.testing.assert_allclose(each.touched[:, 0], points[:, :3] / 1000)
        np.testing.assert_allclose(
            each.touched[:, 1], points[:, 3:] / 1000 @ placed.base[:3, :3].T + placed.base[:3, 3], atol=1e-12
        )
    write_robot(placed.replace(name="arm"), tmp_path / "arm.yaml")
    printed = []
    for table in (by_joints, columns(at_zero, "flange", "quaternion")):
        file = write(tmp_path, table | target, HEAD.format(setup="eye_to_hand"))
        told = CliRunner().invoke(app, ["hand-eye", str(file), "--robot", str(tmp_path / "arm.yaml"), "--json"])
        printed.append(json.loads(told.stdout)["hand_eye"]["xyz_mm"])
    np.testing.assert_allclose(*printed, atol=1e-3)
    np.testing.assert_allclose(printed[0], 1000 * X_TRUE[:3, 3], atol=1.0)


def spoiled(what: str, flange: np.ndarray, target: np.ndarray) -> dict[str, np.ndarray]:
    table = columns(flange, "flange", "quaternion") | columns(target, "target", "matrix")
    match what:
        case "metres":
            for name in POSITION:
                table[f"target_{name}"] = table[f"target_{name}"] / 1000
        case "mixed":
            for name in POSITION:
                table[f"target_{name}"][3] /= 1000
        case "length":
            table["flange_qw"][4] += 0.2
        case "mirrored":
            for row in "123":
                table[f"target_r{row}3"][5] *= -1
        case "skewed":
            table["target_r11"][6] += 0.1
        case "nan":
            table["target_r11"][2] = np.nan
    return table


@pytest.mark.parametrize(
    ("what", "where", "told"),
    [
        ("metres", "columns target_x_mm", "can only be metres"),
        ("mixed", "row 5", "looks like metres"),
        ("length", "row 6", "length is"),
        ("mirrored", "row 7", "left-handed"),
        ("skewed", "row 8", "not a rotation"),
        ("nan", "row 4", "not a finite number"),
    ],
)
def test_bad_samples_are_named(tmp_path, poses, what, where, told):
    with pytest.raises(InputError) as caught:
        load_hand_eye(write(tmp_path, spoiled(what, *poses)))
    assert where in str(caught.value.field)
    assert told in caught.value.problem
    assert "\n" not in str(caught.value)


def test_rotation_vectors_in_degrees_are_told(tmp_path, poses):
    table = columns(poses[0], "flange", "quaternion") | columns(poses[1], "target", "vector")
    for c in "xyz":
        table[f"target_r{c}_rad"] = np.degrees(table[f"target_r{c}_rad"])
    with pytest.raises(InputError, match="can only be degrees"):
        load_hand_eye(write(tmp_path, table))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("hand,0.1,0.2\neye,0.1,0.2\n", "names no column of samples: hand, 0.1"),
        ("flange_x_m,flange_y_m,flange_z_m,flange_qw\n1,2,3,1\n", "not a unit"),
    ],
)
def test_tables_of_other_tools_are_told_what_they_lack(tmp_path, text, told):
    write(tmp_path, {})
    (tmp_path / "samples.csv").write_text(text)
    with pytest.raises(InputError, match=told) as caught:
        load_hand_eye(tmp_path / "set.yaml")
    assert caught.value.remedy


def test_radians_are_told_from_degrees(tmp_path, poses):
    table = {f"q{j}_deg": np.linspace(-2, 2, 8) for j in range(1, 7)} | columns(poses[1], "target", "quaternion")
    with pytest.raises(InputError, match="can only be radians"):
        load_hand_eye(write(tmp_path, table), load_robot("er3a_c60"))


def test_joints_that_slide_are_given_in_millimetres(tmp_path, poses):
    robot = scara()
    values = np.array([[10.0 + k, 20 - 3 * k, 100 + 5 * k, 5 * k] for k in range(8)])
    target = columns(poses[1], "target", "quaternion")
    file = write(tmp_path, dict(zip(joint_columns(robot), values.T, strict=True)) | target)
    found = load_hand_eye(file, robot)
    np.testing.assert_allclose(found.q[0], [np.radians(10), np.radians(20), 0.1, 0])
    np.testing.assert_allclose(found.flange, forward(robot, found.q))
    write(tmp_path, {f"q{k + 1}_deg": values[:, k] for k in range(4)} | target)
    with pytest.raises(InputError, match=r"are not those of made\. Give q1_deg, q2_deg, q3_mm, q4_deg"):
        load_hand_eye(file, robot)


def test_the_studys_sets_are_what_the_script_makes(tmp_path):
    camera_cells.write(tmp_path)
    for file in sorted(tmp_path.iterdir()):
        assert file.read_text() == (camera_cells.FOLDER / file.name).read_text(), file.name


@pytest.mark.parametrize("name", ["er3a_c60", "er3_600"])
def test_vision_files_name_all_that_they_rest_on(name):
    file = ROOT / "data" / "vision" / f"{name}.yaml"
    load_vision(file, load_robot(name))
    assert len(vision_files(file)) == 4
    assert all(each.is_file() for each in vision_files(file))


@pytest.mark.long
def test_the_command_ends_with_an_error_where_a_calibration_cant_be_used(tmp_path, poses):
    flange, target = poses
    table = columns(flange, "flange", "quaternion")
    sound = write(tmp_path, table | columns(target, "target", "quaternion"))
    assert CliRunner().invoke(app, ["hand-eye", str(sound)]).exit_code == 0
    target[:, 1:3, 3] *= -1
    wrong = write(tmp_path, table | columns(target, "target", "quaternion"))
    found = CliRunner().invoke(app, ["hand-eye", str(wrong)])
    assert found.exit_code == 1
    assert "its positions are (x, −y, −z)" in " ".join(found.output.split())


@pytest.mark.long
def test_touched_points_that_contradict_a_calibration_end_the_command_with_code_1(tmp_path, poses):
    """Points of the board, touched where it is, and 20 mm beside."""
    flange, target = poses
    table = columns(flange, "flange", "quaternion") | columns(target, "target", "quaternion")
    file = write(tmp_path, table, HEAD.format(setup="eye_in_hand") + "touched: touched.csv\n")
    on_board = np.array([[0, 0, 0], [100, 0, 0], [0, 80, 0], [100, 80, 0]])
    codes = []
    for beside in (0, 20):
        touched = on_board @ Y_TRUE[:3, :3].T + 1000 * Y_TRUE[:3, 3] + [0, 0, beside]
        rows = [",".join(map(str, row)) for row in np.hstack([on_board, touched]).tolist()]
        (tmp_path / "touched.csv").write_text("\n".join([",".join(POINT_NAMES), *rows]) + "\n")
        found = CliRunner().invoke(app, ["hand-eye", str(file)])
        codes.append((found.exit_code, "Touched points contradict the calibration" in found.output))
        record = json.loads(CliRunner().invoke(app, ["hand-eye", str(file), "--json"]).stdout)
        assert record["touch_contradicts"] == (beside > 0)
        told = [
            assumed_text(Open(each)) in record["assumed"] for each in ("joint_zeros", "touched_points", "real_camera")
        ]
        assert told == [True, False, False]
        frames = [gap_text(Open(each)) in record["not_checked"] for each in ("flange_frame", "base_frame")]
        assert frames == [True, False]
    text = file.read_text()
    file.write_text(text.replace("touched: touched.csv", ""))
    unconfirmed = CliRunner().invoke(app, ["hand-eye", str(file)]).output
    assert all(gap_text(Open(each)) in unconfirmed for each in ("flange_frame", "base_frame"))
    file.write_text(text.replace("touched: touched.csv", "simulated: true"))
    untouched = CliRunner().invoke(app, ["hand-eye", str(file)]).output
    assert all(f"assumed: {assumed_text(Open(each))}" in untouched for each in ("touched_points", "real_camera"))
    assert "recorded poses" not in untouched
    assert codes == [(0, False), (1, True)]
