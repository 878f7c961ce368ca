"""Paths that a path file gives as a program: one for each of its stretches."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from er3a.files.path_file import PathEntry, ProgramPath
from er3a.planning.commands import Command, CommandSource
from er3a.planning.path_verdicts import PathVerdict
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.program_check.program_parts import ProgramPart, parts_of
from er3a.programs.read_program import read_program
from er3a.robots.robot import Robot


@dataclass(frozen=True, eq=False)
class PartOfProgram:
    """A stretch of a program as an entry of a path file."""

    name: str
    title: str
    samples: int
    expect: PathVerdict | None
    part: ProgramPart

    @property
    def kind(self) -> Literal["joint_sequence", "sequence"]:
        """What kind of path it is."""
        return self.part.kind

    def command(self, source: CommandSource, robot: Robot) -> Command:
        """The path in SI units."""
        return self.part.command(source)


PlannedEntry = PathEntry | PartOfProgram


def planned_entries(robot: Robot, entry: PathEntry | ProgramPath, source: CommandSource) -> Iterator[PlannedEntry]:
    """A path as it is, a program as its stretches, named by their numbers.

    Raises
    ------
    InputError
        for a program that can't be read or does not move the arm
    """
    if not isinstance(entry, ProgramPath):
        yield entry
        return
    start = None if entry.start_deg is None else np.radians(entry.start_deg)
    check = check_program(read_program(entry.program), robot, CheckOptions(start=start, measures=False))
    parts = parts_of(check, robot, source)
    for number, part in enumerate(parts, 1):
        name = f"{entry.name}_{number}" if len(parts) > 1 else entry.name
        first, last = part.lines
        title = f"{entry.title}, lines {first} to {last}" if last > first else f"{entry.title}, line {first}"
        yield PartOfProgram(name, title, entry.samples, entry.expect, part)
