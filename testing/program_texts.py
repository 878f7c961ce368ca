"""Texts of robot programs, and what execution and check give of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from er3a.files.robot_library import load_robot
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.programs.instructions import ArmMotion, numbers_of
from er3a.programs.languages import execute, read_program

ROBOT = load_robot("er3a_c60")
HOME = np.radians([0.0, -10.0, -10.0, 0.0, -70.0, 0.0])
NEAR = np.radians([10.0, -15.0, -5.0, 5.0, -60.0, 10.0])
FAR = np.radians([20.0, -5.0, -15.0, -5.0, -65.0, 20.0])
HOME_TEXT, NEAR_TEXT, FAR_TEXT = ("[" + ", ".join(f"{angle:.9f}" for angle in q) + "]" for q in (HOME, NEAR, FAR))
FRAMES = "$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\n"


def text_of(pose) -> str:
    """A pose (4, 4) in m as URScript has it."""
    return "p[" + ", ".join(f"{each:.12f}" for each in numbers_of(pose, "ur")) + "]"


def written(folder: Path, text: str, name: str = "a.script"):
    """A program of this text, read."""
    (folder / name).write_text(text, encoding="utf-8")
    return read_program(folder / name)


def check(folder: Path, text: str, name: str = "a.script", **options):
    """The check of a program, from the home position."""
    given = {"start": HOME, "measures": False} | options
    return check_program(written(folder, text, name), ROBOT, CheckOptions(**given))


def codes(found) -> dict[str, list[int]]:
    """Lines of findings, by code."""
    lines: dict[str, list[int]] = {}
    for each in found.findings:
        lines.setdefault(each.finding.code, []).append(each.place.line)
    return lines


def motions(folder: Path, text: str, name: str = "a.script", **given):
    """Motions as they are carried out."""
    execution = execute(written(folder, text, name), ROBOT, **({"start": HOME} | given))
    return [step.instruction for step in execution.steps if isinstance(step.instruction, ArmMotion)]


def krl(body: str, more: str = "") -> str:
    """A KRL program with this body."""
    return f"DEF a( )\n{body}\nEND\n{more}"


def axes(q) -> str:
    """Joint angles in rad as a KRL axis position."""
    return "{" + ", ".join(f"A{i + 1} {np.degrees(angle):.6f}" for i, angle in enumerate(q)) + "}"
