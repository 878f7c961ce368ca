"""Each thing that a check of programs can find says what to do about it."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.collision.pairs import LinkPair
from er3a.collision.scene import Scene, Sphere
from er3a.files.robot_library import load_robot
from er3a.files.scene_file import load_scene
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.pipeline.messages.programs import PACED, REMEDIES, STAYS_MM, remedies, remedy, remedy_at
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.program_check.program_check_findings import (
    NOTES,
    AcceleratesMoreThanAssumed,
    CheckFinding,
    FasterThanAssumed,
    JointJumps,
    MotionCollides,
    TargetNotGiven,
    ZoneTooLarge,
)
from er3a.programs.execution import RunLimits
from er3a.programs.languages import read_program
from er3a.robots.robot import CombinedLimit, Envelope
from testing.arms import scara
from testing.program_texts import axes

ROBOT = load_robot("er3a_c60")


@pytest.mark.parametrize("kind", get_args(CheckFinding), ids=lambda kind: kind.__name__)
def test_every_caution_and_fail_has_a_remedy(kind):
    assert kind.code in NOTES or kind.code in REMEDIES or kind in remedy.registry


def test_no_remedy_is_for_what_is_never_found():
    assert set(REMEDIES) <= {kind.code for kind in get_args(CheckFinding)}


def test_of_speeds_the_lowest_is_told_and_each_thing_once():
    fast = [FasterThanAssumed(1, 358.1, 180.0), FasterThanAssumed(4, 3786.6, 360.0)]
    told = remedies([*fast, AcceleratesMoreThanAssumed(1, 9.0, 8.0), AcceleratesMoreThanAssumed(2, 9.0, 8.0)])
    assert told == ["Lower the speed of this line to 9.5 % of its own or less, and its acceleration to 0.9 %."]
    assert 0.095 * 3786.6 <= 360.0 < 0.096 * 3786.6


START = "[0.3, -0.3, -0.2, 0.0, -1.0, 0.0]"


@pytest.mark.parametrize("acceleration", [40, 400, 2000])
@pytest.mark.parametrize(
    "line",
    [
        "movel(pose_trans(get_forward_kin({start}), p[0, 0, -0.02, 0, 0, 0]), a={a}, v={v})",
        "movej([0.9, -0.3, -0.2, 0.3, -1.0, 0.0], a={a}, v={v})",
    ],
)
def test_a_line_at_the_pace_advised_passes(tmp_path, line, acceleration):
    """Also where the speed is never reached, so that lowering it alone would change nothing."""

    def found(a: float, v: float):
        text = f"def a():\n  movej({START}, a=1, v=0.5)\n  {line.format(start=START, a=a, v=v)}\nend\n"
        (tmp_path / "a.script").write_text(text)
        check = check_program(read_program(tmp_path / "a.script"), ROBOT, CheckOptions(start=np.zeros(6)))
        return [at.finding for at in check.findings if at.place.line == 3]

    (text,) = [each for each in remedies(found(acceleration, 8.0)) if "acceleration" in each]
    speed, acc = (float(percent) / 100 for percent in re.findall(r"([\d.]+) %", text))
    assert not [each for each in found(acceleration * acc, 8.0 * speed) if isinstance(each, PACED)]


def test_a_zone_may_take_half_of_the_shorter_motion():
    assert remedy(ZoneTooLarge(80.0, 20.0)) == "Make the zone 10.0 mm at most."


SCENE = load_scene("data/scenes/table_and_post.yaml")
ANGLES = re.compile(r"\(([^)]*)\) deg")
HEAD = "DEF a( )\n$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\n$VEL.CP=0.05\nBAS(#VEL_PTP,10)\n"


@pytest.mark.parametrize(
    ("code", "start", "line"),
    [
        ("above_limit", "0,-10,-10,0,-70,0", "PTP {A4 185}"),
        ("whole_turn", "0,-10,-10,0,-70,-100", "PTP {A6 300}"),
        ("motion_collides", "0,-10,-10,0,-70,0", "PTP {A1 100}"),
        ("configuration_changes", "0,-10,-10,0,-70,0", "PTP {A4 170,A5 70,A6 170}"),
        ("passes_singularity", "0,-10,-10,0,-30,0", "LIN {A1 1,A5 30}"),
    ],
)
def test_joint_moves_that_are_advised_pass(tmp_path, code, start, line):
    """Carried out: the line replaced by the moves that its remedy gives, at the speed at which they were checked."""

    def found(*lines: str):
        (tmp_path / "a.src").write_text(HEAD + "".join(f"{each}\n" for each in lines) + "END\n")
        options = CheckOptions(start=np.radians([float(each) for each in start.split(",")]), scene=SCENE)
        return check_program(read_program(tmp_path / "a.src"), ROBOT, options)

    before = found(line)
    (advised,) = [each for each in before.findings if each.finding.code == code]
    moves = [angles.split(", ") for angles in ANGLES.findall(remedy_at(advised))]
    assert moves
    lines = ["PTP {" + ",".join(f"A{i} {angle}" for i, angle in enumerate(move, 1)) + "}" for move in moves]
    after = found(*lines)
    assert [verdict.level for verdict in after.verdicts] == ["pass"] * len(moves)
    if code != "above_limit":  # of which no arm has the end
        ends = [list(check.motions.values())[-1].end for check in (before, after)]
        np.testing.assert_allclose(*(forward(ROBOT, end)[:3, 3] for end in ends if end is not None), atol=1e-4)


def test_of_the_solutions_one_is_advised_on_the_way_to_which_the_tool_hardly_turns():
    """The example's line keeps the tool's orientation through the wrist's singularity; by another solution, hardly
    farther away, a joint move would turn the tool once around."""
    program = read_program(Path("data/programs/faults/singular_line.src"))
    check = check_program(program, ROBOT, CheckOptions(start=np.radians([0, -10, -10, 0, -70, 0]), measures=False))
    advised = next(each for each in check.findings if each.joint_moves)
    motion = check.motions[advised.step]
    (end,) = np.radians(advised.joint_moves)
    R = forward(motion.placed.arm, motion.start + np.linspace(0, 1, 101)[:, None] * (end - motion.start))[:, :3, :3]
    turned = Rotation.from_matrix(R[0].T @ R).magnitude()
    assert np.degrees(turned.max()) < 15
    points = forward(motion.placed.arm, motion.start + np.linspace(0, 1, 101)[:, None] * (end - motion.start))[:, :3, 3]
    way = points[-1] - points[0]
    off = np.linalg.norm(np.cross(points - points[0], way / np.linalg.norm(way)), axis=1)
    assert 1000 * off.max() == pytest.approx(advised.off_mm, rel=0.02)
    assert np.degrees(turned.max()) == pytest.approx(advised.off_deg, rel=0.02)  # the line keeps the orientation
    first = f"leaves the programmed way by up to {advised.off_mm:.1f} mm and tilts by up to {advised.off_deg:.1f} deg"
    assert first in remedy_at(advised).split(": ")[0]


def test_what_no_joint_move_mends_says_so_by_not_advising_one(tmp_path):
    (tmp_path / "a.src").write_text(f"{HEAD}PTP {{A2 -80,A3 -10}}\nEND\n")  # into the table
    options = CheckOptions(start=np.radians([0, -10, -10, 0, -70, 0]), scene=SCENE)
    found = check_program(read_program(tmp_path / "a.src"), ROBOT, options).findings
    assert [(each.finding.code, each.joint_moves) for each in found] == [("motion_collides", ())]
    assert "joint move" not in remedy_at(found[0])


def rapid(*lines: str) -> str:
    """A module whose main has these lines."""
    return "MODULE a\nPROC main()\n" + "".join(f"{line}\n" for line in lines) + "ENDPROC\nENDMODULE\n"


def krl(*lines: str, more: str = "") -> str:
    """A program with these lines, at a speed that is given."""
    return HEAD + "".join(f"{line}\n" for line in lines) + f"END\n{more}"


REST, SLOW = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]", "v10,fine,tool0;"
AT_POINT = f"ConfJ\\Off;ConfL\\Off;MoveJ [[400,0,400],[0,0,1,0],{REST}],v50,fine,tool0;"

TURNS = [f"MoveAbsJ [[0,-10,-10,0,-70,{turn}],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;" for turn in (-120, 0, 120)]

CALLED = ("PROC up()", TURNS[0], "ENDPROC", "PROC serve()", "VAR string text;", "SocketReceive s\\Str:=text;")

BESIDE_MAIN = f"MODULE a\nPROC up()\n{TURNS[0]}\nENDPROC\nENDMODULE\n"


def last(check):
    """Where the arm stands behind the last motion."""
    return list(check.motions.values())[-1].end


HOME = np.radians([0.0, -10.0, -10.0, 0.0, -70.0, 0.0])
BESIDE = np.radians([60.6, 0.9, 63.1, 47.8, 0.1, 0.0])  # a singular pose
AT_HOME = "PTP {A1 0,A2 -10,A3 -10,A4 0,A5 -70,A6 0}"
NONE = "[9E9,9E9,9E9,9E9,9E9,9E9]"
SOFT = "$ACC.CP=0.2"
DOWN = "A 0,B 0,C 180"
RPL = (
    "MJOINT(POINTJ(10,-10,-10,0,-70,0), {speed}, {zone}, {tool});\n"
    "MJOINT(POINTJ(0,-10,-10,0,-70,0), v10perc, fine, {tool});\n"
)
AT_TOOL0 = "MLIN(POINTC(400,0,400,0,0,180), v50, fine, tool0);\n"
WORDS = {"speed": "v10perc", "zone": "fine", "tool": "tool0"}
FRAMED = f"DEF a( )\n$TOOL=TOOL_DATA[3]\n$BASE=$NULLFRAME\n$VEL.CP=0.05\nLIN {{X 300,Y 50,Z 400,{DOWN}}}\nEND\n"
TABLE, ROW = "t_s,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg", "0,10,-10,-10,0,-70,0"
THIRDS = [f"LIN {{A {turn},B 0,C 180}}" for turn in (120, -120, 0)]
LOOP = ("$ACC.CP=0.2", f"LIN {{X 400,Y 0,Z 400,{DOWN}}}", "LOOP", *THIRDS)
MOVEJ = "  movej([0, -0.2, -0.2, 0, -1.2, 0], a=1, v=0.5)\n"
THREAD = "def p():\n  {head} T():\n  " + MOVEJ + "  end\n" + MOVEJ.replace("-0.2", "-0.3") + "  {run}T()\nend\n"
TURNED = {
    "robot": load_robot("ur5e").replace(envelopes=[Envelope(k, (0.0,) * 3, (0.0,) * 3, 0.005) for k in range(1, 7)]),
    "start": np.radians([-160, -26, 42, 139, 169, -55]),
}
TIED = {"robot": ROBOT.replace(combined=[CombinedLimit((0, 1, 1, 0, 0, 0), *np.radians([-60, 60]))])}
CSV = "t_s,q1_deg,q2_deg,q3_mm,q4_deg\n0,0,30,50,0\n4,10,30,{},0\n"
CORNER = """def a():
  movej([-0.349, -0.1745, -0.1745, 0, -1.2217, 0], a=1, v=1)
  movej([0, -0.1745, -0.1745, 0, -1.2217, 0], a=1, v=1, r={})
  movej([0, -0.698, 0.1745, 0, -1.2217, 0], a=1, v=1)
end
"""
BALL = Scene("ball", (Sphere("ball", transform(np.array([0.46921, -0.09252, 0.41923]), np.zeros(3)), 0.043),))
DRAWN = ROBOT.replace(sources={**ROBOT.sources, "envelopes": replace(ROBOT.sources["envelopes"], grade="official")})
GIVEN = "FRAME BASE_DATA[2]\nBASE_DATA[1]={X 0,Y 0,Z 0,A 0,B 0,C 0}"
SHARED = {
    "$config.dat": "DEFDAT $CONFIG\nDECL GLOBAL REAL GZ=5.0\nENDDAT\n",
    "other.src": "DEF other( )\nGZ=9.0\nEND\n",
}
PICKS = {
    "lib1.src": "DEF lib1( )\nEND\nGLOBAL DEF PICK( )\nPTP {A1 5}\nEND\n",
    "lib2.src": "DEF lib2( )\nEND\nGLOBAL DEF PICK( )\nPTP {A1 9}\nEND\n",
}
LIFTED = transform(np.array([0.0, 0.0, 0.1]), np.zeros(3))
MENDED = {
    "target_out_of_reach": (krl(f"PTP {{X 3000,Y 0,Z 400,{DOWN}}}"), krl(f"PTP {{X 400,Y 0,Z 400,{DOWN}}}")),
    "way_out_of_reach": (krl("LIN {X 3000}"), krl("LIN {X 420}")),
    "more_than_full_speed": (RPL.format(**WORDS | {"speed": "v150perc"}), RPL.format(**WORDS | {"speed": "v100perc"})),
    "arrives_otherwise": (
        krl(AT_HOME, "LIN {A1 5,A2 -10,A3 -10,A4 180,A5 70,A6 180}"),
        lambda found: krl(AT_HOME, f"LIN {axes(last(found))}"),
    ),
    "turns_at_start": (
        krl("PTP {A4 0,A5 0}", "LIN_REL {Y 60}"),
        krl("PTP {A4 0,A5 -30}", "LIN_REL {Y 60}"),
    ),
    "turn_not_met": (
        krl(f"PTP {{X 400,Y 0,Z 400,{DOWN},S 2,T 1}}"),
        lambda found: krl(f"PTP {axes(last(found))}"),
    ),
    "configuration_not_met": (
        rapid(f"MoveJ [[400,0,400],[0,0,1,0],[3,3,3,7],{NONE}],v50,fine,tool0;"),
        lambda found: rapid(
            f"MoveAbsJ [[{','.join(f'{q:.6f}' for q in np.degrees(last(found)))}],{NONE}],v50,fine,tool0;"
        ),
    ),
    "configuration_guessed": (
        (krl(f"PTP {{X 400,Y 0,Z 400,{DOWN}}}"), {"start": None}),
        (krl(f"PTP {{X 400,Y 0,Z 400,{DOWN}}}"), {}),
        (krl(AT_HOME, f"PTP {{X 400,Y 0,Z 400,{DOWN}}}"), {"start": None}),
    ),
    "way_not_known": ((krl("PTP {A1 10}", AT_HOME), {"start": None}), krl("PTP {A1 10}", AT_HOME)),
    "may_move": (krl("GO_HOME( )", AT_HOME), krl(AT_HOME)),
    "frames_in_doubt": (
        krl("GO_HOME( )", AT_HOME, f"LIN {{X 400,Y 0,Z 400,{DOWN}}}"),
        krl("GO_HOME( )", "$TOOL=$NULLFRAME", "$BASE=$NULLFRAME", AT_HOME, f"LIN {{X 400,Y 0,Z 400,{DOWN}}}"),
        krl(AT_HOME, f"LIN {{X 400,Y 0,Z 400,{DOWN}}}"),
    ),
    "program_not_understood": (krl("$CORR_T={X 5,Y 0,Z 0,A 0,B 0,C 0}", AT_HOME), krl(AT_HOME)),
    "moves_beside": (
        THREAD.format(head="thread", run="run "),
        THREAD.format(head="def", run=""),
    ),
    "never_reached": (krl(AT_HOME, "RETURN", "PTP {A1 20}"), krl(AT_HOME)),
    "zone_too_large": (
        krl("$APO.CDIS=80", "LIN_REL {Z 40} C_DIS", "LIN_REL {Y 40}"),
        krl("$APO.CDIS=20", "LIN_REL {Z 40} C_DIS", "LIN_REL {Y 40}"),
    ),
    "spline_as_line": (
        krl(AT_HOME, "SPLINE", "SPL {A1 5,A2 -10,A3 -10,A4 0,A5 -70,A6 0}", "ENDSPLINE"),
        krl(AT_HOME, "SPLINE", "SLIN {A1 5,A2 -10,A3 -10,A4 0,A5 -70,A6 0}", "ENDSPLINE"),
        krl(AT_HOME, "SPTP {A1 5,A2 -10,A3 -10,A4 0,A5 -70,A6 0}"),
    ),
    "program_joint_speed_inferred": (
        RPL.format(**WORDS | {"speed": "v200"}),
        RPL.format(**WORDS | {"speed": "v50perc"}),
    ),
    "zone_without_size": (RPL.format(**WORDS | {"zone": "wide"}), RPL.format(**WORDS | {"zone": "z1"})),
    "arc_has_no_circle": (
        krl(f"LIN {{X 400,Y 0,Z 400,{DOWN}}}", f"CIRC {{X 420,Y 0,Z 400,{DOWN}}},{{X 440,Y 0,Z 400,{DOWN}}}"),
        krl(f"LIN {{X 400,Y 0,Z 400,{DOWN}}}", f"CIRC {{X 420,Y 20,Z 400,{DOWN}}},{{X 440,Y 0,Z 400,{DOWN}}}"),
        krl(f"LIN {{X 400,Y 0,Z 400,{DOWN}}}", f"LIN {{X 440,Y 0,Z 400,{DOWN}}}"),
    ),
    "arc_goes_on": (
        krl(f"LIN {{X 400,Y 0,Z 400,{DOWN}}}", "CIRC {X 420,Y 20},{X 440,Y 0,A 10},CA 270"),
        krl(f"LIN {{X 400,Y 0,Z 400,{DOWN}}}", "CIRC {X 420,Y 20},{X 440,Y 0}", "CIRC {X 434,Y -14},{X 420,Y -20}"),
    ),
    "arc_turn_in_doubt": (
        rapid(AT_POINT, f"MoveC [[420,20,400],[0,0.7071068,0.7071068,0],{REST}],[[440,0,400],[0,0,1,0],{REST}],{SLOW}"),
        rapid(AT_POINT, f"MoveC [[420,20,400],[0,0,1,0],{REST}],[[440,0,400],[0,0,1,0],{REST}],{SLOW}"),
    ),
    "target_not_given": (
        krl("PTP XTHERE"),
        (krl("PTP XTHERE"), {"data": "E6AXIS XTHERE={A1 10,A2 -10,A3 -10,A4 0,A5 -70,A6 0}"}),
    ),
    "target_not_given.not_evaluated": (
        rapid(f'MoveAbsJ [[StrMatch("abc",1,"c"),-10,-10,0,-70,0],{NONE}],v50,fine,tool0;'),
        rapid(f"MoveAbsJ [[3,-10,-10,0,-70,0],{NONE}],v50,fine,tool0;"),
        rapid(f"MoveAbsJ [[1+2,-10,-10,0,-70,0],{NONE}],v50,fine,tool0;"),
    ),
    "program_data_file_missing": (
        krl("PTP XP1"),
        (krl("PTP XP1"), {"data": "E6AXIS XP1={A1 10,A2 -10,A3 -10,A4 0,A5 -70,A6 0}"}),
    ),
    "frame_not_given": (FRAMED, (FRAMED, {"frames": {"TOOL_DATA[3]": np.eye(4)}})),
    "tool_stated_elsewhere": (f"{TABLE},x_mm,y_mm,z_mm\n{ROW},500,0,0\n", f"{TABLE}\n{ROW}\n"),
    "frame_of_several": (
        (krl("$TOOL=TOOL_DATA[n]", f"LIN {{X 400,Y 0,Z 400,{DOWN}}}"), {"frames": {"TOOL_DATA[N]": np.eye(4)}}),
        (krl("$TOOL=TOOL_DATA[3]", f"LIN {{X 400,Y 0,Z 400,{DOWN}}}"), {"frames": {"TOOL_DATA[3]": np.eye(4)}}),
    ),
    "frame_taken_as_flange": (AT_TOOL0, (AT_TOOL0, {"frames": {"tool0": np.eye(4)}})),
    "not_followed_to_end.operations": (
        (krl("FOR i=1 TO 40", "PTP {A1 5}", "PTP {A1 0}", "ENDFOR"), {"limits": RunLimits(operations=60)}),
        krl("FOR i=1 TO 40", "PTP {A1 5}", "PTP {A1 0}", "ENDFOR"),
    ),
    "not_followed_to_end.branches": (
        (
            krl(*(line for k in range(6) for line in (f"IF $IN[{k}] THEN", f"PTP {{A1 {k}}}", "ENDIF"))),
            {"limits": RunLimits(ways=3)},
        ),
        krl(*(line for k in range(6) for line in (f"IF $IN[{k}] THEN", f"PTP {{A1 {k}}}", "ENDIF"))),
    ),
    "not_followed_to_end.rounds": (
        (krl("FOR i=1 TO $ANIN[1]", "PTP {A1 5}", "PTP {A1 0}", "ENDFOR"), {"limits": RunLimits(ways=3)}),
        krl("FOR i=1 TO 20", "PTP {A1 5}", "PTP {A1 0}", "ENDFOR"),
    ),
    "not_come_to": (
        (krl("FOR i=1 TO 40", "PTP {A1 5}", "PTP {A1 0}", "ENDFOR", AT_HOME), {"limits": RunLimits(operations=60)}),
        krl("FOR i=1 TO 40", "PTP {A1 5}", "PTP {A1 0}", "ENDFOR", AT_HOME),
    ),
    "not_followed_to_end.drifts": (
        (krl("LOOP", "PTP_REL {A1 0.1}", "ENDLOOP"), {"limits": RunLimits(rounds=20)}),
        krl("LOOP", "PTP_REL {A1 0.1}", AT_HOME, "ENDLOOP"),
        krl("FOR i=1 TO 20", "PTP_REL {A1 0.1}", "ENDFOR"),
    ),
    "not_followed_to_end.recursion": (
        krl("b(3)", more="DEF b(n:IN)\nINT n\nPTP {A1 5}\nb(n-1)\nEND\n"),
        krl("b(3)", more="DEF b(n:IN)\nINT n\nPTP {A1 5}\nIF n<1 THEN\nRETURN\nENDIF\nb(n-1)\nEND\n"),
    ),
    "not_followed_to_end.guessed": (
        rapid("WHILE TRUE DO", "serve;", "ENDWHILE", "ENDPROC", *CALLED, "%text%;"),
        rapid("WHILE TRUE DO", "serve;", "ENDWHILE", "ENDPROC", *CALLED, 'IF text="up" up;'),
    ),
    "rest_not_checked": (
        (krl("PTP {A1 5}", "PTP {A1 6}", "PTP {A1 7}"), {"most_motions": 2}),
        krl("PTP {A1 5}", "PTP {A1 6}", "PTP {A1 7}"),
        (krl("PTP {A1 5}", "PTP {A1 6}"), {"most_motions": 2}),
    ),
    "begun_again": (
        rapid(*TURNS),
        rapid(*TURNS, TURNS[1]),
    ),
    "loop_comes_back_otherwise": (
        (krl(*LOOP, "ENDLOOP"), {"limits": RunLimits(rounds=5)}),
        krl(*LOOP, *THIRDS[1::-1], THIRDS[2], "ENDLOOP"),
    ),
    "program_begun_within": (
        (BESIDE_MAIN, {"files": {"b.mod": rapid("up;")}}),
        (rapid("up;").replace("ENDMODULE", BESIDE_MAIN.replace("MODULE a", "")), {"files": {"b.mod": BESIDE_MAIN}}),
    ),
    "program_name_twice": (
        krl("b( )", more="DEF b( )\nPTP {A1 5}\nEND\nDEF b( )\nPTP {A1 9}\nEND\n"),
        krl("b( )", more="DEF b( )\nPTP {A1 9}\nEND\n"),
    ),
    "program_module_twice": (
        (krl("PICK( )"), {"files": PICKS}),
        (krl("PICK( )"), {"files": PICKS | {"lib2.src": "DEF lib2( )\nEND\n"}}),
    ),
    "speed_not_given": ("DEF a( )\nPTP {A1 5}\nEND\n", krl("PTP {A1 5}")),
    "acceleration_not_known": (krl("BAS(#ACC_PTP,$ANIN[1])", "PTP {A1 5}"), krl("BAS(#ACC_PTP,50)", "PTP {A1 5}")),
    "turn_speed_not_given": (
        krl(SOFT, AT_HOME, "LIN_REL {A 5}"),
        krl(SOFT, "$VEL={CP 0.05,ORI1 30,ORI2 30}", "$ACC={CP 0.2,ORI1 60,ORI2 60}", AT_HOME, "LIN_REL {A 5}"),
    ),
    "frames_from_robot_file": (
        f"DEF a( )\n$VEL.CP=0.05\n{SOFT}\nBAS(#VEL_PTP,10)\n{AT_HOME}\nLIN_REL {{Z 5}}\nEND\n",
        krl(SOFT, AT_HOME, "LIN_REL {Z 5}"),
    ),
    "frames_decide": (
        f"DEF a( )\nDECL POS XP\n{SOFT}\nXP=$POS_ACT\nIF XP.Z>400 THEN\nPTP {{A1 5}}\nENDIF\nPTP {{A1 6}}\nEND\n",
        krl("DECL POS XP", SOFT, "XP=$POS_ACT", "IF XP.Z>400 THEN", "PTP {A1 5}", "ENDIF", "PTP {A1 6}"),
    ),
    "position_completed": (
        krl("DECL AXIS Q", "Q={A1 5}", "PTP Q"),
        krl("DECL AXIS Q", "Q={A1 5,A2 -10,A3 -10,A4 0,A5 -70,A6 0}", "PTP Q"),
    ),
    "frame_given_twice": (
        (
            krl("$BASE=BASE_DATA[1]", SOFT, AT_HOME, "LIN_REL {Z 5}"),
            {"data": GIVEN, "frames": {"BASE_DATA[1]": LIFTED}},
        ),
        (krl("$BASE=BASE_DATA[1]", SOFT, AT_HOME, "LIN_REL {Z 5}"), {"data": GIVEN}),
        (
            krl("$BASE=BASE_DATA[1]", SOFT, AT_HOME, "LIN_REL {Z 5}"),
            {"data": GIVEN.replace("Z 0", "Z 100"), "frames": {"BASE_DATA[1]": LIFTED}},
        ),
    ),
    "turn_not_followed": (
        krl(AT_HOME, "$ORI_TYPE=#JOINT", "LIN_REL {Z 5}"),
        krl(AT_HOME, "$ORI_TYPE=#VAR", "LIN_REL {Z 5}"),
        krl(AT_HOME, "PTP {A1 5}"),
    ),
    "kept_to_next_start": (
        (krl("N=N+5", "PTP {A1 N}"), {"data": "INT N=0"}),
        (krl("N=0", "N=N+5", "PTP {A1 N}"), {"data": "INT N=0"}),
    ),
    "set_elsewhere": (
        (krl("PTP {A1 GZ}"), {"files": SHARED}),
        (krl("GZ=5.0", "PTP {A1 GZ}"), {"files": SHARED}),
    ),
    "turns_otherwise": (
        krl(SOFT, AT_HOME, "LIN_REL {A 60,C 60} #TOOL"),
        krl(SOFT, AT_HOME, "LIN_REL {A 60} #TOOL", "LIN_REL {C 60} #TOOL"),
    ),
    "turns_either_way": (
        krl(SOFT, AT_HOME, "LIN_REL {A 180} #TOOL"),
        krl(SOFT, AT_HOME, "LIN_REL {A 90} #TOOL", "LIN_REL {A 90} #TOOL"),
        krl(SOFT, AT_HOME, "PTP_REL {A6 180}"),
    ),
    "relative_turn_assumed": (
        krl(SOFT, AT_HOME, "LIN_REL {A 20}", "LIN_REL {B 5}"),
        krl(SOFT, AT_HOME, "LIN_REL {A 20}", "LIN_REL {B 5} #TOOL"),
    ),
    "waits_for_others": (
        (krl("N=0", "WAIT FOR N==1", "PTP {A1 N}"), {"data": "INT N=0"}),
        (krl("N=0", "WAIT FOR $IN[1]", "N=1", "PTP {A1 N}"), {"data": "INT N=0"}),
    ),
    "errors_not_followed": (
        rapid("MoveAbsJ [[0,-10,-10,0,-70,5],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;", "ERROR", "TRYNEXT;"),
        rapid("MoveAbsJ [[0,-10,-10,0,-70,5],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;", "ERROR", "EXIT;"),
        rapid("MoveAbsJ [[0,-10,-10,0,-70,5],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;", "ERROR", "Stop;"),
    ),
    "above_limit": (krl("PTP {A1 170}"), krl(f"PTP {{A1 {np.degrees(ROBOT.upper[0]):g}}}")),
    "below_limit": (krl("PTP {A1 -170}"), krl(f"PTP {{A1 {np.degrees(ROBOT.lower[0]):g}}}")),
    "motion_collides.solid": (  # round the post, by the via point that was found
        (krl("PTP {A1 100}"), {"scene": SCENE}),
        lambda before: (
            krl(*(f"PTP {axes(np.radians(move))}" for each in before.findings for move in each.joint_moves)),
            {"scene": SCENE},
        ),
    ),
    "motion_collides.solid_at_target": (
        (krl(f"LIN {{X 400,Y 0,Z 400,{DOWN}}}", "LIN {Z -50}"), {"scene": SCENE}),
        (krl(f"LIN {{X 400,Y 0,Z 400,{DOWN}}}", "LIN {Z 300}"), {"scene": SCENE}),
    ),
    "joint_jumps": (
        krl("PTP {A4 -180,A5 70,A6 180}"),
        krl(AT_HOME),
    ),
    "undecided": (
        (krl(SOFT, f"PTP {axes(BESIDE)}", "LIN_REL {Y -60,Z -60}"), {"start": BESIDE}),
        (krl(SOFT, "PTP {A5 30}", "LIN_REL {Y -60,Z -60}"), {"start": BESIDE + np.radians([0, 0, 0, 0, 30, 0])}),
    ),
    "passes_singularity.elbow": (
        (krl(SOFT, "LIN {A1 23,A2 -50,A3 74,A4 30,A5 70,A6 90}"), {"start": np.radians([21, -45, 67, 36, 79, 80])}),
        (krl(SOFT, "LIN {A1 23,A2 -50,A3 44,A4 30,A5 70,A6 90}"), {"start": np.radians([21, -45, 37, 36, 79, 80])}),
    ),
    "passes_singularity.shoulder": (
        (krl(SOFT, "LIN {A1 30}"), {"start": np.radians([4, 79, -49, 0, -41, 0])}),
        (krl(SOFT, "LIN {A1 30}"), {"start": np.radians([4, 60, -49, 0, -41, 0])}),
    ),
    "configuration_ends": (
        (krl(SOFT, "LIN_REL {X 194,Y -206,Z -57}"), TURNED),
        (krl(SOFT, "LIN_REL {X 1.2,Y -1.2,Z -0.3}"), TURNED),  # where it ends 4.3 mm behind the start
    ),
    "combination_exceeded": (
        (krl("PTP {A2 -50,A3 -20}"), TIED),
        (krl("PTP {A2 -50,A3 -5}"), TIED),
    ),
    "combination_exceeded.": (
        (krl("PTP {X 364.74,Y 0,Z 260,A 0,B 0,C 180}"), TIED),
        (krl("PTP {X 364.74,Y 0,Z 300,A 0,B 0,C 180}"), TIED),
        (krl("PTP {X 364.74,Y 0,Z 260,A 0,B 30,C 180}"), TIED),
    ),
    "slide_exceeded": (
        (CSV.format(200), {"robot": scara(), "start": np.array([0, 0.5, 0.05, 0])}),
        (CSV.format(150), {"robot": scara(), "start": np.array([0, 0.5, 0.05, 0])}),
    ),
    "zone_not_settled": tuple(
        (CORNER.format(zone), {"robot": DRAWN, "scene": BALL, "start": np.radians([-20, -10, -10, 0, -70, 0])})
        for zone in (0.15, 0.05, 0)
    ),
    "motion_collides.links": (
        (krl("LIN {A1 64,A2 13,A3 -75,A4 27,A5 -60,A6 -166}"), {"start": np.radians([63, -20, -61, -4, -63, -126])}),
        (krl(SOFT, "LIN {A1 64,A2 -10}"), {"start": np.radians([63, -20, -61, -4, -63, -126])}),
    ),
    "joint_jumps.moves": (krl("PTP {A1 5,A4 -180,A5 70,A6 180}"), krl("PTP {A1 5}")),
    "passes_singularity.wrist": (
        krl("PTP {A5 -20}", "LIN {A1 2,A5 20}"),
        krl(SOFT, "PTP {A5 -20}", "LIN {A1 2,A5 -30}"),
    ),
}

LONG = ("loop_comes_back_otherwise", "undecided", "not_followed_to_end.drifts")


def form(finding) -> str:
    """Which of several remedies is that of a finding."""
    match finding:
        case MotionCollides():
            if isinstance(finding.touches[0].pair, LinkPair):
                return "links"
            return "solid_at_target" if any(touch.at_target for touch in finding.touches) else "solid"
        case JointJumps():
            return "stays" if finding.moved_mm < STAYS_MM else "moves"
        case TargetNotGiven():
            return finding.reason
    return getattr(finding, "kind", getattr(finding, "type", ""))


@pytest.mark.parametrize(
    "code", [pytest.param(code, marks=pytest.mark.long if code in LONG else ()) for code in MENDED]
)
def test_a_program_that_is_mended_as_advised_passes(tmp_path, code):
    """Each way to mend it that the remedy names."""

    def checked(program):
        text, given = program if isinstance(program, tuple) else (program, {})
        suffix = {"M": "mod", "D": "src", "d": "script", "t": "csv"}.get(text[0], "pgm") if text[:2] != "MJ" else "pgm"
        options = {"start": HOME} | {
            key: value for key, value in given.items() if key not in ("data", "robot", "files")
        }
        (tmp_path / f"a.{suffix}").write_text(text)
        (tmp_path / "a.dat").unlink(missing_ok=True)
        if "data" in given:
            (tmp_path / "a.dat").write_text(f"DEFDAT a\nDECL {given['data']}\nENDDAT\n")
        for name, held in given.get("files", {}).items():
            (tmp_path / name).write_text(held)
        robot = given.get("robot", ROBOT)
        return check_program(read_program(tmp_path / f"a.{suffix}"), robot, CheckOptions(**options))

    def codes(found):
        return {
            name for each in found.findings for name in (each.finding.code, f"{each.finding.code}.{form(each.finding)}")
        }

    broken, *mended = MENDED[code]
    before = checked(broken)
    assert code in codes(before), codes(before)
    for program in mended:
        after = checked(program(before) if callable(program) else program)
        assert code not in codes(after)
        if "way_not_known" not in codes(after):  # without a start pose the first way is unexamined
            assert after.level in ("pass", "note"), codes(after)
