"""The index page: robots x stages, with verdicts and key figures."""

from __future__ import annotations

from pathlib import Path

from er3a.results import read_summary
from er3a.study import STAGES, Study
from er3a.viewing import page

SHOWN_FIGURES = 3
QUESTIONS = {
    "validation": "Does the table match the maker's data?",
    "workspace": "What can it reach, where are the voids?",
    "inverse": "Which joint solutions reach a pose?",
    "trajectory": "Do the paths run into singularities?",
}


def write_index(study: Study, results: Path, output: Path) -> None:
    """Render ``index.html`` from the summaries of all robots and stages."""
    robots = [
        {"robot": study.robot(name), "summaries": [read_summary(results / name / stage) for stage in STAGES]}
        for name in study.robots
    ]
    page.render(
        Path(__file__).with_name("index.html.j2"),
        output,
        robots=robots,
        stages=STAGES,
        questions=QUESTIONS,
        shown_figures=SHOWN_FIGURES,
    )
