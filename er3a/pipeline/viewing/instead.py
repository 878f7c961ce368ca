"""Which table of a study to use instead of one that evidence contradicts."""

from __future__ import annotations

from pathlib import Path

from er3a.errors import ResultError
from er3a.pipeline.results import read_verdict
from er3a.pipeline.study import Study


def table_instead(study: Study, name: str, results: Path) -> str | None:
    """A robot of the study that one of this robot's reference sets is about, and that its own evidence bears out; None
    where there is none, or none that was computed."""
    for other in study.other_tables(name):
        try:
            status = read_verdict(results / other / "validation")[0]
        except ResultError:
            continue
        if status in ("pass", "caution"):
            return other
    return None
