"""A KRL program whose modules stand beside it: each has points and routines of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from er3a.errors import InputError
from er3a.files.robot_library import load_robot
from er3a.pipeline.program_reports import checked_file, json_of, lines_of, not_examined_line, sarif_of
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.programs.instructions import ArmMotion, JointTarget
from er3a.programs.languages import files_of, read_program
from er3a.programs.machine import execute
from testing.program_texts import motions

FILES = {
    "cell.src": "DEF CELL( )\nDECL INT I\nPTP XP1\nFOR I=1 TO 2\nPICK(5.0)\nENDFOR\nHELP( )\nSUB( )\nEND\n"
    "DEF SUB( )\nPTP {A1 40}\nEND\n",
    "cell.dat": "DEFDAT CELL\nDECL AXIS XP1={A1 10,A2 0,A3 0,A4 0,A5 30,A6 0}\nENDDAT\n",
    "Pick.src": "DEF PICK(H:IN)\nDECL REAL H\nPTP XP1\nSUB(H)\nXP1.A1=XP1.A1+1\nEND\n"
    "DEF SUB(A:IN)\nDECL REAL A\nPTP {A1 A}\nDEEPER( )\nEND\n"
    "GLOBAL DEF HELP( )\nPTP SHARED\nEND\nDEF UNUSED( )\nPTP {A1 -70}\nEND\n",
    "Pick.dat": "DEFDAT PICK PUBLIC\nDECL AXIS XP1={A1 -30,A2 0,A3 0,A4 0,A5 30,A6 0}\n"
    "DECL GLOBAL AXIS SHARED={A1 0,A2 0,A3 0,A4 0,A5 20,A6 0}\nENDDAT\n",
    "deeper.src": "DEF DEEPER( )\nSHARED.A2=-5\nPTP {A1 6}\nEND\n",
    "other.src": "DEF OTHER( )\nno KRL at all \"\nEND\n",
}  # fmt: skip


@pytest.fixture
def cell(tmp_path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    return tmp_path / "cell.src"


def test_each_module_has_its_own_points_and_routines(cell):
    run = execute(read_program(cell), load_robot("er3a_c60"), np.zeros(6))
    steps = [run.steps[i] for i in run.way(run.main()) if isinstance(run.steps[i].instruction, ArmMotion)]
    visited = np.degrees([step.instruction.target.joints[[0, 1, 4]] for step in steps])
    wanted = [(10, 0, 30)]
    wanted += [(-30, 0, 30), (5, 0, 30), (6, 0, 30), (-29, 0, 30), (5, 0, 30), (6, 0, 30), (0, -5, 20), (40, -5, 20)]
    np.testing.assert_allclose(visited, wanted, rtol=0, atol=1e-9)
    assert [run.own_line(step) for step in steps] == [3, 5, 5, 5, 5, 5, 5, 7, 11]


def test_files_are_those_that_it_calls_and_those_that_may_set_what_all_know(cell):
    assert {file.name for file in files_of(cell)} == FILES.keys()
    cell.with_name("Pick.dat").write_text(FILES["Pick.dat"].replace("GLOBAL ", ""))
    assert {file.name for file in files_of(cell)} == FILES.keys() - {"other.src"}


@pytest.mark.parametrize("name", ["CELL.DAT", "Cell.Dat", "cElL.dat"])
def test_a_module_is_one_however_the_letters_of_its_files_are_written(cell, name):
    cell.with_name("cell.dat").rename(cell.with_name(name))
    (first, *_) = execute(read_program(cell), load_robot("er3a_c60"), np.zeros(6)).listing().motions
    assert first.target.joints[0] == pytest.approx(np.radians(10))


def test_what_is_wrong_in_a_module_stands_at_its_own_line(cell):
    deeper = cell.with_name("deeper.src")
    deeper.write_text(deeper.read_text().replace("{A1 6}", "{A1 6,A2 200}"))
    options = CheckOptions(start=np.zeros(6), measures=False)
    check = check_program(read_program(cell), load_robot("er3a_c60"), options)
    places = {each.place for each in check.findings if each.finding.code == "above_limit"}
    assert [(place.file, place.line) for place in places] == [(deeper, 3)]
    assert [(each.line, each.place.line) for each in check.verdicts if each.level == "fail"] == [(5, 3)]
    assert "never_reached" not in {each.finding.code for each in check.findings}


def test_a_module_that_can_not_be_read_is_named(cell):
    cell.with_name("deeper.src").write_text('DEF DEEPER( )\nMsg("a\nEND\n')
    with pytest.raises(InputError, match=r"deeper\.src: line 2: a text has no end"):
        read_program(cell)


def test_its_own_routines_come_first(cell):
    cell.write_text(FILES["cell.src"] + "DEF PICK(H:IN)\nDECL REAL H\nPTP {A1 H}\nEND\n")
    program = read_program(cell)
    assert {routine.place.file for name, routine in program.routines.items() if name == "PICK"} == {cell}
    assert "program_name_twice" not in {finding.code for finding in program.findings}


@pytest.mark.parametrize("folder", ["R1", "R1/Program", "R1/Program/weld", "R1/System"])
def test_points_of_the_controller_are_found_from_each_folder_of_an_archive(tmp_path, folder):
    config = "DEFDAT $CONFIG\nE6AXIS XHOME={A1 1,A2 -10,A3 10,A4 0,A5 -60,A6 0}\nENDDAT\n"
    for name in (folder, "R1/System"):
        (tmp_path / name).mkdir(parents=True, exist_ok=True)
    (tmp_path / "R1/System/$config.dat").write_text(config)
    (move,) = motions(tmp_path / folder, "DEF a( )\nPTP XHOME\nEND\n", "a.src")
    np.testing.assert_allclose(np.degrees(move.target.joints), [1, -10, 10, 0, -60, 0])


@pytest.mark.parametrize("public", [True, False])
def test_what_another_modules_data_declare_for_all_is_known(cell, public):
    """Also of one that the program does not call; its own data file is not missing for that."""
    alone, spread = cell.with_name("alone.src"), cell.with_name("points.dat")
    alone.write_text("DEF ALONE( )\nPTP SPREAD\nEND\n")
    head = f"DEFDAT POINTS{' PUBLIC' * public}\n"
    spread.write_text(f"{head}DECL GLOBAL AXIS SPREAD={{A1 7,A2 0,A3 0,A4 0,A5 20,A6 0}}\nDECL AXIS HIDDEN\nENDDAT\n")
    check = check_program(read_program(alone), load_robot("er3a_c60"), CheckOptions(start=np.zeros(6), measures=False))
    codes = {each.finding.code for each in check.findings}
    assert ({"target_not_given", "program_data_file_missing"} <= codes) != public
    assert ("target_not_given" in codes) != public
    assert (spread in files_of(alone)) == public
    cell.with_name("setter.src").write_text("DEF SETTER( )\nSPREAD.A1=50\nEND\n")
    check = check_program(read_program(alone), load_robot("er3a_c60"), CheckOptions(start=np.zeros(6), measures=False))
    assert ("set_elsewhere" in {each.finding.code for each in check.findings}) == public


@pytest.mark.parametrize("public", [True, False])
@pytest.mark.parametrize("called", [True, False])
def test_what_is_declared_for_all_is_seen_by_none_if_its_data_are_not_public(cell, called, public):
    data = f"DEFDAT {'OWNER' if called else 'CELL'}{' PUBLIC' * public}\nDECL GLOBAL REAL AT=7\nENDDAT\n"
    go = "PTP {A1 AT,A2 0,A3 0,A4 0,A5 20,A6 0}\n"
    cell.with_name("owner.src").write_text(f"DEF OWNER( )\n{'' if called else go}END\n")
    cell.with_name("owner.dat" if called else "cell.dat").write_text(data)
    cell.write_text(f"DEF CELL( )\nOWNER( )\n{go if called else ''}END\n")
    (step,) = (each for each in execute(read_program(cell)).steps if isinstance(each.instruction, ArmMotion))
    assert isinstance(step.instruction.target, JointTarget) == public


LIST = "DEFDAT %s PUBLIC\nDECL GLOBAL AXIS L[2]\nL[1]={A1 3,A2 0,A3 0,A4 0,A5 20,A6 0}\nENDDAT\n"


def where_joint_1_goes(path: Path) -> list[float]:
    steps = execute(read_program(path), load_robot("er3a_c60"), np.zeros(6)).steps
    return [
        float(np.degrees(step.instruction.target.joints[0]))
        for step in steps
        if isinstance(step.instruction, ArmMotion)
    ]


@pytest.mark.parametrize("called", [True, False])
def test_elements_of_a_list_that_another_module_declares_for_all_are_known(cell, called):
    cell.with_name("lists.dat").write_text(LIST % "LISTS")
    cell.with_name("lists.src").write_text("DEF LISTS( )\nEND\n")
    cell.write_text(f"DEF CELL( )\n{'LISTS( )' * called}\nPTP L[1]\nEND\n")
    assert where_joint_1_goes(cell) == pytest.approx([3])


def test_an_element_of_a_programs_own_list_that_all_know_is_set_by_what_it_calls(cell):
    cell.with_suffix(".dat").write_text(LIST % "CELL")
    cell.with_name("lists.src").write_text("DEF LISTS( )\nL[1].A1=40\nEND\n")
    cell.write_text("DEF CELL( )\nLISTS( )\nPTP L[1]\nEND\n")
    assert where_joint_1_goes(cell) == pytest.approx([40])


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("DECL INT N=5\nDECL INT N=6", "program_name_twice"),
        (";a\rN=6", "program_not_understood"),
        ("N = = 6", "program_not_understood"),
    ],
)
def test_what_is_wrong_in_the_controllers_data_is_told(cell, line, code):
    cell.with_name("$config.dat").write_text(f"DEFDAT $CONFIG\n{line}\nENDDAT\n")
    told = [(each.code, each.place.file.name) for each in read_program(cell).findings if hasattr(each, "place")]
    assert (code, "$config.dat") in told


@pytest.mark.parametrize(("kind", "told"), [("REAL", True), ("INT", False)])
def test_a_structure_that_two_modules_declare_otherwise_is_told(cell, kind, told):
    cell.with_suffix(".dat").write_text(f"{FILES['cell.dat'][:-7]}STRUC PART {kind} N\nENDDAT\n")
    cell.with_name("Pick.dat").write_text(f"{FILES['Pick.dat'][:-7]}STRUC PART INT N\nENDDAT\n")
    assert ("program_name_twice" in [each.code for each in read_program(cell).findings]) == told


def test_a_name_that_two_data_files_declare_for_all_is_told(cell):
    for number in (1, 2):
        text = f"DEFDAT P{number} PUBLIC\nDECL GLOBAL AXIS SPREAD={{A1 {number},A2 0,A3 0,A4 0,A5 20,A6 0}}\nENDDAT\n"
        cell.with_name(f"p{number}.dat").write_text(text)
    found = read_program(cell).findings
    assert [(each.code, each.name) for each in found] == [("program_name_twice", "SPREAD")]


def archive(folder: Path, files: dict[str, str]) -> None:
    """Files of a controller's archive, in which ``Program/a.src`` is checked."""
    for name in ("Program/a.src", "TP/x"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(text.encode("latin-1"))


UP = "GLOBAL DEF GOUP(A:IN)\nREAL A\nPTP {A1 A}\nEND\nGLOBAL DEFFCT REAL HALF(A:IN)\nREAL A\nRETURN A/2\nENDFCT\n"


@pytest.mark.parametrize("place", ["Program/mylib.src", "Program/lib/mylib.src", "TP/x/mylib.src"])
def test_global_routines_are_known_in_all_modules_whatever_theirs_is_called(tmp_path, place):
    archive(tmp_path, {place: f"DEF mylib( )\nEND\n{UP}DEF hidden( )\nPTP {{A1 70}}\nEND\n"})
    text = "DEF a( )\nGOUP(20.0)\nPTP {A1 HALF(30)}\nown( )\nhidden( )\nEND\nDEF own( )\nPTP {A1 7}\nEND\n"
    found = motions(tmp_path / "Program", text, "a.src")
    np.testing.assert_allclose([np.degrees(each.target.joints[0]) for each in found], [20, 15, 7])
    program = read_program(tmp_path / "Program/a.src")
    check = check_program(program, load_robot("er3a_c60"), CheckOptions(start=np.zeros(6), measures=False))
    assert [each.place.line for each in check.findings if each.finding.code == "may_move"] == [5]
    assert not [each.code for each in program.findings]


def test_a_global_routine_gives_way_to_one_of_the_modules_own(tmp_path):
    archive(tmp_path, {"Program/mylib.src": f"DEF mylib( )\nEND\n{UP}"})
    text = "DEF a( )\nGOUP(20.0)\nEND\nDEF GOUP(A:IN)\nREAL A\nPTP {A1 -5}\nEND\n"
    (found,) = motions(tmp_path / "Program", text, "a.src")
    np.testing.assert_allclose(np.degrees(found.target.joints[0]), -5)


@pytest.mark.parametrize(
    ("files", "told"),
    [
        ({"Program/a/pick.src": "PTP {A1 20}", "Program/b/pick.src": "PTP {A1 60}"}, ["PICK", "Program/a/pick.src"]),
        ({"Program/a/pick.src": "PTP {A1 20}", "Program/b/pick.src": "PTP {A1 20} ;copy"}, []),
        ({"Program/pick.src": "PTP {A1 20}", "Program/old/pick.src": "PTP {A1 60}"}, ["PICK", "Program/pick.src"]),
        ({"Program/a/pick.src": "PTP {A1 20}", "Program/b/other.src": "PTP {A1 60}"}, []),
    ],
)
def test_a_second_module_of_one_name_is_told(tmp_path, files, told):
    """A controller refuses two modules of one name, and which of them it has is not known."""
    archive(tmp_path, {name: f"DEF PICK( )\n{text}\nEND\n" for name, text in files.items()})
    (found,) = motions(tmp_path / "Program", "DEF a( )\nPICK( )\nEND\n", "a.src")
    np.testing.assert_allclose(np.degrees(found.target.joints[0]), 20)
    said = read_program(tmp_path / "Program/a.src").findings
    assert [part for each in said for part in (each.name, each.taken)] == told
    assert [each.code for each in said] == ["program_module_twice"] * (len(told) // 2)


def test_points_that_differ_make_a_module_another_one(tmp_path):
    files = {f"Program/{each}/pick.src": "DEF PICK( )\nPTP XP\nEND\n" for each in "ab"}
    for each, angle in (("a", 20), ("b", 60)):
        files[f"Program/{each}/pick.dat"] = f"DEFDAT PICK\nDECL AXIS XP={{A1 {angle}}}\nENDDAT\n"
    archive(tmp_path, files | {"Program/a.src": "DEF a( )\nPICK( )\nEND\n"})
    assert [each.code for each in read_program(tmp_path / "Program/a.src").findings] == ["program_module_twice"]


@pytest.mark.parametrize("folder", ["System", "SYSTEM"])
@pytest.mark.parametrize("same", [True, False])
def test_the_archives_own_data_come_before_a_copy_beside_the_program(tmp_path, folder, same):
    config = "DEFDAT $CONFIG\nE6AXIS XHOME={A1 1,A2 -10,A3 10,A4 0,A5 -60,A6 0}\nENDDAT\n"
    copy = config if same else config.replace("A1 1", "A1 5")
    archive(tmp_path, {f"{folder}/$config.dat": config, "Program/$config.dat": copy})
    (found,) = motions(tmp_path / "Program", "DEF a( )\nPTP XHOME\nEND\n", "a.src")
    np.testing.assert_allclose(np.degrees(found.target.joints[0]), 1)
    said = read_program(tmp_path / "Program/a.src").findings
    assert [each.code for each in said] == ["program_module_twice"] * (not same)
    (tmp_path / f"{folder}/$config.dat").unlink()
    (found,) = motions(tmp_path / "Program", "DEF a( )\nPTP XHOME\nEND\n", "a.src")
    np.testing.assert_allclose(np.degrees(found.target.joints[0]), 1 if same else 5)


@pytest.mark.parametrize("called", [True, False])
def test_a_module_that_is_no_text_is_named_and_the_program_is_read(tmp_path, called):
    """Where it may set what the program uses."""
    archive(tmp_path, {"Program/bin.src": "\x01\x02", "Program/bin.dat": "\x01"})
    text = f"DEF a( )\nPTP {{A1 GZ}}\n{'BIN( )' * called}\nEND\n"
    assert motions(tmp_path / "Program", text.replace("GZ", "5"), "a.src")
    assert not read_program(tmp_path / "Program/a.src").findings
    config = "DEFDAT $CONFIG\nDECL REAL GZ=5.0\nENDDAT\n"
    archive(tmp_path, {"System/x.sub": "\x01\x02", "System/$config.dat": config})
    assert motions(tmp_path / "Program", text, "a.src")
    program = read_program(tmp_path / "Program/a.src")
    assert {(each.code, each.place.file.name) for each in program.findings} == {
        ("program_not_understood", "bin.src"),
        ("program_not_understood", "x.sub"),
    }
    check = check_program(program, load_robot("er3a_c60"), CheckOptions(start=np.zeros(6), measures=False))
    assert ("may_move" in {each.finding.code for each in check.findings}) == called


def test_what_is_wrong_in_a_called_module_is_told_at_that_module(cell):
    deeper = cell.with_name("deeper.src")
    deeper.write_text('DEF DEEPER( )\nMsg("a\nEND\n')
    checked = checked_file(cell, load_robot("er3a_c60"), CheckOptions(measures=False))
    assert lines_of(checked)[0].startswith(f"{deeper}:2: error: a text has no end")
    (result,) = sarif_of([checked])["runs"][0]["results"]
    assert result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"].endswith("deeper.src")
    assert json_of([checked])[0]["error"]["file"].endswith("deeper.src")


def test_what_another_module_sets_leaves_the_course_of_the_whole_open(tmp_path):
    (tmp_path / "$config.dat").write_text("DEFDAT $CONFIG\nDECL GLOBAL INT PGNO=1\nENDDAT\n")
    (tmp_path / "part.src").write_text("DEF PART( )\nPTP {A1 PGNO}\nEND\n")
    (tmp_path / "cell.src").write_text("DEF CELL( )\nPGNO=2\nEND\n")
    checked = checked_file(tmp_path / "part.src", load_robot("er3a_c60"), CheckOptions(measures=False))
    assert "not examined, or not each time: the course of the whole" in not_examined_line(checked)
