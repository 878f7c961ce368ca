"""Program files (YAML): the robot programs of a cell, and the frames of their tools and bases."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from er3a.files.robot_file import Name, Placement, Text, check_placement
from er3a.files.units import JointsDeg, joint_values
from er3a.files.yaml_file import InputFile, StrictModel, check_own_names, load
from er3a.numerics.arrays import Reals
from er3a.programs.program_names import ProgramOutcome
from er3a.robots.robot import Robot


class ProgramEntry(StrictModel):
    """A program; ``start_deg`` is the joint position before it, ``expect`` the expected verdict."""

    name: Name
    title: Text
    title_zh: Text | None = None
    file: Text
    start_deg: JointsDeg | None = None
    expect: ProgramOutcome | None = None

    def start(self, robot: Robot) -> Reals | None:
        """The joint position before the program, in SI units.

        Returns
        -------
        q : (n,), rad, or m of joints that slide; None if the file names none

        Raises
        ------
        InputError
            if the values are not as many as the robot's joints, or a joint would turn more than ten times
        """
        return None if self.start_deg is None else joint_values(robot, self.start_deg, f"{self.name}.start_deg")


class ProgramsFile(InputFile):
    """Programs and frames.

    ``frames`` maps names of tools and bases in programs (``TOOL_DATA[3]``, ``tool1``) to frames: a tool in the flange's
    frame, a base in the robot's.
    """

    kind: Literal["programs"]
    frames: dict[Annotated[str, Field(min_length=1, max_length=100)], Placement] = {}
    programs: list[ProgramEntry] = []

    @model_validator(mode="after")
    def _own_names_and_plausible_frames(self) -> Self:
        check_own_names("programs", [entry.name for entry in self.programs])
        for name, placement in self.frames.items():
            check_placement(f"frames.{name}", placement)
        return self

    def transforms(self) -> dict[str, Reals]:
        """The frames (4, 4) in m by name."""
        return {name: placement.transform() for name, placement in self.frames.items()}


def load_programs(path: str | Path) -> ProgramsFile:
    """Read and check a program file; the programs themselves are read by :func:`er3a.programs.languages.read_program`.

    Raises
    ------
    InputError
        naming file, field and remedy
    """
    return load(ProgramsFile, path)
