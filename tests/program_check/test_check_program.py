"""What a check of programs finds, and what it does not: each fault's program, and programs written to be sound."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.collision.pairs import label_of
from er3a.collision.scene import Plane, Scene, Sphere
from er3a.collision.shapes import arm_shapes
from er3a.errors import ShapeError
from er3a.files.program_file import load_programs
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.kinematics.solutions import branch_labels
from er3a.planning.commands import CommandSource, build
from er3a.planning.timing import JointLimits
from er3a.program_check.check_program import CheckOptions, check_program, parts_of
from er3a.programs.instructions import numbers_of
from er3a.programs.languages import read_program
from testing.program_texts import HOME_TEXT, NEAR_TEXT, axes
from testing.program_texts import check as check_text
from testing.singular_poses import branch_of

ROOT = Path(__file__).resolve().parents[2]
FAULTS = ROOT / "data/programs/faults"
ROBOT = load_robot("er3a_c60")
HOME = np.radians([0.0, -10.0, -10.0, 0.0, -70.0, 0.0])
LONG = ("drifting_loop", "singular_line")
FOUND = {
    "collision_with_table": {"motion_collides"},
    "drifting_loop": {"not_followed", "way_out_of_reach"},
    "joint_jump": {"joint_jumps"},
    "no_motion": {"program_nothing_moves"},
    "out_of_reach": {"way_out_of_reach"},
    "outside_limits": {"above_limit"},
    "singular_line": {"passes_singularity", "too_fast"},
    "too_fast": {"too_fast"},
    "unknown_tool": {"not_followed"},
    "zone_larger_than_segment": {"zone_too_large"},
}
TABLE = Scene("table", (Plane("table", np.array([0.0, 0.0, 1.0]), 0.0),))


def checked(text: str, tmp_path: Path, name: str = "a.src", **options):
    """The check of a KRL program's body, from the home position."""
    head = "DEF a( )\nBAS(#INITMOV,0)\n$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\nBAS(#VEL_PTP,30)\n$VEL.CP=0.1\n"
    (tmp_path / name).write_text(f"{head}{text}\nEND\n", encoding="utf-8")
    (tmp_path / name).with_suffix(".dat").write_text("DEFDAT a\nENDDAT\n", encoding="utf-8")
    given = {"start": HOME} | options
    return check_program(read_program(tmp_path / name), ROBOT, CheckOptions(**given))


def codes(check) -> set[str]:
    """Codes of all findings."""
    return {each.finding.code for each in check.findings}


def frame(T) -> str:
    """A pose (4, 4) in m as a KRL frame."""
    x, y, z, a, b, c = numbers_of(T, "kuka")
    return f"{{X {x:.6f}, Y {y:.6f}, Z {z:.6f}, A {a:.6f}, B {b:.6f}, C {c:.6f}}}"


def test_every_faulty_program_has_its_faults_here():
    assert {path.stem for path in FAULTS.glob("*.src")} == set(FOUND)


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.long if name in LONG else ()) for name in FOUND])
def test_each_fault_is_found(name):
    check = check_program(FAULTS / f"{name}.src", ROBOT, CheckOptions(start=HOME, scene=TABLE))
    assert codes(check) >= FOUND[name]
    listed = load_programs(ROOT / "data/programs/er3a_c60.yaml").programs
    assert check.level == next(entry.expect for entry in listed if entry.name == name)


@pytest.mark.parametrize("suffix", [".src", ".script", ".pgm"])
def test_the_examples_pass_and_their_times_agree_over_languages(suffix):
    scene = load_scene(ROOT / "data/scenes/table_and_post.yaml")
    frames = load_programs(ROOT / "data/programs/er3a_c60.yaml").transforms()
    options = CheckOptions(start=HOME, scene=scene, frames=frames)
    check = check_program(read_program(ROOT / f"data/programs/weld_seam{suffix}"), ROBOT, options)
    assert [each for each in check.findings if each.level in ("caution", "fail")] == []
    assert all(verdict.times for verdict in check.verdicts)
    assert 25 < check.cycle.blended_s <= check.cycle.stopping_s < 30


def test_a_zone_too_large_for_one_of_its_two_lines_is_named(tmp_path):
    to = "LIN {{X {0}.0, Y {1}.0, Z 320.0, A 0.0, B 0.0, C 180.0}}".format
    body = f"$APO.CDIS=80\n{to(380, 160)}\n{to(400, 160)} C_DIS\n{to(400, 0)}"
    assert "zone_too_large" in codes(checked(body, tmp_path))


def test_limits_reach_and_speeds_by_what_is_written(tmp_path):
    low, high = np.degrees(ROBOT.lower[2]), np.degrees(ROBOT.upper[2])
    inside = checked(f"PTP {{A3 {high - 0.01:.3f}}}", tmp_path)
    assert "above_limit" not in codes(inside)
    assert "above_limit" in codes(checked(f"PTP {{A3 {high + 0.01:.3f}}}", tmp_path))
    assert "below_limit" in codes(checked(f"PTP {{A3 {low - 0.01:.3f}}}", tmp_path))
    fast = ROBOT.replace(speed=np.full(6, np.radians(100.0)))
    program = read_program(tmp_path / "a.src")
    assert "too_fast" not in codes(check_program(program, fast, CheckOptions(start=HOME)))
    (tmp_path / "b.script").write_text("def b():\n  movej([1,-0.17,-0.17,0,-1.22,0], a=5, v=2.0)\nend\n")
    over = check_program(read_program(tmp_path / "b.script"), fast, CheckOptions(start=HOME))
    assert {each.finding.code for each in over.findings if each.level == "fail"} == {"too_fast"}


def test_a_line_is_timed_by_speed_and_acceleration(tmp_path):
    (tmp_path / "a.script").write_text(
        "def a():\n  movel(pose_trans(get_actual_tcp_pose(), p[0,0,0.1,0,0,0]), a=0.5, v=0.1)\nend\n"
    )
    arm = ROBOT
    check = check_program(read_program(tmp_path / "a.script"), arm, CheckOptions(start=HOME))
    assert check.cycle.stopping_s == pytest.approx(0.1 / 0.1 + 0.1 / 0.5, rel=1e-6)
    assert check.cycle.complete


@pytest.mark.parametrize(("speed", "by_joint"), [(100, False), (5000, True)])
def test_a_joint_move_takes_as_long_as_its_tool_or_its_slowest_joint(speed, by_joint, tmp_path):
    turned = HOME + np.radians([60, 0, 0, 0, 0, 0])
    target = f"[[{','.join(f'{each:.9f}' for each in np.degrees(turned))}],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    text = f"MODULE m\n  PROC main()\n    MoveAbsJ {target},v{speed},fine,tool0;\n  ENDPROC\nENDMODULE\n"
    (tmp_path / "m.mod").write_text(text)
    check = check_program(read_program(tmp_path / "m.mod"), ROBOT, CheckOptions(start=HOME))
    radius = np.linalg.norm(forward(ROBOT, HOME)[:2, 3])  # a sixth of a turn has a chord as long
    joint = 60 / 180 + 0.25  # s, at the speed and acceleration assumed of a joint without a document
    assert check.cycle.stopping_s == pytest.approx(joint if by_joint else 1000 * radius / speed, rel=1e-6)


def moment(check, code: str) -> float:
    """When, within its motion, the one finding of a code begins, s."""
    return next(each.moment for each in check.findings if each.finding.code == code)


def test_a_joint_move_passes_a_limit_when_its_trapezoid_of_speed_says(tmp_path):
    far = np.degrees(ROBOT.upper[2]) - np.degrees(HOME[2])
    check = checked(f"PTP {{A3 {np.degrees(ROBOT.upper[2]) + 35:.6f}}}", tmp_path)
    speed, acceleration = 0.3 * 180.0, 180.0 / 0.25  # deg/s and deg/s^2, assumed of a joint without a document
    ramp = speed / acceleration
    assert moment(check, "above_limit") == pytest.approx(ramp + (far - speed * ramp / 2) / speed, abs=1e-6)


def test_a_joint_is_too_fast_from_when_its_ramp_comes_to_its_limit(tmp_path):
    fast = ROBOT.replace(speed=np.full(6, np.radians(100.0)))
    (tmp_path / "b.script").write_text("def b():\n  movej([1,-0.17,-0.17,0,-1.22,0], a=5, v=2.0)\nend\n")
    check = check_program(read_program(tmp_path / "b.script"), fast, CheckOptions(start=HOME))
    assert moment(check, "too_fast") == pytest.approx(np.radians(100.0) / 5, rel=1e-4)


@pytest.mark.parametrize(
    ("name", "code"), [("out_of_reach", "way_out_of_reach"), ("collision_with_table", "motion_collides")]
)
def test_what_a_line_meets_has_the_time_of_its_place(name, code):
    scene = load_scene(ROOT / "data/scenes/table_and_post.yaml")
    check = check_program(read_program(FAULTS / f"{name}.src"), ROBOT, CheckOptions(start=HOME, scene=scene))
    found = next(each for each in check.findings if each.finding.code == code)
    speed, acceleration = 0.2, 2.0  # m/s of the program's $VEL.CP; m/s^2 that are assumed
    way = getattr(found.finding, "touches", [found.finding])[0].at_mm / 1000
    assert way > speed**2 / acceleration / 2  # behind the ramp up
    assert found.moment == pytest.approx(way / speed + speed / acceleration / 2, abs=1e-4)
    assert check.execution.steps[found.step].place.line == found.place.line


def test_a_line_keeps_the_tool_on_its_way(tmp_path):
    T = forward(ROBOT, HOME)
    end = T.copy()
    end[:3, 3] += [0.05, 0.1, -0.05]
    check = checked(f"LIN {{X {1000 * end[0, 3]:.6f}, Y {1000 * end[1, 3]:.6f}, Z {1000 * end[2, 3]:.6f}}}", tmp_path)
    (motion,) = check.motions.values()
    points = forward(ROBOT, motion.path.q)[:, :3, 3]
    along = (points - T[:3, 3]) @ (end[:3, 3] - T[:3, 3]) / np.sum((end[:3, 3] - T[:3, 3]) ** 2)
    assert np.abs(T[:3, 3] + along[:, None] * (end[:3, 3] - T[:3, 3]) - points).max() < 1e-8
    assert along[0] == pytest.approx(0, abs=1e-8)
    assert along[-1] == pytest.approx(1, abs=1e-6)


def test_rates_of_a_line_are_those_of_its_way(tmp_path):
    """Against differences of joints that are solved on the line at the times of its trapezoid, by its own formula."""
    start = np.radians([10.0, -20.0, -15.0, 20.0, -60.0, 30.0])
    T = forward(ROBOT, start)
    way = np.array([0.05, 0.3, -0.15])
    limits = JointLimits(np.full(6, 1e-3), np.full(6, 1e-3), acceleration_assumed=False)
    words = ", ".join(f"{key} {1000 * value:.6f}" for key, value in zip("XYZ", T[:3, 3] + way))
    check = checked(f"$VEL.CP=1.0\n$ACC.CP=4.0\nLIN {{{words}}}", tmp_path, joint_limits=limits, start=start)
    speed, acceleration, length = 1.0, 4.0, np.linalg.norm(way)
    ramp, step = speed / acceleration, 2e-4
    duration = length / speed + ramp
    t = np.arange(0, duration, step)
    ahead = np.minimum(t, duration - t)
    done = np.where(ahead < ramp, acceleration * ahead**2 / 2, speed * (ahead - ramp / 2))
    share = np.where(t < duration / 2, done, length - done) / length
    poses = np.tile(T, (len(t), 1, 1))
    poses[:, :3, 3] += share[:, None] * way
    q = [start]
    for pose in poses:
        rows = inverse(ROBOT, pose, q[-1]).q
        q.append(rows[np.abs(rows - q[-1]).max(axis=1).argmin()])
    velocity = np.abs(np.diff(q[1:], axis=0)).max(axis=0) / step
    bend = np.abs(np.diff(q[1:], 2, axis=0)) / step**2
    smooth = (np.abs(t[1:-1] - ramp) > 2 * step) & (np.abs(t[1:-1] - duration + ramp) > 2 * step)
    found = {
        (each.finding.code, each.finding.joint): each.finding for each in check.findings if "oo_" in each.finding.code
    }
    for joint in range(1, 7):
        for code, most in (("too_fast", velocity), ("acceleration_too_great", bend[smooth].max(axis=0))):
            needed = np.radians(found[code, joint].needed.value)
            assert needed == pytest.approx(most[joint - 1], rel=0.01)


def test_the_branch_of_joint_angles_is_that_of_the_inverse():
    rng = np.random.default_rng(4)
    for q in rng.uniform(ROBOT.lower, ROBOT.upper, (50, 6)):
        found = inverse(ROBOT, forward(ROBOT, q), q)
        nearest = int(np.abs(found.q - q).max(axis=1).argmin())
        assert branch_of(ROBOT, q) == found.branch[nearest]
    assert len(set(branch_labels(ROBOT))) == 8


def test_whole_turns_and_configuration_changes_are_said(tmp_path):
    far = HOME.copy()
    far[5] = np.radians(190.0)
    near = HOME.copy()
    near[5] = np.radians(-10.0)
    check = checked(f"PTP {axes(near)}\nPTP {axes(far)}", tmp_path)
    turn = next(each.finding for each in check.findings if each.finding.code == "whole_turn")
    assert (turn.joint, round(turn.angle_deg), round(turn.nearest_deg)) == (6, 200, -160)


def test_a_zone_that_allows_a_collision_is_a_caution(tmp_path):
    T = forward(ROBOT, HOME)
    first, second = T.copy(), T.copy()
    first[:3, 3] += [0.0, 0.15, 0.0]
    second[:3, 3] += [-0.15, 0.15, 0.0]
    words = [", ".join(f"{k} {1000 * v:.3f}" for k, v in zip("XYZ", end[:3, 3])) for end in (first, second)]
    body = f"$APO.CDIS=70\nLIN {{{words[0]}}} C_DIS\nLIN {{{words[1]}}}"
    free = checked(body, tmp_path)
    assert "zone_collides" not in codes(free)
    assert min(motion.clearance for motion in free.motions.values()) > 0.05
    # The capsule of the last link meets a ball inside the corner, but not on the lines.
    cut = first[:3, 3] + 0.25 * (T[:3, 3] + second[:3, 3] - 2 * first[:3, 3])
    radius = max(each.radius for each in arm_shapes(ROBOT).capsules if each.link == 6)
    place = np.eye(4)
    place[:3, 3] = cut - [0.0, 0.0, radius + 0.012]
    scene = Scene("ball", (Sphere("ball", place, 0.015),))
    check = checked(body, tmp_path, scene=scene)
    assert "motion_collides" not in codes(check)
    assert "zone_collides" in codes(check)
    assert check.level == "caution"
    stop = checked(body.replace(" C_DIS", ""), tmp_path, scene=scene)
    assert "zone_collides" not in codes(stop)


def test_what_a_loop_finds_again_is_told_as_it_is_at_worst(tmp_path):
    deeper = "INT I\nDECL E6AXIS J\nJ={A1 0,A2 -10,A3 -10,A4 0,A5 0,A6 0}\nFOR I=1 TO 3\nPTP J\n"
    body = deeper + "IF I==2 THEN\nJ.A5=-140\nELSE\nJ.A5=-120\nENDIF\nPTP J\nENDFOR"
    below = next(each for each in checked(body, tmp_path).findings if each.finding.code == "below_limit")
    assert below.finding.reached_deg == pytest.approx(-140)


def test_a_loop_tells_each_pair_that_touches_in_any_round_as_deep_as_in_all(tmp_path):
    T = forward(ROBOT, HOME)
    radius = max(each.radius for each in arm_shapes(ROBOT).capsules if each.link == 6)

    def ball(name: str, aside: float, down: float) -> Sphere:
        place = np.eye(4)
        place[:3, 3] = T[:3, 3] + [0.0, aside, -down - radius]
        return Sphere(name, place, 0.02)

    scene = Scene("balls", (ball("near", 0.0, 0.1), ball("aside", 0.13, 0.15)))
    x, y, z = (1000 * T[:3, 3]).round(6)
    dips = f"INT I\nDECL FRAME F\nF={{X {x}, Y {y}, Z {z}, A 0, B 0, C 180}}\nFOR I=0 TO 1\n"
    check = checked(f"{dips}F.Z={z}-90-15*I\nLIN F\nF.Z={z}\nLIN F\nENDFOR", tmp_path, scene=scene)
    down = next(each for each in check.findings if each.finding.code == "motion_collides")
    (near,) = down.finding.touches
    assert near.depth_mm == pytest.approx(25, abs=0.5)
    assert near.at_mm == pytest.approx(80, abs=1)
    there = f"F.Y={y}+130*I\nLIN F\nF.Z={z}-90-50*I\nLIN F\nF.Z={z}\nLIN F"
    check = checked(f"{dips}{there}\nENDFOR", tmp_path, scene=scene)
    down = next(each for each in check.findings if each.finding.code == "motion_collides")
    assert [label_of(touch.pair).split("/")[-1] for touch in down.finding.touches] == ["near", "aside"]


def test_a_start_of_another_length_is_refused(tmp_path):
    with pytest.raises(ShapeError):
        checked("PTP {A1 10}", tmp_path, start=np.zeros(5))


@pytest.mark.long
@pytest.mark.parametrize(("suffix", "count"), [(".src", 4000), (".pgm", 5000)])
def test_a_long_program_has_a_verdict_for_each_line(suffix, count, tmp_path):
    angle = np.linspace(0, 60 * np.pi, count)
    x, y = 400 + 30 * np.cos(angle), 30 * np.sin(angle)
    x[-2] = 5000.0
    if suffix == ".src":
        lines = [f"LIN {{X {a:.3f},Y {b:.3f},Z 450,A 0,B 0,C 180}} C_DIS" for a, b in zip(x, y)]
        text = "\n".join(["DEF a( )", *lines, "END", ""])
    else:
        joints = [f"POINTJ({a:.4f},-10,-10,0,-70,0)" for a in x - 400]
        text = "\n".join(["", *(f"MJOINT({point}, v50perc, fine, tool0);" for point in joints)])
    (tmp_path / f"a{suffix}").write_text(text)
    check = check_program(read_program(tmp_path / f"a{suffix}"), ROBOT, CheckOptions(start=HOME))
    assert len(check.verdicts) == count
    assert {"target_out_of_reach", "way_out_of_reach", "above_limit"} & {
        each.finding.code for each in check.findings if each.place.line > 0.99 * count
    }


def stretches(folder, *lines):
    """The stretches of a URScript program from the home position, built, without the move to its beginning."""
    text = f"set_tcp(p[0,0,0,0,0,0])\nmovej({HOME_TEXT})\n" + "\n".join(lines) + "\n"
    found = check_text(folder, text, "a.script")
    parts, rest = parts_of(found, ROBOT, CommandSource(folder / "a.script", "a"))
    assert rest == ()
    return [build(ROBOT, part.made, {}) for part in parts], found


@pytest.mark.parametrize("start", [HOME, None])
def test_a_fault_at_a_motion_that_no_stretch_holds_goes_with_all_of_them(tmp_path, start):
    """It is on the other side of a branch, or behind a start that is not known; one of a stretch is not told twice."""
    beyond = f"movej({(HOME + 5 * np.eye(6)[0]).tolist()})"
    moves = f"  movej({HOME_TEXT})\n  movej({NEAR_TEXT})"
    body = f"{beyond}\n{moves}" if start is None else f"if get_digital_in(0):\n{moves}\nelse:\n  {beyond}\nend"
    found = check_text(tmp_path, f"set_tcp(p[0,0,0,0,0,0])\n{body}\n", "a.script", start=start)
    parts, _ = parts_of(found, ROBOT, CommandSource(tmp_path / "a.script", "a"))
    assert [[each.level for each in part.found if each.finding.code == "above_limit"] for part in parts] == [["fail"]]
    within = check_text(tmp_path, f"set_tcp(p[0,0,0,0,0,0])\nmovej({NEAR_TEXT})\n{beyond}\n", "a.script")
    ((held,), _) = parts_of(within, ROBOT, CommandSource(tmp_path / "a.script", "a"))
    assert "above_limit" not in {each.finding.code for each in held.found}


def test_joint_moves_of_a_stretch_keep_the_times_of_the_program(tmp_path):
    """1 rad at 1 rad/s and 1.4 rad/s2: 1 + 1/1.4 s; 0.1 rad at 0.02 rad/s and 0.5 rad/s2: 5 + 0.04 s."""
    fast, slow = HOME + np.eye(6)[0], HOME + 1.1 * np.eye(6)[0]
    moves = (f"movej({fast.tolist()}, a=1.4, v=1.0)", f"movej({slow.tolist()}, a=0.5, v=0.02)")
    (made,), _ = stretches(tmp_path, *moves)
    t = np.linspace(0, made.duration, 2001)
    speed = np.abs(made.joints.joints(t)[1][:, 0])
    assert made.duration == pytest.approx(1 + 1 / 1.4 + 5.04)
    assert speed[t < 1.7].max() == pytest.approx(1.0)
    assert speed[t > 1.72].max() == pytest.approx(0.02)


@pytest.mark.parametrize("speed", [0.1, 0.01])
def test_lines_of_a_stretch_keep_the_times_of_the_program(tmp_path, speed):
    """100 mm each at 0.1 m/s and 1 m/s2: 1.1 s from rest to rest, whatever rounds the corner between them."""
    poses = ("p[0.4,0,0.4,3.1,0,0]", "p[0.4,0,0.5,3.1,0,0]", "p[0.4,0.1,0.5,3.1,0,0]")
    speeds = (0.1, 0.1, speed)
    (made,), found = stretches(
        tmp_path, *(f"movel({pose}, a=1, v={v}, r={r})" for pose, v, r in zip(poses, speeds, (0, 0.02, 0)))
    )
    first = list(found.motions.values())[1].path.law.duration
    assert made.duration == pytest.approx(first + 1.1 + 0.1 / speed + speed)
    t = np.linspace(first + 1.2, made.duration, 2001)
    assert (made.tool.progress(t)[1] * made.tool.length).max() == pytest.approx(speed, rel=1e-3)


@pytest.mark.long
def test_turn_chooses_among_the_solutions_of_a_pose(tmp_path):
    T = forward(ROBOT, np.radians([10.0, -20.0, -15.0, 20.0, -60.0, 30.0]))
    inside = [q for q in inverse(ROBOT, T).q if ((q >= ROBOT.lower) & (q <= ROBOT.upper)).all()]
    turns = {sum(1 << i for i in range(6) if q[i] < 0) for q in inside}
    assert len(turns) > 1
    for turn in range(64):
        check = checked(f"PTP {frame(T)}".replace("}", f", S 0, T {turn}}}"), tmp_path)
        (motion,) = check.motions.values()
        refused = codes(check) & {"configuration_not_met", "above_limit", "below_limit"}
        assert bool(refused) == (turn not in turns)
        assert check.level != "pass" or turn in turns
        if turn in turns:
            assert sum(1 << i for i in range(6) if motion.end[i] < 0) == turn


def test_frames_make_targets_of_a_named_tool_and_base_known(tmp_path):
    body = "$TOOL=TOOL_DATA[3]\n$BASE=BASE_DATA[2]\nLIN {X 300, Y 50, Z 200, A 0, B 0, C 180}"
    unknown = checked(body, tmp_path)
    assert {each.finding.reason for each in unknown.findings if each.finding.code == "not_followed"} == {"tool"}
    assert [each.followed for each in unknown.verdicts] == [False]
    tool, base = np.eye(4), np.eye(4)
    tool[2, 3], base[2, 3] = 0.05, 0.1
    (motion,) = checked(body, tmp_path, frames={"TOOL_DATA[3]": tool, "BASE_DATA[2]": base}).motions.values()
    flange = forward(ROBOT, motion.end)
    np.testing.assert_allclose(flange[:3, 3], [0.3, 0.05, 0.3 + 0.05], atol=1e-6)


def test_targets_are_checked_though_there_is_no_time_for_proofs(tmp_path):
    near = [f"LIN {{X {300 + i},Y 0,Z 450,A 0,B 0,C 180}}" for i in range(6)]
    faults = ["LIN {X 3000,Y 0,Z 450,A 0,B 0,C 180}", "PTP {A1 500,A2 -10,A3 -10,A4 0,A5 -70,A6 0}", "PTP XNOWHERE"]
    body = "\n".join([f"PTP {axes(HOME)}", *near, *faults, near[0]])
    check = checked(body, tmp_path, keep_on=lambda: False)
    found = {(each.place.line, each.finding.code) for each in check.findings}
    assert {(14, "way_out_of_reach"), (15, "above_limit"), (16, "not_followed")} <= found


@pytest.mark.long
def test_a_round_of_a_loop_that_turns_the_wrist_on_leaves_its_limits(tmp_path):
    T = forward(ROBOT, HOME)
    turns = []
    for third in (1, 2, 3):
        turned = T.copy()
        turned[:3, :3] = T[:3, :3] @ Rotation.from_rotvec([0, 0, third * 2 * np.pi / 3]).as_matrix()
        turns.append(f"LIN {frame(turned)}")
    check = checked("LOOP\n" + "\n".join(turns) + "\nENDLOOP", tmp_path)
    assert {"above_limit", "below_limit"} & codes(check)


MM = "PROC main()\nMoveL [[0.38,0.18,0.22],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v200,fine,tool0;\nENDPROC\n"
KRL_FAST = "DEF a( )\n$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\n$VEL.CP={}\nLIN_REL {{Z -20}}\nEND\n"
OTHER_UNITS = {
    "deg": ("a.script", "movej([90,-90,45,-90,-90,0])\n"),
    "mm": ("a.script", "movel(p[380,180,220,0,3.14,0])\n"),
    "mm/s": ("a.src", KRL_FAST.format(200)),
    "m": ("a.mod", MM),
    "rad": ("a.src", "DEF a( )\nPTP {A1 0.4,A2 -0.43,A3 -0.37,A4 0,A5 -0.76,A6 -0.44}\nEND\n"),
    "": ("b.src", KRL_FAST.format(0.2)),
    "none": ("b.script", f"movej({HOME_TEXT})\n"),
}


@pytest.mark.parametrize("unit", OTHER_UNITS)
def test_a_number_in_another_unit_is_said_to_be_in_it(unit, tmp_path):
    name, text = OTHER_UNITS[unit]
    (tmp_path / name).write_text(text, encoding="utf-8")
    fast = ROBOT.replace(speed=np.radians([230.0, 200.0, 250.0, 320.0, 320.0, 420.0]))
    found = check_program(read_program(tmp_path / name), fast, CheckOptions(start=HOME, measures=False))
    units = {each.finding.kind for each in found.findings if each.finding.code == "suspect_number"}
    assert units == {unit} - {"", "none"}


@pytest.mark.parametrize(
    ("cause", "code", "passes"),
    [
        ("$VEL_AXIS[7]=50", "program_not_understood", True),
        ("$VEL_CP=0.5", "not_followed", False),
        ("moves_anything()", "not_followed", False),
    ],
)
def test_a_cause_is_one_finding_at_its_own_line(cause, code, passes, tmp_path):
    text = (
        f"DEF a( )\n$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\n{cause}\n$VEL_AXIS[1]=30\nPTP {axes(HOME)}\nPTP {{A1 5}}\nEND\n"
    )
    found = check_text(tmp_path, text, "a.src")
    named = [(each.finding.code, each.place.line) for each in found.findings if each.level in ("caution", "fail")]
    assert [each for each in named if each[0] != "way_not_known"] == [(code, 4)]
    last = next(each for each in found.verdicts if each.line == 7)
    assert (last.level == "pass") == (passes or cause == "moves_anything()")  # to where it is known to stand again


@pytest.mark.parametrize("end", [0.3, -0.3, 1.5, -1.5])
def test_turn_bits_say_nothing_of_a_joint_within_a_degree_of_0(end, tmp_path):
    q = np.radians([20.0, -10.0, -10.0, end, -70.0, 10.0])
    numbers = ",".join(f"{key} {value:.6f}" for key, value in zip("XYZABC", numbers_of(forward(ROBOT, q), "kuka")))
    turn = sum(1 << i for i, value in enumerate(q) if (value < 0) != (i == 3))  # the other side of 0 for joint 4
    text = f"DEF a( )\n$BASE=$NULLFRAME\nPTP {{{numbers},S 0,T {turn}}}\nEND\n"
    found = check_text(tmp_path, text, "a.src")
    assert any(each.finding.code == "configuration_not_met" for each in found.findings) == (abs(end) > 1)
