"""An unknown word, call or value never leads to a pass of a motion that depends on it."""

from __future__ import annotations

import random
from dataclasses import dataclass, field

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.programs.execution import RunLimits
from er3a.programs.instructions import ArmMotion, JointTarget
from er3a.programs.languages import execute, read_program

ROBOT = load_robot("er3a_c60")
START = np.radians([0, -20, 10, 0, 30, 0])
AXES = "PTP {A1 5, A2 -20, A3 10, A4 0, A5 30, A6 0}"


def krl(body: str) -> str:
    """A program of KRL."""
    return f"DEF JOB ( )\nDECL INT N, M\nDECL E6AXIS HERE\n$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\n{body}\nEND\n"


def checked(tmp_path, text, name="job.src", **options):
    """A program, checked from a start."""
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return check_program(read_program(path), ROBOT, CheckOptions(start=START, **options))


LINE = "LIN_REL {X 1}"
UNKNOWN = {  # what is not known before the last motion, which depends on it
    "call": ("STRANGE(1)", LINE),
    "word": ("FROBNICATE THE ARM", LINE),
    "function": ("N=STRANGE(2)", LINE),
    "variable of the controller": ("$CORR_T={X 5,Y 0,Z 0,A 0,B 0,C 0}", LINE),
    "tool": ("$TOOL=TOOL_DATA[7]", LINE),
    "base": ("$BASE=BASE_DATA[3]", "LIN {X 400,Y 0,Z 400,A 0,B 90,C 0}"),
    "value": ("N=$ANIN[1]", "PTP {A1 N}"),
    "value by a call": ("SREAD(TEXT[],STATE,N)", "PTP {A1 N}"),
    "value of a side": ("N=1\nIF $IN[1] THEN\nN=$ANIN[2]\nENDIF", "PTP {A1 N}"),
    "value of rounds": ("N=0\nWHILE $IN[1]\nN=N+1\nENDWHILE", "PTP {A1 N}"),
    "value of a loop without end": ("N=0\nLOOP\nN=N+1\nIF $IN[1] THEN\nEXIT\nENDIF\nENDLOOP", "PTP {A1 N}"),
    "variable of an interrupt": ("INTERRUPT DECL 4 WHEN $IN[1] DO N=3", "PTP {A1 N}"),
    "setting": ("$ORI_TYPE=#JOINT", LINE),
    "half of a turn": ("", "LIN_REL {C 180} #TOOL"),
    "point": ("", "PTP XP1"),
    "spline": ("SPLINE\nSPL XP1\nENDSPLINE", LINE),
    "axis": ("", "PTP {A1 0, E1 100}"),
    "side that is too much": ("FOR N=1 TO 100\nIF $IN[N] THEN\nM=M+N\nENDIF\nENDFOR", "PTP {A1 M}"),
    "after a side": (f"IF $IN[1] THEN\n{AXES}\nENDIF\nSTRANGE()", LINE),
    "recursion": ("JOB()", LINE),
}


@pytest.mark.parametrize("case", UNKNOWN)
def test_a_motion_that_depends_on_it_is_no_pass(case, tmp_path):
    before, motion = UNKNOWN[case]
    verdicts = checked(tmp_path, krl(f"{AXES}\n{before}\n{motion}")).verdicts
    assert verdicts[-1].level in ("caution", "fail")
    assert not verdicts[-1].followed


def test_a_pose_beside_a_track_is_no_fail(tmp_path):
    far = "{X 5000, Y 0, Z 500, A 0, B 90, C 0"
    on_track, alone = (checked(tmp_path, krl(f"{AXES}\nPTP {far}{outer}}}")) for outer in (", E1 4500", ""))
    assert [each.level for each in (on_track.verdicts[-1], alone.verdicts[-1])] == ["caution", "fail"]


def test_without_it_the_motions_pass(tmp_path):
    check = checked(tmp_path, krl(f"{AXES}\nN=10\n{LINE}\nPTP {{A1 N}}"))
    assert [(each.level in ("pass", "note"), each.followed) for each in check.verdicts] == [(True, True)] * 3
    assert "self-collision" in check.checked
    assert "scene" not in check.checked


def test_what_is_assumed_is_followed(tmp_path):
    text = krl(f"{AXES}\nSTRANGE(1)\n{LINE}\nPTP {{A1 XN}}")
    limits = RunLimits(assumed=("str*",), assumed_values={"XN": 3})
    assert all(each.followed for each in checked(tmp_path, text, limits=limits).verdicts)


def test_routines_that_nothing_calls_are_checked(tmp_path):
    text = krl(AXES) + f"DEF OTHER ( )\nPTP {{A1 500, A2 -20, A3 10, A4 0, A5 30, A6 0}}\n{LINE}\nEND\n"
    check = checked(tmp_path, text)
    assert {each.finding.code for each in check.findings if each.level == "fail"} == {"above_limit"}
    assert check.verdicts[0].level in ("pass", "note")


OTHERS = {
    "urscript call": (
        "a.script",
        "def job():\n movej([0,-1.2,1,0,1,0])\n strange()\n"
        " movel(pose_add(get_target_tcp_pose(),p[0,0,0.01,0,0,0]))\nend\n",
    ),
    "rapid call": (
        "a.mod",
        "MODULE m\nPROC main()\nVAR num n:=1;\nstrange n;\n"
        "MoveAbsJ [[n,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\nENDPROC\nENDMODULE\n",
    ),
    "rapid tool": (
        "a.mod",
        "MODULE m\nPROC main()\n"
        "MoveAbsJ [[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n"
        "MoveL Offs(CRobT(),0,0,5),v100,fine,tStrange;\nENDPROC\nENDMODULE\n",
    ),
    "rpl call": (
        "a.pgm",
        "MJOINT(POINTJ(0,-20,10,0,30,0),v20perc,fine,tool0);\nstrange(1);\nMLIN(POINTC(300,0,300,0,90,0),v20,fine,tool0);\n",
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("case", OTHERS)
def test_so_it_is_in_other_languages(case, tmp_path):
    name, text = OTHERS[case]
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    arm = ROBOT if name != "a.script" else load_robot("ur5e")
    check = check_program(read_program(path), arm, CheckOptions(start=np.radians([0, -60, 60, 0, 60, 0])))
    assert check.verdicts[-1].level in ("caution", "fail")
    assert not check.verdicts[-1].followed


@dataclass
class Made:
    """A random program, and what one run of it does with random inputs."""

    rng: random.Random
    lines: list[str] = field(default_factory=list)

    def block(self, depth: int) -> list[tuple]:
        """Random statements, each a tuple for :func:`carried_out`, written to ``lines``."""
        return [self.statement(depth) for _ in range(self.rng.randint(1, 4))]

    def statement(self, depth: int) -> tuple:
        kind = self.rng.choice(["set", "add", "move", "move", *(["if", "ifin", "for", "while"] if depth else [])])
        x, y = self.rng.choice("NMK"), self.rng.choice("NMK")
        number = self.rng.randint(0, 3)
        if kind == "set":
            self.lines.append(f"{x}={number}")
            return ("set", x, number)
        if kind == "add":
            self.lines.append(f"{x}={y}+{number}")
            return ("add", x, y, number)
        if kind == "move":
            self.lines.append(f"PTP {{A1 {x}+{number}, A2 -20, A3 10, A4 0, A5 30, A6 0}}")
            return ("move", x, number, len(self.lines))
        head = {
            "if": f"IF {x}>{number} THEN",
            "ifin": f"IF $IN[{number + 1}] THEN",
            "while": f"WHILE $IN[{number + 1}]",
        }
        if kind == "for":
            self.lines.append(f"FOR I{depth}=1 TO {number}")
            body = self.block(depth - 1)
            self.lines.append("ENDFOR")
            return ("for", number, body)
        self.lines.append(head[kind])
        body = self.block(depth - 1)
        other = []
        if kind != "while":
            self.lines.append("ELSE")
            other = self.block(depth - 1)
        self.lines.append("ENDWHILE" if kind == "while" else "ENDIF")
        return (kind, x, number, body, other)


def carried_out(block, values, rng, done):
    """What a block does, with inputs as they come."""
    for kind, *rest in block:
        if len(done) > 300:
            return
        if kind == "set":
            values[rest[0]] = rest[1]
        elif kind == "add":
            values[rest[0]] = values[rest[1]] + rest[2]
        elif kind == "move":
            done.append((rest[2], values[rest[0]] + rest[1]))
        elif kind == "for":
            for _ in range(rest[0]):
                carried_out(rest[1], values, rng, done)
        elif kind == "while":
            while rng.random() < 0.7 and len(done) < 300:
                carried_out(rest[2], values, rng, done)
        else:
            holds = values[rest[0]] > rest[1] if kind == "if" else rng.random() < 0.5
            carried_out(rest[2 if holds else 3], values, rng, done)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(60))
def test_each_run_of_a_random_program_does_what_was_followed(seed, tmp_path):
    made = Made(random.Random(seed))
    block = made.block(3)
    path = tmp_path / "job.src"
    head = "DEF JOB ( )\nDECL INT N, M, K, I1, I2, I3\nN=0\nM=1\nK=2\n"
    path.write_text(head + "\n".join(made.lines) + "\nEND\n", encoding="utf-8")
    execution = execute(read_program(path), ROBOT)
    assert execution.complete
    followed, unknown = set(), set()
    for step in execution.steps:
        if isinstance(step.instruction, ArmMotion):
            if isinstance(step.instruction.target, JointTarget):
                followed.add((step.place.line, round(float(np.degrees(step.instruction.target.joints[0])))))
            else:
                unknown.add(step.place.line)
    for run in range(30):
        done: list[tuple[int, int]] = []
        carried_out(block, {"N": 0, "M": 1, "K": 2}, random.Random(run), done)
        for line, angle in done:
            here = line + head.count("\n")
            assert here in unknown or (here, angle) in followed


def test_ways_of_too_many_sides_are_joined_and_not_cut(tmp_path):
    """What differs between them is unknown then: a motion by it is not followed, and one without it passes."""
    sides = "".join(f"IF $IN[{number}] THEN\nM={number}\n" for number in range(1, 6)) + "ENDIF\n" * 5
    check = checked(tmp_path, krl(f"M=0\n{sides}{AXES}\nPTP {{A1 M}}"), limits=RunLimits(ways=3))
    assert check.execution.complete
    assert [(each.level in ("pass", "note"), each.followed) for each in check.verdicts] == [
        (True, True),
        (False, False),
    ]
