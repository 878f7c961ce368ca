"""A made-up stage: small results of every kind, written where the workspace stage has its own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from er3a.finding import fact
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.messages.say import texts
from er3a.pipeline.results import Figure, Results, Summary, Verdict, write_results
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.stage import Stage
from er3a.pipeline.study import Study
from er3a.pipeline.tables import Table, Texts, column, per_joint, vector

ROBOT = "er3_600"


TEXTS = texts({"made.hollow": "A hollow (空洞) of {volume_m3:.2f} m³.", "made.solid": "All is solid."})


class MadeSummary(Summary):
    """With a key of its own."""

    reach_m: tuple[float, ...]


class Rows(Table):
    """One column of each kind."""

    x_m: Reals = column("how far")
    count: Integers = column("how many")
    label: Texts = column("what")
    q_deg: Reals = per_joint("joint angle")
    point_mm: Reals = vector("{}_mm", "where")


class MadeResults(Results):
    """A summary and a table."""

    summary: MadeSummary
    rows: Rows


@dataclass(frozen=True)
class MadeStage(Stage):
    """A stage with the model and the words above, which takes all else from the workspace stage."""

    messages = __name__

    def module(self, name: str) -> Any:
        """The model, whatever the name."""
        return SimpleNamespace(RESULTS=MadeResults)


STAGE = MadeStage(**vars(STAGES["workspace"]))
ROWS = Rows(
    x_m=[0.1, np.nan, -0.0],
    count=[1, 2, 3],
    label=["a", "空洞", None],
    q_deg=np.arange(18.0).reshape(3, 6),
    point_mm=np.arange(9.0).reshape(3, 3),
)
KEY_FIGURES = {"hull_volume": "Volume of the hull", "reach": "Reach", "solved": "Targets that are solved"}
SUMMARY = MadeSummary(
    Verdict("fail", fact("made.hollow", volume_m3=0.25)),
    (Figure("hull_volume", 1.25, "m³", 0.01), Figure("reach", None, "mm"), Figure("solved", 2, "", of=3)),
    (0.5, 1.0),
)


def write(folder: Path, study: Study, summary: MadeSummary = SUMMARY, rows: Rows = ROWS) -> Path:
    """Write results of the stage into a folder, and return the path of their summary."""
    write_results(folder, study, ROBOT, STAGE, MadeResults(summary, rows))
    return folder / "summary.json"
