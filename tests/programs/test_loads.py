"""What programs say hangs on the flange: the same part in three languages, written by hand in the flange's frame."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.finding import fact, is_one
from er3a.program_check.check_program import CheckOptions, ProgramCheck, check_program
from er3a.programs.instructions import ArmMotion, JointTarget, Listing, Load, NamedFrame, UnclearLoad, Unknown
from er3a.programs.languages import execute, read_program, write_program
from er3a.programs.writing import WriteOptions, WrittenProgram
from er3a.robots.masses import MassBody

HOME = "0,-10,-10,0,-70,0"
MOVES = {
    "krl": "PTP {A1 0,A2 -10,A3 -10,A4 0,A5 -70,A6 0}\n",
    "urscript": "  movej([0,-0.17,-0.17,0,-1.22,0])\n",
    "rapid": "MoveAbsJ [[0,-10,-10,0,-70,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tG;\n",
}
SUFFIX = {"krl": ".src", "urscript": ".script", "rapid": ".mod"}
RAPID = (
    "MODULE M\nPERS tooldata tG:=[TRUE,[[0,0,100],[0.7071067811865476,0,0,0.7071067811865476]],"
    "[1,[0,0,50],[1,0,0,0],0.01,0.02,0.03]];\nPERS loaddata part:=[1,[20,0,50],[1,0,0,0],0.004,0.005,0.006];\n"
    "PERS loaddata whole:=[2.5,[0,0,60],[1,0,0,0],0,0,0];\nPROC main()\n{body}ENDPROC\nENDMODULE\n"
)
WRAPPED = {"krl": "DEF P( )\n{body}END\n", "urscript": "def p():\n{body}end\n", "rapid": RAPID}


def loads(language: str, tmp_path, *settings: str) -> list[Load | None]:
    """The load of a motion behind each setting."""
    file = tmp_path / f"p{SUFFIX[language]}"
    body = "".join(f"{each}\n{MOVES[language]}" for each in settings)
    file.write_text(WRAPPED[language].replace("{body}", body))
    run = execute(read_program(file), load_robot("er3a_c60"))
    return [motion.load for motion in run.listing().motions]


def same(load: Load | None, mass: float, centre: tuple, inertia: tuple, within: float = 1e-12) -> None:
    assert isinstance(load, MassBody)
    assert load.mass == pytest.approx(mass)
    np.testing.assert_allclose(load.centre, centre, atol=within)
    np.testing.assert_allclose(load.inertia, inertia, atol=within)


def test_krl_gives_loads_by_variable_number_and_tool(tmp_path):
    record = "{M 2.5,CM {X 10,Y 0,Z 50,A 90,B 0,C 0},J {X 0.1,Y 0.2,Z 0.3}}"
    (tmp_path / "$config.dat").write_text(
        "DEFDAT $CONFIG PUBLIC\nDECL FRAME TOOL_DATA[16]\nDECL LOAD LOAD_DATA[16]\n"
        "TOOL_DATA[3]={X 0,Y 0,Z 100,A 0,B 0,C 0}\n"
        "LOAD_DATA[3]={M 4,CM {X 0,Y 0,Z 70,A 0,B 0,C 0},J {X 0,Y 0,Z 0}}\n"
        "LOAD_DATA[4]={M -1,CM {X 0,Y 0,Z 0,A 0,B 0,C 0},J {X 0,Y 0,Z 0}}\nENDDAT\n"
    )
    settings = ("", f"$LOAD={record}", "$LOAD.M=3", "BAS(#TOOL,3)", "$LOAD=LOAD_DATA[4]", "$LOAD=LOAD_DATA[9]")
    before, turned, heavier, numbered, unknown, open_ = loads("krl", tmp_path, *settings)
    assert before is None
    same(turned, 2.5, (0.01, 0, 0.05), (0.2, 0.1, 0.3, 0, 0, 0))  # 90 deg about z: the axes x and y change places
    same(heavier, 3, (0.01, 0, 0.05), (0.2, 0.1, 0.3, 0, 0, 0))
    same(numbered, 4, (0, 0, 0.07), (0,) * 6)
    assert unknown is None
    assert open_ == UnclearLoad("LOAD_DATA[9]")


def test_parts_of_a_krl_load_whose_whole_is_not_known_are_not_dropped(tmp_path):
    """Controllers hold a load from before; a program that changes its mass names that alone."""
    (tmp_path / "$config.dat").write_text("DEFDAT $CONFIG PUBLIC\nDECL LOAD LOAD_DATA[16]\nENDDAT\n")
    settings = ("$LOAD.M=50", "$LOAD.CM.Z=500", "BAS(#TOOL,0)", "$LOAD.M=$ANIN[1]")
    alone, moved, none, unknown = loads("krl", tmp_path, *settings)
    assert alone == UnclearLoad("$LOAD.M", 50.0)
    assert moved == UnclearLoad("$LOAD.M", 50.0)
    assert none is None
    assert unknown.mass is None


def test_a_mass_alone_is_compared_with_the_payload(tmp_path):
    move = "  movej([0,-0.17,-0.17,0,-1.22,0])\n"
    found = checked(
        tmp_path, f"def p():\n  set_payload(50)\n{move}  set_payload(read_input_float_register(0))\n{move}end\n"
    )
    said = [each for each in found.findings if is_one(each.finding, "load_above_payload")]
    assert [(each.level, each.finding.code) for each in said] == [
        ("fail", "load_above_payload"),
    ]


def test_rapid_has_the_load_of_its_tool_and_names_what_is_gripped(tmp_path):
    (tool, again) = loads("rapid", tmp_path, "", "GripLoad part;")
    same(tool, 1, (0, 0, 0.05), (0.01, 0.02, 0.03, 0, 0, 0))
    assert again == tool
    unknown = [
        step for step in execute(read_program(tmp_path / "p.mod")).steps if isinstance(step.instruction, Unknown)
    ]
    assert [step.instruction.text for step in unknown] == ["GripLoad part"]


PART = MassBody(2.5, (0.01, -0.02, 0.05), (0.02, 0.03, 0.04, 0.001, -0.002, 0.003))
PLAIN = MassBody(1.2, (0.0, 0.0, 0.07))


def written(language: str, loads: list[Load | None], repeats_from: int | None = None) -> WrittenProgram:
    """Joint motions with these loads, written."""
    tool = NamedFrame("", np.array([[0, -1, 0, 0.0], [1, 0, 0, 0], [0, 0, 1, 0.1], [0, 0, 0, 1]]))
    points = (np.radians([i, -10, -10, 0, -70, 0]) for i in range(len(loads)))
    motions = [ArmMotion("joint", JointTarget(q), tool=tool, load=load) for q, load in zip(points, loads)]
    robot = load_robot("er3a_c60")
    return write_program(Listing("p", tuple(motions), repeats_from=repeats_from), language, WriteOptions(robot))


def read_back(program: WrittenProgram, tmp_path) -> list[Load | None]:
    for suffix, text in program.files.items():
        (tmp_path / f"p{suffix}").write_text(text)
    run = execute(read_program(tmp_path / f"p{next(iter(program.files))}"), load_robot("er3a_c60"))
    return [step.instruction.load for step in run.steps if isinstance(step.instruction, ArmMotion)]


@pytest.mark.parametrize("language", SUFFIX)
def test_written_loads_come_back(language, tmp_path):
    given = [None, PART, PART, PLAIN, None, PART]
    found = read_back(written(language, given), tmp_path)
    for load, wanted in zip(found, given, strict=True):
        if wanted is None:
            assert load is None
        else:
            same(load, wanted.mass, wanted.centre, wanted.inertia, 1e-8)


@pytest.mark.parametrize("language", SUFFIX)
def test_each_round_of_a_loop_begins_with_its_own_load(language, tmp_path):
    found = read_back(written(language, [PART, PART, PLAIN], repeats_from=1), tmp_path)
    assert len(found) >= 5
    assert [load.mass for load in found] == [2.5, *([2.5, 1.2] * len(found))[: len(found) - 1]]


def test_a_load_that_can_not_be_written_is_named():
    for language, load, name in (
        ("rpl", PART, "a load of 2.5 kg"),
        ("xpl", PART, "a load of 2.5 kg"),
        ("krl", UnclearLoad("set_payload(2)", 2.0), "the load set_payload(2)"),
    ):
        findings = written(language, [load]).findings
        assert name in [each.name for each in findings if is_one(each, "written_tool_not_given")]


def checked(tmp_path, text: str, robot: str = "er3_600") -> ProgramCheck:
    (tmp_path / "p.script").write_text(text)
    start = np.radians([float(each) for each in HOME.split(",")])
    return check_program(read_program(tmp_path / "p.script"), load_robot(robot), CheckOptions(start, measures=False))


def test_a_load_is_named_once_and_one_above_the_payload_fails(tmp_path):
    move = MOVES["urscript"]
    text = (
        f"def p():\n  set_payload(2, [0, 0, 0.05])\n{move}{move}  set_payload(3.5, [0, 0, 0.05])\n{move}"
        f"  set_payload(2, [0, 0, 0.05])\n{move}end\n"
    )
    found = checked(tmp_path, text)
    said = [each for each in found.findings if is_one(each.finding, "load_above_payload")]
    assert [(each.place.line, each.level, each.finding) for each in said] == [
        (6, "fail", fact("load_above_payload", mass_kg=3.5, payload_kg=3.0)),
    ]


def test_a_load_behind_a_branch_is_followed_on_both_sides(tmp_path):
    move = MOVES["urscript"]
    text = (
        f"def p():\n  set_payload(1, [0, 0, 0.05])\n  if get_digital_in(1):\n    set_payload(5, [0, 0, 0.05])\n  end\n"
        f"{move}end\n"
    )
    assert any(is_one(each.finding, "load_above_payload") for each in checked(tmp_path, text).findings)
