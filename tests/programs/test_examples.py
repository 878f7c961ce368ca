"""The example programs do what they say, the same in each language, and the faulty ones have their fault."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import forward
from er3a.programs.languages import execute, read_program, write_program
from er3a.programs.solving import Resolver
from er3a.programs.writing import WriteOptions

EXAMPLES = Path(__file__).resolve().parents[2] / "data/programs"
TASKS = {"pick_place": ("er3a_c60", 8), "weld_seam": ("er3a_c60", 7), "palletise": ("er3_600", 36)}
SUFFIXES = (".src", ".script", ".pgm", ".XPL")
FILES = [path for path in sorted(EXAMPLES.iterdir()) if path.suffix in SUFFIXES]


def tool_points(path, robot):
    """Where the tool stands behind each motion of a program's main way, mm; all joints are found."""
    execution = execute(read_program(path), robot)
    assert execution.program.motions()
    assert execution.complete
    resolver, points = Resolver(robot, None), []
    for number, motion in enumerate(execution.listing().motions):
        resolver.ready(motion)
        q = resolver.joints_after(number)
        assert q is not None
        assert ((q >= robot.lower) & (q <= robot.upper)).all()
        points.append(forward(robot, q)[:3, 3] * 1000)
    return np.array(points)


def test_each_task_is_there_in_each_language():
    found = {(path.stem.lower(), path.suffix) for path in FILES}
    assert found == {(task, suffix) for task in TASKS for suffix in SUFFIXES}


@pytest.mark.parametrize("task", TASKS)
def test_each_language_goes_to_the_same_places(task):
    name, least = TASKS[task]
    robot = load_robot(name)
    visited = {}
    for path in FILES:
        if path.stem.lower() == task:
            visited[path.suffix] = {tuple(np.round(point / 2) * 2) for point in tool_points(path, robot)}
            assert len(tool_points(path, robot)) >= least
    wanted = visited[".src"]
    for suffix, found in visited.items():
        if task == "weld_seam":
            assert wanted <= found if suffix != ".script" else wanted == found
        else:
            assert found == wanted, suffix


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_examples_are_written_and_read_in_their_language(path, tmp_path):
    program = read_program(path)
    robot = load_robot(TASKS[path.stem.lower()][0])
    listing = execute(program, robot).listing()
    written = write_program(listing, program.language, WriteOptions(robot))
    for suffix, text in written.files.items():
        (tmp_path / (written.name + suffix)).write_text(text, encoding="utf-8")
    back = execute(read_program(tmp_path / (written.name + next(iter(written.files)))), robot).listing()
    assert len(back.motions) == len(listing.motions)
    assert write_program(back, program.language, WriteOptions(robot)).files == written.files


@pytest.mark.parametrize("path", sorted((EXAMPLES / "faults").glob("*.src")), ids=lambda path: path.stem)
def test_faulty_programs_can_be_read(path):
    program = read_program(path)
    execution = execute(program, load_robot("er3a_c60"))
    assert (not program.motions()) == (path.stem == "no_motion")
    assert execution.complete
