"""Does a model agree with its controller? Against poses that another program made, and made-up causes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import er3a
from er3a.confirmation.document import controller_set
from er3a.confirmation.fit import Fitter
from er3a.confirmation.layers import search
from er3a.confirmation.pairs import Pairs
from er3a.confirmation.poses import read_pairs
from er3a.errors import Er3aError, InputError
from er3a.files.orientations import of_angles
from er3a.files.robot_writer import write_robot
from er3a.references.predict import state_of
from er3a.references.reference import quantities_of
from testing import controller_cases
from testing.arms import links_of_rows

DEG = np.pi / 180
A, ALPHA, D = (0, -0.425, -0.395, 0, 0, 0), (90, 0, 0, 90, -90, 0), (0.152, 0, 0, 0.102, 0.102, 0.1)


def arm(**changes) -> er3a.Robot:
    """A cobot of the usual six-axis kind, whose twists and lengths a maker publishes."""
    columns = {"a": np.array(A), "alpha": np.array(ALPHA) * DEG, "d": np.array(D)}
    return er3a.Robot.from_dh(**{**columns, **changes}, name="made")


def shown(q: np.ndarray, columns=(A, ALPHA, D), offset=(0, 0, 0, 0, 0, 0)) -> np.ndarray:
    """What a controller shows at joint values (N, 6), rad, multiplied out without er3a's kinematics."""
    a, alpha, d = (np.array(each, float) for each in columns)
    links = links_of_rows(a, alpha * DEG, d)
    found = np.tile(np.eye(4), (len(q), 1, 1))
    for k in range(6):
        turn = np.tile(np.eye(4), (len(q), 1, 1))
        turn[:, :3, :3] = Rotation.from_rotvec(np.outer(q[:, k] + offset[k], [0, 0, 1])).as_matrix()
        found = found @ turn @ links[k + 1]
    return found


def typed(q: np.ndarray, T: np.ndarray, form: str = "xyz", size: float = 1.0) -> Pairs:
    """Rows as typed from a pendant to 0.01, with roll, pitch and yaw; the forms of a table with these headings."""
    xyz = np.round(T[:, :3, 3] * 1000 * size, 2) / 1000
    angles = np.round(Rotation.from_matrix(T[:, :3, :3]).as_euler(form, degrees=True), 2) * DEG
    turns = {name: of_angles(name, angles) for name in ("rpy", "abc", "zyz", "xyz", "rotation_vector")}
    digits = np.full(6, 0.01 * DEG), np.full(3, 1e-5), 0.01 * DEG
    return Pairs(np.radians(np.round(np.degrees(q), 2)), xyz, turns, 1, *digits, np.arange(2, len(q) + 2))


def poses(seed: int = 5, count: int = 12) -> np.ndarray:
    """Joint values (N, 6), rad."""
    return np.random.default_rng(seed).uniform(-2.4, 2.4, (count, 6))


def moved(xyz, rpy=(0, 0, 0)) -> np.ndarray:
    """A transform of m and deg, by SciPy."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_euler("xyz", rpy, degrees=True).as_matrix(), xyz
    return T


@pytest.mark.parametrize("seed", range(8))
def test_a_right_arm_is_not_refused_for_its_digits(seed):
    q = poses(seed)
    found = er3a.confirm(arm(), typed(q, shown(q)))
    assert found.verdict == "agrees"
    assert found.left_mm.max() < 5 * found.digits_mm


def test_a_tool_and_a_base_are_named_with_intervals():
    q, X, Y = poses(), moved((0.02, 0, 0.12), (0, 30, 0)), moved((0.3, -0.2, 0.05), (0, 0, 45))
    found = er3a.confirm(arm(), typed(q, Y @ shown(q) @ X))
    assert found.layers == ("frames",)
    for place, true in ((found.tool, X), (found.base, Y)):
        assert np.abs(place.T[:3, 3] - true[:3, 3]).max() * 1000 < 2 * place.half_width_mm < 0.2


def test_a_tool_that_is_turned_by_a_quarter_has_round_angles():
    q, X = poses(), moved((0, 0, 0), (0, -90, 0))
    found = er3a.confirm(arm(), typed(q, shown(q) @ X))
    assert found.layers == ("frames",)
    np.testing.assert_allclose(found.tool.rpy_deg, [0, -90, 0], atol=0.05)


@pytest.mark.long
def test_zero_and_sense_of_joints_are_named():
    q = poses()
    zero = er3a.confirm(arm(), typed(q, shown(q, offset=(0, 0, 1.5 * DEG, 0, 0, 0))))
    assert zero.layers == ("joints",)
    (entry,) = zero.entries
    assert entry.entry.name == "offset3"
    assert abs(entry.found - 1.5) < 2 * entry.half_width
    back = er3a.confirm(arm(), typed(q, shown(q * [1, 1, 1, 1, -1, 1])))
    assert [(each.code, each.joint) for each in back.joints] == [("turns_other_way", 5)]
    assert np.allclose(er3a.forward(back.corrected, q), shown(q * [1, 1, 1, 1, -1, 1]), atol=1e-12)


@pytest.mark.long
def test_what_is_counted_from_the_ground_is_named():
    q = poses()
    own = q.copy()
    own[:, 2] -= q[:, 1]
    found = er3a.confirm(arm(), typed(q, shown(own)))
    assert [(each.code, each.joint, each.by, each.factor) for each in found.joints] == [("counted_from", 3, 2, -1.0)]
    assert np.allclose(er3a.forward(found.corrected, q), shown(own), atol=1e-12)


@pytest.mark.long
def test_the_reading_is_named():
    q = poses()
    angles = er3a.confirm(arm(), typed(q, shown(q), "ZYX"))
    assert (angles.verdict, angles.form, angles.renamed) == ("reading", "abc", True)
    inches = er3a.confirm(arm(), typed(q, shown(q), size=1 / 25.4))
    assert (inches.verdict, inches.factor) == ("reading", 25.4)
    pairs = typed(q, shown(q))
    pairs.xyz[8, 0] += 0.027
    misread = er3a.confirm(arm(), pairs)
    assert (misread.verdict, misread.lines[~misread.fits].tolist()) == ("reading", [10])


@pytest.mark.long
def test_two_lengths_and_small_corrections_are_told_from_each_other():
    q, noise = poses(), np.random.default_rng(1)
    family = er3a.confirm(
        arm(), typed(q, shown(q, ((0, -0.525, -0.395, 0, 0, 0), ALPHA, (0.152, 0, 0, 0.102, 0.202, 0.1))))
    )
    assert {each.entry.name for each in family.entries} == {"a2", "d5"}
    true = A + noise.normal(0, 4e-4, 6), ALPHA + noise.normal(0, 0.06, 6), D + noise.normal(0, 4e-4, 6)
    small = er3a.confirm(arm(), typed(q, shown(q, true)))
    assert small.layers == ("small",)
    assert small.before_mm.max() > 10 * small.left_mm.max()
    new = poses(9, 50)
    off = np.linalg.norm(er3a.forward(small.corrected, new)[:, :3, 3] - shown(new, true)[:, :3, 3], axis=1)
    assert 1000 * off.max() < 0.5


def test_positions_alone_name_what_they_can():
    q, X = poses(count=16), moved((0.02, 0, 0.12))
    pairs = typed(q, shown(q) @ X)
    found = er3a.confirm(arm(), Pairs(pairs.q, pairs.xyz, {}, 1, pairs.q_digit, pairs.xyz_digit, 0.0, pairs.lines))
    assert (found.layers, found.oriented) == (("frames",), False)
    assert np.abs(found.tool.xyz_mm - [20, 0, 120]).max() < 0.2
    with pytest.raises(Er3aError, match="8 at least"):
        er3a.confirm(arm(), Pairs(q[:7], pairs.xyz[:7]))


@pytest.mark.long
def test_an_arm_of_another_kind_stays_open():
    q = poses()
    other = shown(q, ((0.3, 0.2, -0.1, 0.05, 0, 0), (45, -30, 60, 90, -45, 10), (0.1, 0.3, 0, 0.2, 0, 0.1)))
    assert er3a.confirm(arm(), typed(q, other)).verdict == "open"


FILES = {
    "kuka.csv": "name;A1;A2;A3;A4;A5;A6;X;Y;Z;A;B;C\nP1;{0};{1};{2};{3};{4};{5};{6};{7};{8};{9};{10};{11}\n",
    "fanuc.csv": "J1,J2,J3,J4,J5,J6,X,Y,Z,W,P,R\n{0},{1},{2},{3},{4},{5},{6},{7},{8},{11},{10},{9}\n",
    "own.csv": "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,point,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n"
    "{0},{1},{2},{3},{4},{5},flange,{6},{7},{8},{11},{10},{9}\n",
    "krl.dat": "DECL A={{E6AXIS: A1 {0}, A2 {1}, A3 {2}, A4 {3}, A5 {4}, A6 {5}, E1 0.0}}\n"
    "P={{E6POS: X {6}, Y {7}, Z {8}, A {9}, B {10}, C {11}, S 2, T 10}}\n",
    "efort.var": "POINTJ({0}, {1}, {2}, {3}, {4}, {5}) POINTC({6}, {7}, {8}, {9}, {10}, {11}, cfg(0))\n",
}
NUMBERS = (10.0, -85.32, 92.1, 0.5, 45.25, -12.3, 512.34, -35.12, 610.45, 31.5, 8.14, -176.32)


@pytest.mark.parametrize("name", FILES)
def test_natural_files_are_read_alike(name, tmp_path):
    text = FILES[name].format(*(f"{number:.2f}" for number in NUMBERS))
    path = tmp_path / name
    path.write_text(text.replace(".", ",") if ";" in text else text)
    pairs = read_pairs(path, arm())
    assert np.allclose(np.degrees(pairs.q[0]), NUMBERS[:6])
    assert np.allclose(pairs.xyz[0] * 1000, NUMBERS[6:9])
    expected = Rotation.from_euler("ZYX", NUMBERS[9:], degrees=True).as_matrix()
    assert np.allclose(pairs.turns[pairs.forms[0]][0], expected)
    assert np.median(pairs.xyz_digit) == pytest.approx(1e-5)
    assert np.median(np.degrees(pairs.q_digit)) == pytest.approx(0.01)


def test_rapid_and_a_recording_are_read(tmp_path):
    rapid = tmp_path / "log.txt"
    rapid.write_text("[[10,-20,15,0,30,0],[9E9,9E9]] [[498.21,87.85,431.09],[0.5,0.5,-0.5,0.5],[0,0,0,0],[9E9]]\n")
    pairs = read_pairs(rapid, arm())
    assert np.allclose(pairs.turns["quaternion"][0], Rotation.from_quat([0.5, -0.5, 0.5, 0.5]).as_matrix())
    names = [f"actual_q_{k}" for k in range(6)] + [f"actual_qd_{k}" for k in range(6)]
    names += [f"actual_TCP_pose_{k}" for k in range(6)]
    rows = [[0.1 * k] * 6 + [0.2 * (k % 3 == 2)] * 6 + [0.1, 0.2, 0.3, 0, 0, 1.5] for k in (0, 0, 1, 2, 3)]
    recording = tmp_path / "rtde.csv"
    recording.write_text("\n".join(" ".join(map(str, row)) for row in (names, *rows)))
    pairs = read_pairs(recording, arm())
    assert pairs.q[:, 0].tolist() == pytest.approx([0.0, 0.1, 0.3])
    assert pairs.lines.tolist() == [3, 4, 6]


@pytest.mark.parametrize(
    ("text", "field"),
    [("", "None"), ("a,b\n1,2\n", "header"), ("J1,J2,J3,J4,J5,J6,X,Y,Z\n1,2,3,4,5,6,7,8,x\n", "row 2"),
     ("J1,J2,J3,J4,J5,J6\n1,2,3,4,5,6\n", "header"), ("J1,J2,J3,J4,J5,J6,X,Y,Z\n1,2\n", "row 2")],
)  # fmt: skip
def test_what_cannot_be_read_is_named(text, field, tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        read_pairs(path, arm())
    assert field in str(error.value.field or "None")


def test_targets_that_make_no_pairs_are_refused(tmp_path):
    path = tmp_path / "points.dat"
    path.write_text("{A1 1, A2 2, A3 3, A4 4, A5 5, A6 6}\n{X 1, Y 2, Z 3}\n{X 4, Y 5, Z 6}\n")
    with pytest.raises(InputError, match="1 targets of joints and 2 of poses"):
        read_pairs(path, arm())


def test_a_plan_is_safe_and_settles_more_than_chance():
    from er3a.confirmation.plan import _effects, plan

    robot = er3a.load_robot("er3a_c60")
    found = plan(robot)
    assert found.q.shape == (5, 6)
    assert (found.q > robot.lower).all()
    assert (found.q < robot.upper).all()
    assert (er3a.clearance(robot, found.q, None).distance > 0.03).all()
    assert np.allclose(found.T, er3a.forward(robot, found.q))

    def information(q: np.ndarray) -> float:
        J = _effects(robot, q).reshape(30, -1)
        return float(np.linalg.slogdet(np.eye(J.shape[1]) + J.T @ J)[1])

    random = np.random.default_rng(0).uniform(robot.lower, robot.upper, (20, 5, 6))
    assert information(found.q) > max(map(information, random))


@pytest.mark.long
def test_the_command_answers_and_writes(tmp_path):
    from typer.testing import CliRunner

    from er3a.pipeline.cli import app

    q = poses()
    T = er3a.forward(er3a.load_robot("ur5e"), q) @ moved((0, 0, 0.12))
    angles = Rotation.from_matrix(T[:, :3, :3]).as_rotvec()
    rows = np.round(np.c_[np.degrees(q), 1000 * T[:, :3, 3], np.degrees(angles)], 3)
    header = "j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n"
    text = header + "\n".join(",".join(map(str, row)) for row in rows)
    output = tmp_path / "mine.yaml"
    done = CliRunner().invoke(app, ["confirm", "ur5e", "-", "--output", str(output), "--all"], input=text)
    assert done.exit_code == 1
    assert "FRAMES" in done.stdout
    assert "119.99" in done.stdout or "120.0" in done.stdout
    assert np.abs(er3a.forward(er3a.load_robot(output), q) - T).max() < 1e-4
    assert CliRunner().invoke(app, ["confirm", "ur5e", "-", "--expect", "frames"], input=text).exit_code == 0


def test_a_confirmation_has_no_truth_value():
    q = poses()
    found = er3a.confirm(arm(), q, shown(q))
    with pytest.raises(TypeError):
        bool(found)
    assert "agrees" in repr(found)


@pytest.mark.long
@pytest.mark.parametrize("name", ["er3_600", "lbr_iiwa_14"])  # the campaign has more
def test_each_cause_alone_is_named_first(name):
    robot = er3a.load_robot(name)
    for causes in ((), *((cause,) for cause in controller_cases.CAUSES)):
        made = controller_cases.case(robot, causes, seed=0)
        assert controller_cases.judged(search(Fitter(robot, made.pairs)), made.truth) == "first", causes


def written(folder: Path, T: np.ndarray, q: np.ndarray, decimals: np.ndarray | int = 2) -> Path:
    """A table as typed from a pendant, each number to its own ``decimals``, (N, 12) or what broadcasts to it."""
    rows = np.concatenate([q / DEG, T[:, :3, 3] * 1000], axis=1)
    rows = np.concatenate([rows, Rotation.from_matrix(T[:, :3, :3]).as_euler("xyz", degrees=True)], axis=1)
    heading = ",".join([*(f"J{k}" for k in range(1, 7)), *"XYZWPR"])
    path = folder / "pendant.csv"
    to = np.broadcast_to(decimals, rows.shape)
    lines = [",".join(f"{value:.{k}f}" for value, k in zip(row, own)) for row, own in zip(rows, to)]
    path.write_text("\n".join([heading, *lines]))
    return path


MIXED = {
    "rows in turns": 1 + np.arange(12)[:, None] % 2,
    "two rows with more": np.where(np.arange(12)[:, None] < 2, 2, 1),
    "last row with fewer": np.where(np.arange(12)[:, None] < 11, 2, 1),
    "three columns with more": np.where(np.arange(12) < 3, 2, 1),
    "one field with more": np.where(np.arange(144).reshape(12, 12) == 40, 3, 1),
}


@pytest.mark.long
@pytest.mark.parametrize(("seed", "decimals"), list(enumerate(MIXED.values())), ids=list(MIXED))
def test_digits_that_differ_refuse_no_right_arm(tmp_path, decimals, seed):
    q = poses(seed)
    path = written(tmp_path, shown(q), q, decimals)
    assert er3a.confirm(arm(), path, angles="rpy").verdict == "agrees"
    longer = arm(a=np.array(A) * [1, 1.02, 1, 1, 1, 1])
    assert er3a.confirm(longer, path, angles="rpy").verdict != "agrees"


@pytest.mark.long
def test_a_controller_s_poses_are_a_document_about_the_arm(tmp_path):
    q, X, Y = poses(), moved((0.02, 0, 0.12), (0, 30, 0)), moved((0.3, -0.2, 0.05), (0, 0, 45))
    model = arm()
    here = model.replace(base=Y, tool=X)
    found = controller_set(here, model, written(tmp_path, Y @ shown(q) @ X, q))
    assert len(found.rows["positions"]) == len(q)
    state = state_of(model, quantities_of(found.checkable))
    for each in found.checkable:
        assert abs(each.quantity.value(state) - each.expected) <= each.uncertainty, each
    with pytest.raises(InputError, match="tool or base set that the study has not"):
        controller_set(model, model, tmp_path / "pendant.csv")


@pytest.mark.long
def test_the_page_opens_with_the_answer(tmp_path, call):
    q = poses()
    written(tmp_path, shown(q) @ moved((0.02, 0, 0.12)), q)
    arm_file = tmp_path / "made.yaml"
    write_robot(arm(), arm_file)
    page = tmp_path / "page.html"
    assert call("confirm", arm_file, tmp_path / "pendant.csv", "--html", page, "--expect", "frames").returncode == 0
    text = page.read_text(encoding="utf-8")
    headline = re.search(r'<h1>.*?<span class="(\w+)">', text)
    assert headline
    assert headline[1] == "caution"
    placed = re.search(r"tool of the controller: \{xyz_mm: \[(\S+), \S+, (\S+)\]", text)
    assert placed
    assert [float(each) for each in placed.groups()] == pytest.approx([20, 120], abs=0.05)
