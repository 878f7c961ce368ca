"""What has to be confirmed of a table before anything made with it is run on the arm, and what no check looked at.

Pages say it, and so does each robot program in its first lines, because who gets the file may never see a page.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from er3a.pipeline import language
from er3a.pipeline.messages.scope import assumed_text, missed_text, never_text
from er3a.pipeline.messages.validation import condition
from er3a.pipeline.results import read_stage
from er3a.pipeline.scope import Coverage, Open
from er3a.pipeline.stages.registry import STAGES


def condition_of(validated: Path | None) -> tuple[str, int]:
    """What of a table has to be confirmed before anything is run on the arm.

    Parameters
    ----------
    validated : folder of the validation stage's results; None where there are none

    Returns
    -------
    text : empty where documents settle all of the table that has to be settled
    count : of the entries that it asks to confirm; 0 where no document speaks of the table

    Raises
    ------
    ResultError
        if the results are damaged or of another version
    """
    summary = read_stage(validated, STAGES["validation"]).results.summary if validated else None
    evidence, finding = getattr(summary, "evidence", None), summary and summary.verdict.finding
    text = condition(evidence.parts if evidence else (), getattr(finding, "unbounded", ()))
    return text, len(evidence.unconfirmed) if evidence else 0


def program_head(
    validated: Path | None, checked: Iterable[Coverage] = (), assumed: Iterable[Open] = (), stage: str = "trajectory"
) -> list[str]:
    """What a robot program begins with, in English.

    Parameters
    ----------
    validated : folder of the validation stage's results; None where there are none
    checked : what the checks of the motion cover
    assumed : what these rest on
    stage : that checked it

    Returns
    -------
    lines : what has to be confirmed, as :func:`condition_of` says it, what was not checked, and what was assumed
    """
    with language.using("en"):
        missed = [f"not checked: {missed_text(each)}" for each in checked if not each.complete]
        given = [f"assumed: {assumed_text(each)}" for each in assumed]
        return [line for line in (condition_of(validated)[0], *missed, *given, never_text(stage)) if line]
