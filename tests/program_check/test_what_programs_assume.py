"""What a program leaves to the controller, to the cell or to its next start: it is followed, or noted with the verdict.

Expected times and joints are worked out by hand in the comments.
"""

from __future__ import annotations

import numpy as np
import pytest

from er3a.geometry.transforms import transform
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.programs.instructions import JointTarget, PoseTarget
from er3a.programs.languages import read_program, write_program
from er3a.programs.machine import execute
from er3a.programs.writing import WriteOptions
from testing.program_texts import FRAMES, HOME, HOME_TEXT, NEAR, ROBOT, axes, check, codes, krl, motions, written

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
    (folder / "a.dat").write_text(f"DEFDAT a\n{data}\nENDDAT\n")
    return check(folder, krl(FRAMES + SPEEDS + body), "a.src", **options)


def joints(folder, body: str) -> list[float]:
    """Where joint 1 goes, deg, on each motion of a KRL program."""
    found = motions(folder, krl(body), "a.src")
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
