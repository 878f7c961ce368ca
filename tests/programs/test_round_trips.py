"""What is written is read back: texts are equal, joints and poses to the digits that are printed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.files.robot_library import load_robot
from er3a.finding import fact, is_one
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.planning.commands import (
    JointSequenceCommand,
    JointTableCommand,
    SegmentCommand,
    Start,
    ToolSequenceCommand,
    ToolTableCommand,
)
from er3a.planning.profiles import Times
from er3a.programs.from_commands import listing_of
from er3a.programs.instructions import ArmMotion, JointTarget, Listing, Output, Pause, PoseTarget, Rate, Remark, Zone
from er3a.programs.languages import execute, read_program, write_program
from er3a.programs.writing import HEAD, WriteOptions, with_head_lines

LANGUAGES = ("krl", "urscript", "rpl", "xpl", "rapid")
ROBOT = load_robot("er3a_c60")
PRINTED = {"krl": 1e-6, "rpl": 1e-6, "xpl": 1e-6, "rapid": 1e-6, "urscript": np.degrees(1e-9)}  # deg


def saved(folder, written):
    """The file of a program that was written, with those beside it."""
    paths = [folder / (written.name + suffix) for suffix in written.files]
    for path, text in zip(paths, written.files.values()):
        path.write_text(text, encoding="utf-8")
    return paths[0]


def read_back(folder, written):
    """A program that was written, run."""
    program = read_program(saved(folder, written))
    return execute(program, ROBOT)


def joints_inside(rng, count):
    """Random joints within the limits."""
    return rng.uniform(ROBOT.lower, ROBOT.upper, (count, 6))


def tool_path(bends: int = 0):
    """A start and lines and arcs that the arm can do."""
    q = np.radians([10.0, -20.0, 15.0, 5.0, -60.0, 20.0])
    T = forward(ROBOT, q)
    first, last = T.copy(), T.copy()
    first[:3, 3] += [0.03, 0.08, -0.02]
    first[:3, :3] = Rotation.from_rotvec([0.0, 0.1, 0.05]).as_matrix() @ T[:3, :3]
    last[:3, 3] += [0.0, 0.1, 0.0]
    via = first[:3, 3] + [0.0, 0.02, 0.03]
    parts = [SegmentCommand(first, blend=0.01), SegmentCommand(last, via=via, blend=0.0), SegmentCommand(T)]
    return q, ToolSequenceCommand(Start(joints=q), tuple(parts[: bends or None]), 5.0)


@pytest.mark.long
@pytest.mark.parametrize("language", LANGUAGES)
def test_joints_of_random_paths_come_back_to_the_digits_printed(language, tmp_path):
    rng = np.random.default_rng(7)
    for number in range(25):  # 200 paths in the long form below
        path = joints_inside(rng, int(rng.integers(2, 9)))
        listing = listing_of(JointSequenceCommand(path, 0.0, 4.0), ROBOT, path[0], f"path_{number}").listing
        execution = read_back(tmp_path, write_program(listing, language, WriteOptions(ROBOT)))
        visited = [each.target.joints for each in execution.listing().motions]
        np.testing.assert_allclose(np.degrees(visited), np.degrees(path), rtol=0, atol=PRINTED[language] * 0.51)


@pytest.mark.long
@pytest.mark.parametrize("language", LANGUAGES)
def test_joints_of_200_random_paths_come_back_to_the_digits_printed(language, tmp_path):
    rng = np.random.default_rng(8)
    for _ in range(200):
        path = joints_inside(rng, 4)
        listing = listing_of(JointSequenceCommand(path, 0.0, 4.0), ROBOT, path[0]).listing
        execution = read_back(tmp_path, write_program(listing, language, WriteOptions(ROBOT)))
        visited = [each.target.joints for each in execution.listing().motions]
        np.testing.assert_allclose(np.degrees(visited), np.degrees(path), rtol=0, atol=PRINTED[language] * 0.51)


@pytest.mark.parametrize("language", LANGUAGES)
def test_lines_and_arcs_are_written_read_and_written_again(language, tmp_path):
    q, command = tool_path()
    path = listing_of(command, ROBOT, q, "weld")
    written = write_program(path.listing, language, WriteOptions(ROBOT))
    execution = read_back(tmp_path, written)
    again = write_program(execution.listing(), language, WriteOptions(ROBOT))
    assert again.files == written.files
    kinds = [each.kind for each in execution.listing().motions]
    assert kinds[:2] == ["joint", "line"]
    assert ("arc" in kinds) == (language in ("krl", "urscript", "rapid"))


@pytest.mark.parametrize("language", LANGUAGES)
def test_lines_at_the_beginning_of_a_head_come_first_and_change_no_motion(language, tmp_path):
    q = np.radians([[0.0, -10, 15, 5, -60, 20], [3.0, -9, 15, 5, -60, 20]])
    lines = ["not confirmed: alpha 6", "no tool"]
    listing = listing_of(JointSequenceCommand(q, 0.0, 4.0), ROBOT, q[0], "p").listing
    texts = write_program(listing, language, WriteOptions(ROBOT, head=("path",))).files
    warned = {suffix: with_head_lines(text, lines) for suffix, text in texts.items()}
    told = next(iter(warned.values()))
    places = [told.index(f"{HEAD}{line}") for line in [*lines, "path"]]
    assert places == sorted(places)
    for name, files in (("plain", texts), ("warned", warned)):
        (tmp_path / name).mkdir()
        for suffix, text in files.items():
            (tmp_path / name / f"p{suffix}").write_text(text, encoding="utf-8")
    both = [read_program(tmp_path / name / f"p{next(iter(texts))}") for name in ("plain", "warned")]
    first, second = ([each for each in execute(it, ROBOT).listing().motions] for it in both)
    assert first == second != []


@pytest.mark.parametrize("language", ["krl", "urscript", "rapid"])
def test_poses_come_back_to_the_digits_printed(language, tmp_path):
    q, command = tool_path()
    path = listing_of(command, ROBOT, q)
    execution = read_back(tmp_path, write_program(path.listing, language, WriteOptions(ROBOT)))
    for wanted, found in zip(path.listing.motions, execution.listing().motions, strict=True):
        if isinstance(wanted.target, PoseTarget):
            np.testing.assert_allclose(found.target.pose, wanted.target.pose, atol=2e-8)
        if wanted.kind == "arc":
            np.testing.assert_allclose(found.via.pose[:3, 3], wanted.via.pose[:3, 3], atol=2e-9)


@pytest.mark.parametrize("language", ["rpl", "xpl"])
def test_arcs_become_lines_within_the_deviation_that_is_said(language, tmp_path):
    q, command = tool_path(2)
    path = listing_of(command, ROBOT, q)
    written = write_program(path.listing, language, WriteOptions(ROBOT))
    split = next(each for each in written.findings if is_one(each, "written_arcs_split"))
    assert split.arcs == 1
    text = next(iter(written.files.values()))
    assert f"1 arc(s) as {split.lines} lines that stay within 0.1 mm" in text
    moves = read_back(tmp_path, written).listing().motions
    ends = np.array([forward(ROBOT, each.target.joints)[:3, 3] for each in moves[-split.lines - 1 :]])
    start, via, end = ends[0], command.segments[1].via, ends[-1]
    a, b = via - start, end - start
    normal = np.cross(a, b)
    to_centre = np.cross((a @ a) * b - (b @ b) * a, normal) / (2 * normal @ normal)
    radius = np.linalg.norm(to_centre)
    middles = (ends[1:] + ends[:-1]) / 2
    for points in (ends, middles):
        off = np.abs(np.linalg.norm(points - start - to_centre, axis=1) - radius)
        assert off.max() < 1.01e-4
    assert (
        np.abs(np.linalg.norm(middles - start - to_centre, axis=1) - radius).max() > 0.25e-4
    )  # no more lines than need be


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_loop_for_ever_is_written_read_and_written_again(language, tmp_path):
    rng = np.random.default_rng(3)
    path = joints_inside(rng, 4)
    motions = [ArmMotion("joint", JointTarget(q), speed=Rate(0.5, "share")) for q in path]
    listing = Listing("palletise", (Remark("begin"), *motions[:2], Pause(0.5), *motions[2:]), repeats_from=2)
    written = write_program(listing, language, WriteOptions(ROBOT))
    execution = read_back(tmp_path, written)
    assert [each.kind for each in execution.endings] == ["joins"]
    back = execution.listing()
    assert back.repeats_from == 2 + len(written.findings)  # remarks of the head
    assert len(back.motions) == 4
    assert write_program(back, language, WriteOptions(ROBOT)).files == written.files


@pytest.mark.parametrize("language", LANGUAGES)
def test_timed_tables_become_points_and_their_halts_waits(language, tmp_path):
    q, _ = tool_path()
    T = forward(ROBOT, q)
    poses = np.repeat(T[None], 4, axis=0)
    poses[:, 0, 3] += [0.0, 0.02, 0.04, 0.04]
    poses[3, 1, 3] += 0.03
    timing = Times(np.array([0.0, 1.0, 2.0, 2.5, 3.0]), np.array([0, 1, 2, 2, 3]))
    command = ToolTableCommand(poses, ("a", "b", "c", "d"), timing, blend=0.005)
    listing = listing_of(command, ROBOT, q).listing
    assert [each.seconds for each in listing.instructions if isinstance(each, Pause)] == [0.5]
    assert [each.speed.value for each in listing.motions[1:]] == [1.0, 1.0, 0.5]
    assert [each.zone.kind for each in listing.motions] == ["fine", "distance", "fine", "fine"]
    found = read_back(tmp_path, write_program(listing, language, WriteOptions(ROBOT))).listing()
    assert [type(each) for each in found.instructions if not isinstance(each, Remark)] == [
        *(ArmMotion, ArmMotion, ArmMotion, Pause, ArmMotion)
    ]
    ends = [each.target for each in found.motions[1:]]
    points = [each.pose if isinstance(each, PoseTarget) else forward(ROBOT, each.joints) for each in ends]
    np.testing.assert_allclose(points, poses[1:], atol=1e-7)


def test_joint_tables_become_joint_moves():
    rng = np.random.default_rng(2)
    path = joints_inside(rng, 5)
    listing = listing_of(JointTableCommand(path, 4.0, 0.1), ROBOT, path[0]).listing
    assert [each.kind for each in listing.motions] == ["joint"] * 5
    np.testing.assert_array_equal([each.target.joints for each in listing.motions], path)
    assert sum(each.speed.value for each in listing.motions[1:]) == pytest.approx(4.0)


@pytest.mark.parametrize("kind", ["line", "arc", "table"])
@pytest.mark.parametrize("roll", [0.0, np.pi])
@pytest.mark.parametrize(("axis", "sense"), [(None, 1), (np.array([0.0, 0.0, -1.0]), -1)])
def test_a_turn_by_180_deg_is_written_in_two_halves_of_the_sense_that_is_asked(kind, roll, axis, sense):
    """Also of an arm that hangs from a ceiling, whose own base is the other way up than the path's frame."""
    q, robot = np.radians([0.0, -20.0, 15.0, 0.0, -60.0, 0.0]), ROBOT.replace(base=transform(np.zeros(3), [roll, 0, 0]))
    T = forward(robot, q)
    end = T.copy()
    end[:3, :3] = Rotation.from_rotvec([0, 0, np.pi]).as_matrix() @ T[:3, :3]
    end[:3, 3] += [0.0, 0.04, 0.0]
    via = T[:3, 3] + [0.02, 0.02, 0.0] if kind == "arc" else None
    command = ToolSequenceCommand(Start(joints=q), (SegmentCommand(end, via, axis),), 2.0)
    if kind == "table":
        command = ToolTableCommand(np.array([T, end]), ("a", "b"), 2.0, half_turn_axis=axis)
    path = listing_of(command, robot, q)
    assert path.findings == (fact("written_half_turns_split", lines=1),)
    half, rest = path.listing.motions[1:]
    middle = robot.base @ half.target.pose
    turn = Rotation.from_matrix(middle[:3, :3] @ T[:3, :3].T).as_rotvec()
    np.testing.assert_allclose(turn, [0, 0, sense * np.pi / 2], atol=1e-9)
    np.testing.assert_allclose(robot.base @ rest.target.pose, end, atol=1e-12)
    assert (half.speed.value, rest.speed.value) == (1.0, 1.0)
    for point in [half.target, half.via, rest.via] if kind == "arc" else []:
        place = (robot.base @ point.pose)[:3, 3]
        np.testing.assert_allclose(np.linalg.norm(place - T[:3, 3] - [0, 0.02, 0]), 0.02, atol=1e-12)


@pytest.mark.parametrize(("axis", "sense"), [(None, 1), (np.array([0.0, 0.0, -1.0]), -1)])
def test_so_is_one_of_an_arc_or_of_a_table(axis, sense):
    q = np.radians([0.0, -20.0, 15.0, 0.0, -60.0, 0.0])
    T = forward(ROBOT, q)
    end = T.copy()
    end[:3, :3] = Rotation.from_rotvec([0, 0, np.pi]).as_matrix() @ T[:3, :3]
    end[:3, 3] += [0.0, 0.06, 0.0]
    arc = SegmentCommand(end, T[:3, 3] + [0.03, 0.03, 0.0], axis)
    table = ToolTableCommand(np.stack([T, end]), ("row 2", "row 3"), 2.0, half_turn_axis=axis)
    for command, points in (
        (ToolSequenceCommand(Start(joints=q), (arc,), 2.0), [[0.03, 0.03, 0]]),
        (table, [[0, 0.03, 0]]),
    ):
        path = listing_of(command, ROBOT, q)
        assert path.findings == (fact("written_half_turns_split", lines=1),)
        _, first, second = path.listing.motions
        turn = Rotation.from_matrix(first.target.pose[:3, :3] @ T[:3, :3].T).as_rotvec()
        np.testing.assert_allclose(turn, [0, 0, sense * np.pi / 2], atol=1e-9)
        np.testing.assert_allclose(first.target.pose[:3, 3] - T[:3, 3], points[0], atol=1e-9)
        np.testing.assert_array_equal(second.target.pose, end)
        assert (first.speed.value, second.speed.value) == (1.0, 1.0)
        if first.via is not None:
            spoke = 0.03 * np.sqrt(0.5)
            np.testing.assert_allclose(first.via.pose[:3, 3] - T[:3, 3], [spoke, 0.03 - spoke, 0], atol=1e-9)


def test_what_a_language_has_no_equal_for_is_said_in_the_head():
    rng = np.random.default_rng(5)
    a = joints_inside(rng, 1)[0]
    b = 0.9 * a
    moves = (
        ArmMotion("joint", JointTarget(a), speed=Rate(3.0, "share"), zone=Zone("angle", 0.1)),
        ArmMotion("joint", JointTarget(b), speed=Rate(2.0, "s")),
        Output("io.DOut[3]", "TRUE"),
    )
    listing = Listing("mixed", moves, language="rpl")
    written = write_program(listing, "krl", WriteOptions(ROBOT))
    assert written.findings == (
        *(
            fact("written_zones_dropped", zones=1),
            fact("written_speeds_estimated", motions=1),
            fact("written_speeds_cut", motions=1),
        ),
        *(
            fact("written_not_translated", instructions=1),
            fact("written_speeds_of_assumed", motions=1, assumed="100 deg/s"),
        ),
    )
    head = written.files[".src"].split("BAS(")[0]
    for words in ("zone(s)", "duration(s)", "above 100 %, which", "an assumed 100 deg/s", "other language"):
        assert words in head
    rpl = write_program(Listing("mixed", moves[1:2]), "rpl", WriteOptions(ROBOT, start=a))
    assert {each.code for each in rpl.findings} == {
        "written_speeds_estimated",
        "written_speeds_of_assumed",
        "written_values_rounded",
    }
    slow = write_program(Listing("slow", (replace(moves[1], speed=Rate(9000.0, "s")),)), "rpl", WriteOptions(ROBOT, a))
    assert {each.code for each in slow.findings} == {
        "written_speeds_estimated",
        "written_speeds_of_assumed",
        "written_speeds_raised",
    }
    assert "FASTER than what was checked" in slow.files[".pgm"]
    narrow = ArmMotion("joint", JointTarget(a), speed=Rate(0.5, "share"), zone=Zone("distance", 0.0))
    rapid = write_program(Listing("narrow", (narrow,)), "rapid", WriteOptions(ROBOT))
    assert (rapid.findings, ",vmax,fine," in rapid.files[".mod"]) == ((fact("written_zones_dropped", zones=1),), True)


def test_branches_and_external_axes_that_are_left_out_are_said_in_the_head(tmp_path):
    text = (
        "DEF a( )\nPTP {E6AXIS: A1 5,A2 -10,A3 -10,A4 0,A5 -70,A6 0,E1 100}\nIF $IN[1] THEN\nPTP {A1 9}\nENDIF\nEND\n"
    )
    (tmp_path / "a.src").write_text(text)
    listing = execute(read_program(tmp_path / "a.src"), ROBOT).listing()
    written = write_program(listing, "urscript", WriteOptions(ROBOT))
    assert {fact("written_one_side", branches=1), fact("written_external_axes_dropped", motions=1)} <= set(
        written.findings
    )
    head = written.files[".script"].split("movej")[0]
    assert "1 branch(es) of which one side alone" in head
    assert "without their external axes" in head


def test_only_an_assumed_speed_that_decides_is_named():
    """J1 alone moves by 1 rad: in 1 s at 1 / 1.25 of what it can do, whatever the others can."""
    known = ROBOT.replace(speed=np.array([1.25, *[np.nan] * 5]))
    turn = ArmMotion("joint", JointTarget(np.eye(6)[0]), speed=Rate(1.0, "s"))
    first = write_program(Listing("turn", (turn,)), "krl", WriteOptions(known, np.zeros(6)))
    assert (first.findings, "BAS(#VEL_PTP,80.0)" in first.files[".src"]) == (
        (fact("written_speeds_estimated", motions=1),),
        True,
    )
    own = WriteOptions(ROBOT, np.zeros(6), assumed_speed=np.radians([180, 180, 180, 360, 360, 360]))
    fast = replace(turn, speed=Rate(1 / np.radians(0.95 * 180), "s"))
    second = write_program(Listing("turn", (fast,)), "krl", own)
    assert second.findings == (
        fact("written_speeds_estimated", motions=1),
        fact("written_speeds_of_assumed", motions=1, assumed="180 deg/s"),
    )
    assert "BAS(#VEL_PTP,95.0)" in second.files[".src"]
    half = Listing("half", (replace(turn, speed=Rate(0.5, "share")),), language="krl")
    assert write_program(half, "krl", own).findings == ()
    invented = write_program(half, "urscript", own)
    assert (invented.findings, "v=1.570796" in invented.files[".script"]) == (
        (fact("written_speeds_of_assumed", motions=1, assumed="180 deg/s"),),
        True,
    )


def test_a_pose_without_an_arm_is_left_out_where_joints_are_written():
    listing = Listing("poses", (ArmMotion("line", PoseTarget(np.eye(4))),))
    assert fact("written_targets_left_out", motions=1) in write_program(listing, "rpl").findings
    assert "LIN {X 0.000000" in write_program(listing, "krl").files[".src"]


def test_no_configuration_is_ever_guessed():
    q, command = tool_path()
    listing = listing_of(command, ROBOT, q).listing
    for language in LANGUAGES:
        text = "".join(write_program(listing, language, WriteOptions(ROBOT)).files.values())
        assert "CFG" not in text
        assert ",S " not in text
        assert ",T " not in text


def test_tools_are_written_as_each_language_has_them(tmp_path):
    tool = np.eye(4)
    tool[:3, 3] = [0.0, 0.01, 0.12]
    robot = ROBOT.replace(tool=tool)
    q, _ = tool_path()
    end = forward(robot, q)
    end[0, 3] += 0.02
    command = ToolSequenceCommand(Start(joints=q), (SegmentCommand(end),), 2.0)
    listing = listing_of(command, robot, q).listing
    krl = write_program(listing, "krl", WriteOptions(robot))
    assert "$TOOL={FRAME: X 0.000000,Y 10.000000,Z 120.000000" in krl.files[".src"]
    ur = write_program(listing, "urscript", WriteOptions(robot))
    assert "set_tcp(p[0.000000000, 0.010000000, 0.120000000" in ur.files[".script"]
    rpl = write_program(listing, "rpl", WriteOptions(robot))
    assert any(is_one(each, "written_tool_not_given") for each in rpl.findings)
    for written in (krl, ur):
        moves = execute(read_program(saved(tmp_path, written)), robot).listing().motions
        np.testing.assert_allclose(moves[1].tool.pose, tool, atol=1e-9)
        np.testing.assert_allclose(moves[1].target.pose, end, atol=2e-8)


def wound_path(count):
    """Joints near enough to each other to be one branch, and their poses."""
    rng = np.random.default_rng(11)
    q = np.radians([10.0, -20.0, 15.0, 5.0, -60.0, 20.0]) + np.cumsum(rng.uniform(-0.01, 0.01, (count, 6)), axis=0)
    return q, forward(ROBOT, q)


@pytest.mark.long
@pytest.mark.parametrize("language", ["rpl", "xpl"])
def test_joints_of_a_long_table_of_poses_are_those_it_was_made_of(language, tmp_path):
    q, poses = wound_path(2500)  # more than are solved at once
    command = ToolTableCommand(poses, tuple(map(str, range(len(q)))), 100.0, blend=0.0)
    listing = listing_of(command, ROBOT, q[0]).listing
    moves = read_back(tmp_path, write_program(listing, language, WriteOptions(ROBOT))).listing().motions
    np.testing.assert_allclose(np.degrees([each.target.joints for each in moves]), np.degrees(q), rtol=0, atol=1e-6)


def test_poses_that_are_written_as_poses_need_no_inverse(monkeypatch):
    q, poses = wound_path(50)
    listing = listing_of(ToolTableCommand(poses, tuple(map(str, range(50))), 9.0, blend=0.001), ROBOT, q[0]).listing
    wanted = {language: write_program(listing, language, WriteOptions(ROBOT)).files for language in LANGUAGES[:2]}
    monkeypatch.setattr("er3a.programs.solving.inverse_batch", None)
    for language, files in wanted.items():
        assert write_program(listing, language, WriteOptions(ROBOT)).files == files


def test_a_table_that_leaves_the_reach_is_left_out_from_there_and_said():
    q, poses = wound_path(30)
    poses = poses.copy()
    poses[20, 0, 3] += 5.0
    listing = listing_of(ToolTableCommand(poses, tuple(map(str, range(30))), 9.0, blend=0.0), ROBOT, q[0]).listing
    written = write_program(listing, "rpl", WriteOptions(ROBOT))
    assert fact("written_targets_left_out", motions=1) in written.findings
    assert written.files[".pgm"].count("MLIN(POINTJ") == 28
