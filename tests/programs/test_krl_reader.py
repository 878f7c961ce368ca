"""KRL as pendants save it and people write it."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.errors import InputError
from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import forward
from er3a.programs.instructions import Aside, Decision, JointTarget, Output, Pause, PoseTarget, Unknown
from er3a.programs.languages import execute, read_program

DATA = """&ACCESS RVP
DEFDAT weld PUBLIC
EXT BAS (BAS_COMMAND :IN,REAL :IN )
DECL E6POS XP1={X 500.0,Y 10.0,Z 400.0,A 0.0,B 90.0,C 0.0,S 2,T 35,E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}
DECL FDAT FP1={TOOL_NO 3,BASE_NO 0,IPO_FRAME #BASE,POINT2[] " ",TQ_STATE FALSE}
DECL LDAT LCPDAT1={VEL 2.0,ACC 80.0,APO_DIST 50.0,APO_FAC 50.0,AXIS_VEL 100.0,ORI_TYP #VAR}
DECL PDAT PPDAT1={VEL 100.0,ACC 60.0,APO_DIST 20.0,APO_MODE #CPTP}
DECL E6POS ROW[3]
ROW[2]={X 510.0,Y 20.0,Z 410.0,A 0.0,B 90.0,C 0.0}
SIGNAL GRIPPER $OUT[8]
ENDDAT
"""


def run(folder, body, data=DATA, more="", **given):
    """A program with this body, run."""
    path = folder / "weld.src"
    path.write_text(f"&ACCESS RVP\nDEF weld( )\n{body}\nEND\n{more}", encoding="utf-8")
    if data is not None:
        (folder / "weld.dat").write_text(data, encoding="utf-8")
    return execute(read_program(path), **given)


def moves(execution):
    """The motions of all steps."""
    return [step.instruction for step in execution.steps if hasattr(step.instruction, "target")]


def test_inline_forms_give_speed_zone_tool_and_base(tmp_path):
    body = """;FOLD LIN P1 CONT Vel=2 m/s CPDAT1 Tool[3]:gun Base[0];%{PE}%R 8.3.44,%MKUKATPBASIS,%CMOVE,%VLIN
$BWDSTART=FALSE
LDAT_ACT=LCPDAT1
FDAT_ACT=FP1
BAS(#CP_PARAMS,2)
LIN XP1 C_DIS C_DIS
;ENDFOLD
PDAT_ACT=PPDAT1
BAS(#PTP_PARAMS,70)
PTP XP1 C_PTP"""
    line, joint = moves(run(tmp_path, body))
    assert (line.speed.value, line.speed.unit) == (2.0, "m/s")
    assert (line.acceleration.value, line.acceleration.unit) == (0.8, "share")
    assert (line.zone.kind, line.zone.value) == ("distance", 0.05)
    assert (line.tool.name, line.base.name) == ("TOOL_DATA[3]", "$NULLFRAME")
    assert line.target.configuration == (("S", 2.0), ("T", 35.0))
    np.testing.assert_allclose(line.target.pose[:3, 3], [0.5, 0.01, 0.4])
    assert (joint.speed.value, joint.acceleration.value) == (0.7, 0.6)
    assert (joint.zone.kind, joint.zone.value) == ("share", 0.2)


def test_settings_behind_with_hold_for_their_motion_alone(tmp_path):
    body = """$VEL.CP=0.5
SLIN XP1 WITH $VEL=SVEL_CP(0.1, ,LCPDAT1), $TOOL=STOOL2(FP1), $BASE=SBASE(FP1.BASE_NO), $APO=SAPO(LCPDAT1) C_SPL
SPTP XP1 WITH $VEL_AXIS[1]=SVEL_JOINT(30.0), $TOOL=STOOL2(FP1), $ACC_AXIS[1]=SACC_JOINT(PPDAT1)
LIN XP1"""
    slow, joint, after = moves(run(tmp_path, body))
    assert (slow.speed.value, slow.zone.value, slow.tool.name) == (0.1, 0.05, "TOOL_DATA[3]")
    assert (joint.speed.value, joint.acceleration.value) == (0.3, 0.6)
    assert (after.speed.value, after.tool.name, after.acceleration) == (0.5, "", None)


def test_a_partial_position_keeps_the_rest(tmp_path):
    first, second, third = moves(run(tmp_path, "LIN XP1\nLIN {X 100}\nPTP {A3 10}"))
    np.testing.assert_allclose(second.target.pose[:3, 3], [0.1, 0.01, 0.4])
    np.testing.assert_allclose(second.target.pose[:3, :3], first.target.pose[:3, :3], atol=1e-12)
    assert np.isnan(third.target.joints).tolist() == [True, True, False, True, True, True]


def test_a_partial_position_behind_axes_needs_the_arm(tmp_path):
    robot, q = load_robot("er3a_c60"), np.radians([10.0, -20.0, 15.0, 5.0, -60.0, 20.0])
    frames, axes = "$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\n", "PTP {A1 10,A2 -20,A3 15,A4 5,A5 -60,A6 20}\n"
    body = f"{frames}{axes}LIN {{X 100}}\nLIN_REL {{Z 10}} #TOOL"
    unknown = moves(run(tmp_path, body))
    assert [each.target.reason for each in unknown[1:]] == ["position_unknown"] * 2
    _, known, up = moves(run(tmp_path, body, robot=robot))
    T = forward(robot, q)
    np.testing.assert_allclose(known.target.pose[1:], T[1:], atol=1e-12)
    assert known.target.pose[0, 3] == pytest.approx(0.1)
    np.testing.assert_allclose(up.target.pose[:3, 3], known.target.pose[:3, 3] + 0.01 * T[:3, 2], atol=1e-12)


def test_a_relative_line_turns_about_the_axes_of_base_or_of_tool(tmp_path):
    robot, q = load_robot("er3a_c60"), np.radians([10.0, -20.0, 15.0, 5.0, -60.0, 20.0])
    body = "$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\nPTP {A1 10,A2 -20,A3 15,A4 5,A5 -60,A6 20}\nLIN_REL {A 90,X 10}"
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    T = forward(robot, q)
    for frame, R, way in (("#BASE", turn @ T[:3, :3], [0.01, 0, 0]), ("#TOOL", T[:3, :3] @ turn, 0.01 * T[:3, 0])):
        _, found = moves(run(tmp_path, f"{body} {frame}", robot=robot))
        np.testing.assert_allclose(found.target.pose[:3, :3], R, atol=1e-12)
        np.testing.assert_allclose(found.target.pose[:3, 3], T[:3, 3] + way, atol=1e-12)


def test_more_than_full_speed_is_full_speed(tmp_path):
    for percent, share in ((150, 1.0), (40, 0.4)):
        (line,) = moves(run(tmp_path, f"BAS(#ACC_CP,{percent})\nLIN {{X 400,Y 0,Z 450,A 0,B 0,C 180}}"))
        assert (line.acceleration.value, line.acceleration.unit) == (share, "share")


def test_positions_are_computed_with(tmp_path):
    body = """DECL E6POS P
DECL INT i
P=XP1
FOR i=1 TO 3 STEP 2
P.X=XP1.X+i*10
LIN P
ENDFOR
LIN XP1:{X 0,Y 0,Z 10,A 0,B 0,C 0}
LIN ROW[2]
LIN lifted(XP1, 50.0)"""
    more = "DEFFCT E6POS lifted(q:IN,dz:IN)\nDECL E6POS q\nDECL REAL dz\nq.Z=q.Z+dz\nRETURN q\nENDFCT\n"
    found = [each.target.pose[:3, 3] * 1000 for each in moves(run(tmp_path, body, more=more))]
    wanted = [[510, 10, 400], [530, 10, 400], [510, 10, 400], [510, 20, 410], [500, 10, 450]]
    np.testing.assert_allclose(found, wanted, atol=1e-9)


def test_subroutines_take_arguments_and_give_values_back(tmp_path):
    body = "DECL INT n\nn=2\ngo(n, 3)\nIF n==5 THEN\nPTP {A1 1,A2 0,A3 0,A4 0,A5 0,A6 0}\nENDIF"
    more = "DEF go(a:OUT,b:IN)\nINT a\nINT b\nPTP {A1 9,A2 0,A3 0,A4 0,A5 0,A6 0}\na=a+b\nEND\n"
    execution = run(tmp_path, body, more=more)
    steps = [step for step in execution.steps if hasattr(step.instruction, "target")]
    assert [round(float(np.degrees(step.instruction.target.joints[0]))) for step in steps] == [9, 1]
    assert [[place.line for place in step.calls] for step in steps] == [[5], []]
    assert steps[0].place.line == 13


def test_branches_on_inputs_are_followed_on_both_sides(tmp_path):
    body = """LOOP
IF $IN[1] AND NOT $IN[2] THEN
PTP {A1 1,A2 0,A3 0,A4 0,A5 0,A6 0}
ELSE
PTP {A1 2,A2 0,A3 0,A4 0,A5 0,A6 0}
ENDIF
WAIT SEC 0.5
WAIT FOR $IN[3]
GRIPPER=TRUE
ENDLOOP"""
    execution = run(tmp_path, body)
    assert execution.complete
    angles = {round(float(np.degrees(each.target.joints[0]))) for each in moves(execution)}
    assert angles == {1, 2}
    kinds = [type(step.instruction) for step in execution.steps]
    assert (
        kinds.count(Decision) == len([step for step in execution.steps if isinstance(step.instruction, Decision)]) >= 2
    )
    said = [step.instruction for step in execution.steps]
    assert Pause(0.5) in said
    assert Pause(condition="$IN[3]") in said
    assert Output("$OUT[8]", "TRUE") in said


def test_a_counter_of_parts_does_not_hide_that_a_loop_repeats(tmp_path):
    execution = run(tmp_path, "DECL INT n\nn=0\nLOOP\nn=n+1\nPTP {A1 1,A2 0,A3 0,A4 0,A5 0,A6 0}\nENDLOOP")
    assert [each.kind for each in execution.endings] == ["joins"]
    assert len(moves(execution)) <= 2


def test_a_loop_that_drifts_is_told_from_one_that_repeats(tmp_path):
    body = "DECL E6POS P\nP=XP1\nLOOP\nP.X=P.X+1\nLIN P\nENDLOOP"
    execution = run(tmp_path, body)
    reasons = {getattr(each.target, "reason", "") for each in moves(execution)}
    assert [each.kind for each in execution.endings] == ["joins"]
    assert reasons == {"", "undefined"}


def test_recursion_ends(tmp_path):
    execution = run(tmp_path, "again()", more="DEF again()\nPTP {A1 1,A2 0,A3 0,A4 0,A5 0,A6 0}\nagain()\nEND\n")
    assert [each.kind for each in execution.endings] == ["depth"]


@pytest.mark.parametrize(
    ("body", "angles"),
    [
        ("i=0\nREPEAT\ni=i+1\nMOVE\nUNTIL i>=3", [1, 2, 3]),
        ("i=0\nWHILE i<3\ni=i+1\nMOVE\nENDWHILE", [1, 2, 3]),
        ("FOR i=3 TO 1 STEP -1\nMOVE\nENDFOR", [3, 2, 1]),
        ("i=0\nLOOP\ni=i+1\nMOVE\nIF i==2 THEN\nEXIT\nENDIF\nENDLOOP", [1, 2]),
        ("i=1\nagain:\nMOVE\ni=i+1\nIF i<3 THEN\nGOTO again\nENDIF", [1, 2]),
        ("i=2\nSWITCH i\nCASE 1\ni=7\nCASE 2,3\ni=8\nDEFAULT\ni=9\nENDSWITCH\nMOVE", [8]),
        ("i=5\nSWITCH i\nCASE 1\ni=7\nDEFAULT\ni=9\nENDSWITCH\nMOVE", [9]),
        ("i=7/2\nMOVE", [3]),
    ],
)
def test_control_structures(body, angles, tmp_path):
    move = "PTP {A1 i,A2 0,A3 0,A4 0,A5 0,A6 0}"
    execution = run(tmp_path, "DECL INT i\n" + body.replace("MOVE", move))
    assert [round(float(np.degrees(each.target.joints[0]))) for each in moves(execution)] == angles
    assert [each.kind for each in execution.endings] == ["end"]


def test_arcs(tmp_path):
    body = "LIN XP1\nCIRC {X 510,Y 20,Z 400,A 0,B 90,C 0},{X 520,Y 10,Z 400,A 0,B 90,C 0},CA 90 C_DIS"
    _, arc = moves(run(tmp_path, body))
    assert (arc.kind, arc.zone.kind) == ("arc", "named")
    assert (arc.target.text, arc.target.reason) == ("CA", "arc_angle")


def test_what_is_not_understood_is_kept_and_named(tmp_path):
    execution = run(tmp_path, "PTP {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}\n???\nSOME_TECH(1,#ON)\nPTP XHOME\nLIN {X NAN}")
    said = [step.instruction for step in execution.steps]
    assert Unknown("???") in said
    assert Unknown("SOME_TECH(1,#ON)") in said
    home, lost = (each.target for each in moves(execution)[1:])
    assert (home.text, home.reason) == ("XHOME", "undefined")
    assert lost.reason == "not_finite"


def test_triggers_and_interrupts_move_nothing_unless_they_call(tmp_path):
    body = "INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )"
    body += "\nTRIGGER WHEN PATH=0 DELAY=0 DO $OUT[1]=TRUE"
    body += "\nINTERRUPT DECL 4 WHEN $IN[1] DO flee()"
    kinds = [type(step.instruction) for step in run(tmp_path, body).steps]
    assert kinds == [Aside, Aside, Unknown]  # no file holds what it calls


def test_external_axes_are_kept(tmp_path):
    found = moves(
        run(tmp_path, "PTP {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0,E1 120.5}\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0,E1 7,E2 0}")
    )
    assert isinstance(found[0].target, JointTarget)
    assert isinstance(found[1].target, PoseTarget)
    assert [each.target.external for each in found] == [(("E1", 120.5),), (("E1", 7.0),)]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("DEF a()\nIF TRUE THEN\nEND\n", "the IF that begins here has no end"),
        ("DEF a()\nLOOP\nENDWHILE\n", "the LOOP of line 2 is open"),
        ("DEF a()\nENDIF\nEND\n", "none is open"),
        ('DEF a()\nX="open\nEND\n', "a text has no end"),
        ("DEF a()\nGOTO nowhere\nEND\n", "no label"),
        ("DEF a()\nPTP {A1 0}\n", "has no END"),
        ("DEF (\nEND\n", "head of a routine"),
        ("PTP {A1 0}\n", "outside of any routine"),
        ("DEF a()\nINT I\nFOR I=1 TO 2 STEP 0\nENDFOR\nEND\n", "STEP 0"),
    ],
)
def test_what_has_no_end_is_an_error_with_its_line(text, told, tmp_path):
    path = tmp_path / "a.src"
    path.write_text(text)
    with pytest.raises(InputError, match="line") as caught:
        read_program(path)
    assert told in str(caught.value)


def test_speeds_and_zones_set_as_a_whole_count_like_their_fields(tmp_path):
    body = "$VEL.CP=0.1\n$VEL={CP 0.3,ORI1 200.0}\n$ACC={CP 2.0}\n$APO={CPTP 50,CDIS 20}\n"
    body += "LIN {X 300,Y 0,Z 300,A 0,B 0,C 180} C_DIS\n$VEL.CP=0.2\nLIN {X 310,Y 0,Z 300,A 0,B 0,C 180}\n"
    (tmp_path / "a.src").write_text(f"DEF a( )\n{body}END\n")
    first, second = execute(read_program(tmp_path / "a.src")).listing().motions
    assert (first.speed.value, first.acceleration.value, first.zone.value) == (0.3, 2.0, 0.02)
    assert second.speed.value == 0.2


def test_axes_beside_the_arm_are_named(tmp_path):
    body = "PTP {A1 0,A2 -20,A3 0,A4 0,A5 -60,A6 0}\nASYPTP {E1 10}\nON_ERROR_PROCEED\nPTP {A1 5}"
    execution = run(tmp_path, body)
    assert [each for each in execution.steps if isinstance(each.instruction, Unknown)]
    assert np.isnan(moves(execution)[1].target.joints[1:]).all()


def test_the_zone_of_a_joint_spline_is_that_of_its_data(tmp_path):
    body = "SPTP XP1 WITH $APO = SAPO_PTP(PPDAT1) C_Spl\nSLIN XP1 WITH $APO = SAPO(LCPDAT1) C_SPL"
    joint, line = moves(run(tmp_path, body))
    assert (joint.zone.kind, joint.zone.value) == ("share", 0.2)
    assert (line.zone.kind, line.zone.value) == ("distance", 0.05)


@pytest.mark.parametrize(("line", "named"), [("KLIN XP1", True), ("INT XP1", False), ("DECL PART XP1", False)])
def test_two_names_among_instructions_are_a_declaration_only_by_a_known_type(tmp_path, line, named):
    execution = run(tmp_path, f"PTP {{A1 5}}\n{line}\nPTP {{A1 6}}")
    found = [each.instruction for each in execution.steps if isinstance(each.instruction, Unknown)]
    assert [each.may_move for each in found] == [True] * named


def test_what_a_switch_asks_is_worked_out_once(tmp_path):
    more = "DEFFCT INT NEXT( )\nN=N+1\nRETURN N\nENDFCT\n"
    body = "SWITCH NEXT( )\nCASE 2\nPTP {A1 2}\nCASE 1\nPTP {A1 1}\nENDSWITCH\nPTP {A1 N}"
    found = moves(run(tmp_path, body, data="DEFDAT a\nINT N=0\nENDDAT\n", more=more))
    assert [round(float(np.degrees(each.target.joints[0]))) for each in found] == [1, 1]


def test_a_case_whose_values_can_not_be_read_is_an_error(tmp_path):
    with pytest.raises(InputError, match="CASE"):
        run(tmp_path, "SWITCH N\nCASE 1 2\nENDSWITCH")


@pytest.mark.parametrize(
    "line",
    ["中文", "LIN {X 1} 中", "PTP é {A1 1}", "X=1 µ", "'", "°", "\\", "LIN {X 1,}", "PTP {A1 1,A1 2}", "LIN {X a,X b}"],
)
def test_lines_that_are_no_krl_are_kept_and_named(line, tmp_path):
    execution = run(tmp_path, line)
    (step,) = execution.steps
    assert isinstance(step.instruction, Unknown)
    assert step.instruction.text == line


def test_a_position_of_axes_and_coordinates_is_none(tmp_path):
    (motion,) = moves(run(tmp_path, "PTP {X 400,A1 5}"))
    assert motion.target.reason == "not_understood"


def test_relative_motions_by_a_tool_beside_the_arm_are_not_understood(tmp_path):
    """The workpiece moves by them, not the tool: the way of the flange is another."""
    body = "$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\nPTP {A1 0,A2 -90,A3 90,A4 0,A5 30,A6 0}\n$IPO_MODE=#TCP\n"
    line, joint = moves(run(tmp_path, f"{body}LIN_REL {{X 5}}\nPTP_REL {{A1 5}}", robot=load_robot("er3a_c60")))[1:]
    assert line.target.reason == "external_tool"
    assert not isinstance(joint.target, PoseTarget)


AXES = "PTP {{A1 {}, A2 0, A3 0, A4 0, A5 -60, A6 0}}"


@pytest.mark.parametrize(
    ("body", "more"),
    [
        ("S(A[])", "DEF S(X[]:OUT)\nINT X[]\nX[1]=50\nEND"),
        ("S(A[])", "DEF S(X[]:OUT)\nINT X[]\nT(X[])\nEND\nDEF T(Y[]:OUT)\nINT Y[]\nY[1]=50\nEND"),
        ("I=F(A[])", "DEFFCT INT F(X[]:OUT)\nINT X[]\nX[1]=50\nRETURN 1\nENDFCT"),
        ("B[2]=50\nA[]=B[]", None),
        ('SREAD("50",STATE,OFFSET,"%d",A[1])', None),
        ('I=EKI_GETINT("Cell","Angle",A[1])', None),
        ('IF EKI_GETINT("Cell","Angle",A[1]) THEN\nWAIT SEC 1\nENDIF', None),
        ("CAST_FROM(BUFFER[],OFFSET,A[])", None),
        ("LOST(A[])", None),
    ],
)
def test_what_is_passed_by_reference_does_not_keep_its_old_value(body, more, tmp_path):
    found = run(tmp_path, f"DECL INT A[2],B[2],I\nA[1]=3\nA[2]=4\n{body}\n{AXES.format('A[1]')}", more=more or "")
    known = [each.target.joints[0] for each in moves(found) if isinstance(each.target, JointTarget)]
    assert known == []
    assert moves(found)


def test_percents_beyond_100_are_taken_as_100_and_kept_to_be_named(tmp_path):
    (found,) = moves(run(tmp_path, "BAS(#VEL_PTP,400)\nPTP {A1 10,A2 0,A3 0,A4 0,A5 0,A6 0}"))
    assert (found.speed.value, found.speed.unit, found.speed.text) == (1.0, "share", "400 %")


def test_what_a_trigger_sets_but_outputs_is_not_followed(tmp_path):
    body = "TRIGGER WHEN PATH=0 DELAY=0 DO {}\nPTP {{A1 10,A2 0,A3 0,A4 0,A5 0,A6 0}}"
    for what, known in (("$OUT[1]=TRUE", True), ("$VEL_AXIS[7]=50", False), ("N=1", False)):
        steps = run(tmp_path, body.format(what)).steps
        assert any(isinstance(each.instruction, Unknown) for each in steps) != known


@pytest.mark.parametrize("inside", ["X[K]=50", "GETTHEM(X[])"])
def test_a_list_of_which_an_unknown_element_is_set_has_none_that_is_known(inside, tmp_path):
    more = f"DEF S(X[]:OUT)\nINT X[],K\n{inside}\nEND"
    found = run(tmp_path, f"DECL INT A[2]\nA[1]=3\nS(A[])\n{AXES.format('A[1]')}", more=more)
    assert [each.target for each in moves(found) if isinstance(each.target, JointTarget)] == []


def test_functions_that_only_read_their_arguments_keep_them(tmp_path):
    body = f'DECL INT I\nI=3\nEKI_SETINT("Cell","Angle",I)\nCWRITE(H,STATE,MODE,"%d",I)\n{AXES.format("I")}'
    (move,) = moves(run(tmp_path, body))
    assert move.target.joints[0] == pytest.approx(np.radians(3))


@pytest.mark.parametrize(
    "body",
    [
        'S[]="abc"\nS[1]="z"\nIF S[]=="abc" THEN',
        'S[1]="z"\nS[]="abc"\nIF S[1]=="z" THEN',
        'S[]="abc"\nSTRCLEAR(S[])\nIF S[]=="abc" THEN',
    ],
)
def test_a_text_and_its_letters_change_together(body, tmp_path):
    found = run(tmp_path, f"DECL CHAR S[9]\n{body}\n{AXES.format(5)}\nELSE\n{AXES.format(7)}\nENDIF")
    assert len(moves(found)) == 2  # both sides


@pytest.mark.parametrize(
    ("body", "data", "reached", "told"),
    [
        ("DECL AXIS P[3]\nP[3]={AT}\nPTP P[3]", "", 1, False),
        ("DECL AXIS P[3]\nP[0]={AT}\nPTP P[0]", "", 0, True),
        ("DECL AXIS P[3]\nP[4]={AT}\nPTP P[4]", "", 0, True),
        ("INT I\nDECL AXIS P[3]\nFOR I=1 TO 4\nP[I]={AT}\nP[I].A1=5\nPTP P[I]\nENDFOR", "", 3, True),
        ("INT M[2,2]\nM[2,1]=5\nPTP {A1 M[2,1],A2 0,A3 0,A4 0,A5 30,A6 0}", "", 1, False),
        ("INT M[2,2]\nM[3,1]=5\nPTP {A1 M[3,1],A2 0,A3 0,A4 0,A5 30,A6 0}", "", 0, True),
        ("PTP XP[2]\nPTP XP[1]", "DECL AXIS XP[2]\nXP[1]={AT}\nXP[2]={AT}", 2, False),
        ("PTP XP[3]", "DECL AXIS XP[2]\nXP[3]={AT}", 0, True),
        ("$VEL_AXIS[6]=50\n$ACC_AXIS[1]=50\nPTP {AT}", "", 1, False),
        ("$VEL_AXIS[7]=50\nPTP {AT}", "", 1, True),
        ("PTP {AT} WITH $VEL_AXIS[1]=50", "", 1, False),
        ("PTP {AT} WITH $VEL_AXIS[7]=50", "", 1, True),
        ("IF $VEL_AXIS[7]>10 THEN\nENDIF\nPTP {AT}", "", 1, True),
        ("REAL X\nX=2*$ACC_AXIS[13]\nPTP {AT}", "", 1, True),
        ("INT I\nFOR I=1 TO 7\n$ACC_AXIS[I]=50\nENDFOR\nPTP {AT}", "", 1, True),
    ],
)
def test_an_element_that_a_list_is_not_declared_with_is_none_and_told(body, data, reached, told, tmp_path):
    """Indices begin at 1, and a controller stops at one outside of the declaration."""
    at = "{A1 10,A2 0,A3 0,A4 0,A5 30,A6 0}"
    more = f"DEF S(Q[]:OUT)\nDECL AXIS Q[]\nQ[3]={at}\nEND"
    found = run(tmp_path, body.replace("{AT}", at), f"DEFDAT weld\n{data}\nENDDAT\n".replace("{AT}", at), more)
    given = [each for each in moves(found) if isinstance(each.target, JointTarget)]
    assert len(given) == reached
    lines = [each for step in found.steps if isinstance(each := step.instruction, Unknown)]
    assert bool(lines) == told


def test_a_tool_beyond_the_declared_ones_is_the_one_that_is_given(tmp_path):
    (tmp_path / "$config.dat").write_text("DEFDAT $CONFIG PUBLIC\nDECL FRAME TOOL_DATA[16]\nENDDAT\n")
    body = "$TOOL=TOOL_DATA[20]\nLIN {X 400,Y 0,Z 450,A 0,B 0,C 180}"
    for given in ({}, {"TOOL_DATA[20]": np.eye(4)}):
        (found,) = moves(run(tmp_path, body, frames=given))
        assert found.tool.name.startswith("TOOL_DATA[20]")
        assert (found.tool.pose is not None) == bool(given)


def test_where_the_arm_is_becomes_the_base(tmp_path):
    """0, 0, 50 in a base at the arm's own position is 50 mm further along the tool's z."""
    body = """$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\nPTP {A1 0,A2 -10,A3 -10,A4 0,A5 -70,A6 0}
$BASE=$POS_ACT
LIN {X 0,Y 0,Z 50,A 0,B 0,C 0}
$TOOL=$POS_ACT
PTP {A1 5}"""
    robot = load_robot("er3a_c60")
    first, line, last = moves(run(tmp_path, body, robot=robot, start=np.zeros(6)))
    here, there = forward(robot, first.target.joints), (line.base.pose @ line.target.pose)[:3, 3]
    np.testing.assert_allclose(there, (here @ [0, 0, 0.05, 1])[:3], rtol=0, atol=1e-3)
    assert last.tool.name == "$POS_ACT"
