"""What the page and the recording of programs say, beside the verdict."""

from __future__ import annotations

import er3a.pipeline.messages.program_check  # noqa: F401
from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.messages.say import counted, joined
from er3a.pipeline.stages.programs.model import ProgramSummary

FIGURES = {
    "programs_passed": N_("Programs that pass"),
    "instructions_passed": N_("Motion instructions that pass"),
    "instructions_caution": N_("Motion instructions with caution"),
    "instructions_failed": N_("Motion instructions that fail"),
    "least_clearance": N_("Least clearance of programs meant to pass"),
}


def cycle_text(program: ProgramSummary) -> str:
    """How long a program takes, and what that leaves out."""
    cycle = program.cycle
    low, high = f"{cycle.blended_s:.2f}", f"{cycle.stopping_s:.2f}"
    time = tr("{time} s", time=low) if low == high else tr("{low} to {high} s", low=low, high=high)
    what = tr("one round: {time}", time=time) if cycle.repeats else time
    waits = (
        counted("programs.waits", "and {count} wait for a signal", "and {count} waits for signals", cycle.waits)
        if cycle.waits
        else ""
    )
    unknown = "" if cycle.complete else tr("without the motions whose path is unknown")
    return joined([what, waits, unknown], ", ")
