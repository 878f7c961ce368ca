"""Robot programs: public ones with the arm alone, faults put into sound ones, and times.

The public programs are no part of the project. ``PUBLIC_PROGRAMS=FOLDER make campaigns ARGS=programs`` checks those
that ``cells.yaml`` in that folder lists (:mod:`testing.public_programs`).
"""

from __future__ import annotations

import os
import time
from collections import Counter
from pathlib import Path

import numpy as np

from er3a.program_check.check_program import CheckOptions, check_program
from er3a.programs.languages import read_program
from testing.program_faults import START, arm, found, texts
from testing.program_faults import checked as checked_cell
from testing.program_texts import HOME, ROBOT, text_of
from testing.public_programs import Outcome, outcomes, summary

FOLDER = "PUBLIC_PROGRAMS"
MOTIONS = (1_000, 10_000)
HEAD = """# Robot programs

Written by `make campaigns ARGS=programs` with `PUBLIC_PROGRAMS` naming a folder of public programs, which are no part
of this project: only their numbers are here.
"""


def table() -> str:
    """The page of evidence.

    Raises
    ------
    RuntimeError
        without a folder of public programs
    """
    folder = os.environ.get(FOLDER)
    if not folder:
        raise RuntimeError(f"give a folder with cells.yaml: {FOLDER}=FOLDER make campaigns ARGS=programs")
    _warm()
    return "\n".join((HEAD, _public(list(outcomes(Path(folder)))), _sound(), _faults(), _times()))


def _warm() -> None:
    """Compile the kernels, which is no part of a check's time."""
    for count in (3, 40):
        _many(count)


def _public(done: list[Outcome]) -> str:
    codes: Counter[str] = Counter()
    for each in done:
        codes += each.findings
    rows = [
        f"| {each.file.suffix.lower()} | {each.motions} | {each.given} | {each.passed} | {each.clean} | {each.failed} "
        f"| {each.seconds:.2f} | {each.rows} "
        f"| {each.error or ', '.join(code for code, _ in each.findings.most_common(2))} |"
        for each in done
    ]
    reasons = [f"| {code.replace(' ', ' | ')} | {count} |" for code, count in codes.most_common(12)]
    return "\n".join(
        (
            "## Public programs, with the robot alone\n",
            f"{summary(done)}. *In the files* are motions whose target, tool and base the program's files give; of",
            "these *pass* limits, reach, configuration, singular poses, rates and self-collision, with at most advice",
            "about numbers; *nothing said* are those without that. Arms: URDFs of the makers' families, the machine",
            "data of the archives, or data sheets. The first program waits for compiling no longer.\n",
            "| language | motions | in the files | pass | nothing said | fail | s | lines | most frequent |",
            "|---|---|---|---|---|---|---|---|---|",
            *rows,
            "\nWhy motions do not pass:\n",
            "| code | level | motions |",
            "|---|---|---|",
            *reasons,
            "",
        )
    )


def _sound() -> str:
    """Sound programs with robot, start and scene."""
    import tempfile

    with tempfile.TemporaryDirectory() as name:
        texts(Path(name))
        names = ("pick_place.src", "pick_place.script", "pick_place.pgm", "cell.mod")
        levels = {each: checked_cell(Path(name) / each, arm()).level for each in names}
    said = ", ".join(f"{name}: {level}" for name, level in levels.items())
    return f"## Sound programs with robot, start and scene\n\n{said}.\n"


def _faults() -> str:
    rows = list(found())
    named, failing = sum(bool(each.codes) for each in rows), sum(each.fails for each in rows)
    lines = [
        f"| {each.fault.file} | {each.fault.what} | {', '.join(each.codes) or 'not named'} | {1 if each.fails else 0} |"
        for each in rows
    ]
    return "\n".join(
        (
            "## Faults put into them\n",
            f"{len(rows)} faults, one at a time (`testing/program_faults.py`): {named} named at their line, {failing}",
            "with exit code 1. The others are no certain failures. Other files may give a name; controllers cut zones",
            "and speeds; and some wrong numbers keep the arm clear of all that is given.\n",
            "| file | fault | named by | exit code |",
            "|---|---|---|---|",
            *lines,
            "",
        )
    )


def _many(count: int) -> float:
    """Processor time (s) of reading and checking a URScript of so many lines."""
    import tempfile

    from er3a.kinematics.forward import forward

    home = forward(ROBOT, HOME)
    body = []
    for number in range(count):
        pose = home.copy()
        pose[:3, 3] += np.array([0.0, 0.05 * np.sin(number), 0.05 * np.cos(number)]) - [0.0, 0.0, 0.05]
        body.append(f"  movel({text_of(pose)}, a=1.2, v=0.1)")
    with tempfile.TemporaryDirectory() as name:
        file = Path(name) / "many.script"
        file.write_text("def many():\n" + "\n".join(body) + "\nend\n", encoding="utf-8")
        begun = time.process_time()
        check_program(read_program(file), ROBOT, CheckOptions(start=START))
        return time.process_time() - begun


def _times() -> str:
    rows = [f"| {count} | {_many(count):.1f} |" for count in MOTIONS]
    return "\n".join(("## Times\n", "Processor time of reading and checking a URScript of lines.\n", "| motions | s |",
                      "|---|---|", *rows, ""))  # fmt: skip


if __name__ == "__main__":
    print(table())
