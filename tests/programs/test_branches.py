"""Branches on what only the cell knows: which are followed on both sides, and which are passed."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.programs.execution import RunLimits
from er3a.programs.instructions import ArmMotion, Decision, JointTarget
from er3a.programs.languages import read_program
from er3a.programs.machine import Machine, execute
from tests.programs.test_round_trips import ROBOT

GRIPPER = """def work():
  def grip(width):
    timeout = 0
    while get_digital_in(9) == False:
      if timeout > 750000:
        break
      end
      timeout = timeout + 1
      sync()
    end
    i = 0
    while i < 17:
      set_digital_out(8, True)
      if get_digital_in(8):
        found = 1
      end
      i = i + 1
    end
    if get_digital_in(7):
      popup("lost")
      return False
    end
    return True
  end
  while True:
    movej([0, -1.57, 1.57, 0, 1.57, 0])
    grip(50)
    movej([0.5, -1.57, 1.57, 0, 1.57, 0])
    grip(10)
  end
end
"""


def program_of(folder, name, text):
    """A program of a text."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return read_program(path)


def test_a_grippers_own_waits_are_passed_and_the_motions_behind_are_checked(tmp_path):
    execution = execute(program_of(tmp_path, "grip.script", GRIPPER))
    assert execution.complete
    assert [each.kind for each in execution.endings] == ["repeats"]
    assert {execution.steps[i].place.line for i in execution.motions} == {26, 28}


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        (
            "a.mod",
            "MODULE a\nPROC main()\nTEST GInput(gi1)\nCASE 1,2:\nStop;\nENDTEST\nENDPROC\nENDMODULE\n",
            "TEST GInput(gi1) CASE 1,2",
        ),
        ("a.src", "DEF a( )\nSWITCH $IN[1]\nCASE TRUE\nHALT\nENDSWITCH\nEND\n", "SWITCH $IN[1] CASE TRUE"),
        ("a.pgm", "CASE i OF\n1,2: DWELL(1);\nEND_CASE;\n", "CASE i OF 1,2"),
    ],
)
def test_a_case_is_told_with_what_its_values_are_compared_with(name, text, told, tmp_path):
    steps = execute(program_of(tmp_path, name, text)).steps
    assert {each.instruction.condition for each in steps if isinstance(each.instruction, Decision)} == {told}


def test_a_side_that_changes_where_the_arm_goes_is_followed(tmp_path):
    text = "DEF p( )\nDECL REAL z\nz=0\nIF $IN[1] THEN\nz=10\nENDIF\nPTP {A1 0,A2 z,A3 0,A4 0,A5 0,A6 0}\nEND\n"
    steps = execute(program_of(tmp_path, "p.src", text)).steps
    targets = [each.instruction.target for each in steps if hasattr(each.instruction, "target")]
    assert sorted(round(float(np.degrees(each.joints[1]))) for each in targets) == [0, 10]


@pytest.mark.parametrize(
    "side", ["halt", "RETURN", "EXIT", "PTP {A1 5,A2 0,A3 0,A4 0,A5 0,A6 0}", "unknown()", "BAS(#TOOL,2)", "GOTO out"]
)
def test_a_side_that_ends_moves_or_leaves_is_not_passed(side, tmp_path):
    inside = f"LOOP\nIF $IN[1] THEN\n{side}\nENDIF\nPTP {{A1 1,A2 0,A3 0,A4 0,A5 0,A6 0}}\nENDLOOP\nout:\n"
    text = f"DEF p( )\n{inside}PTP {{A1 9,A2 0,A3 0,A4 0,A5 0,A6 0}}\nEND\n"
    execution = execute(program_of(tmp_path, "p.src", text))
    taken = {each.instruction.taken for each in execution.steps if isinstance(each.instruction, Decision)}
    assert taken == ({True, False} if side != "halt" else taken)
    assert execution.complete


def random_program(rng, lines):
    """Nested ifs and loops on inputs and counters, with motions, in KRL."""
    text, blocks = ["DEF p( )", "INT a, b, c", "a=0", "b=0", "c=0"], []
    for _ in range(lines):
        kind = rng.integers(9)
        name = "abc"[rng.integers(3)]
        if kind <= 1 and len(blocks) < 4:
            condition = [f"$IN[{rng.integers(4)}]", f"{name}>1", f"{name}==$IN[1]"][rng.integers(3)]
            text.append(f"IF {condition} THEN")
            blocks.append("ENDIF")
        elif kind == 2 and len(blocks) < 4:
            text.append(f"WHILE $IN[{rng.integers(4)}]")
            blocks.append("ENDWHILE")
        elif kind == 3 and blocks:
            text.append(blocks.pop())
        elif kind == 4 and blocks and blocks[-1] == "ENDIF":
            text.append("ELSE")
            blocks[-1] = "ENDIF "
        elif kind <= 6:
            text.append(f"{name}={['abc'[rng.integers(3)], str(rng.integers(3))][rng.integers(2)]}")
        elif kind == 7:
            text.append(f"PTP {{A1 {rng.integers(9)},A2 {name},A3 0,A4 0,A5 0,A6 0}}")
        else:
            text.append(["$OUT[1]=TRUE", "WAIT SEC 0", "sub()"][rng.integers(3)])
    text += reversed(blocks)
    sub = ["DEF sub( )", "IF $IN[7] THEN", "a=1", "RETURN", "ENDIF", "b=2", "END"]
    return "\n".join([*text, "PTP {A1 1,A2 a,A3 b,A4 c,A5 0,A6 0}", "END", *sub, ""])


def visited(execution):
    """Where the arm goes, by line; what is not known by its text."""
    found = set()
    for step in execution.steps:
        target = getattr(step.instruction, "target", None)
        if target is not None:
            known = isinstance(target, JointTarget)
            found.add((step.place.line, tuple(np.degrees(target.joints).round(9)) if known else target))
    return found


@pytest.mark.long
@pytest.mark.parametrize("seed", range(10))
def test_the_arm_goes_where_it_goes_when_both_sides_of_every_branch_are_followed(seed, tmp_path, monkeypatch):
    program = program_of(tmp_path, "p.src", random_program(np.random.default_rng(seed), 40))
    passed = execute(program, limits=RunLimits(ways=100_000))
    start = Machine.__init__

    def forgetful(self, *given):
        start(self, *given)
        self.quiet = {}

    monkeypatch.setattr(Machine, "__init__", forgetful)
    followed = execute(program, limits=RunLimits(ways=100_000))
    assert passed.complete
    assert followed.complete
    assert visited(passed) == visited(followed)


def test_motions_behind_the_last_step_that_is_followed_are_not_called_unreachable(tmp_path):
    text = "DEF p( )\nINT i\nFOR i=1 TO 100\nIF $IN[i] THEN\nPTP {A1 i}\nENDIF\nENDFOR\nPTP {A1 3}\nEND\n"
    options = CheckOptions(limits=RunLimits(operations=200, ways=3), start=np.zeros(6), measures=False)
    check = check_program(program_of(tmp_path, "p.src", text), ROBOT, options)
    codes = {each.finding.code: each.level for each in check.findings}
    assert codes["not_come_to"] == "caution"
    assert "never_reached" not in codes


def test_ways_that_come_into_one_state_again_use_up_no_branches(tmp_path):
    """2^12 sequences of branches, but 13 states behind each: how many parts there are."""
    taken = "".join(f"IF $IN[{i}] THEN\nn=n+1\nPTP {{A1 {i}}}\nPTP {{A1 0}}\nENDIF\n" for i in range(1, 13))
    last = "IF n>6 THEN\nPTP {A1 33}\nENDIF\n"
    text = f"DEF p( )\nDECL INT n\nn=0\nPTP {{A1 0,A2 0,A3 0,A4 0,A5 30,A6 0}}\n{taken}{last}END\n"
    execution = execute(program_of(tmp_path, "p.src", text), ROBOT, limits=RunLimits(ways=20))
    assert execution.complete
    assert 33 in {target[0] for _, target in visited(execution)}


def test_a_loop_to_an_unknown_end_leaves_branches_for_what_is_behind_it(tmp_path):
    loop = "FOR i=1 TO n\n$ACC_AXIS[i]=50\nENDFOR\n"
    rest = "IF $IN[1] THEN\nPTP {A1 5}\nELSE\nPTP {A1 6}\nENDIF\n"
    text = f"DEF p( )\nINT i\nPTP {{A1 0,A2 0,A3 0,A4 0,A5 30,A6 0}}\n{loop}{rest}END\n"
    execution = execute(program_of(tmp_path, "p.src", text), ROBOT, limits=RunLimits(operations=20_000, ways=400))
    behind = [
        step.before for step in execution.steps if isinstance(step.instruction, Decision) and step.place.line == 7
    ]
    assert len(behind) > len(set(behind)), "both sides were followed from one state"
    assert {each.place.line: each.kind for each in execution.endings if each.kind != "end"} == {
        4: "rounds",
        7: "branches",
    }
    cut = execute(program_of(tmp_path, "p.src", text), ROBOT, limits=RunLimits(ways=1))
    assert [each.place.line for each in cut.endings if each.kind == "rounds"] == [4]
    assert {each.kind for each in cut.endings} == {"rounds", "branches", "end"}, "it leaves the loop"


def sides(first, second, before="SW=$IN[1]\n", between="", declared="BOOL SW\n", more=""):
    """A program that asks twice, and moves axis 1 on each of the four sides."""
    asked = f"IF {first} THEN\nPTP {{A1 1}}\nELSE\nPTP {{A1 2}}\nENDIF\n{between}"
    asked += f"IF {second} THEN\nPTP {{A1 3}}\nELSE\nPTP {{A1 4}}\nENDIF\n"
    return f"DEF p( )\n{declared}PTP {{A1 0,A2 0,A3 0,A4 0,A5 30,A6 0}}\n{before}{asked}END\n{more}"


ONCE, OPPOSITE = {(1, 3), (2, 4)}, {(1, 4), (2, 3)}
ANY = ONCE | OPPOSITE
SET = "DEF set(V:OUT)\nBOOL V\nV=$IN[1]\nEND\n"
ASKED_TWICE = {  # the program, which sides of the two branches one run may take
    "once": (sides("SW", "SW"), ONCE),
    "not": (sides("SW", "NOT SW"), OPPOSITE),
    "compared": (sides("SW==TRUE", "SW==FALSE"), OPPOSITE),
    "input": (sides("$IN[1]", "$IN[1]"), ANY),
    "set_again": (sides("SW", "SW", between="SW=$IN[1]\n"), ANY),
    "set_by_a_routine": (sides("SW", "SW", between="set(SW)\n", more=SET), ANY),
    "set_in_a_routine": (sides("SW", "SW", before="set(SW)\n", more=SET), ONCE),
    "perhaps_set": (sides("SW", "SW", between="IF $IN[2] THEN\nSW=$IN[1]\nENDIF\n"), ANY),
    "two_variables": (sides("SW", "TW", "SW=$IN[1]\nTW=SW\n", declared="BOOL SW,TW\n"), ANY),
    "not_its_own": (sides("SW", "SW", declared=""), ANY),
    "nothing_assigned": (sides("SW", "SW", before=""), ANY),
    "interrupt": (sides("SW", "SW", "INTERRUPT DECL 3 WHEN $IN[2] DO set(SW)\nSW=$IN[1]\n", more=SET), ANY),
    "unknown_interrupt": (sides("SW", "SW", "INTERRUPT DECL 3 WHEN $IN[2] DO FOO(SW)\nSW=$IN[1]\n"), ANY),
}


@pytest.mark.parametrize("case", ASKED_TWICE)
def test_a_variable_that_is_read_once_has_one_value_at_both_branches(case, tmp_path):
    text, wanted = ASKED_TWICE[case]
    execution = execute(program_of(tmp_path, "p.src", text), ROBOT)
    found = set()
    for ending in (each for each in execution.endings if not each.beside):
        way = [execution.steps[i].instruction for i in execution.way(ending)]
        moved = [round(np.degrees(each.target.joints[0])) for each in way if isinstance(each, ArmMotion)]
        found.add(tuple(each for each in moved if each))
    assert {each for each in found if len(each) == 2} == wanted  # shorter ones join another between the two


def test_ways_meet_behind_the_last_branch_that_asks_a_variable(tmp_path):
    asked = "SW=$IN[1]\nIF SW THEN\nPTP {A1 1}\nENDIF\nIF SW THEN\nPTP {A1 2}\nENDIF\nPTP {A1 0}\n"
    start = "DEF p( )\nBOOL SW\nPTP {A1 0,A2 0,A3 0,A4 0,A5 30,A6 0}\n"
    text = f"{start}SW=$IN[1]\nLOOP\n{asked}ENDLOOP\nEND\n"
    execution = execute(program_of(tmp_path, "p.src", text), ROBOT)
    assert execution.complete
    assert len([each for each in execution.steps if isinstance(each.instruction, Decision)]) == 4, (
        "two rounds, of one branch each"
    )


@pytest.mark.parametrize("phase", ["following", "checking"])
@pytest.mark.parametrize("asks", [0, 1, 3])
def test_what_a_stopped_check_left_out_is_named_and_does_not_pass(phase, asks, tmp_path):
    moves = "".join(f"IF $IN[{i}] THEN\nPTP {{A1 {i}}}\nELSE\nPTP {{A1 {-i}}}\nENDIF\n" for i in range(1, 31))
    text = f"DEF p( )\nPTP {{A1 0,A2 0,A3 0,A4 0,A5 30,A6 0}}\n{moves}END\n"
    asked = []

    def keep_on(at, done, of):
        asked.append(at)
        return asked.count(phase) <= asks

    program = program_of(tmp_path, "p.src", text)
    options = CheckOptions(start=np.zeros(6), measures=False, keep_on=keep_on)
    check = check_program(program, ROBOT, options)
    whole = check_program(program, ROBOT, CheckOptions(start=np.zeros(6), measures=False))
    missed = {each.place.line for each in check.not_examined if each.what == "motion"}
    assert whole.not_examined == ()
    assert check.level == "caution"
    assert {"following": "not_followed_to_end", "checking": "rest_not_checked"}[phase] in {
        each.finding.code for each in check.findings
    }
    for now, then in zip(check.verdicts, whole.verdicts):
        assert (now.times == then.times) or now.line in missed or phase == "following"
        assert now.level == "caution" if now.line in missed or not now.times else now.level == then.level
    if phase == "following":
        assert {each.what for each in check.not_examined} == {"motion", "course"}


def test_behind_what_may_move_the_arm_no_way_is_known(tmp_path):
    text = "DEF p( )\nPTP {A1 0,A2 0,A3 0,A4 0,A5 30,A6 0}\nother()\nPTP {A1 9,A2 0,A3 0,A4 0,A5 30,A6 0}\nEND\n"
    check = check_program(program_of(tmp_path, "p.src", text), ROBOT, CheckOptions(start=np.zeros(6), measures=False))
    assert [(each.place.line, each.finding.code) for each in check.findings if "known" in each.finding.code] == [
        (4, "way_not_known")
    ]


def test_a_motion_to_where_the_arm_stands_needs_no_start(tmp_path):
    text = "DEF p( )\nPTP $AXIS_ACT ; skip BCO quickly\nLIN $POS_ACT\nPTP {A1 9,A2 0,A3 0,A4 0,A5 30,A6 0}\nEND\n"
    check = check_program(program_of(tmp_path, "p.src", text), ROBOT, CheckOptions(measures=False))
    assert "target_not_given" not in {each.finding.code for each in check.findings}
    assert [each.end is None for each in check.motions.values()] == [True, True, False]


XPL = """<?xml version="1.0"?><Xpl-source><XplEnvironment><Pous><Pou><Name>Main</Name><Type>Program</Type><Body>
{inside}
<mjoint><target>POINTJ(0,-10,-10,0,-70,0)</target><speed>v5perc</speed><zone>fine</zone><tool>tool0</tool>
<refsys></refsys></mjoint><end_pro/>{after}</Body>{pous}</Pou></Pous></XplEnvironment></Xpl-source>"""
POU = """<Pou><Name>{n}</Name><Body><mjoint><target>POINTJ({n}0,-10,-10,0,-70,0)</target><speed>v5perc</speed>
<zone>fine</zone><tool>tool0</tool></mjoint></Body></Pou>"""
ONE = "<if><cond>io.DIn[1]</cond><pouref>1</pouref>{}</if>"
ELSE, ELSIF = "<else><pouref>2</pouref></else>", "<elsif><cond>io.DIn[2]</cond><pouref>2</pouref></elsif>"


@pytest.mark.parametrize(
    ("inside", "ways"),
    [
        (ONE.format(""), {(1, 0), (0,)}),
        (ONE.format("<pouref>2</pouref>"), {(1, 0), (2, 0)}),
        (ONE.format(ELSE), {(1, 0), (2, 0)}),
        (ONE.format("") + ELSE, {(1, 0), (2, 0)}),
        (ONE.format(ELSIF), {(1, 0), (2, 0), (0,)}),
        (ONE.format("").replace("io.DIn[1]", "1=1") + ELSE, {(1, 0)}),
    ],
)
def test_an_if_of_the_controllers_xml_has_its_sides(inside, ways, tmp_path):
    pous = "".join(POU.format(n=n) for n in (1, 2) if f"<pouref>{n}<" in inside)
    text = XPL.format(inside=inside, after="", pous=pous)
    program = program_of(tmp_path, "IF.XPL", text)
    assert [each.code for each in program.findings] == ["program_form_inferred"]
    execution = execute(program)
    found = set()
    for ending in execution.endings:
        moves = [execution.steps[i].instruction for i in execution.way(ending)]
        if ending.kind == "joins":
            moves += [execution.steps[ending.repeats_from].instruction]
        found.add(tuple(round(float(np.degrees(m.target.joints[0])) / 10) for m in moves if hasattr(m, "target")))
    assert found == ways


def test_an_if_of_another_form_may_move_and_so_may_what_stands_behind_it(tmp_path):
    inside = "<if><cond>x</cond><then><mjoint /></then></if>" + ELSE
    check = check_program(
        program_of(tmp_path, "IF.XPL", XPL.format(inside=inside, after="", pous=POU.format(n=2))), ROBOT
    )
    assert sorted({each.finding.code for each in check.findings if each.level == "caution"})[0] == "may_move"


def test_nothing_stands_behind_the_end_of_a_program(tmp_path):
    execution = execute(program_of(tmp_path, "END.XPL", XPL.format(inside="", after="<odd />", pous="")))
    assert [type(each.instruction).__name__ for each in execution.steps] == ["ArmMotion"]


@pytest.mark.long
def test_lines_of_an_arm_with_three_parallel_axes_are_followed(tmp_path):
    text = """def line():
  set_tcp(p[0,0,0,0,0,0])
  movej([1.57, -1.57, 1.57, -1.57, -1.57, 0.0])
  here = get_forward_kin([1.57, -1.57, 1.57, -1.57, -1.57, 0.0])
  movel(pose_add(here, p[0,0,-0.1,0,0,0]), v=0.1)
  movel(pose_add(here, p[0,2,0,0,0,0]), v=0.1)
end
"""
    arm = load_robot("ur5e")
    check = check_program(program_of(tmp_path, "line.script", text), arm, CheckOptions(measures=False))
    assert {each.place.line: each.level for each in check.verdicts} == {3: "caution", 5: "pass", 6: "fail"}
    assert "way_out_of_reach" in {each.finding.code for each in check.findings}
