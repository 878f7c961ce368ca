"""A factory's own calibration: tables whose d cancel hundreds of metres hold the same arm with small numbers."""

from __future__ import annotations

import re

import numpy as np
import pytest
from typer.testing import CliRunner

import er3a
from er3a.errors import InputError
from er3a.files.factory_calibration import load_factory_calibration
from er3a.files.robot_file import RobotFile
from er3a.files.robot_library import load_robot, read_arm, robot_of
from er3a.files.robot_writer import robot_file, write_robot
from er3a.files.yaml_file import parse
from er3a.formats.urdf import export_urdf, import_urdf
from er3a.geometry.transforms import rot_x, rot_y, rot_z, translation
from er3a.pipeline.cli import app
from er3a.robots.robot import Envelope

# A UR3's, as its owner published it (MyRobotLab/pyrobotlab, issue 145).
CONF = """\
[mounting]
delta_theta = [ 9.14361764983717684e-08, 0.178461025123001604, 6.68283349819805572, -0.578116982609792496, \
6.11299818305960363e-06, -5.03926212855332345e-07]
delta_a = [ -0.000243788991999517813, 0.00381165418642351317, 0.034503078453104935, 0.000107694612896758047, \
-0.000198736633205663144, 0]
delta_d = [ 9.225352853908797e-05, 12.0620003757611567, 17.6719025641737275, -29.7339960369544869, \
-2.8164617795367608e-05, 0.000217420471082099831]
delta_alpha = [ 0.00115615746589403656, 0.0035851898103369975, 0.00392132336586574568, 0.000406668888106365145, \
-0.00201170396009153762, 0]
calibration_status = 2 # 0 == notInitialized / 1 == notLinearised / 2 == Linearised
"""
A, D = np.array([0, -243.65, -213.25, 0, 0, 0]), np.array([151.9, 0, 0, 112.35, 85.35, 81.9])
ALPHA = np.array([90.0, 0, 0, 90, -90, 0])


def nominal() -> er3a.Robot:
    ur5e = load_robot("ur5e")
    return ur5e.replace(name="ur3", a=A / 1000, d=D / 1000, alpha=np.radians(ALPHA))


def published(stretch: float = 1.0) -> dict[str, np.ndarray]:
    """The arm's D-H columns, m and rad; ``stretch`` moves the normals farther away, to d of hundreds of metres."""
    found = {
        key: np.array([float(word) for word in re.search(rf"delta_{key} = \[(.*)\]", CONF)[1].split(",")])
        for key in ("theta", "a", "d", "alpha")
    }
    columns = {"a": A / 1000 + found["a"], "d": D / 1000 + found["d"], "alpha": np.radians(ALPHA) + found["alpha"]}
    total = columns["d"][1:4].sum()
    columns["d"][1:3] *= stretch
    columns["d"][3] = total - columns["d"][1:3].sum()
    columns["alpha"][1:3] /= stretch
    return columns | {"theta": found["theta"]}


def by_hand(columns: dict[str, np.ndarray], q: np.ndarray) -> np.ndarray:
    """Forward kinematics, row by row."""
    T = np.eye(4)
    for k in range(6):
        T = T @ rot_z(q[k] + columns["theta"][k]) @ translation(0, 0, columns["d"][k])
        T = T @ translation(columns["a"][k], 0, 0) @ rot_x(columns["alpha"][k])
    return T


def assert_is(robot: er3a.Robot, columns: dict[str, np.ndarray], random: np.random.Generator, tolerance: float) -> None:
    for q in random.uniform(-3, 3, (50, 6)):
        np.testing.assert_allclose(er3a.forward(robot, q), by_hand(columns, q), atol=tolerance)
    assert np.abs([*robot.a, *robot.d]).max() < 0.5


def test_a_controllers_own_file_is_the_same_arm_with_small_numbers(tmp_path, random):
    path = tmp_path / "calibration.conf"
    path.write_text(CONF, encoding="utf-8")
    found = load_factory_calibration(path, nominal())
    assert_is(found, published(), random, 1e-12)
    np.testing.assert_allclose(found.a, A / 1000, atol=1e-3)
    assert found.beta.any()
    shaped = nominal().replace(envelopes=(Envelope(1, (0.0, 0.0, 0.0), (0.0, 0.0, 0.1), 0.05),))
    write_robot(shaped, tmp_path / "ur3.yaml")
    words = ["import-calibration", str(path), "--robot", str(tmp_path / "ur3.yaml")]
    done = CliRunner().invoke(app, [*words, "--output", str(tmp_path / "mine.yaml")])
    assert done.exit_code == 0, done.output
    assert "without shapes, masses and references" in done.stderr
    assert_is(load_robot(tmp_path / "mine.yaml"), published(), random, 1e-12)
    compared = er3a.compare(found, load_robot(tmp_path / "mine.yaml"))
    assert compared.geometry.same


# A UR5's and a UR3's, as their owners published them (ros-industrial-attic/ur_modern_driver, issue 179; a script for an
# arm whose axes 3 and 4 are 12 mrad off): table, delta_theta, delta_a, delta_d, delta_alpha.
OTHERS = {
    "ur5": (
        ([0, -425, -392.25, 0, 0, 0], [89.159, 0, 0, 109.15, 94.65, 82.3]),
        [2.077509786e-05, 0.968215715555, -1.856853850148, 0.888647901450, 5.661068149e-05, -7.463107641e-05],
        [0.000393621050, 0.184093300397, 0.144939533007, -6.432974036e-05, 7.767090401e-06, 0],
        [4.002630978e-05, 278.244144925623573, -183.695513914913732, -94.5471513669751289, 0.000304782682, 0.000123738],
        [-0.000271624944, 0.00125856505456124258, -0.00322052070697146503, 0.000651530165, -0.000587004657, 0],
    ),
    "ur3": (
        (A, D),
        [4.618040646e-05, -0.0596917792801850075, 0.187982530479293558, -0.128421417771249463, 1.8692e-05, -3.7087e-05],
        [3.746454691e-05, 0.000432751256, 0.001515463734, 3.547393913e-05, 5.124090782e-05, 0],
        [0.000223224170, -6.29131988413453058, 8.56941731705468257, -2.27804644471935935, -7.3139e-05, 0.000410720],
        [0.000118200678, 0.0023051124802664618, 0.0120016019438704737, 0.000466335408, -0.000233982646, 0],
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("name", OTHERS)
def test_a_calibrated_arm_is_compared_with_its_nominal_table_by_small_numbers(name, tmp_path):
    (a, d), *deltas = OTHERS[name]
    keys = "delta_theta", "delta_a", "delta_d", "delta_alpha"
    path = tmp_path / "calibration.conf"
    path.write_text("\n".join(f"{key} = {delta!r}" for key, delta in zip(keys, deltas)) + "\n", encoding="utf-8")
    table = nominal().replace(a=np.array(a) / 1000, d=np.array(d) / 1000)
    arm = load_factory_calibration(path, table)
    assert np.abs([*arm.a, *arm.d]).max() < 0.5
    found = er3a.compare(arm, table)
    assert found.verdict == "other_arm"
    assert "alpha3" in {each.entry for each in found.geometry.differences}
    for each in found.geometry.differences:
        assert abs(each.difference) < (3 if each.unit == "mm" else 1)
    assert found.zero.same
    assert found.aligned_mm < 5


@pytest.mark.parametrize("stretch", [1.0, 30.0])
def test_a_table_whose_d_cancel_is_read_as_csv_and_as_robot_file(stretch, tmp_path, random):
    columns = published(stretch)
    written = [np.degrees(v) if key in ("alpha", "theta") else 1000 * v for key, v in columns.items()]
    lines = [",".join(map(repr, [k, *row])) for k, row in enumerate(np.column_stack(written).tolist(), 1)]
    path = tmp_path / "table.csv"
    path.write_text("\n".join(["joint,a_mm,d_mm,alpha_deg,offset_deg", *lines]) + "\n", encoding="utf-8")
    arm = read_arm(str(path))
    assert any("cancel" in note for note in arm.notes)
    assert_is(arm.robot, columns, random, 1e-9)
    content = robot_file(load_robot("ur5e")).model_dump(exclude_none=True)
    for k, row in enumerate(content["dh"]["rows"]):
        row |= {"a_mm": 1000 * columns["a"][k], "d_mm": 1000 * columns["d"][k]}
        row["alpha_deg"] = float(np.degrees(columns["alpha"][k]))
        content["zero"]["rows"][k]["offset_deg"] = float(np.degrees(columns["theta"][k]))
    content["dh"]["calibrated"] = True
    assert_is(robot_of(parse(RobotFile, content, None)), columns, random, 1e-9)


def test_hayati_rows_and_calibrated_can_be_said_in_a_csv(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text(
        "joint,a_mm,alpha_deg,d_mm,beta_deg,calibrated\n1,0.3,90,400,0,true\n2,300,0.1,0,0.2,true\n3,100,0,0,0,true\n",
        encoding="utf-8",
    )
    robot = read_arm(str(path)).robot
    np.testing.assert_allclose(np.degrees(robot.beta), [0, 0.2, 0])
    np.testing.assert_allclose(robot.a, [0.0003, 0.3, 0.1])


def test_lengths_that_do_not_cancel_are_refused_as_before(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("joint,a_mm,alpha_deg,d_mm\n1,0,90,400\n2,300,0.1,-29621.6\n3,100,0,0\n", encoding="utf-8")
    with pytest.raises(InputError, match="longer than any robot's link"):
        read_arm(str(path))


LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
# ur_description's default_kinematics.yaml of a UR5e, which is its nominal table.
DEFAULT = [
    (0, 0, 0.1625, 0, 0, 0),
    (0, 0, 0, 1.570796327, 0, 0),
    (-0.425, 0, 0, 0, 0, 0),
    (-0.3922, 0, 0.1333, 0, 0, 0),
    (0, -0.0997, -2.044881182297852e-11, 1.570796327, 0, 0),
    (0, 0.0996, -2.042830148012698e-11, 1.570796326589793, 3.141592653589793, 3.141592653589793),
]


def written(tmp_path, poses):
    lines = ["kinematics:"]
    for name, pose in zip(LINKS, poses):
        lines += [
            f"  {name}:",
            *(f"    {key}: {float(v)!r}" for key, v in zip(("x", "y", "z", "roll", "pitch", "yaw"), pose)),
        ]
    path = tmp_path / "my_calibration.yaml"
    path.write_text("\n".join([*lines, "  hash: calib_1234"]) + "\n", encoding="utf-8")
    return path


def test_the_default_yaml_is_the_nominal_table_and_a_calibrated_one_its_own_chain(tmp_path, random):
    ur5e = load_robot("ur5e")
    found = load_factory_calibration(written(tmp_path, DEFAULT), ur5e)
    q = random.uniform(-3, 3, (50, 6))
    np.testing.assert_allclose(er3a.forward(found, q), er3a.forward(ur5e, q), atol=1e-8)
    poses = np.array(DEFAULT) + random.normal(0, 1e-3, (6, 6))
    found = load_factory_calibration(written(tmp_path, poses), ur5e)
    for one in q:
        T = np.eye(4)
        for (x, y, z, roll, pitch, yaw), angle in zip(poses, one):
            T = T @ translation(x, y, z) @ rot_z(yaw) @ rot_y(pitch) @ rot_x(roll) @ rot_z(angle)
        np.testing.assert_allclose(er3a.forward(found, one), T, atol=1e-12)
    assert found.beta.any()
    assert np.abs([*found.a, *found.d]).max() < 1


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["delta_theta", "missing", "calibration.conf"]),
        (CONF.replace("delta_a", "delta_b"), ["delta_a", "missing"]),
        (CONF.replace("delta_d = [ 9.2", "delta_d = [ x"), ["delta_d", "6 numbers"]),
        (CONF.replace("12.0620003757611567", "99"), ["links of", "nominal table"]),
    ],
)
def test_a_file_that_is_no_calibration_is_one_clear_error(text, words, tmp_path):
    path = tmp_path / "calibration.conf"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_factory_calibration(path, nominal())
    for word in [*words, str(path)]:
        assert word in str(caught.value)


@pytest.mark.parametrize("off_mrad", [1.5, 3.0, 6.0, 10.0])
def test_a_urdf_with_parallel_axes_that_are_off_is_read_and_written(off_mrad, tmp_path, random):
    ur5e = load_robot("ur5e")
    truth = ur5e.replace(beta=np.array([0, off_mrad, -off_mrad, 0, 0, 0]) / 1000)
    path = tmp_path / "arm.urdf"
    path.write_text(export_urdf(truth), encoding="utf-8")
    found = import_urdf(path).robot
    q = random.uniform(-3, 3, (50, 6))
    np.testing.assert_allclose(er3a.forward(found, q), er3a.forward(truth, q), atol=1e-9)
    assert np.abs([*found.a, *found.d]).max() < 1
    write_robot(found.replace(name="mine"), tmp_path / "mine.yaml")
    np.testing.assert_allclose(er3a.forward(load_robot(tmp_path / "mine.yaml"), q), er3a.forward(truth, q), atol=1e-9)
