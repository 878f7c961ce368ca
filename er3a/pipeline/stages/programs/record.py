"""The recording of programs: the arm carries out each program in turn, with the line that it is at as text."""

from __future__ import annotations

from collections import defaultdict
from itertools import pairwise
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from er3a.numerics.arrays import Integers
from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.programs import cycle_text, level_word
from er3a.pipeline.messages.say import say, say_all
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.programs.model import FindingAt, ProgramMotion, ProgramsResults, ProgramSummary
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.arm import log_arm, send_motion, view_of
from er3a.pipeline.viewing.palette import JOINT_NAMES, JOINTS, VERDICTS, rgb
from er3a.pipeline.viewing.recording import (
    ARM,
    TIMELINE,
    curves_view,
    escaped,
    events_view,
    log_event,
    log_note,
    log_now,
    log_scene,
    recording,
    send_run,
    words_view,
)
from er3a.pipeline.viewing.skeleton import skeleton
from er3a.program_check.program_check_findings import Level
from er3a.programs.languages import LANGUAGES
from er3a.robots.robot import Robot

STAGE = "programs"
SCENE_OF = "trajectory"  # the stage whose scene counts here too
SCENE = f"/{SCENE_OF}/scene/**"
PAUSE = 1.0  # s between two programs
AROUND = 4  # lines of the listing before and behind the one that is carried out
SKELETON_EVERY = 100
COLOURS: dict[str, str] = {**VERDICTS, "note": VERDICTS["pass"]}
LEVELS: dict[Level, rr.TextLogLevel] = {
    "note": rr.TextLogLevel.INFO,
    "caution": rr.TextLogLevel.WARN,
    "fail": rr.TextLogLevel.ERROR,
}


def record(study: Study, stored: Stored[ProgramsResults], output: Path) -> None:
    """Write the recording of a robot's programs."""
    name, results = stored.robot, stored.results
    robot, motion = study.robot(name), results.motion
    with recording(output, name, STAGE, _layout(robot, motion)) as stream:
        log_scene(stream, study, name, SCENE_OF, STAGE)
        log_arm(stream, robot, np.radians(motion.q_deg[0]) if len(motion) else np.zeros(len(robot.lower)))
        starts, start = [], 0.0
        for program in results.summary.programs:
            rows = motion.take(motion.program == program.name)
            starts.append((program, start))
            texts = results.lines.text[results.lines.program == program.name].tolist()
            _announce(stream, program, start)
            if len(rows):
                _run(stream, robot, rows, start)
                _lines(stream, program, rows, texts, start)
                start += float(rows.t_s[-1])
            start += PAUSE
        log_note(stream, STAGE, _note(robot, results, starts))


def _layout(robot: Robot, motion: ProgramMotion) -> rrb.Horizontal:
    words = words_view(STAGE, "This line", events_view(STAGE, "Findings"), row_shares=[4, 5, 4])
    arms = [skeleton(robot, np.radians(q)) for q in motion.q_deg[::SKELETON_EVERY]]  # in sight all along the programs
    points = [motion.xyz_mm / 1000, *(arms or [skeleton(robot, np.zeros(len(robot.lower)))])]
    view = view_of(robot, "Arm and tool", [ARM, f"/{STAGE}/**", SCENE], points)
    left = rrb.Vertical(view, curves_view(f"/{STAGE}/angle", "Joint angle (deg)"), row_shares=[3, 1], name="Arm")
    return rrb.Horizontal(left, words, column_shares=[3, 2], name="Programs")


def _announce(stream: rr.RecordingStream, program: ProgramSummary, start: float) -> None:
    """A program's verdict; the way of the one before is taken away."""
    stream.set_time(TIMELINE, duration=start)
    stream.log(f"{STAGE}/way", rr.LineStrips3D([]))
    text = f"## {program.name}\n**{outcome_word(program.outcome)}**: {escaped(program.title)}\n\n{cycle_text(program)}"
    log_now(stream, STAGE, start, text)
    level = {"pass": rr.TextLogLevel.INFO, "caution": rr.TextLogLevel.WARN, "fail": rr.TextLogLevel.ERROR}
    told = f"{program.name}: {outcome_word(program.outcome)}"
    log_event(stream, STAGE, start, told, level[program.outcome])


def _run(stream: rr.RecordingStream, robot: Robot, rows: ProgramMotion, start: float) -> None:
    """The arm, the tool's whole way coloured by verdict, and the joint angles."""
    times = start + rows.t_s
    send_motion(stream, robot, times, np.radians(rows.q_deg))
    strips, colours = [], []
    for a, b in _stretches(rows):
        points = rows.xyz_mm[max(a - 1, 0) : b] / 1000
        if len(points) > 1:
            strips.append(points)
            colours.append(rgb(COLOURS[rows.level[a]]))
    stream.set_time(TIMELINE, duration=start)
    stream.log(f"{STAGE}/way", rr.LineStrips3D(strips, colors=colours, radii=0.004))
    names, shades = list(JOINT_NAMES[: rows.q_deg.shape[1]]), list(JOINTS[: rows.q_deg.shape[1]])
    send_run(stream, f"{STAGE}/angle", times, rows.q_deg, names, shades)


def _lines(
    stream: rr.RecordingStream, program: ProgramSummary, rows: ProgramMotion, texts: list[str], start: float
) -> None:
    """The line that is carried out, in its listing, and its findings."""
    own = Path(program.file).name
    found: dict[int, list[FindingAt]] = defaultdict(list)
    for each in program.findings:
        if each.file == own:
            found[each.line].append(each)
    told: set[int] = set()
    for a, _ in _stretches(rows):
        line = int(rows.line[a])
        now = start + float(rows.t_s[a])
        log_now(stream, STAGE, now, _document(program, line, texts, found[line], rows.level[a]))
        for each in [] if line in told else found[line]:
            text = f"{program.name}:{line}: {say(each.finding)}"
            log_event(stream, STAGE, now, text, LEVELS[each.level])
        told.add(line)


def _document(program: ProgramSummary, line: int, texts: list[str], found: list[FindingAt], level: Level) -> str:
    first, last = max(line - AROUND, 1), min(line + AROUND, len(texts))
    listing = [
        f"{'▶' if n == line else ' '}{n:>5}  {texts[n - 1]}".replace("```", "'''") for n in range(first, last + 1)
    ]
    remarks = [f"- {escaped(say(each.finding))}" for each in found]
    return "\n".join([f"## {program.name}, line {line}: {level_word(level)}", "```", *listing, "```", *remarks])


def _stretches(rows: ProgramMotion) -> list[tuple[int, int]]:
    """First row, and the row behind the last, of each motion: where the line changes or a motion begins again."""
    lines: Integers = rows.line
    edges = np.flatnonzero(np.diff(lines) != 0) + 1
    bounds = [0, *edges.tolist(), len(rows)]
    return list(pairwise(bounds))


def _note(robot: Robot, results: ProgramsResults, starts: list[tuple[ProgramSummary, float]]) -> str:
    rows = [
        f"| {start:.0f} s | {program.name} | {LANGUAGES[program.language].title} | {outcome_word(program.outcome)} |"
        for program, start in starts
    ]
    return "\n".join(
        [
            f"# {escaped(robot.title)}: programs",
            say_all(results.summary.verdict.findings),
            "",
            "**Look first** at the red stretches of the tool's path. Press play: the arm carries out one program after "
            "another, and the text beside it shows the line that it is at.",
            "",
            "- line: the tool's path, green where the motion passes, amber where it wants caution, red where it fails",
            "- grey solids: the scene",
            "",
            "| from | program | language | verdict |",
            "|---|---|---|---|",
            *rows,
        ]
    )
