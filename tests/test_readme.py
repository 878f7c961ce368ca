"""The README's figures that the default study samples, against those of the small one, within what both leave open."""

from __future__ import annotations

import re

import pytest

from er3a.pipeline.results import read_stage
from er3a.pipeline.stages.registry import STAGES
from testing.readme import answer

pytestmark = pytest.mark.long


def figures(small_study, stage: str) -> dict:
    summary = read_stage(small_study.folder / "results/er3a_c60" / stage, STAGES[stage]).results.summary
    return {figure.name: figure for figure in summary.figures}


def test_the_readme_tells_the_reach_within_what_is_proven(small_study):
    found = figures(small_study, "workspace")
    told = answer("What does the arm reach")
    least, most, void = map(float, re.findall(r"\d+\.\d+", told))
    assert found["volume_lower"].value <= least < most <= found["volume_upper"].value
    assert found["enclosed_voids_lower"].value <= void  # more cells prove more of it empty


def test_the_readme_tells_the_mean_number_of_solutions(small_study):
    mean = figures(small_study, "validation")["solutions_of_random_pose"]
    told, most = re.search(r"([\d.]+) of (\d+) within the limits", answer("Which joint solutions")).groups()
    assert int(most) == mean.of
    assert abs(float(told) - mean.value) < 0.35  # of 200 poses
