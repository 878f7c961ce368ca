"""What a program leaves to the controller, to the cell or to its next start: it is followed, or noted with the verdict.

Expected times and joints are worked out by hand in the comments.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.geometry.transforms import rotation_angle, transform
from er3a.kinematics.forward import forward
from er3a.planning.commands import CommandSource
from er3a.program_check.check_program import CheckOptions, check_program, parts_of
from er3a.programs.instructions import JointTarget, PoseTarget
from er3a.programs.languages import files_of, read_program, write_program
from er3a.programs.machine import execute
from er3a.programs.writing import WriteOptions
from testing.program_texts import (
    FRAMES,
    HOME,
    HOME_TEXT,
    NEAR,
    NEAR_TEXT,
    ROBOT,
    axes,
    check,
    codes,
    krl,
    motions,
    written,
)

SPEEDS = "$VEL.CP=0.1\n$ACC.CP=0.2\n$VEL_AXIS[1]=10\n"
POSE = "{X 400,Y 0,Z 300,A %g,B 180,C 0}"
NONE = "[9E9,9E9,9E9,9E9,9E9,9E9]"
AT_START = f"MoveAbsJ [[0,-10,-10,0,-70,0],{NONE}],v50,fine,tool0;\nConfL\\Off;\n"
TARGET = f"CONST robtarget p:=[[400,0,300],[0,1,0,0],[0,0,0,0],{NONE}];\n"


def rapid(body: str, data: str = "", more: str = "") -> str:
    """A module whose main begins at the home position."""
    return f"MODULE a\n{TARGET}{data}\nPROC main()\n{AT_START}{body}\nENDPROC\n{more}\nENDMODULE\n"


def with_data(folder, body: str, data: str, **options):
    """The check of a KRL program whose .dat has these lines."""
    (folder / "a.dat").write_text(f"DEFDAT a PUBLIC\n{data}\nENDDAT\n")
    return check(folder, krl(FRAMES + SPEEDS + body), "a.src", **options)


def joints(folder, body: str, more: str = "") -> list[float]:
    """Where joint 1 goes, deg, on each motion of a KRL program."""
    found = motions(folder, krl(body, more), "a.src")
    return [float(np.degrees(each.target.joints[0])) for each in found if isinstance(each.target, JointTarget)]


@pytest.mark.parametrize(
    ("settings", "turn", "seconds"),
    [
        # about the base's z, which is across the tool's x axis: ORI1; 60 deg at 20 deg/s, ramps of 1 s
        ("$VEL.ORI1=20\n$VEL.ORI2=200\n$ACC.ORI1=20\n$ACC.ORI2=200", (60, 0), 4.0),
        # 60 deg about the tool's own x axis: ORI2
        ("$VEL.ORI1=200\n$VEL.ORI2=30\n$ACC.ORI1=200\n$ACC.ORI2=30", (0, 60), 3.0),
        ("$VEL={CP 0.1,ORI1 20,ORI2 200}\n$ACC={CP 0.2,ORI1 20,ORI2 200}", (60, 0), 4.0),
        # the path takes longer: 100 mm at 100 mm/s, ramps of 0.5 s
        ("$VEL.ORI1=200\n$VEL.ORI2=200\n$ACC.ORI1=2000\n$ACC.ORI2=2000", (10, 0), 1.5),
    ],
)
def test_a_line_of_krl_takes_as_long_as_its_path_or_as_its_turn(tmp_path, settings, turn, seconds):
    a, c = turn
    way = (
        f"LIN_REL {{Y 100,A {a}}}"
        if seconds == 1.5
        else f"LIN_REL {{A {a},C {c}}} #TOOL"
        if c
        else f"LIN_REL {{A {a}}}"
    )
    found = check(tmp_path, krl(f"{FRAMES}{SPEEDS}{settings}\nLIN {POSE % 0}\n{way}"), "a.src")
    assert list(found.motions.values())[-1].way.law.duration == pytest.approx(seconds)
    assert "turn_speed_not_given" not in {each.finding.code for each in found.findings if each.place.line > 8}


def test_a_turn_at_the_speed_that_is_set_is_too_fast_for_a_joint(tmp_path):
    """60 deg of axis 6 at 1000 deg/s; the program passed while turns were timed by $VEL.CP."""
    fast = "$VEL.ORI1=1000\n$VEL.ORI2=1000\n$ACC.ORI1=10000\n$ACC.ORI2=10000"
    found = check(tmp_path, krl(f"{FRAMES}{SPEEDS}{fast}\nLIN {POSE % 0}\nLIN {POSE % 60}"), "a.src")
    assert {"faster_than_assumed", "too_fast"} & codes(found).keys()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.src", krl(f"{FRAMES}{SPEEDS}LIN_REL {{A 5}}")),
        ("a.src", krl(f"{FRAMES}{SPEEDS}SLIN_REL {{A 5}}")),
        (
            "a.script",
            "def a():\n set_tcp(p[0,0,0,0,0,0])\n movel(pose_trans(get_actual_tcp_pose(), p[0,0,0,0,0,0.1]))\nend\n",
        ),
        (
            "a.pgm",
            "MLIN(POINTC(400,0,400,0,0,180), v50, fine, tool0);\nMLIN(POINTC(400,0,400,9,0,180), v50, fine, tool0);\n",
        ),
    ],
)
def test_where_a_turn_decides_and_has_no_speed_the_assumed_one_is_told(tmp_path, name, text):
    found = check(tmp_path, text, name)
    noted = [each for each in found.findings if each.finding.code == "turn_speed_not_given"]
    assert [each.level for each in noted][-1:] == ["note"]
    speed = {"a.src": 0.1, "a.script": 0.25, "a.pgm": 0.05}[name]
    assert noted[-1].finding.assumed_deg_s == pytest.approx(np.degrees(speed / 0.1))  # as 0.1 m of the path


def test_a_turning_speed_that_is_not_known_is_a_caution_where_the_turn_decides(tmp_path):
    body = f"{FRAMES}{SPEEDS}$VEL.ORI1=$ANIN[1]\n$VEL.ORI2=50\n"
    found = check(tmp_path, krl(f"{body}LIN_REL {{A 5}}"), "a.src")
    assert [each.level for each in found.findings if each.finding.code == "turn_speed_not_given"] == ["caution"]
    assert "turn_speed_not_given" not in codes(check(tmp_path, krl(f"{body}LIN_REL {{Z 5}}"), "a.src"))


@pytest.mark.parametrize("word", ["$VEL.CP={}", "BAS(#VEL_CP,{})", "WITH"])
@pytest.mark.parametrize(("speed", "told"), [(250, True), (5, True), (3, False), (0.25, False)])
def test_a_speed_along_the_path_that_no_controller_takes_is_a_caution(tmp_path, word, speed, told):
    """250 is mm/s, typed where m/s are meant."""
    line = f"SLIN_REL {{Z 5}} WITH $VEL.CP={speed}" if word == "WITH" else f"{word.format(speed)}\nLIN_REL {{Z 5}}"
    found = check(tmp_path, krl(f"{FRAMES}{SPEEDS}{line}"), "a.src")
    assert [each.level for each in found.findings if each.finding.code == "speed_not_given"] == ["caution"] * told


@pytest.mark.parametrize(
    ("name", "text", "kind"),
    [
        ("a.src", krl(f"{SPEEDS}LIN_REL {{Z 5}}\nLIN_REL {{Z -5}}"), "both"),
        ("a.src", krl(f"$BASE=$NULLFRAME\n{SPEEDS}PTP {axes(NEAR)}\nLIN_REL {{Z 5}}"), "tool"),
        ("a.src", krl(f"$TOOL=$NULLFRAME\n{SPEEDS}LIN_REL {{Z 5}}"), "base"),
        ("a.src", krl(f"{FRAMES}{SPEEDS}LIN_REL {{Z 5}}"), None),
        ("a.src", krl(f"{SPEEDS}PTP {axes(NEAR)}"), None),
        ("a.script", "def a():\n movel(p[0.4,0,0.4,3.1,0,0])\nend\n", "tool"),
        ("a.script", f"def a():\n movel({HOME_TEXT})\nend\n", "tool"),
        ("a.script", f"def a():\n movej({HOME_TEXT})\nend\n", None),
        ("a.script", "def a():\n set_tcp(p[0,0,0,0,0,0])\n movel(p[0.4,0,0.4,3.1,0,0])\nend\n", None),
    ],
)
def test_a_tool_and_a_base_that_a_program_does_not_set_are_told_once(tmp_path, name, text, kind):
    noted = [each for each in check(tmp_path, text, name).findings if each.finding.code == "frames_from_robot_file"]
    assert [(each.finding.kind, each.level) for each in noted] == ([] if kind is None else [(kind, "note")])


@pytest.mark.parametrize(
    ("read", "condition", "both"),
    [
        ("get_actual_joint_positions()", "q[0] == 0", True),
        ("get_actual_joint_positions()", "q[0] <= 0", True),
        ("get_actual_joint_positions()", "q[0] <= 0.01", False),
        ("get_target_joint_positions()", "q[0] == 0", False),
        ("get_actual_tool_flange_pose()", "q[1] <= 0", True),
        ("get_actual_tool_flange_pose()", "q[1] < 0.1", False),
    ],
)
def test_what_is_measured_is_not_exact(tmp_path, read, condition, both):
    text = f"def a():\n movej({HOME_TEXT})\n q = {read}\n if {condition}:\n movej({NEAR_TEXT})\n end\nend\n"
    assert ("both_sides_checked" in codes(check(tmp_path, text, "a.script"))) == both


@pytest.mark.parametrize(
    ("begin", "end"),
    [
        ("force_mode(p[0,0,0,0,0,0],[0,0,1,0,0,0],[0,0,10,0,0,0],2,[1,1,1,1,1,1])", "end_force_mode()"),
        ("path_offset_enable()", "path_offset_disable()"),
        ("track_conveyor_linear(p[1,0,0,0,0,0],500)", "stop_conveyor_tracking()"),
    ],
)
def test_what_changes_every_motion_until_it_is_ended_stays_in_doubt_until_then(tmp_path, begin, end):
    moves = f"movej({HOME_TEXT})\nmovej({NEAR_TEXT})\n"
    text = f"{begin}\nset_tcp(p[0,0,0,0,0,0])\n{moves}{end}\n{moves}"
    assert codes(check(tmp_path, text, "a.script"))["frames_in_doubt"] == [3, 4]


def test_where_force_mode_leads_the_arm_is_not_known(tmp_path):
    begin = "force_mode(p[0,0,0,0,0,0],[0,0,1,0,0,0],[0,0,10,0,0,0],2,[1,1,1,1,1,1])"
    read = "q = get_actual_joint_positions()"
    text = f"{begin}\nset_tcp(p[0,0,0,0,0,0])\nmovej({HOME_TEXT})\n{read}\nend_force_mode()\nmovej({NEAR_TEXT})\n"
    found = codes(check(tmp_path, f"{text}movej(q)\n", "a.script"))
    assert found["way_not_known"] == [3, 6]
    assert found["target_not_given"] == [7]
    assert codes(check(tmp_path, f"{begin}\nsleep(1)\nend_force_mode()\n", "a.script"))["may_move"] == [1]


LIFT = f"if here[2] > 0.3:\n movej({NEAR_TEXT})\nend\nmovej({HOME_TEXT})"
ROBOT_TCP = "set_tcp(p[0,0,0,0,0,0])"


@pytest.mark.parametrize(
    ("body", "told"),
    [
        (f"here = get_actual_tcp_pose()\n{LIFT}", [("frames_decide", "caution", 3)]),
        (f"here = get_forward_kin()\n{LIFT}", [("frames_decide", "caution", 3)]),
        (f"z = get_tcp_offset()\nhere = z\n{LIFT}", [("frames_decide", "caution", 3)]),
        (f"{LIFT.replace('here', 'get_target_tcp_pose()')}", [("frames_decide", "caution", 3)]),
        (f"{ROBOT_TCP}\nhere = get_actual_tcp_pose()\n{LIFT}", []),
        (f"here = get_actual_tool_flange_pose()\n{LIFT}", []),
        (f"here = get_forward_kin({NEAR_TEXT}, p[0,0,0,0,0,0])\n{LIFT}", []),
        ("here = get_actual_tcp_pose()\ntextmsg(here)\nif here[2] > 0.3:\n textmsg(1)\nend", []),
        (
            "here = get_actual_tcp_pose()\nmovej([here[2], -0.2, -0.2, 0, -1.2, 0])",
            [("frames_from_robot_file", "note", 3)],
        ),
    ],
)
def test_a_pose_that_is_read_with_a_tool_that_is_not_set_and_decides_is_no_pass(tmp_path, body, told):
    found = check(tmp_path, f"def a():\n movej({HOME_TEXT})\n{body}\nend\n", "a.script")
    of_frames = ("frames_decide", "frames_from_robot_file")
    said = [
        (each.finding.code, each.level, each.place.line) for each in found.findings if each.finding.code in of_frames
    ]
    assert said == told
    course = [each.place.line for each in found.not_examined if each.what == "course"]
    assert course == [line for code, _, line in told if code == "frames_decide"]


def test_a_routine_that_decides_by_where_the_tool_is_is_told_where_that_is_read(tmp_path):
    low = "def low():\n here = get_actual_tcp_pose()\n return here[2] < 0.3\nend\n"
    text = f"def a():\n{low} if low():\n movej({NEAR_TEXT})\nend\n movej({HOME_TEXT})\nend\n"
    assert codes(check(tmp_path, text, "a.script")).get("frames_decide") == [3]
    body = f"XP=$POS_ACT\nIF XP.Z>300 THEN\nPTP {axes(NEAR)}\nENDIF\nPTP {axes(HOME)}"
    for set_before, told in (("", "both"), ("$TOOL=$NULLFRAME\n", "base"), (FRAMES, None)):
        found = check(tmp_path, krl(f"DECL POS XP\n{set_before}{SPEEDS}{body}"), "a.src").findings
        kinds = [each.finding.kind for each in found if each.finding.code == "frames_decide"]
        assert kinds == ([] if told is None else [told])


@pytest.mark.parametrize("used", [True, False])
def test_a_frame_that_program_and_cell_give_differently_is_told_where_it_is_used(tmp_path, used):
    (tmp_path / "$config.dat").write_text(
        "DEFDAT $CONFIG\nDECL FRAME BASE_DATA[32]\nBASE_DATA[1]={X 10,Y 0,Z 0,A 0,B 0,C 0}\nENDDAT\n"
    )
    text = krl(f"$TOOL=$NULLFRAME\n$BASE={'BASE_DATA[1]' if used else '$NULLFRAME'}\n{SPEEDS}LIN {POSE % 0}")
    given = {"BASE_DATA[1]": transform(np.array([0.01, 0.0, -0.1]), np.radians([0, 0, 2.0]))}
    found = check(tmp_path, text, "a.src", frames=given)
    noted = [each for each in found.findings if each.finding.code == "frame_given_twice"]
    assert [each.place.file.name for each in noted] == (["$config.dat"] if used else [])
    for each in noted:
        assert each.level == "caution"
        assert (each.finding.moved_mm, each.finding.turned_deg) == (pytest.approx(100.0), pytest.approx(2.0))


def test_a_tool_of_rapid_that_the_cell_gives_otherwise_is_told(tmp_path):
    data = "PERS tooldata t1:=[TRUE,[[0,0,10],[1,0,0,0]],[1,[0,0,10],[1,0,0,0],0,0,0]];"
    (tmp_path / "a.mod").write_text(rapid("MoveL p,v100,fine,t1;", data))
    for moved, noted in ((0.05, [3]), (0.01, [])):
        options = CheckOptions(
            start=HOME, measures=False, frames={"t1": transform(np.array([0, 0, moved]), np.zeros(3))}
        )
        found = check_program(read_program(tmp_path / "a.mod"), ROBOT, options)
        assert codes(found).get("frame_given_twice", []) == noted


@pytest.mark.parametrize(
    ("data", "body", "lines"),
    [
        ("INT N=0", "N=N+30\nPTP {A1 N}", [7]),
        ("INT N=0", "N=0\nN=N+30\nPTP {A1 N}", []),  # set before it is read
        ("INT N=0", "PTP {A1 5}\n$OUT[1]=N>3\nN=N+1", []),  # decides no motion
        ("INT N=0", "IF N>3 THEN\n$OUT[1]=TRUE\nENDIF\nPTP {A1 5}\nN=N+1", []),
        ("BOOL B=TRUE", "IF B THEN\nPTP {A1 5}\nENDIF\nB=FALSE", [10]),
        ("BOOL B=TRUE", "B=FALSE\nIF B THEN\nPTP {A1 5}\nENDIF\nPTP {A1 9}\nB=TRUE", []),
        ("E6AXIS X={A1 0,A2 -10,A3 -10,A4 0,A5 -70,A6 0}", "X={A1 5,A2 -10,A3 -10,A4 0,A5 -70,A6 0}\nPTP X", []),
        ("E6AXIS X={A1 0,A2 -10,A3 -10,A4 0,A5 -70,A6 0}", "X.A1=X.A1+5\nPTP X", [7]),
        ("INT N=0", "LOOP\nPTP {A1 N}\nN=5-N\nENDLOOP", []),  # which has no end
        ("INT N=0", "PTP {A1 N}\nLOOP\nN=5\nPTP {A1 9}\nENDLOOP", [9]),  # but another beginning
        ("INT N=0", "IF $IN[1] THEN\nN=0\nENDIF\nPTP {A1 N}\nN=5", [8]),  # on the way that does not set it
    ],
)
def test_a_variable_that_decides_motions_and_keeps_its_value_to_the_next_start_is_no_pass(tmp_path, data, body, lines):
    found = with_data(tmp_path, body, f"DECL {data}")
    assert codes(found).get("kept_to_next_start", []) == lines
    assert [(each.place.line, each.what) for each in found.not_examined if lines] == [(n, "course") for n in lines]


def test_a_module_variable_of_rapid_keeps_its_value_to_the_next_cycle(tmp_path):
    found = check(tmp_path, rapid("MoveL Offs(p,n*30,0,0),v100,fine,tool0;\nn:=n+1;", "VAR num n:=0;"), "a.mod")
    assert codes(found)["kept_to_next_start"] == [8]
    local = rapid("n:=0;\nMoveL Offs(p,n*30,0,0),v100,fine,tool0;\nn:=n+1;", "VAR num n:=0;")
    assert "kept_to_next_start" not in codes(check(tmp_path, local, "a.mod"))


@pytest.mark.parametrize(("kind", "lines"), [("PERS", [9]), ("VAR", [])])
def test_of_an_endless_program_of_rapid_data_that_persist_keep_their_value_to_the_next_start(tmp_path, kind, lines):
    """A VAR has its first value again where the program pointer is set to main."""
    body = "MoveL Offs(p,n*30,0,0),v100,fine,tool0;\nWHILE TRUE DO\nn:=1;\nMoveL p,v100,fine,tool0;\nENDWHILE"
    found = check(tmp_path, rapid(body, f"{kind} num n:=0;"), "a.mod")
    assert codes(found).get("kept_to_next_start", []) == lines


LATER = "GLOBAL DEF work( )\n{wait}PTP {{A1 30}}\nEND\n"
BUSY = "WHILE GO==FALSE\nWAIT SEC 0.1\nENDWHILE\n"


@pytest.mark.parametrize("inside", [False, True])
def test_a_loop_that_only_another_task_ends_is_told_and_what_comes_behind_it_is_checked(tmp_path, inside):
    (tmp_path / "work.src").write_text(LATER.format(wait=BUSY if inside else ""))
    body = "PTP {A1 5}\n" + ("" if inside else BUSY) + "work( )"
    found = with_data(tmp_path, body, "DECL GLOBAL BOOL GO=FALSE")
    waits = [each for each in found.findings if each.finding.code == "waits_for_others"]
    assert [(each.level, each.place.file.name) for each in waits] == [("caution", "work.src" if inside else "a.src")]
    assert [each.what for each in found.not_examined] == ["course"]
    assert [(each.place.file.name, each.times) for each in found.verdicts] == [("a.src", 1), ("work.src", 1)]


@pytest.mark.parametrize("body", ["LOOP\nWAIT SEC 1\nENDLOOP", "WHILE GO==FALSE\nWAIT SEC 1\nENDWHILE"])
def test_a_loop_without_a_motion_that_nothing_comes_behind_waits_for_none(tmp_path, body):
    found = with_data(tmp_path, f"PTP {{A1 5}}\n{body}", "DECL GLOBAL BOOL GO=FALSE")
    assert "waits_for_others" not in codes(found)


def test_a_variable_that_is_unknown_as_a_whole_has_no_known_part(tmp_path):
    found = with_data(tmp_path, "XP.A1=50\nXP=YP\nPTP {A1 XP.A1}", "INT N=0")
    assert codes(found)["target_not_given"] == [9]


def test_the_same_joint_move_bends_within_a_spline_alone(tmp_path):
    body = "SPTP {A1 10}\nPTP {A1 0}\nPTP_SPLINE\nSPTP {A1 10}\nENDSPLINE"
    assert codes(with_data(tmp_path, body, "INT N=0"))["spline_as_line"] == [10]


def test_a_loop_that_an_input_ends_waits_for_no_other_task(tmp_path):
    """What else it asks is known, and stays so."""
    text = (
        "def a():\n  debug = False\n  while True:\n    if debug:\n      textmsg(1)\n    end\n"
        "    if get_digital_in(1):\n      movej([0, -0.2, -0.2, 0, -1.2, 0])\n    end\n    sync()\n  end\nend\n"
    )
    found = check(tmp_path, text, "a.script")
    assert "waits_for_others" not in codes(found)
    assert len(found.verdicts) == 1


def test_a_loop_that_may_move_the_arm_is_no_wait(tmp_path):
    body = "PTP {A1 5}\nWHILE GO==FALSE\nNUDGE( )\nENDWHILE\nPTP {A1 30}"
    found = codes(with_data(tmp_path, body, "DECL GLOBAL BOOL GO=FALSE"))
    assert "waits_for_others" not in found
    assert found["may_move"] == [9]


def test_a_call_of_what_moves_that_no_way_leads_to_is_named_where_its_file_is_another(tmp_path):
    (tmp_path / "work.src").write_text(LATER.format(wait=""))
    found = with_data(tmp_path, "PTP {A1 5}\nIF GO THEN\nwork( )\nENDIF", "DECL GLOBAL BOOL GO=FALSE")
    assert codes(found)["never_reached"] == [9]


def test_motions_of_a_called_module_that_no_way_leads_to_are_named(tmp_path):
    """Each among what was not examined, and the first of its routine as a finding; routines that none calls are not."""
    pick = "DEF pick(S :IN)\nINT S\nIF S==1 THEN\nPTP {A1 5}\nELSE\nPTP {A1 9}\nPTP {A1 8}\nENDIF\nEND\n"
    (tmp_path / "pick.src").write_text(pick + "GLOBAL DEF other( )\nPTP {A1 7}\nEND\n")
    found = with_data(tmp_path, "PTP {A1 1}\npick(1)", "")
    places = [
        (each.place.file.name, each.place.line) for each in found.findings if each.finding.code == "never_reached"
    ]
    assert places == [("pick.src", 6)]
    assert [(each.what, each.place.line) for each in found.not_examined] == [("motion", 6), ("motion", 7)]
    assert found.level == "caution"


@pytest.mark.parametrize("given", ["v", "q{1}"])
def test_what_a_routine_gives_back_by_a_parameter_goes_on_on_both_ways(tmp_path, given):
    routine = "PROC choose(INOUT num x)\nIF di1=1 THEN\nx:=10;\nELSE\nx:=20;\nENDIF\nENDPROC"
    turn = f"MoveAbsJ [[{given},-10,-10,0,-70,0],{NONE}],v50,fine,tool0;"
    text = rapid(f"choose {given};\n{turn}", "VAR num v;\nVAR num q{1};", routine)
    turns = [np.degrees(each.target.joints[0]) for each in motions(tmp_path, text, "a.mod")[1:]]
    assert sorted(turns) == [pytest.approx(10), pytest.approx(20)]


@pytest.mark.parametrize(
    ("asked", "sides"),
    [("a=[2,0,0]", 2), ("a<>[2,0,0]", 2), ("a=[2,1,0]", 1), ("b=[2,0,0]", 1), ("c=[0.3,0,0]", 2)],
)
def test_values_with_an_unknown_part_are_equal_or_not(tmp_path, asked, sides):
    """But for those that another part tells apart. 0.1 + 0.2 is 0.3 or not, by the controller's rounding."""
    data = "VAR pos a;\nVAR pos b:=[2,0,0];\nVAR pos c;"
    body = f"a.x:=ai1;\nc.x:=0.1+0.2;\nIF {asked} THEN\n{at_turn(20)}ELSE\n{at_turn(30)}ENDIF"
    assert len(motions(tmp_path, rapid(body, data), "a.mod")) == 1 + sides


def at_turn(degrees: float) -> str:
    return f"MoveAbsJ [[0,-10,-10,0,-70,{degrees}],{NONE}],v50,fine,tool0;\n"


@pytest.mark.parametrize(
    ("data", "body", "told"),
    [
        ("", at_turn(-120) + at_turn(0) + at_turn(120), {5: ["whole_turn"]}),
        ("", at_turn(-120) + at_turn(0) + at_turn(120) + at_turn(0), {}),
        ("", at_turn(-120) + at_turn(0) + at_turn(120) + "EXIT;\n", {}),
        ("", "WHILE TRUE DO\n" + at_turn(-120) + at_turn(0) + "ENDWHILE\n", {}),
        # up from where the arm is, which is too high at the end of the first round
        (
            "VAR robtarget q;",
            "q:=CRobT(\\Tool:=tool0\\WObj:=wobj0);\nMoveL Offs(q,0,0,250),v100,fine,tool0;\n",
            {6: ["target_out_of_reach"]},
        ),
    ],
)
def test_a_program_of_rapid_is_begun_again_from_where_it_ends(tmp_path, data, body, told):
    """As in run mode Continuous: what is found then alone is a caution; what is found is not twice."""
    text = f"MODULE a\n{data}\nPROC main()\nConfL\\Off;\n{body}ENDPROC\nENDMODULE\n"
    found = check(tmp_path, text, "a.mod")
    again = {each.place.line: each for each in found.findings if each.finding.code == "begun_again"}
    assert {line: [code for code in each.finding.codes if code in told[line]] for line, each in again.items()} == told
    assert {each.level for each in again.values()} <= {"caution"}
    assert not any(found.execution.steps[number].again for number in found.main)
    assert {each.times for each in found.verdicts} <= ({1, 2} if "WHILE" in body else {1})


def test_a_cycle_that_is_left_begins_again_from_where_the_arm_is(tmp_path):
    """Its first line is followed from the point at which it was left too."""
    body = "MoveL p,v100,fine,tool0;\nIF di1=1 ExitCycle;\nMoveL Offs(p,0,50,0),v100,fine,tool0;"
    (tmp_path / "a.mod").write_text(rapid(body))
    found = check_program(read_program(tmp_path / "a.mod"), ROBOT, CheckOptions(start=HOME, measures=False))
    starts = {motion.start.tobytes() for n, motion in found.motions.items() if found.execution.steps[n].place.line == 5}
    assert len(starts) == 2
    assert [each.kind for each in found.execution.endings].count("end") == 1


def test_a_counter_that_moves_the_target_in_each_cycle_that_is_left_drifts(tmp_path):
    body = "MoveL Offs(p,n,0,0),v100,fine,tool0;\nn:=n+1;\nIF di1=1 ExitCycle;"
    found = check(tmp_path, rapid(body, "VAR num n:=0;"), "a.mod", most_motions=50)
    assert "not_followed_to_end" in codes(found)


def test_a_position_after_set_sys_data_is_that_of_the_tool_it_names(tmp_path):
    """CRobT gives the tip of t2, 50 mm before the flange, which looks down: the line goes nowhere."""
    data = "VAR robtarget q;PERS tooldata t2:=[TRUE,[[0,0,50],[1,0,0,0]],[1,[0,0,10],[1,0,0,0],0,0,0]];"
    body = "MoveL p,v100,fine,tool0;\nSetSysData t2;\nq:=CRobT();\nMoveL q,v100,fine,t2;"
    last = motions(tmp_path, rapid(body, data), "a.mod")[-1]
    assert isinstance(last.target, PoseTarget)
    np.testing.assert_allclose(last.target.pose[:3, 3], [0.4, 0.0, 0.25], atol=1e-9)
    unknown = motions(tmp_path, rapid(body.replace("t2;\nq", "t2\\ObjectName:=s;\nq"), data), "a.mod")[-1]
    assert not isinstance(unknown.target, PoseTarget)


def test_an_external_axis_that_is_moved_from_where_it_is_is_told(tmp_path):
    body = "q:=CRobT();\nq.extax.eax_a:=q.extax.eax_a+100;\nMoveL q,v100,fine,tool0;"
    assert codes(check(tmp_path, rapid(body, "VAR robtarget q;"), "a.mod"))["external_axes_left_out"] == [9]


@pytest.mark.parametrize(
    "line", ["WaitUntil StrToVal(s,n);", "WaitUntil di1=1 OR StrToVal(s,n)\\MaxTime:=2\\TimeFlag:=b;"]
)
def test_what_the_condition_of_a_wait_changes_is_not_known(tmp_path, line):
    data = 'VAR num n:=0;VAR bool b;VAR string s:="5";'
    found = check(tmp_path, rapid(f"{line}\nMoveL Offs(p,0,0,n),v100,fine,tool0;", data), "a.mod")
    assert "target_not_given" in codes(found)


def test_a_routine_of_the_program_in_the_condition_of_a_wait_is_carried_out(tmp_path):
    more = "FUNC bool there()\nMoveL p,v100,fine,tool0;\nRETURN TRUE;\nENDFUNC"
    assert len(motions(tmp_path, rapid("WaitUntil there();", more=more), "a.mod")) == 2


@pytest.mark.parametrize(
    ("handler", "named"), [("RETRY;", True), ("Incr k;\nIF k<3 RETRY;\nEXIT;", True), ("Stop;", False)]
)
def test_a_routine_that_a_caller_carries_out_again_after_an_error_is_named(tmp_path, handler, named):
    """RETRY calls sub1 again while the arm is at its second point, and as often as handler and controller allow."""
    sub = "PROC sub1()\nn:=n+100;\nMoveL Offs(p,0,n,0),v100,fine,tool0;\nMoveL Offs(p,0,50,0),v100,fine,tool0;\n"
    sub += "WaitDI di1,1\\MaxTime:=2;\nENDPROC"
    found = codes(check(tmp_path, rapid(f"sub1;\nERROR\n{handler}", "VAR num k;\nVAR num n;\n", sub), "a.mod"))
    assert ("errors_not_followed" in found) == named
    assert not {"target_out_of_reach", "way_out_of_reach", "not_followed_to_end"} & set(found)


def test_an_instruction_whose_error_ends_its_routine_is_followed_on_both_sides(tmp_path):
    """The socket fails: the caller goes on from p, not from above it."""
    sub = 'PROC sub1()\nMoveL p,v100,fine,tool0;\nSocketConnect s,"a",1;\nMoveL Offs(p,0,0,100),v100,fine,tool0;\n'
    found = check(
        tmp_path, rapid("sub1;\nMoveL Offs(p,0,50,0),v100,fine,tool0;", more=f"{sub}ERROR\nRETURN;\nENDPROC"), "a.mod"
    )
    lines = [found.execution.steps[n].place.line for n in found.motions]
    assert lines.count(8) == 2


@pytest.mark.parametrize(
    ("body", "degrees"),
    [
        ("STRUC PART INT N,REAL X\nDECL PART S\nS.N=12.7\nPTP {A1 S.N}", 13),
        ("STRUC PART INT N,REAL X,Y\nDECL PART S\nS={N 12.7,X 5,Y 5}\nPTP {A1 S.N}", 13),
        ("STRUC PART INT N,REAL X,Y\nDECL PART S\nS={N 1,X 5,Y 5}\nS.Y=7\nPTP {A1 S.Y/2}", 3.5),
        ("STRUC PART INT N,M,REAL X\nDECL PART S[2]\nS[2]={N 7,M 2,X 0}\nPTP {A1 S[2].N/S[2].M}", 3),
        ("INT I\nREAL R\nI=7\nR=I/2\nPTP {A1 R}", 3),  # whole numbers, whole quotient
        ("REAL R\nR=7.0/2\nPTP {A1 R}", 3.5),
    ],
)
def test_fields_of_structures_have_the_types_that_are_declared(tmp_path, body, degrees):
    assert joints(tmp_path, body) == pytest.approx([degrees])


def test_types_of_structures_are_read_from_data_files_too(tmp_path):
    (tmp_path / "a.dat").write_text("DEFDAT a\nSTRUC PART INT N,REAL X\nDECL PART S={N 12.7,X 3}\nENDDAT\n")
    assert joints(tmp_path, "PTP {A1 S.N}") == pytest.approx([13])


@pytest.mark.parametrize(
    ("data", "line", "noted"),
    [
        ("E6POS XP={X 400,Y 0,Z 300}", "LIN XP", "position_completed"),
        ("E6AXIS XP={A1 10}", "PTP XP", "position_completed"),
        ("E6POS XP={X 400,Y 0,Z 300}", "LIN XQ", "target_not_given"),
        ("E6POS XP", "LIN XP", "target_not_given"),
        ("E6POS XP={X 400,Y 0,Z 300,A 0,B 180,C 0}", "LIN XP", None),
        ("E6POS XP={X 400,Y 0,Z 300}", "LIN {X 400,Y 0,Z 300}", None),
        ("E6POS XP={X 40,Y 0,Z 0}", "LIN_REL XP", None),
    ],
)
def test_what_a_data_file_does_not_give_of_a_point_is_told(tmp_path, data, line, noted):
    found = codes(with_data(tmp_path, line, f"DECL {data}"))
    assert {"position_completed", "target_not_given"} & found.keys() == ({noted} if noted else set())


def test_a_zone_by_percent_whose_percent_is_not_set_has_no_known_size(tmp_path):
    body = f"$APO.CDIS=30\nPTP {axes(NEAR)} C_PTP\nPTP {axes(HOME)}"
    assert codes(check(tmp_path, krl(FRAMES + SPEEDS + body), "a.src"))["zone_without_size"] == [8]
    assert "zone_without_size" not in codes(check(tmp_path, krl(f"{FRAMES}{SPEEDS}$APO.CPTP=30\n{body}"), "a.src"))


@pytest.mark.parametrize(
    ("data", "zone"),
    [
        ("PDAT_ACT={VEL 10,ACC 10,APO_DIST 5,APO_MODE #CDIS}\nBAS(#PTP_DAT)", ("share", 0.4)),
        ("LDAT_ACT={VEL 0.1,ACC 10,APO_DIST 5}\nBAS(#CP_DAT)", ("share", 0.4)),
        ("PDAT_ACT={VEL 10,ACC 10,APO_DIST 5}\nBAS(#PTP_DAT)", ("share", 0.05)),
    ],
)
def test_a_distance_of_motion_data_leaves_the_percent_of_joint_moves(tmp_path, data, zone):
    moved = motions(tmp_path, krl(f"$APO.CPTP=40\n{data}\nPTP {axes(NEAR)} C_PTP"), "a.src")[-1]
    assert moved.zone.kind == zone[0]
    assert moved.zone.value == pytest.approx(zone[1])


def test_a_speed_of_bas_is_not_bounded_by_the_one_of_initmov(tmp_path):
    """Some controllers' own bas.src do that, others don't."""
    (tmp_path / "$config.dat").write_text("DEFDAT $CONFIG\nREAL DEF_VEL_CP=2.0\nENDDAT\n")
    moved = motions(tmp_path, krl(f"BAS(#VEL_CP,3)\n{FRAMES}LIN {POSE % 0}"), "a.src")[-1]
    assert moved.speed.value == 3.0


def test_data_of_lines_that_leave_out_how_arcs_turn_mean_the_controllers_way(tmp_path):
    data = "DEF_CIRC_TYP=#PATH\nDECL LDAT LDAT_ACT={VEL 0.1,ACC 10,APO_DIST 5,ORI_TYP #VAR}"
    arc = f"LIN {POSE % 0}\nCIRC {{X 390,Y 20,Z 300}},{{X 400,Y 40,Z 300}}"
    assert "turn_not_followed" in codes(with_data(tmp_path, f"BAS(#CP_DAT)\n{arc}", data))


def test_a_load_of_which_a_part_is_given_is_a_caution(tmp_path):
    found = check(tmp_path, krl(f"{FRAMES}{SPEEDS}$LOAD.M=2\nPTP {axes(NEAR)}"), "a.src")
    assert [(each.finding.code, each.level) for each in found.findings] == [("load_not_examined", "caution")]


def test_a_line_that_begins_after_a_carriage_return_alone_is_named(tmp_path):
    """Editors show it as part of the line before, which is a comment; controllers may too."""
    text = krl(f"{FRAMES}{SPEEDS}PTP {axes(NEAR)}\n; note\rPTP {{A1 100}}")
    (tmp_path / "a.src").write_bytes(text.encode())
    found = check_program(read_program(tmp_path / "a.src"), ROBOT, CheckOptions(start=HOME, measures=False))
    assert codes(found)["program_not_understood"] == [9]
    for ends in ("\r", "\r\n"):
        (tmp_path / "a.src").write_bytes(text.replace("\r", "\n").replace("\n", ends).encode())
        assert "program_not_understood" not in codes(check_program(read_program(tmp_path / "a.src"), ROBOT))


@pytest.mark.parametrize(("option", "named"), [("\\Corr", True), ("\\WObj:=wobj0", False)])
def test_an_option_of_a_motion_that_may_shift_its_path_is_named(tmp_path, option, named):
    found = check(tmp_path, rapid(f"MoveL p,v100,fine,tool0{option};"), "a.mod")
    assert codes(found).get("program_not_simulated", []) == ([7] if named else [])


def test_an_external_axis_of_rpl_whose_value_is_not_known_is_named(tmp_path):
    (tmp_path / "a.var").write_text("Routine Var REAL x\n")
    text = "x := fidbus.mtcp_ri[1];\nMJOINT(EPOINTJ(5,-10,-10,0,-70,0,x,0,0,0,0,0), v10perc, fine, tool0);\n"
    assert codes(check(tmp_path, text, "a.pgm")) == {"external_axes_left_out": [2]}


@pytest.mark.parametrize("language", ["krl", "rapid"])
def test_a_program_that_is_written_turns_the_tool_no_faster(tmp_path, language):
    turns = "$VEL.ORI1=20\n$VEL.ORI2=30\n$ACC.ORI1=40\n$ACC.ORI2=50"
    body = f"{FRAMES}{SPEEDS}{turns}\nPTP {axes(NEAR)}\nLIN_REL {{Z 5}}"
    listing = execute(written(tmp_path, krl(body), "a.src"), ROBOT, HOME).listing()
    (text,) = (
        each for name, each in write_program(listing, language, WriteOptions(ROBOT)).files.items() if name != ".dat"
    )
    assert all(line in text for line in turns.split()) if language == "krl" else "[100.0,20.0,5000,1000]" in text


HANDLED = f"VAR num n:=5;\nVAR robtarget place:=[[400,0,300],[0,1,0,0],[0,0,0,0],{NONE}];\n"
TO_PLACE = "MoveJ Offs(place,0,0,n),v50,fine,tool0;"
WAIT = "WaitDI di1,1\\MaxTime:=3;\n"


@pytest.mark.parametrize("called", ["grip;", "IF di2=1 grip;", "outer;"])
@pytest.mark.parametrize(
    "handler",
    ["n:=50; TRYNEXT;", "n:=50; RETURN;", "place.trans.z:=350; TRYNEXT;", "PDispSet [[0,0,50],[1,0,0,0]]; TRYNEXT;"],
)
def test_what_a_handler_sets_is_not_known_where_its_routine_was_called(tmp_path, called, handler):
    more = f"PROC grip()\n{WAIT}ERROR\n{handler}\nENDPROC\nPROC outer()\ngrip;\nENDPROC"
    found = codes(check(tmp_path, rapid(f"{called}\n{TO_PLACE}", HANDLED, more), "a.mod"))
    assert {"target_not_given", "frame_not_given"} & set(found)


def test_what_a_function_gives_back_is_not_known_where_its_handler_gives_something_else(tmp_path):
    ask = f"FUNC num ask()\n{WAIT}RETURN 5;\nERROR\nRETURN 50;\nENDFUNC"
    found = codes(check(tmp_path, rapid(f"n:=ask();\n{TO_PLACE}", HANDLED, ask), "a.mod"))
    assert "target_not_given" in found


def test_an_output_or_an_acceleration_that_a_handler_sets_leaves_the_targets_known(tmp_path):
    grip = f"PROC grip()\n{WAIT}ERROR\nReset do1;\nAccSet 50,50;\nTRYNEXT;\nENDPROC"
    found = codes(check(tmp_path, rapid(f"grip;\n{TO_PLACE}", HANDLED, grip), "a.mod"))
    assert not {"target_not_given", "frame_not_given"} & set(found)


GIVEN_OUT = "$OUT[8]=FALSE\n"
ASK_OUT = "\nIF $OUT[8] THEN\nPTP {A1 5}\nELSE\nPTP {A1 9}\nENDIF"


@pytest.mark.parametrize(
    ("setting", "ways"),
    [
        ("", [9.0]),
        ("GRIP=15", [5.0, 9.0]),  # $OUT[5] to $OUT[8] as one number
        ("$OUT[N]=TRUE", [5.0, 9.0]),  # N is an input
        ("PULSE($OUT[8],TRUE,0.5)", [5.0, 9.0]),
        ("TRIGGER WHEN DISTANCE=0 DELAY=0 DO PULSE(ONE,TRUE,0.5)", [5.0, 9.0]),
        ("ONE=TRUE", [5.0]),
        ("BAS(#OUT_ASYNC)", [5.0, 9.0]),
    ],
)
def test_an_output_that_is_set_under_another_name_is_not_taken_as_it_was(tmp_path, setting, ways):
    data = "SIGNAL GRIP $OUT[5] TO $OUT[8]\nSIGNAL ONE $OUT[8]\nSIGNAL N $IN[1] TO $IN[4]"
    (tmp_path / "a.dat").write_text(f"DEFDAT a\n{data}\nENDDAT\n")
    assert sorted(set(np.round(joints(tmp_path, GIVEN_OUT + setting + ASK_OUT), 6))) == ways


@pytest.mark.parametrize("called", [True, False])
def test_a_signal_that_a_module_declares_for_all_is_an_output(tmp_path, called):
    (tmp_path / "io.dat").write_text("DEFDAT IO PUBLIC\nGLOBAL SIGNAL GRIP $OUT[8]\nENDDAT\n")
    (tmp_path / "io.src").write_text("DEF io( )\nEND\n")
    call = "io( )\n" if called else ""
    assert joints(tmp_path, f"{call}{GIVEN_OUT}GRIP=TRUE{ASK_OUT}") == [5.0]


@pytest.mark.parametrize(("signal", "way"), [("$OUT[8]", [5.0]), ("$OUT[5] TO $OUT[8]", [5.0, 9.0])])
def test_a_routine_that_gets_a_signal_sets_the_output(tmp_path, signal, way):
    (tmp_path / "a.dat").write_text(f"DEFDAT a\nSIGNAL GRIP {signal}\nENDDAT\n")
    more = "DEF SETIT(S:OUT)\nBOOL S\nS=TRUE\nEND\n"
    assert sorted(set(joints(tmp_path, f"{GIVEN_OUT}SETIT(GRIP){ASK_OUT}", more))) == pytest.approx(way)


@pytest.mark.parametrize(("head", "way"), [("DEF SETIT(GRIP:IN)\nBOOL GRIP", 9.0), ("DEF SETIT(X:IN)", 5.0)])
def test_a_parameter_with_the_name_of_a_signal_is_the_parameter(tmp_path, head, way):
    (tmp_path / "$config.dat").write_text("DEFDAT $CONFIG\nSIGNAL GRIP $OUT[8]\nENDDAT\n")
    more = f"{head}\nGRIP=TRUE\nEND\n"
    assert joints(tmp_path, f"{GIVEN_OUT}SETIT(FALSE){ASK_OUT}", more) == [way]


def test_a_signal_is_no_point_that_a_data_file_lacks(tmp_path):
    (tmp_path / "$config.dat").write_text("DEFDAT $CONFIG\nSIGNAL GRIP $OUT[8]\nENDDAT\n")
    assert "program_data_file_missing" not in codes(check(tmp_path, krl("IF GRIP THEN\nENDIF"), "a.src"))


def test_a_signal_of_the_controller_is_known_to_the_modules_that_a_program_calls(tmp_path):
    (tmp_path / "$config.dat").write_text("DEFDAT $CONFIG\nSIGNAL ONE $OUT[8]\nENDDAT\n")
    (tmp_path / "sets.src").write_text("DEF sets( )\nONE=TRUE\nEND\n")
    assert joints(tmp_path, f"{GIVEN_OUT}sets( ){ASK_OUT}") == [5.0]


@pytest.mark.parametrize("condition", ["GO", "GO AND $IN[1]", "NOT (NOT GO)", "$OUT[3]", "N==4"])
def test_a_wait_that_only_another_task_can_end_is_named_and_what_it_asks_is_open(tmp_path, condition):
    body = f"GO=FALSE\nN=1\n$OUT[3]=FALSE\nWAIT FOR {condition}\nIF GO OR $OUT[3] OR N==4 THEN\nPTP {{A1 5}}\nENDIF"
    found = with_data(tmp_path, body, "DECL BOOL GO\nDECL INT N")
    assert codes(found)["waits_for_others"] == [10]
    assert (10, "course") in [(each.place.line, each.what) for each in found.not_examined]
    assert 5.0 in np.round(joints(tmp_path, body), 6)


@pytest.mark.parametrize("condition", ["GO", "$IN[1]", "GO OR $IN[1]", "$TIMER[1]>0"])
def test_a_wait_for_what_holds_or_for_an_input_is_not(tmp_path, condition):
    found = with_data(tmp_path, f"GO=TRUE\nWAIT FOR {condition}\nPTP {{A1 5}}", "DECL BOOL GO")
    assert "waits_for_others" not in codes(found)


CONFIG = "DEFDAT $CONFIG PUBLIC\nDECL GLOBAL REAL GZ=5.0\nDECL GLOBAL INT UNUSED=1\nENDDAT\n"


def test_what_a_submit_program_sets_has_no_known_value(tmp_path):
    (tmp_path / "$config.dat").write_text(CONFIG)
    assert joints(tmp_path, "PTP {A1 GZ}") == [5.0]
    (tmp_path / "sps.sub").write_text("DEF SPS( )\nDECL REAL UNUSED\nUNUSED=3\nIF $IN[1] THEN\nGZ=30.0\nENDIF\nEND\n")
    assert "target_not_given" in codes(check(tmp_path, krl("PTP {A1 GZ}"), "a.src"))
    assert joints(tmp_path, "PTP {A1 UNUSED}") == [1.0]  # its own variable of that name is another


SETTERS = {
    "assigned": "GZ=30.0",
    "by the controller's function": 'RET=EKI_GETREAL("X","Y",GZ)',
    "read": 'SREAD(S[],STATE,OFFSET,"%f",GZ)',
    "given to a routine that sets it": "SETIT(GZ)",
    "given on to one that does": "GIVEON(GZ)",
    "given to another module's routine": "SETZ(GZ)",
    "cyclically": "ANIN ON GZ=1.0*$ANIN[1]",
    "counted": "FOR GZ=1 TO 3\nENDFOR",
    "when interrupted": "INTERRUPT DECL 4 WHEN $IN[1] DO GZ=4",
    "by an interrupt's routine": "INTERRUPT DECL 4 WHEN $IN[1] DO SETIT(GZ)",
    "by what is not understood": "SETALL TO GZ",
    "by a command": 'CWRITE($CMD,STATE,MODE,"=GZ 30")',
}
KEEPERS = ("OTHER=GZ", "LOOKAT(GZ)", "LOOKZ(GZ)", 'EKI_SETREAL("X","Y",GZ)', "IF GZ==1 THEN\nENDIF")
OWN_ROUTINES = (
    "DEF SETIT(P:OUT)\nREAL P\nP=90\nEND\nDEF GIVEON(P:OUT)\nREAL P\nSETIT(P)\nEND\n"
    "DEF LOOKAT(P:OUT)\nREAL P,Q\nQ=P\nEND\n"
)
LIBRARY = "DEF LIB( )\nEND\nGLOBAL DEF SETZ(P)\nREAL P\nP=90\nEND\nGLOBAL DEF LOOKZ(P:IN)\nREAL P\nP=90\nEND\n"


@pytest.mark.parametrize("line", [*SETTERS.values(), *KEEPERS])
@pytest.mark.parametrize(
    "place", ["Program/sub/other.sub", "System/other.sub", "Program/other.sub", "Program/x/a.sub", "TP/other.src"]
)
def test_whatever_another_program_of_the_archive_may_set_has_no_known_value_or_is_told(tmp_path, line, place):
    """A submit program may lie anywhere, and under any name."""
    files = {
        "System/$config.dat": CONFIG,
        "Program/lib.src": LIBRARY,
        place: f"DEF other( )\n  {line}\nEND\n{OWN_ROUTINES}",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "Program/x").mkdir(exist_ok=True)
    found = codes(check(tmp_path / "Program/x", krl("PTP {A1 GZ}"), "a.src"))
    code = "target_not_given" if place.endswith("sub") else "set_elsewhere"
    assert (code in found) == (line in SETTERS.values())


@pytest.mark.parametrize("called", [True, False])
def test_what_bas_does_to_the_homes_of_a_new_controller_is_left_out(tmp_path, called):
    """It asks for the kind of the arm; each submit program calls it."""
    home = "DEFDAT $CONFIG\nDECL AXIS XHOME={A1 5,A2 -10,A3 -10,A4 0,A5 -70,A6 0}\nENDDAT\n"
    basics = (
        "DEF BAS(WHAT:IN,N:IN)\nEND\nGLOBAL DEF BASISTECH_PLC_INIT( )\nHOMES( )\nEND\nDEF HOMES( )\nXHOME=$H_POS\nEND\n"
    )
    submit = "DEF SPS( )\nBASISTECH_PLC_INIT( )\nEND\n"
    for name, text in (("System/$config.dat", home), ("System/bas.src", basics), ("System/sps.sub", submit)):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "Program").mkdir()
    found = codes(check(tmp_path / "Program", krl(f"{'BAS(#INITMOV,0)' * called}\nPTP XHOME"), "a.src"))
    assert not {"set_elsewhere", "target_not_given"} & found.keys()


@pytest.mark.parametrize("called", [True, False])
def test_a_routine_that_the_program_does_not_call_may_set_a_variable_too(tmp_path, called):
    (tmp_path / "$config.dat").write_text(CONFIG)
    (tmp_path / "lib.src").write_text("DEF lib( )\nEND\nGLOBAL DEF PRESET( )\nGZ=30.0\nEND\n")
    body = "lib( )\nGZ=5\nPRESET( )\nPTP {A1 GZ}" if called else "lib( )\nPTP {A1 GZ}"
    assert ("set_elsewhere" in codes(check(tmp_path, krl(body), "a.src"))) != called


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ("GLOBAL DEF PRESET( )\nGZ=30.0\nEND\n", True),
        ("GLOBAL DEF PRESET( )\nHELP( )\nEND\nDEF HELP( )\nGZ=30.0\nEND\n", True),
        ("DEF PRESET( )\nGZ=30.0\nEND\n", False),
    ],
)
@pytest.mark.parametrize("own", [True, False])
def test_a_routine_that_nobody_calls_counts_where_other_modules_see_it(tmp_path, own, more, told):
    (tmp_path / "$config.dat").write_text(CONFIG)
    (tmp_path / "lib.src").write_text(f"DEF lib( )\nEND\n{'' if own else more}")
    found = codes(check(tmp_path, krl("lib( )\nPTP {A1 GZ}", more if own else ""), "a.src"))
    assert ("set_elsewhere" in found) == told


@pytest.mark.parametrize(("name", "code"), [("sps.sub", "target_not_given"), ("other.src", "set_elsewhere")])
def test_what_a_called_module_declares_for_all_may_be_set_by_others(tmp_path, name, code):
    (tmp_path / "lib.dat").write_text(CONFIG.replace("$CONFIG", "LIB"))
    (tmp_path / "lib.src").write_text("DEF lib( )\nEND\n")
    (tmp_path / name).write_text(f"DEF {name[:-4]}( )\nGZ=30.0\nEND\n")
    assert code in codes(check(tmp_path, krl("lib( )\nPTP {A1 GZ}"), "a.src"))


@pytest.mark.parametrize("frames", [{}, {"BASE_DATA[3]": np.eye(4)}])
@pytest.mark.parametrize("own", ["", "BASE_DATA[5]=$NULLFRAME\n"])
def test_a_base_that_a_submit_program_sets_is_not_known(tmp_path, own, frames):
    (tmp_path / "$config.dat").write_text("DEFDAT $CONFIG\nBASE_DATA[3]={X 0,Y 0,Z 0,A 0,B 0,C 0}\nENDDAT\n")
    (tmp_path / "sps.sub").write_text("DEF SPS( )\nBASE_DATA[3].Y=$ANIN[1]\nEND\n")
    body = f"{FRAMES}{SPEEDS}{own}$BASE=BASE_DATA[3]\nLIN {POSE % 0}"
    assert "frame_not_given" in codes(check(tmp_path, krl(body), "a.src", frames=frames))


def test_the_programs_number_is_not_known_after_p00(tmp_path):
    (tmp_path / "$config.dat").write_text("DEFDAT $CONFIG\nINT PGNO=0\nENDDAT\n")
    body = "P00(#EXT_PGNO,#PGNO_GET,DMY[],0)\nSWITCH PGNO\nCASE 1\nPTP {A1 5}\nDEFAULT\nPTP {A1 9}\nENDSWITCH"
    assert sorted(joints(tmp_path, body)) == pytest.approx([5.0, 9.0])


@pytest.mark.parametrize("line", ["$OUT[7]=$IN[3]", "PULSE($OUT[7],TRUE,0.5)", "USERPLC( )"])
def test_what_a_submit_program_makes_of_outputs_is_not_known(tmp_path, line):
    (tmp_path / "sps.sub").write_text(f"DEF SPS( )\nLOOP\n{line}\nENDLOOP\nEND\n")
    (tmp_path / "userplc.src").write_text("DEF USERPLC( )\n$OUT[7]=$IN[3]\nEND\n")
    body = "$OUT[7]=FALSE\nWAIT SEC 1\nIF $OUT[7] THEN\nPTP {A1 40}\nENDIF"
    assert joints(tmp_path, body) == [40.0]


@pytest.mark.parametrize(
    ("body", "told"),
    [("PTP {A1 GZ}", True), ("GZ=9\nPTP {A1 GZ}", False), ("PTP {A1 5}", False), ("$OUT[1]=GZ>1\nPTP {A1 5}", False)],
)
def test_a_variable_of_the_controller_that_another_program_sets_is_told(tmp_path, body, told):
    (tmp_path / "$config.dat").write_text(CONFIG)
    (tmp_path / "other.src").write_text("DEF other( )\nIF $IN[1] THEN\nGZ=30.0\nENDIF\nEND\n")
    found = check(tmp_path, krl(body), "a.src")
    said = [each.finding for each in found.findings if each.finding.code == "set_elsewhere"]
    assert [(each.name, each.file, each.line) for each in said] == ([("GZ", "other.src", 3)] if told else [])
    called = check(tmp_path, krl(f"other( )\n{body}"), "a.src")
    assert "set_elsewhere" not in codes(called)  # what it calls is followed


def test_files_that_decide_so_belong_to_the_program(tmp_path):
    names = ["$config.dat", "$machine.dat", "other.src", "sps.sub"]
    for name in names:
        (tmp_path / name).write_text("DEF x( )\nEND\n" if name[0] != "$" else "DEFDAT x\nENDDAT\n")
    (tmp_path / "a.src").write_text(krl("PTP {A1 5}"))
    assert {each.name for each in files_of(tmp_path / "a.src")} == {"a.src", *names}
    (tmp_path / "a.txt").write_text((tmp_path / "a.src").read_text())  # read by what it holds, not by its name
    assert {each.name for each in files_of(tmp_path / "a.txt")} >= {"a.txt", *names}


@pytest.mark.parametrize(
    ("before", "z"),
    [
        ("", 100),
        ("BASE_CORR={X 0,Y 0,Z -30,A 0,B 0,C 0}\nBASE_CORR_ON=TRUE", 70),
        ("M_BASE_CORR={X 0,Y 0,Z -20,A 0,B 0,C 0}\nM_BAS_COR_ON=TRUE", 80),
        ("BASE_CORR={X 0,Y 0,Z -30,A 0,B 0,C 0}\nBASE_CORR_ON=FALSE", 100),
        ("BASE_CORR={X 0,Y 0,Z -30,A 0,B 0,C 0}\nBASE_CORR_ON=$IN[1]", None),
        ("BASE_CORR={X 0,Y 0,Z -30,A 0,B 0,C 0}\nBASE_CORR_ON=TRUE\nBAS(#INITMOV,0)", 100),
        ("MACHINE_FRAME_DAT[1]={MACH_DEF_INDEX 2}", None),
    ],
)
def test_bas_adds_the_corrections_that_are_on(tmp_path, before, z):
    data = "BASE_DATA[1]={X 0,Y 0,Z 100,A 0,B 0,C 0}\nTOOL_DATA[1]={X 0,Y 0,Z 0,A 0,B 0,C 0}"
    (tmp_path / "a.dat").write_text(f"DEFDAT a\n{data}\nENDDAT\n")
    (found,) = motions(tmp_path, krl(f"{before}\nBAS(#TOOL,1)\nBAS(#BASE,1)\nLIN {POSE % 0}"), "a.src")
    assert (None if found.base.pose is None else round(1000 * found.base.pose[2, 3], 6)) == z


def test_arcs_that_turn_with_their_path_are_named_where_the_controller_s_data_say_so(tmp_path):
    (tmp_path / "$config.dat").write_text("DEFDAT $CONFIG\nCIRC_TYPE DEF_CIRC_TYP=#PATH\nENDDAT\n")
    assert 2 in codes(check(tmp_path, krl("BAS(#INITMOV,0)\nPTP {A1 5}"), "a.src"))["program_not_understood"]


@pytest.mark.parametrize("line", ['CWRITE($CMD,S,M,"RUN /R1/UP( )")', "$LOAD_A3={M 8.0}"])
def test_commands_and_loads_on_the_arm_are_no_pass(tmp_path, line):
    found = check(tmp_path, krl(f"{line}\nPTP {{A1 5}}"), "a.src")
    assert any(each.level == "caution" and each.place.line == 2 for each in found.findings)


@pytest.mark.parametrize(
    ("before", "ask", "ways"),
    [
        ("ON_ERROR_PROCEED\nR=STRTOINT(S[],N)", "$ERR.NUMBER==0", [5.0, 9.0]),
        ("", "$ERR.NUMBER==0", [5.0]),
        ("PTP {A1 20}", "$AXIS_ACT.A1>=20", [5.0, 9.0]),
        ("PTP {A1 20}", "$AXIS_ACT.A1>=19.9", [5.0]),
        ("$SOFT_PLCBOOL[1]=FALSE", "$SOFT_PLCBOOL[1]", [5.0, 9.0]),
        ("STOP=1", "STOP==1", [5.0]),
    ],
)
def test_what_the_controller_may_have_otherwise_does_not_decide(tmp_path, before, ask, ways):
    body = f"PTP {axes(HOME)}\n{before}\nIF {ask} THEN\nPTP {{A1 5}}\nELSE\nPTP {{A1 9}}\nENDIF"
    assert sorted({*np.round(joints(tmp_path, body), 6)} & {5.0, 9.0}) == ways


def test_bas_asks_for_an_error_that_is_none(tmp_path):
    asking = "ON_ERROR_PROCEED\nR=N\nIF $ERR.NUMBER==0 THEN\nPTP {A1 5}\nELSE\nPTP {A1 9}\nENDIF"
    (tmp_path / "bas.src").write_text(f"DEF BAS(WHAT:IN,N:IN)\n{asking}\nEND\n")
    assert joints(tmp_path, "ON_ERROR_PROCEED\nBAS(#INITMOV,0)") == [5.0]


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ("$IPO_MODE=UNKNOWN", "target_not_given"),
        ("$VEL=UNKNOWN", "speed_not_given"),
        ("$ACC=UNKNOWN", "acceleration_not_known"),
        ("$APO=UNKNOWN", "zone_without_size"),
        ("BAS(#FRAMES)", "frame_not_given"),
        ("LDAT_ACT=UNKNOWN\nBAS(#CP_DAT)", "turn_not_followed"),
        ("LDAT_ACT={VEL 0.1,ACC 10,APO_DIST UNKNOWN,ORI_TYP #VAR}\nBAS(#CP_DAT)", "zone_without_size"),
        ('RET=EKI_GETFRAME("A","B",$BASE)', "frame_not_given"),
    ],
)
def test_a_setting_of_unknown_value_is_not_the_one_before(tmp_path, lines, told):
    line = f"LIN {POSE % 0} C_DIS\nLIN {POSE % 5}"
    for before, found in (("", False), (lines, True)):
        text = krl(f"{FRAMES}{SPEEDS}$IPO_MODE=#BASE\n$APO.CDIS=1\n$ORI_TYPE=#VAR\n{before}\n{line}")
        assert (told in codes(check(tmp_path, text, "a.src"))) == found


@pytest.mark.parametrize(
    ("setting", "following", "told"),
    [
        ("$APO={CDIS 5,CORI 5}", f"LIN {POSE % 0} C_ORI\nLIN {POSE % 5}", "zone_without_size"),
        ("$ACC_AXIS[1]=SACC_JOINT(UNKNOWN)", "", "acceleration_not_known"),
        ("$LOAD=SLOAD(3)", "", "load_not_examined"),
    ],
)
def test_what_stands_after_with_counts_and_for_its_motion_alone(tmp_path, setting, following, told):
    load = "LOAD_DATA[3]={M 2,CM {X 0,Y 0,Z 0,A 0,B 0,C 0},J {X 0,Y 0,Z 0}}"
    found = with_data(tmp_path, f"SPTP {axes(NEAR)} WITH {setting}\n{following}", load)
    assert told in codes(found)


@pytest.mark.parametrize("target", ["{X 400,Y 0,Z 300,A 0,B 180,C 0,Q 5}", "{A1 5,A7 90}"])
def test_a_position_with_fields_that_none_has_is_none(tmp_path, target):
    assert "target_not_given" in codes(check(tmp_path, krl(f"{FRAMES}{SPEEDS}PTP {target}"), "a.src"))


@pytest.mark.parametrize(("coordinate", "named"), [("270.0", True), ("0.0", False), ("-1.5E2", True)])
def test_a_part_of_where_the_machine_data_put_the_robot_counts_too(tmp_path, coordinate, named):
    (tmp_path / "$machine.dat").write_text(f"DEFDAT $MACHINE\nFRAME $ROBROOT\n$ROBROOT.Z={coordinate} ;mm\nENDDAT\n")
    assert ("program_not_simulated" in codes(check(tmp_path, krl("PTP {A1 5}"), "a.src"))) == named


@pytest.mark.parametrize("kind", ["", "FRAME ", "DECL FRAME "])
@pytest.mark.parametrize(("root", "named"), [("Z 270,A 0", True), ("Z 0,A 180", True), ("Z 0,A 0", False)])
def test_a_robot_that_its_machine_data_put_elsewhere_is_no_pass(tmp_path, kind, root, named):
    program = tmp_path / "KRC/R1/Program"
    program.mkdir(parents=True)
    (tmp_path / "KRC/R1/Mada").mkdir()
    (tmp_path / "KRC/R1/Mada/$machine.dat").write_text(
        f"DEFDAT $MACHINE PUBLIC\n{kind}$ROBROOT={{FRAME: X 0.0,Y 0.0,{root},B 0.0,C 0.0}} ;x\nENDDAT\n"
    )
    found = check(program, krl(f"{FRAMES}LIN {POSE % 0}"), "a.src")
    assert ("program_not_simulated" in codes(found)) == named


@pytest.mark.parametrize(
    ("moves", "cautious"),
    [
        ("P=$POS_ACT\nPTP {A1 5,A6 -100}\nPTP P", True),  # two solutions have its Turn; its Status is not known
        (f"LIN {POSE % 0}\nP=$POS_ACT\nPTP {{A1 5,A2 -10,A3 -10,A4 0,A5 -70,A6 0}}\nPTP P", True),
        (f"LIN {POSE % 0}\nP=$POS_ACT\nPTP {{A1 5,A2 -10,A3 -10,A4 0,A5 -70,A6 0}}\nLIN P", False),
        (f"LIN {POSE % 0}\nF=$POS_ACT\nPTP {{A1 5,A2 -10,A3 -10,A4 0,A5 -70,A6 0}}\nPTP F", False),  # no S, no T
    ],
)
def test_a_position_that_is_read_keeps_status_and_turn(tmp_path, moves, cautious):
    body = f"DECL E6POS P\nDECL FRAME F\n{FRAMES}{SPEEDS}{moves}"
    assert ("configuration_not_read" in codes(check(tmp_path, krl(body), "a.src"))) == cautious


def test_a_turn_that_was_read_is_gone_back_to(tmp_path):
    """A6 was at -100 deg: the nearest solution after 250 deg would be 260 deg."""
    body = "DECL E6POS P\n$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\nPTP {A6 -100}\nP=$POS_ACT\nPTP {A6 0}\nPTP {A6 130}\n"
    found = check(tmp_path, krl(f"{body}PTP {{A6 250}}\nPTP P"), "a.src")
    last = list(found.motions.values())[-1]
    assert np.degrees(last.way.q[-1][5]) == pytest.approx(-100)


CALLED = "DEF b( )\nPTP {A1 K}\nEND\n"


@pytest.mark.parametrize(
    ("own", "shared", "way"),
    [
        ("DECL INT K=5", "", None),  # b does not see it
        ("DECL GLOBAL INT K=5", "", 5.0),
        ("DECL INT K=5", "DECL GLOBAL INT K=9", 9.0),  # what b sees is the controller's
        ("", "DECL GLOBAL INT K=9", 9.0),
    ],
)
def test_a_module_does_not_see_what_its_caller_keeps_for_itself(tmp_path, own, shared, way):
    (tmp_path / "a.dat").write_text(f"DEFDAT a PUBLIC\n{own}\nENDDAT\n")
    (tmp_path / "$config.dat").write_text(f"DEFDAT $CONFIG\n{shared}\nENDDAT\n")
    (tmp_path / "b.src").write_text(CALLED)
    assert joints(tmp_path, "b( )") == ([] if way is None else [way])
    if "K=5" in own:
        assert joints(tmp_path, "PTP {A1 K}\nb( )")[0] == 5.0  # the program itself does


def test_a_module_calls_the_module_of_a_name_and_not_its_caller_s_own_routine(tmp_path):
    (tmp_path / "b.src").write_text("DEF b( )\nhelp( )\nEND\n")
    (tmp_path / "help.src").write_text("DEF help( )\nPTP {A1 9}\nEND\n")
    text = krl("b( )\nhelp( )", more="DEF help( )\nPTP {A1 5}\nEND\n")
    found = motions(tmp_path, text, "a.src")
    assert [round(float(np.degrees(each.target.joints[0]))) for each in found] == [9, 5]


def test_a_parameter_of_a_module_is_not_the_variable_of_that_name(tmp_path):
    (tmp_path / "b.src").write_text("DEF b(K:IN )\nINT K\nPTP {A1 K}\nEND\n")
    (tmp_path / "b.dat").write_text("DEFDAT b\nDECL INT K=7\nENDDAT\n")
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL INT K=5\nENDDAT\n")
    assert joints(tmp_path, "b(9)") == [9.0]


@pytest.mark.parametrize(
    "line",
    [
        "TRIGGER WHEN DISTANCE=0 DELAY=F() DO $OUT[1]=TRUE",
        "TRIGGER WHEN PATH=F() DELAY=0 DO $OUT[1]=TRUE",
        "TRIGGER WHEN DISTANCE=0 DELAY=0 DO I=F()",
        "STOP WHEN PATH=F() IF $IN[1]",
        "ANIN ON X=1*F()+0",
    ],
)
def test_a_function_is_followed_wherever_it_is_called(tmp_path, line):
    more = "DEFFCT INT F( )\nN=9\nRETURN 0\nENDFCT\n"
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL INT N=5\nENDDAT\n")
    found = motions(tmp_path, krl(f"{line}\nPTP {{A1 N}}", more), "a.src")
    assert [round(float(np.degrees(each.target.joints[0]))) for each in found] == [9]


@pytest.mark.parametrize("folder", ["TP/Grip", "Program/sub", "System"])
def test_modules_anywhere_in_an_archive_are_read(tmp_path, folder):
    """USER_GRP is a controller's own name, whose file people edit."""
    program, place = tmp_path / "KRC/R1/Program", tmp_path / "KRC/R1" / folder
    for each in (program, place, tmp_path / "KRC/R1/System"):
        each.mkdir(parents=True, exist_ok=True)
    (place / "user_grp.src").write_text("GLOBAL DEF USER_GRP(N:IN)\nINT N\nPTP {A1 N}\nEND\n")
    (place / "own.src").write_text("DEF own( )\nPTP {A1 9}\nEND\n")
    assert joints(program, "USER_GRP(5)\nown( )") == [5.0, 9.0]


@pytest.mark.parametrize(("folder", "read"), [("Program/lib", True), ("System", False), ("TP/Sync", False)])
def test_a_users_module_of_the_name_of_a_controllers_own_is_read(tmp_path, folder, read):
    for each in ("Program/x", "System", folder):
        (tmp_path / each).mkdir(parents=True, exist_ok=True)
    (tmp_path / folder / "sync.src").write_text("DEF SYNC( )\nPTP {A1 9}\nEND\n")
    assert joints(tmp_path / "Program/x", "SYNC( )\nPTP {A1 5}") == ([9.0, 5.0] if read else [5.0])


def test_an_archive_is_known_however_its_letters_are_written(tmp_path):
    for each in ("PROGRAM/x", "PROGRAM/y", "SYSTEM"):
        (tmp_path / each).mkdir(parents=True)
    (tmp_path / "PROGRAM/y/own.src").write_text("DEF own( )\nPTP {A1 9}\nEND\n")
    assert joints(tmp_path / "PROGRAM/x", "own( )") == [9.0]


def test_a_folder_that_is_no_archive_is_not_searched(tmp_path):
    """As a system's own folder of that name, above a program that somebody keeps."""
    mine, others = tmp_path / "home/mine", tmp_path / "System/deep"
    for each in (mine, others):
        each.mkdir(parents=True)
    (others / "own.src").write_text("DEF own( )\nPTP {A1 9}\nEND\n")
    found = check(mine, krl("own( )\nPTP {A1 5}"), "a.src")
    assert codes(found)["may_move"] == [2]
    assert files_of(mine / "a.src") == (mine / "a.src",)


def test_turning_speeds_of_the_controller_s_data_hold_after_initmov(tmp_path):
    data = "REAL DEF_VEL_ORI1=20.0\nREAL DEF_VEL_ORI2=200.0\nREAL DEF_ACC_ORI1=20.0\nREAL DEF_ACC_ORI2=200.0\n"
    (tmp_path / "$config.dat").write_text(f"DEFDAT $CONFIG\n{data}ENDDAT\n")
    body = f"BAS(#INITMOV,0)\n{FRAMES}{SPEEDS}LIN {POSE % 0}\nLIN_REL {{A 60}}"
    found = check(tmp_path, krl(body), "a.src")
    assert list(found.motions.values())[-1].way.law.duration == pytest.approx(4.0)  # as of $VEL.ORI1 set directly


def test_a_frame_by_an_index_that_is_known_is_called_by_its_number(tmp_path):
    data = "BASE_DATA[2]={X 0,Y 0,Z 0,A 0,B 0,C 0}\nDECL INT N=2"
    found = with_data(tmp_path, f"$BASE=BASE_DATA[N]\nLIN {POSE % 0}", data)
    assert "frame_of_several" not in codes(found)
    (moved,) = motions(tmp_path, krl(f"{FRAMES}$BASE=BASE_DATA[N]\nLIN {POSE % 0}"), "a.src")
    assert moved.base.name == "BASE_DATA[2]"


@pytest.mark.parametrize(
    ("turn", "told"),
    [("A 60", False), ("C 60", False), ("A 60,C 60", True), ("A 3,C 3", False)],
)
def test_a_line_of_krl_that_swings_the_tool_and_turns_it_too_is_no_pass(tmp_path, turn, told):
    """In the tool's frame: A swings its x axis, C turns about it."""
    body = f"{FRAMES}{SPEEDS}LIN {POSE % 0}\nLIN_REL {{{turn}}} #TOOL"
    found = [each.finding for each in check(tmp_path, krl(body), "a.src").findings if each.place.line == 8]
    apart = [each.off_deg for each in found if each.code == "turns_otherwise"]
    assert bool(apart) == told
    if told:  # exp(s r) against exp(s swing) exp(s twist), worked out with scipy
        z, x = (Rotation.from_euler(axis, 60, degrees=True).as_rotvec() for axis in "zx")
        whole = (Rotation.from_rotvec(z) * Rotation.from_rotvec(x)).as_rotvec()
        ways = (
            Rotation.from_rotvec(s * whole).inv() * Rotation.from_rotvec(s * z) * Rotation.from_rotvec(s * x)
            for s in (0.25, 0.5, 0.75)
        )
        assert apart == [pytest.approx(max(np.degrees(each.magnitude()) for each in ways))]


@pytest.mark.parametrize(
    ("first", "second", "told"),
    [
        ("3.1416, 0, 0", "0, 3.1416, 0", True),  # half a turn about z, to 1e-11 rad
        ("3.14, 0, 0", "0, 3.14, 0", True),
        ("3.1416, 0, 0", "0.05, 3.1416, 0", False),
        ("3.1416, 0, 0", "3.1416, 0.1, 0", False),
    ],
)
def test_half_a_turn_is_no_pass_since_it_may_go_either_way(tmp_path, first, second, told):
    text = f"set_tcp(p[0,0,0,0,0,0])\nmovej({HOME_TEXT})\nmovel(p[0.4,0,0.4,{first}])\nmovel(p[0.4,0,0.45,{second}])\n"
    found = [each for each in check(tmp_path, text, "a.script").findings if each.finding.code == "turns_either_way"]
    assert [(each.place.line, each.level) for each in found] == ([(4, "caution")] if told else [])
    assert all(each.finding.axis == pytest.approx((0.0, 0.0, 1.0), abs=2e-3) for each in found)


@pytest.mark.parametrize("turn", ["A 180", "C 180"])
def test_half_a_turn_of_krl_is_no_pass(tmp_path, turn):
    body = f"{FRAMES}{SPEEDS}LIN {POSE % 0}\nLIN_REL {{{turn}}} #TOOL"
    assert 8 in codes(check(tmp_path, krl(body), "a.src"))["turns_either_way"]


@pytest.mark.parametrize(
    ("before", "turn", "told"),
    [(0, "A 20", False), (0, "B 20", True), (40, "B 20", True), (40, "A 20", False), (40, "B 20} #TOOL ;", False)],
)
def test_the_angles_of_a_relative_position_in_the_base_may_mean_two_things(tmp_path, before, turn, told):
    body = f"{FRAMES}{SPEEDS}LIN {{X 400,Y 0,Z 300,A {before},B 170,C 0}}\nLIN_REL {{{turn}}}"
    assert ("relative_turn_assumed" in codes(check(tmp_path, krl(body), "a.src"))) == told


def on_circle(degrees: float, yaw: float, tilt: float = 0.0) -> str:
    """A robtarget on a circle of 30 mm, of a tool that looks down, tilted, and is turned about the circle's axis."""
    turn = Rotation.from_euler("ZX", [yaw, 180 - tilt], degrees=True).as_quat()[[3, 0, 1, 2]]
    x, y = 400 + 30 * np.cos(np.radians(degrees)), 30 * np.sin(np.radians(degrees))
    return f"[[{x:.9f},{y:.9f},300],[{','.join(f'{each:.12f}' for each in turn)}],[0,0,0,0],{NONE}]"


def on_arc(first: str, point: str, last: str, mode: str = "") -> str:
    at = "v100,fine,tool0;"
    return rapid(f"ConfJ\\Off;\nMoveJ {first},{at}\n{mode}MoveC {point},{last},{at}")


@pytest.mark.parametrize(
    ("ends", "yaws", "tilt", "mode", "middle"),
    [
        ((-100, 100), (-100, 0, 100), 0, "", 0),  # with the path, though that is no shorter way
        ((-100, 100), (0, 0, 0), 0, "", 0),  # as it was all the way, though the path turns by 200 deg
        ((-90, 90), (-90, 0, 90), 0, "", 0),
        ((-100, 100), (-100, 0, 100), 0, "CirPathMode\\ObjectFrame;\n", 180),  # 160 deg the other way round
        ((-75, 75), (-75, 0, 75), 30, "", 0),  # half of the tilt, about the axis that is carried along
        ((-75, 75), (-75, 0, 75), 30, "CirPathMode;\n", 0),
    ],
)
def test_an_arc_of_rapid_turns_the_tool_with_the_path(tmp_path, ends, yaws, tilt, mode, middle):
    """As Basic Characteristics RAPID, MoveC, says; the orientation of the arc's point chooses between two senses."""
    start, point, end = on_circle(ends[0], yaws[0]), on_circle(0, yaws[1], tilt / 2), on_circle(ends[1], yaws[2], tilt)
    found = check(tmp_path, on_arc(start, point, end, mode), "a.mod")
    arc = list(found.motions.values())[-1]
    assert arc.way is not None
    assert not {each.code for each in arc.findings} & {"arc_turn_in_doubt", "turns_either_way", "way_out_of_reach"}
    assert "program_not_simulated" not in codes(found)
    R = forward(ROBOT, arc.way.joints_at(np.array([0.5])))[0, :3, :3]
    wanted = Rotation.from_euler("ZX", [middle, 180 - tilt / 2], degrees=True).as_matrix()
    assert np.degrees(rotation_angle(R, wanted)) < 1e-4


def test_a_point_on_an_arc_whose_orientation_is_as_far_from_both_senses_is_a_caution(tmp_path):
    ends = on_circle(-90, 0), on_circle(90, 0)
    assert "arc_turn_in_doubt" in codes(check(tmp_path, on_arc(ends[0], on_circle(0, 90), ends[1]), "a.mod"))
    assert "arc_turn_in_doubt" not in codes(check(tmp_path, on_arc(ends[0], on_circle(0, 20), ends[1]), "a.mod"))
    short = on_circle(-45, 0), on_circle(45, 0)  # which turns back by 90 deg beside the path
    for yaw, doubted in ((0, False), (180, True)):
        found = codes(check(tmp_path, on_arc(short[0], on_circle(0, yaw), short[1]), "a.mod"))
        assert ("arc_turn_in_doubt" in found) == doubted


def test_what_else_circular_paths_may_be_told_is_named(tmp_path):
    text = on_arc(on_circle(-90, 0), on_circle(0, 0), on_circle(90, 0), "CirPathMode\\CirPointOri;\n")
    assert codes(check(tmp_path, text, "a.mod"))["program_not_simulated"] == [9]


def test_an_arc_that_turns_with_the_path_is_no_arc_of_a_path(tmp_path):
    """A path's arcs turn about one axis: what does otherwise is left out, and what does not is none the less."""
    for yaws, parts in (((-75, 0, 75), 1), ((0, 0, 0), 2)):
        text = on_arc(*(on_circle(*each) for each in zip((-75, 0, 75), yaws, (0, 10, 20) if parts == 1 else (0, 0, 0))))
        found = check(tmp_path, text, "a.mod")
        made, rest = parts_of(found, ROBOT, CommandSource())
        assert (len(made), rest) == (parts, () if parts == 2 else (9,))


def test_arcs_are_written_so_that_they_turn_as_they_were_read_or_that_is_told(tmp_path):
    with_path = on_arc(on_circle(-75, -75), on_circle(0, 0, 10), on_circle(75, 75, 20))
    about_axis = with_path.replace("MoveC", "CirPathMode\\ObjectFrame;\nMoveC")
    for text, mode in ((with_path, "PathFrame"), (about_axis, "ObjectFrame")):
        listing = execute(written(tmp_path, text, "a.mod"), ROBOT, HOME).listing()
        again = write_program(listing, "rapid", WriteOptions(ROBOT, HOME)).files[".mod"]
        assert f"CirPathMode \\{mode};" in again
        assert motions(tmp_path, again, "b.mod")[-1].with_path == (mode == "PathFrame")
        for language in ("krl", "urscript"):
            told = {each.code for each in write_program(listing, language, WriteOptions(ROBOT, HOME)).findings}
            assert ("written_arcs_turn_otherwise" in told) == (mode == "PathFrame")
    plain = execute(written(tmp_path, on_arc(*(on_circle(each, 0) for each in (-75, 0, 75))), "a.mod"), ROBOT, HOME)
    assert "CirPathMode" not in write_program(plain.listing(), "rapid", WriteOptions(ROBOT, HOME)).files[".mod"]


@pytest.mark.parametrize(
    ("frame", "named"),
    [
        ('-use_joint_5 "rob1_6" -base_frame_pos_x 0\\\n      -base_frame_pos_z 0.9 -base_frame_orient_u0 0', True),
        ('-base_frame_coordinated "M7DM1"', True),
        ("-base_frame_pos_z 0 -base_frame_orient_u0 1 -base_frame_orient_u3 0", False),
        ("-gravity_beta 0", False),
    ],
)
def test_a_robot_that_its_configuration_puts_elsewhere_is_no_pass(tmp_path, frame, named):
    """As for KRL: what is a work object in the world is not one in the robot's base."""
    inside = tmp_path / "backup/RAPID/TASK1/PROGMOD"
    inside.mkdir(parents=True)
    (tmp_path / "backup/SYSPAR").mkdir()
    text = f'MOC:CFG_1.0:6:0::\n#\nROBOT:\n\n      -name "ROB_1" -use_joint_0 "rob1_1"\\\n      {frame}\n#\n'
    (tmp_path / "backup/SYSPAR/MOC.cfg").write_text(text + 'SINGLE:\n      -name "M7DM1" -base_frame_pos_x 1\n')
    found = check(inside, rapid("MoveL p,v100,fine,tool0;"), "a.mod")
    assert [each.place.line for each in found.findings if each.finding.code == "program_not_simulated"] == [5] * named
    assert [each.place.file.name for each in found.not_examined] == ["MOC.cfg"] * named
    assert "MOC.cfg" in {each.name for each in files_of(inside / "a.mod")}


@pytest.mark.parametrize("other", ["T_COMM", "T_COMM/PROGMOD", "T_COMM/modules", "TASK2/PROGMOD"])
def test_what_another_task_sets_has_no_known_value_whatever_its_folder_is_called(tmp_path, other):
    own = other.replace("T_COMM", "T_ROB1").replace("TASK2", "TASK1")
    for folder in (own, other):
        (tmp_path / folder).mkdir(parents=True)
    data = "PERS num height:=20;"
    (tmp_path / other / "comm.mod").write_text(f"MODULE comm\n{data}\nPROC main()\nheight:=50;\nENDPROC\nENDMODULE\n")
    found = check(tmp_path / own, rapid("MoveL Offs(p,0,0,height),v100,fine,tool0;", data), "a.mod")
    assert codes(found)["target_not_given"] == [7]


@pytest.mark.parametrize(
    ("done", "sets"),
    [
        ('GetDataVal "x",height;', True),
        ("ok:=StrToVal(text,height);", True),
        ("ReadRawBytes raw,1,height;", True),
        ("TPReadNum height,text;", True),
        ("IF height>5 n:=height;", False),
    ],
)
def test_what_another_task_reads_into_shared_data_is_set_there(tmp_path, done, sets):
    """The data may be declared in another module of the same task."""
    for folder in ("TASK1", "TASK2"):
        (tmp_path / folder).mkdir()
    data = "PERS num height:=20;"
    (tmp_path / "TASK2/data.sys").write_text(f"MODULE data\n{data}\nENDMODULE\n")
    (tmp_path / "TASK2/comm.mod").write_text(f"MODULE comm\nPROC main()\n{done}\nENDPROC\nENDMODULE\n")
    found = check(tmp_path / "TASK1", rapid("MoveL Offs(p,0,0,height),v100,fine,tool0;", data), "a.mod")
    assert ("target_not_given" in codes(found)) == sets


@pytest.mark.parametrize("wait", ["WaitDI di1,1", "WaitUntil di1=1", "WaitUntil n=2", "WaitTestAndSet busy"])
def test_a_wait_that_ends_anyhow_waits_for_no_other_task(tmp_path, wait):
    """Its flag is what it gives, not what it asks; nor is it kept to the next start."""
    option = "" if wait.endswith("busy") else "\\MaxTime:=3\\TimeFlag:=late"
    data = "VAR bool late;\nVAR bool busy;\nVAR num n:=1;"
    body = f"{wait}{option};\nMoveL p,v100,fine,tool0;\nIF late MoveL Offs(p,0,0,20),v100,fine,tool0;"
    assert not {"waits_for_others", "kept_to_next_start"} & codes(check(tmp_path, rapid(body, data), "a.mod")).keys()


def test_a_text_that_may_name_what_runs_already_is_a_caution_and_no_error(tmp_path):
    routines = f"PROC serve()\nSocketReceive s1\\Str:=cmd;\n%cmd%;\nENDPROC\nPROC up()\n{at_turn(20)}ENDPROC"
    body = "WHILE TRUE DO\nserve;\nENDWHILE"
    found = check(tmp_path, rapid(body, "VAR string cmd;\nVAR socketdev s1;", routines), "a.mod")
    ends = [each for each in found.findings if each.finding.code == "not_followed_to_end"]
    assert [(each.level, each.finding.kind, each.place.line) for each in ends] == [("caution", "guessed", 14)]
    assert found.level == "caution"
    assert {each.place.line for each in found.verdicts if each.times} == {6, 17}


@pytest.mark.parametrize(("main", "named"), [("MAIN", True), ("other", False), ("main", None)])
def test_a_module_that_is_checked_without_the_main_that_calls_it_is_no_pass(tmp_path, main, named):
    """What main sets before, as a displacement, is not known to it."""
    helper = f"MODULE helper\n{TARGET}PROC path()\nMoveL p,v100,fine,tool0;\nENDPROC\nENDMODULE\n"
    called = "PDispSet [[0,0,-250],[1,0,0,0]];\npath;\n" if named is not None else "Stop;\n"
    (tmp_path / "cell.mod").write_text(f"MODULE cell\nPROC {main}()\n{called}ENDPROC\nENDMODULE\n")
    found = check(tmp_path, helper, "helper.mod")
    assert codes(found).get("program_begun_within", []) == [3] * bool(named)
    assert [(each.place.line, each.what) for each in found.not_examined] == [(3, "course")] * bool(named)


@pytest.mark.parametrize(("zone", "known"), [("fine", True), ("z10", False)])
def test_a_procedure_that_is_called_within_a_corner_is_none_that_comes_before_the_next_line(tmp_path, zone, known):
    """Of the next line's target the program reads the variables before the arm is in the corner."""
    body = f'n:=0;\nMoveLSync p,v100,{zone},tool0,"shift";\nMoveL Offs(p,0,0,n),v100,fine,tool0;'
    last = motions(tmp_path, rapid(body, "VAR num n;", "PROC shift()\nn:=n+50;\nENDPROC"), "a.mod")[-1]
    assert isinstance(last.target, PoseTarget) == known
    moving = rapid(body, "VAR num n;", "PROC shift()\nMoveL Offs(p,0,50,0),v100,fine,tool0;\nENDPROC")
    assert ("moves_beside" in codes(check(tmp_path, moving, "a.mod"))) != known


def test_what_is_computed_of_joints_and_targets_goes_with_the_displacement(tmp_path):
    """By ABB's manual both functions are for the program displacement that is active: 20 mm up."""
    data = f"VAR robtarget r;VAR jointtarget j;CONST jointtarget h:=[[0,-10,-10,0,-70,0],{NONE}];"
    there = "r:=CalcRobT(h,tool0);\nMoveL r,v100,fine,tool0;"
    plain, moved = (
        motions(tmp_path, rapid(before + there, data), "a.mod")[-1]
        for before in ("", "PDispSet [[0,0,20],[1,0,0,0]];\n")
    )
    assert moved.target.pose[2, 3] == pytest.approx(plain.target.pose[2, 3] - 0.02)
    there = "j:=CalcJointT(p,tool0);\nMoveAbsJ j,v100,fine,tool0;"
    moved = motions(tmp_path, rapid("PDispSet [[0,0,20],[1,0,0,0]];\n" + there, data), "a.mod")[-1]
    np.testing.assert_allclose((moved.base.pose @ moved.target.pose)[:3, 3], [0.4, 0, 0.32], atol=1e-9)


@pytest.mark.parametrize(
    ("routine", "named"),
    [
        ("height:=-150;", True),
        ("PDispSet [[0,0,-150],[1,0,0,0]];", True),
        ("SetDO do1,0; ! height:=3", False),
        ("unused:=2;", False),
        (None, True),
    ],
)
def test_a_routine_that_the_controller_calls_at_an_event_is_named_if_it_may_change_motions(tmp_path, routine, named):
    inside = tmp_path / "RAPID/TASK1/PROGMOD"
    inside.mkdir(parents=True)
    (tmp_path / "SYSPAR").mkdir()
    hooks = 'CAB_EXEC_HOOKS:\n\n      -Routine "rStart" -Shelf "START"\n#\nCAB_TASKS:\n      -Routine "rOther"\n'
    (tmp_path / "SYSPAR/SYS.cfg").write_text(f"SYS:CFG_1.0:6:0::\n#\n{hooks}")
    if routine is not None:
        text = f"MODULE ev\nVAR num unused;\nPROC rStart()\n{routine}\nENDPROC\nENDMODULE\n"
        (inside / "ev.mod").write_text(text)
    found = check(inside, rapid("MoveL Offs(p,0,0,height),v100,fine,tool0;", "VAR num height:=0;"), "a.mod")
    assert [each.place.line for each in found.findings if each.finding.code == "program_not_simulated"] == [5] * named
