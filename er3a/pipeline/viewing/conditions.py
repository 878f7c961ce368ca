"""What has to be confirmed of a table before anything made with it is run on the arm, and what no check looked at.

Pages say it, and so does each robot program in its first lines, because who gets the file may never see a page.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from er3a.pipeline import language
from er3a.pipeline.messages.left_out import left_out_text
from er3a.pipeline.messages.validation import condition
from er3a.pipeline.results import NEVER_A_PASS, LeftOut, LeftOutSubject, read_stage
from er3a.pipeline.stages.registry import STAGES

WARNED_OF: frozenset[LeftOutSubject] = NEVER_A_PASS | {
    *("tool", "carried", "gripped_parts", "placed_box", "torques", "ways_between"),
}


def condition_of(validated: Path | None) -> str:
    """What of a table has to be confirmed before anything is run on the arm.

    Parameters
    ----------
    validated : folder of the validation stage's results; None where there are none

    Returns
    -------
    text : empty where documents settle all of the table that has to be settled

    Raises
    ------
    ResultError
        if the results are damaged or of another version
    """
    summary = read_stage(validated, STAGES["validation"]).results.summary if validated else None
    evidence, finding = getattr(summary, "evidence", None), summary and summary.verdict.finding
    return condition(evidence.parts if evidence else (), getattr(finding, "unbounded", ()))


def program_head(validated: Path | None, not_examined: Iterable[LeftOut] = ()) -> list[str]:
    """What a robot program begins with, in English.

    Parameters
    ----------
    validated : folder of the validation stage's results; None where there are none
    not_examined : what the checks of the motion leave out

    Returns
    -------
    lines : what has to be confirmed, as :func:`condition_of` says it, and what was not checked (``WARNED_OF``)
    """
    with language.using("en"):
        missed = [f"not checked: {left_out_text(each)}" for each in not_examined if each.subject in WARNED_OF]
        return [line for line in (condition_of(validated), *missed) if line]
