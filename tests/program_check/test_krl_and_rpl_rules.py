"""Rules of KRL and RPL: what a program leaves out, what the controller sets, and what no manual says."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.programs.instructions import JointTarget, Listing, PoseTarget, UnresolvedTarget, numbers_of
from er3a.programs.languages import write_program
from er3a.programs.writing import WriteOptions
from testing.program_texts import (
    FAR,
    FRAMES,
    HOME,
    NEAR,
    ROBOT,
    axes,
    check,
    codes,
    krl,
    motions,
    written,
)


def test_whole_numbers_are_joined_bit_by_bit(tmp_path):
    values = ("6 B_AND 3", "6 B_OR 3", "6 B_EXOR 3", "B_NOT 6")
    body = "DECL INT n\n" + "\n".join(f"n={value}\nPTP {{A1 (n)}}" for value in values)
    found = [np.degrees(each.target.joints[0]) for each in motions(tmp_path, krl(body), "a.src")]
    np.testing.assert_allclose(found, [2, 7, 5, -7])


def test_an_index_beyond_a_list_is_a_fault_in_its_line(tmp_path):
    body = f"DECL AXIS P[2]\n$VEL_AXIS[6]=50\n$VEL_AXIS[7]=50\nP[2]={axes(NEAR)}\nPTP P[2]\nP[3]={axes(NEAR)}"
    found = check(tmp_path, krl(body), "a.src").findings
    assert [each.place.line for each in found if each.level == "fail"] == [4, 7]


CONFIG = """DEFDAT $CONFIG
DECL FRAME TOOL_DATA[16]
TOOL_DATA[1]={X 0.0,Y 0.0,Z 107.7,A 0.0,B 0.0,C 0.0}
DECL REAL DEF_VEL_CP=2.0
DECL REAL DEF_ACC_CP=2.3
DECL REAL DEF_APO_CDIS=1.5
ENDDAT
"""


def test_initmov_sets_what_the_controllers_own_module_sets(tmp_path):
    (tmp_path / "$config.dat").write_text(CONFIG)
    body = "$TOOL={X 0,Y 0,Z 50,A 0,B 0,C 0}\n$BASE={X 500,Y 0,Z 0,A 0,B 0,C 0}\n"
    body += f"BAS(#INITMOV,0)\nPTP {axes(NEAR)}\nLIN_REL {{Z 10}} C_DIS"
    joint, line = motions(tmp_path, krl(body), "a.src")
    assert (joint.speed.value, joint.acceleration.value) == (1.0, 1.0)
    assert (line.speed.value, line.acceleration.value, line.acceleration.unit) == (2.0, 2.3, "m/s2")
    assert (line.zone.kind, line.zone.value) == ("distance", 0.0015)
    assert line.tool.name == "TOOL_DATA[1]"
    np.testing.assert_allclose(line.tool.pose[:3, 3], [0, 0, 0.1077])
    np.testing.assert_allclose(line.base.pose, np.eye(4))


def test_behind_initmov_a_tool_that_nothing_gives_is_named(tmp_path):
    found = check(tmp_path, krl(f"BAS(#INITMOV,0)\nPTP {axes(NEAR)}\nLIN_REL {{Z 10}}"), "a.src")
    assert codes(found)["frame_not_given"] == [3, 4]
    assert found.level == "fail"


def test_ptp_dat_and_cp_dat_take_the_speeds_of_the_data(tmp_path):
    body = "PDAT_ACT={VEL 40.0,ACC 60.0,APO_DIST 150.0}\nBAS(#PTP_DAT)\nPTP " + axes(NEAR) + " C_PTP\n"
    body += "LDAT_ACT={VEL 0.3,ACC 50.0,APO_DIST 20.0}\nBAS(#CP_DAT)\nLIN_REL {Z 1} C_DIS"
    joint, line = motions(tmp_path, krl(body), "a.src")
    assert (joint.speed.value, joint.acceleration.value, joint.zone.value) == (0.4, 0.6, 1.0)
    assert (line.speed.value, line.acceleration.value, line.zone.value) == (0.3, 0.5, 0.02)


BASICS = """DEF BAS (COMMAND :IN,REAL_PAR :IN )
DECL BAS_COMMAND COMMAND
REAL REAL_PAR
SWITCH COMMAND
CASE #INITMOV
  $BASE={X 0,Y 0,Z 200,A 0,B 0,C 0}
  $TOOL=$NULLFRAME
CASE #VEL_PTP
  half(REAL_PAR)
ENDSWITCH
END
DEF half(percent :IN )
REAL percent
INT i
FOR i=1 TO $NUM_AX
  $VEL_AXIS[i]=percent/2
ENDFOR
END
"""


@pytest.mark.parametrize("place", ["KRC/R1/Program/bas.src", "KRC/R1/System/bas.src"])
def test_a_controllers_own_basics_are_read(tmp_path, place):
    folder = tmp_path / "KRC/R1/Program/cell"
    folder.mkdir(parents=True)
    if "Program" in place:
        place = "KRC/R1/Program/cell/bas.src"
    (tmp_path / place).parent.mkdir(exist_ok=True)
    (tmp_path / place).write_text(BASICS)
    text = krl(f"BAS(#INITMOV,0)\nBAS(#VEL_PTP,50)\nPTP {axes(NEAR)}\nLIN {{X 300}}")
    joint, line = motions(folder, text, "a.src")
    assert joint.speed.value == 0.25
    np.testing.assert_allclose(line.base.pose[:3, 3], [0, 0, 0.2])


def pose_text(q, more: str = "") -> str:
    """The tool's pose in the robot's base as a KRL position."""
    x, y, z, a, b, c = numbers_of(forward(ROBOT.replace(base=np.eye(4), tool=np.eye(4)), q), "kuka")
    return f"{{X {x:.6f},Y {y:.6f},Z {z:.6f},A {a:.6f},B {b:.6f},C {c:.6f}{more}}}"


def test_a_status_without_a_turn_is_named(tmp_path):
    found = check(tmp_path, krl(f"{FRAMES}PTP {pose_text(NEAR, ',S 2')}"), "a.src")
    assert codes(found)["configuration_not_read"] == [4]
    assert found.level == "caution"


def test_a_first_target_with_several_solutions_from_nowhere_is_a_guess(tmp_path):
    text = krl(f"{FRAMES}PTP {pose_text(NEAR)}\nPTP {axes(FAR)}")
    bare = ROBOT.replace(base=np.eye(4), tool=np.eye(4))
    solutions = inverse(bare, forward(bare, NEAR))
    found = check(tmp_path, text, "a.src", start=None)
    (guessed,) = (each.finding for each in found.findings if each.finding.code == "configuration_guessed")
    assert guessed.solutions == int(solutions.within_limits.sum()) > 1
    assert "configuration_guessed" not in codes(check(tmp_path, text, "a.src"))
    assert ("way", 4) in {(each.what, each.place.line) for each in found.not_examined}


def test_the_orientation_is_kept_where_the_program_says_so(tmp_path):
    line = "LIN {X 300,Y 20,Z 400,A 10,B 80,C 0}"
    _, kept = motions(tmp_path, krl(f"{FRAMES}PTP {axes(NEAR)}\n$ORI_TYPE=#CONSTANT\n{line}"), "a.src")
    assert isinstance(kept.target, PoseTarget)
    bare = ROBOT.replace(base=np.eye(4), tool=np.eye(4))
    np.testing.assert_allclose(kept.target.pose[:3, :3], forward(bare, NEAR)[:3, :3], atol=1e-12)
    found = check(tmp_path, krl(f"{FRAMES}PTP {axes(NEAR)}\n$ORI_TYPE=#JOINT\nPTP {axes(FAR)}"), "a.src")
    assert codes(found)["program_not_understood"] == [5]


@pytest.mark.parametrize(("body", "missing"), [(f"PTP {axes(NEAR)}", False), ("PTP XHOME", False), ("PTP XP1", True)])
def test_a_missing_data_file_is_told_where_something_of_it_is_used(tmp_path, body, missing):
    found = check(tmp_path, krl(f"{body}\n$OUT[1]=TRUE"), "a.src")
    assert ("program_data_file_missing" in codes(found)) == missing


@pytest.mark.parametrize(
    ("text", "missing"),
    [("MJOINT(POINTJ(0,0,0,0,-70,0), v50perc, fine, tool0);", False), ("MJOINT(P1, v500, fine, tool0);", True)],
)
def test_a_missing_var_file_too(tmp_path, text, missing):
    assert ("program_data_file_missing" in codes(check(tmp_path, f"{text}\n", "a.pgm"))) == missing


@pytest.mark.parametrize("changed", ["tool0.z := 100;", "wobj0.x := 100;"])
def test_a_frame_that_a_program_of_rpl_changes_is_not_the_one_given(tmp_path, changed):
    moves = "MJOINT(POINTJ(0,0,0,0,-70,0), v50perc, fine, tool0);\nMLIN({}, v50, fine, tool0, wobj0);\n"
    moves = moves.format("POINTC(400,0,400,0,0,180)")
    assert "frame_not_given" not in codes(check(tmp_path, moves, "a.pgm"))
    assert codes(check(tmp_path, f"{changed}\n{moves}", "a.pgm"))["frame_not_given"][-1] == 3


@pytest.mark.parametrize(
    "changed",
    ["IF io.din1 THEN\nwobj0.x := 100;\nEND_IF;\n{0}", "{0}WHILE io.din1 DO\n{0}wobj0.x := 100;\nEND_WHILE;\n"],
)
def test_so_is_one_that_a_side_or_a_round_changes_for_motions_that_name_none(tmp_path, changed):
    start, line = (
        "MJOINT(POINTJ(0,0,0,0,-70,0), v50perc, fine, tool0);\n",
        "MLIN(POINTC(400,0,400,0,0,180), v50, fine, tool0);\n",
    )
    assert "frame_not_given" not in codes(check(tmp_path, start + line, "a.pgm"))
    assert "frame_not_given" in codes(check(tmp_path, start + changed.format(line), "a.pgm"))


def test_functions_of_rpl_whose_unit_no_source_tells_have_no_value(tmp_path):
    for angle, known in (("SIN(30)", False), ("ABS(-30)", True), ("SQRT(-30)", False)):
        (motion,) = motions(tmp_path, f"MJOINT(POINTJ({angle},0,0,0,-70,0), v50perc, fine, tool0);\n", "a.pgm")
        assert isinstance(motion.target, JointTarget) == known


@pytest.mark.parametrize(
    ("text", "name", "code"),
    [
        ("DEF a( )\nSPLINE\nSPL {A1 5,A2 -10,A3 -10,A4 0,A5 -70,A6 0}\nENDSPLINE\nEND\n", "a.src", "spline_as_line"),
        (2 * "MJOINT(POINTJ(5,-10,-10,0,-70,0), v10perc, wide, tool0);\n", "a.pgm", "zone_without_size"),
    ],
)
def test_a_way_whose_course_is_not_known_is_no_pass(tmp_path, text, name, code):
    """A spline bends, and a corner is cut as far as its zone says, wherever that leads."""
    found = check(tmp_path, text, name)
    assert code in codes(found)
    assert found.level == "caution"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.pgm", "MJOINT(POINTJ(5,-10,-10,0,-70,0), {0}, fine, tool0);\n" * 2),
        ("a.XPL", "<mjoint><target>POINTJ(5,-10,-10,0,-70,0)</target><speed>{0}</speed><zone>fine</zone></mjoint>" * 2),
    ],
)
@pytest.mark.parametrize("speed", ["v200", "v20perc"])
def test_a_joint_motion_at_a_speed_of_the_tool_is_told_once(tmp_path, name, text, speed):
    """No source tells how long it takes; files of controllers have it."""
    body = (
        XML.format(declared="", body=text.format(speed), more="", behind="") if name == "a.XPL" else text.format(speed)
    )
    found = codes(check(tmp_path, body, name))
    assert len(found.get("program_joint_speed_inferred", [])) == (speed == "v200")


def test_a_zone_that_a_motion_of_rpl_lacks_has_no_known_size(tmp_path):
    text = 2 * "MJOINT(POINTJ({},-10,-10,0,-70,0), v10perc);\n"
    assert codes(check(tmp_path, text.format(5, 10), "a.pgm"))["zone_without_size"] == [1]


@pytest.mark.parametrize(
    "text",
    [
        "IF({0}) THEN\n{1} END_IF;",
        "WHILE({0}) DO\n{1} END_WHILE;",
        "REPEAT {1} UNTIL(NOT({0})) END_REPEAT;",
        "IF({0})THEN {1} END_IF;",
    ],
)
def test_conditions_of_rpl_need_no_space_before_them(tmp_path, text):
    move = "MJOINT(POINTJ(5,-10,-10,0,-70,0), v10perc, fine, tool0);"
    found = check(tmp_path, text.format("1 = 2", move), "a.pgm")
    assert "program_not_understood" not in codes(found)
    assert "both_sides_checked" not in codes(found)
    asked = codes(check(tmp_path, text.format("MOVEIT()", move), "a.pgm"))
    assert asked["may_move"][0] == 1
    chosen = f"i := 2;\nCASE(i) OF 1: MJOINT(far, v10perc, fine, tool0); 2: {move} END_CASE;"
    assert [each.target.joints[0] for each in motions(tmp_path, chosen, "a.pgm")] == [np.radians(5)]


def test_what_an_assignment_of_rpl_that_is_not_understood_sets_has_no_value(tmp_path):
    text = "P := POINTJ(5,-10,-10,0,-70,0);\nP := OFFSET(P, 1 2);\nMJOINT(P, v10perc, fine, tool0);\n"
    assert motions(tmp_path, text, "a.pgm")[0].target.reason == "undefined"
    parts = "<set><dest>P</dest><expr>POINTJ({},-10,-10,0,-70,0)</expr>{}</set>"
    move = "<mjoint><target>P</target><speed>v20perc</speed><zone>fine</zone><tool>tool0</tool></mjoint>"
    body = parts.format(5, "") + parts.format(9, "<by>2</by>") + move
    found = motions(tmp_path, XML.format(declared="", body=body, more="", behind=""), "a.XPL")
    assert found[0].target.reason == "undefined"


@pytest.mark.parametrize(("scope", "known"), [("Routine", True), ("Input", False)])
def test_what_a_caller_gives_is_not_what_the_point_file_says(tmp_path, scope, known):
    (tmp_path / "a.var").write_text(f"{scope} Var BOOL go := FALSE;\n", encoding="utf-8")
    text = "IF go THEN MJOINT(POINTJ(5,-10,-10,0,-70,0), v10perc, fine, tool0); END_IF;\n"
    assert ("both_sides_checked" in codes(check(tmp_path, text, "a.pgm"))) != known


def test_motions_with_more_targets_than_they_have_are_not_understood(tmp_path):
    for body in (f"PTP {axes(NEAR)}, {axes(FAR)}", f"{FRAMES}CIRC {pose_text(NEAR)}"):
        assert motions(tmp_path, krl(body), "a.src")[-1].target.reason == "not_understood"
    (motion,) = motions(tmp_path, "MJOINT(POINTJ(0,0,0,0,-70,0), v50perc, fine, tool0, wobj0, 3);\n", "a.pgm")
    assert motion.target.reason == "not_understood"


@pytest.mark.parametrize("note", ["grip", '"grip', '"grip"', 'the 2" pipe'])
def test_no_row_of_a_table_is_taken_for_the_rest_of_a_note(tmp_path, note):
    head = "t_s,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,note\n"
    out = np.where(np.arange(6) == 1, np.radians(-170), NEAR)
    rows = [f"{2 * k}," + ",".join(map(str, np.degrees(q))) for k, q in enumerate((HOME, NEAR, out, FAR))]
    found = check(tmp_path, head + f",{note}\n".join(rows) + ",\n", "a.csv")
    assert codes(found)["below_limit"] == [4]


ZEROS = "A 0,B 0,C 0"


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (["P={X 300,Y 0,Z 400,A 0,B 90,C 0}", "LIN P"], None),
        (["P={X 300,Y 0,Z 400,A 0,B 90,C 0}", "P={X 310}", "LIN P"], "undefined"),
        (["P.X=300", "P.Y=0", "P.Z=400", "LIN P"], None),  # the rest is where the arm stands
        (["P=?!", "P.X=300", "P.Y=0", "P.Z=400", "LIN P"], "undefined"),
        ([f"XP[1]={axes(NEAR)}", "XP[1]=?!", "PTP XP[1]"], "undefined"),
        ([f"LIN {{X 300,Y 0,Z 0,{ZEROS}}}:{{X 10,Y 0,Z 400}}"], "undefined"),
        ([f"LIN {{X 300,Y 0,Z 0,{ZEROS}}}:{{X 10,Y 0,Z 400,{ZEROS}}}"], None),
    ],
)
def test_what_a_position_leaves_out_is_no_zero(tmp_path, lines, reason):
    body = f"{FRAMES}DECL E6POS P\nPTP {axes(NEAR)}\n" + "\n".join(lines)
    assert getattr(motions(tmp_path, krl(body), "a.src")[-1].target, "reason", None) == reason


def test_a_position_that_leaves_out_a_turn_the_variable_had_does_not_say_which_solution_is_meant(tmp_path):
    body = f"{FRAMES}DECL E6POS P\nP={pose_text(NEAR, ',S 2,T 0')}\nP={pose_text(NEAR)}\nPTP P"
    assert "configuration_not_read" in codes(check(tmp_path, krl(body), "a.src"))
    listing = Listing("b", tuple(motions(tmp_path, krl(body), "a.src")), language="krl")
    again = write_program(listing, "krl", WriteOptions(ROBOT))  # with the joints that it found, or without the turns
    assert "left out" not in "".join(again.files.values())


@pytest.mark.parametrize(
    ("lines", "height"),
    [
        (["$BASE={X 0,Y 0,Z 100}"], None),
        (["$BASE.Z=100"], None),
        (["$BASE=BASE_DATA[1]"], 0.05),
        (["BASE_DATA[1].Z=BASE_DATA[1].Z+100", "$BASE=BASE_DATA[1]"], 0.15),
        (["$BASE=BASE_DATA[1]", "$BASE.Z=100"], 0.1),
        ([f"$BASE=BASE_DATA[1]:{{X 0,Y 0,Z 100,{ZEROS}}}"], 0.15),
        (["BASE_DATA[1]=SEEN", "$BASE=BASE_DATA[1]"], None),
        ([f"BASE_DATA[SEEN]={{X 0,Y 0,Z 9,{ZEROS}}}", "$BASE=BASE_DATA[1]"], None),
        (["BASE_DATA[1].Z=SEEN", "$BASE=BASE_DATA[1]"], None),
        (["$BASE=SEEN"], None),
        (["BASE_DATA[1]=?!", "$BASE=BASE_DATA[1]"], None),
        (["DECL FRAME BASE_DATA[16]", "$BASE=BASE_DATA[1]"], 0.05),
    ],
)
def test_a_frame_of_the_cell_is_what_the_program_makes_of_it_or_not_given(tmp_path, lines, height):
    cell = np.eye(4)
    cell[2, 3] = 0.05
    body = "$TOOL=$NULLFRAME\n" + "\n".join(lines) + f"\nPTP {axes(NEAR)}\nLIN {{X 300}}"
    found = check(tmp_path, krl(body), "a.src", frames={"BASE_DATA[1]": cell})
    missing = [each.finding.name for each in found.findings if each.finding.code == "frame_not_given"]
    assert bool(missing) == (height is None)
    if height is None:
        mapped = check(tmp_path, krl(body), "a.src", frames={"BASE_DATA[1]": cell, missing[-1]: cell})
        assert "frame_not_given" not in codes(mapped)
    else:
        (base,) = {each.placed.motion.base.pose[2, 3] for each in found.motions.values()}
        assert base == pytest.approx(height)


@pytest.mark.parametrize(
    ("angle", "degrees"), [("7/2", None), ("8/2", 4), ("7/2.0", 3.5), ("-6/4", None), ("-6 MOD 3", 0)]
)
def test_a_quotient_that_no_source_settles_has_no_value(tmp_path, angle, degrees):
    """No document of RPL tells whether two whole numbers have a whole quotient; programs write 100.0."""
    (found,) = motions(tmp_path, f"MJOINT(POINTJ({angle},0,0,0,-70,0), v50perc, fine, tool0);\n", "a.pgm")
    assert isinstance(found.target, UnresolvedTarget) == (degrees is None)
    if degrees is not None:
        assert np.degrees(found.target.joints[0]) == pytest.approx(degrees)


XML = """<Xpl-source><XplEnvironment><VarDeclarations><VarGlobal>{declared}</VarGlobal></VarDeclarations><Pous><Pou>
<Name>Main</Name><Type>Program</Type><Body>{body}</Body>{more}</Pou></Pous></XplEnvironment>{behind}</Xpl-source>"""
JOINT = """<mjoint{as_}><target>{to}</target><speed>v20perc</speed><zone>fine</zone><tool>tool0</tool>{more}</mjoint>"""
MOVE, HOME_POINT = JOINT.format(as_="", to="POINTJ(0,-10,-10,0,-70,0)", more=""), "(0,-10,-10,0,-70,0)"
BELOW = f"<Pou><Name>1</Name><Body>{MOVE}</Body></Pou>"


def of_xml(body=MOVE, more="", behind="", declared=""):
    return XML.format(body=body, more=more, behind=behind, declared=declared)


@pytest.mark.parametrize(
    ("first", "second", "declared", "named"),
    [
        (["i"], ["I"], "", []),
        (["i", "I"], [], "", ["i, I"]),
        ([], ["I"], "i", ["i, I"]),
        (["i"], ["i"], "i", []),
    ],
)
def test_names_that_differ_by_capital_letters_are_compared_where_one_routine_sees_both(
    tmp_path, first, second, declared, named
):
    def variables(names):
        return "".join(f"<Var><Name>{name}</Name><Type>INT</Type><InitValue>1</InitValue></Var>" for name in names)

    local = "<VarDeclarations><VarLocal>{}</VarLocal></VarDeclarations>"
    main, other = (local.format(variables(names)) for names in (first, second))
    routine = f"</Pou><Pou><Name>Other</Name><Type>Subroutine</Type>{other}<Body>{MOVE}</Body>"
    program = written(tmp_path, of_xml(more=main + routine, declared=variables(declared)), "a.XPL")
    assert [each.text for each in program.findings if each.code == "program_not_understood"] == named


def with_part(part):
    return of_xml(MOVE.replace("</mjoint>", part + "</mjoint>"))


@pytest.mark.parametrize(
    "text",
    [
        of_xml(more=BELOW),  # a body that no loop names
        of_xml(f"{MOVE}<while><cond>io.DIn[1]</cond><pouref>1</pouref></while>", BELOW + BELOW),
        of_xml(f"{MOVE}<while><cond>io.DIn[1]</cond><pouref>1</pouref>{MOVE}</while>", BELOW),
        of_xml(f"{MOVE}<for><var>i</var><from>1</from><to>2</to><step>2</step><pouref>1</pouref></for>", BELOW),
        of_xml(more=MOVE),
        of_xml(behind=f"<XplEnvironment>{BELOW}</XplEnvironment>"),
        of_xml(f"{MOVE}MJOINT(POINTJ(0,0,0,0,0,0), v20perc, fine, tool0);"),
        with_part("<offset>OFFSET(0,0,-300)</offset>"),
        with_part("<target>POINTJ(0,0,0,0,0,0)</target>"),
        with_part("relative"),
        *(
            of_xml(JOINT.format(as_=each, to="POINTJ" + HOME_POINT, more=""))
            for each in (' disable="1"', ' rel="true"')
        ),
        of_xml().replace("<Body>", '<Body disable="true">'),
        of_xml(f"{MOVE}<wait><condition>io.DIn[1]</condition><timeout>5</timeout><label>L</label></wait>"),
        of_xml(f"{MOVE}<call><cond>x</cond><subroutine><name>Main</name></subroutine></call>"),
        of_xml(declared="<Var><Name>p</Name><Type>POINTJ</Type><Retain>file.dat</Retain></Var>"),
        of_xml(MOVE.replace("v20perc", "vmax")),
        of_xml(MOVE.replace("tool0", "")),
        of_xml(
            JOINT.format(as_="", to="p", more=""),
            declared=f"<Var><Name>p</Name><Type>POINTJ</Type><InitValue>{HOME_POINT[:-1]},99)</InitValue></Var>",
        ),
    ],
)
def test_what_is_not_read_of_the_controllers_xml_is_named(tmp_path, text):
    assert not {"program_not_understood", "may_move"} & set(codes(check(tmp_path, of_xml(), "a.XPL")))
    found = check(tmp_path, text, "a.XPL", frames={"tool0": np.eye(4)})
    named = {"program_not_understood", "may_move", "speed_not_given", "frame_not_given", "target_not_given"}
    assert {each.finding.code for each in found.findings if each.level in ("caution", "fail")} & named
    assert found.level in ("caution", "fail")


def test_what_is_switched_off_with_its_bodies_is_not_named(tmp_path):
    loop = '<while disable="true"><cond>io.DIn[1]</cond><pouref>1</pouref></while>'
    found = check(tmp_path, of_xml(MOVE + loop, BELOW), "a.XPL", frames={"tool0": np.eye(4)})
    assert codes(found) == codes(check(tmp_path, of_xml(), "a.XPL", frames={"tool0": np.eye(4)}))


@pytest.mark.parametrize(
    "line",
    [
        "io.MoveTo(near);",
        "log.run(near);",
        "sys.override := 500;",
        "near.q2 := -80;\nMJOINT(near, v20perc, fine, tool0);",
        "Near := home;\nMJOINT(near, v20perc, fine, tool0);",
        "MJOINT(POINTJ(-7 MOD 3,-10,-10,0,-70,0), v20perc, fine, tool0);",
        "MJOINT(POINTJ(\uff11,-10,-10,0,-70,0), v20perc, fine, tool0);",
        "fidbus.rw[3] := 0;\nIF fidbus.rw[3] = 1 THEN home.j1 := 500; END_IF;",
    ],
)
def test_what_no_source_tells_of_rpl_is_no_pass(tmp_path, line):
    points = f"Routine Var POINTJ {{}} := {HOME_POINT};\n"
    (tmp_path / "a.var").write_text(points.format("near") + points.format("home"), encoding="utf-8")
    text = "{}\nMJOINT(home, v20perc, fine, tool0);\n"
    plain, found = (check(tmp_path, text.format(each), "a.pgm", frames={"tool0": np.eye(4)}) for each in ("", line))
    worse = {"program_not_understood", "may_move", "target_not_given", "above_limit"}
    assert not worse & set(codes(plain))
    assert worse & set(codes(found))
    assert found.level in ("caution", "fail")


@pytest.mark.parametrize(
    ("angles", "alike"), [((-4.7, 65.7, 93.1, -51.2, 15.7, -128.3), 2), ((10, -15, -5, 5, -60, 10), 1)]
)
def test_a_turn_that_two_solutions_have_is_not_known_to_mean_the_nearest(tmp_path, angles, alike):
    """Elbow up and elbow down may have the same signs, and S is not used."""
    own = np.radians(angles)
    found = inverse(ROBOT, forward(ROBOT, own))
    rows = found.q[found.within_limits]
    assert ((rows < 0) == (own < 0)).all(axis=1).sum() == alike
    numbers = zip("XYZABC", numbers_of(forward(ROBOT, own), "kuka"))
    target = ",".join(f"{key} {value:.9f}" for key, value in numbers)
    turn = int(((own < 0) << np.arange(6)).sum())
    checked = check(tmp_path, krl(f"{FRAMES}PTP {{{target},S 2,T {turn}}}"), "a.src")
    assert codes(checked).get("configuration_not_read") == (None if alike == 1 else [4])


def test_numbers_of_rpl_that_rounding_decides_on_are_followed_both_ways(tmp_path):
    """REAL has 32 bits, in which 0.1 + 0.2 is 0.3."""
    turn = "MJOINT(POINTJ({},-10,-10,0,-70,0), v50perc, fine, tool0);\n"
    text = "x := 0.1 + 0.2;\nq := 20;\nIF x = 0.3 THEN\nq := 30;\nEND_IF;\n" + turn.format("q")
    found = check(tmp_path, text, "a.pgm")
    assert [each.times for each in found.verdicts] == [2]
