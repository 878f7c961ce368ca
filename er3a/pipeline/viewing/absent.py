"""The views of a stage that was not computed: they say why."""

from __future__ import annotations

from pathlib import Path

from er3a.pipeline.messages.say import say
from er3a.pipeline.results import AbsentResults, Stored
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.page import head_of, render, run_command
from er3a.pipeline.viewing.recording import escaped, write_reason


def report_absent(study: Study, stored: Stored[AbsentResults], output: Path) -> None:
    """Write the page: the verdict, and where it comes from."""
    render(
        Path(__file__).with_name("absent.html.j2"),
        output,
        head=head_of(stored, {}),
        command=run_command(study, f"{stored.robot}/{stored.stage}.html"),
        robot=study.robot(stored.robot),
        robot_pages=study.pages(stored.robot),
    )


def record_absent(study: Study, stored: Stored[AbsentResults], output: Path) -> None:
    """Write a recording that holds the reason alone."""
    write_reason(output, stored.robot, stored.stage, escaped(say(stored.results.summary.verdict.finding)))
