"""The recording of programs: the arm runs each program in turn, with the current line as text."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import rerun as rr

from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.programs import cycle_text, level_word
from er3a.pipeline.messages.say import say
from er3a.pipeline.player.motions import PlayedMotion
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.programs.model import FindingAt, ProgramMotion, ProgramsResults, ProgramSummary
from er3a.pipeline.stages.programs.page.played import WEIGHTS, motions, of_line, stretches, worst_first
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.palette import VERDICTS, rgb
from er3a.pipeline.viewing.recording import Logged, Run, escaped, record_stage
from er3a.program_check.program_check_findings import Level
from er3a.programs.languages import LANGUAGES

AROUND = 4  # lines of the listing before and after the one that is carried out
COLOURS: dict[str, str] = {**VERDICTS, "note": VERDICTS["pass"]}
NOTE = """# {title}: programs
**Look first** at the red stretches of the tool's path. Press play: the arm carries out one program after another, and \
the text beside it shows the line that it is at.

{findings}

- line: the tool's path, green where the motion passes, amber where it wants caution, red where it fails
- red bodies: they overlap at that moment
- grey solids: the scene
"""


def record(study: Study, stored: Stored[ProgramsResults], output: Path) -> None:
    """Write the recording of a robot's programs."""
    results = stored.results
    played = {motion.name: motion for motion in motions(study.robot(stored.robot), results)}
    record_stage(
        study,
        stored,
        output,
        NOTE,
        runs=[_run(results, program, played[program.name]) for program in worst_first(results)],
        scene=study.scene(stored.robot, "trajectory"),  # the stage whose scene counts here too
        views={"Arm and tool": ["**"]},
        points=[results.motion.xyz_mm / 1000],
        now="This line",
    )


def _run(results: ProgramsResults, program: ProgramSummary, motion: PlayedMotion) -> Run:
    rows = results.motion.take(results.motion.program == program.name)
    listing = results.lines.text[results.lines.program == program.name].tolist()
    outcome = "passes in the model" if program.outcome == "pass" else outcome_word(program.outcome)
    texts, lines = [], []
    for line, level, t0, _ in stretches(rows):
        texts.append((t0, _document(program, line, listing, of_line(program, line), level)))
        lines.append((t0, f"{program.name}:{line}", WEIGHTS[level]))
    return Run(
        name=program.name,
        text=f"## {program.name}\n**{outcome}**: {escaped(program.title)}\n\n{cycle_text(program)}",
        t=motion.t,
        q=motion.q,
        events=[each for each in motion.events if each.status != "plain"],
        outcome=f"{outcome} ({LANGUAGES[program.language].title})",
        status=WEIGHTS[program.outcome],
        shapes=[(0.0, "way", _way(rows))],
        texts=texts,
        lanes={"line": lines},
    )


def _way(rows: ProgramMotion) -> Logged:
    """The tool's whole way coloured by verdict."""
    edges = np.flatnonzero(np.diff(rows.line) != 0) + 1
    parts = [(a, rows.xyz_mm[max(a - 1, 0) : b] / 1000) for a, b in pairwise([0, *edges.tolist(), len(rows)])]
    parts = [(a, points) for a, points in parts if len(points) > 1]
    colours = [rgb(COLOURS[rows.level[a]]) for a, _ in parts]
    return rr.LineStrips3D([points for _, points in parts], colors=colours, radii=0.004)


def _document(
    program: ProgramSummary, line: int, texts: Sequence[str], found: Sequence[FindingAt], level: Level
) -> str:
    first, last = max(line - AROUND, 1), min(line + AROUND, len(texts))
    listing = [
        f"{'▶' if n == line else ' '}{n:>5}  {texts[n - 1]}".replace("```", "'''") for n in range(first, last + 1)
    ]
    remarks = [f"- {escaped(say(each.finding))}" for each in found]
    return "\n".join([f"## {program.name}, line {line}: {level_word(level)}", "```", *listing, "```", *remarks])
