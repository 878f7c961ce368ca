"""The heads of all stages, for pages that show more than one."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

from er3a.pipeline.results import read_stage
from er3a.pipeline.stages.stage import Stage
from er3a.pipeline.viewing.page import Head, head_of


def stage_head(folder: Path, stage: Stage) -> Head:
    """The verdict and key figures that a folder holds, in the page's language."""
    words = import_module(stage.messages)
    return head_of(read_stage(folder, stage), words.FIGURES)
