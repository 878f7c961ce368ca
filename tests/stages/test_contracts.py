"""Every stage of the registry has the verbs that its entry names, with the signatures that the pipeline calls."""

from __future__ import annotations

import inspect
from importlib import import_module
from typing import get_type_hints

import pytest

from er3a.pipeline.results import Results, Stored, Summary
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.stage import Stage

OF_COMPUTE = ["study", "name"]
OF_VIEWS = ["study", "stored", "output"]


@pytest.fixture(params=STAGES.values(), ids=lambda stage: stage.name)
def stage(request) -> Stage:
    return request.param


def test_it_computes_the_results_of_its_model(stage):
    compute = stage.module("compute").compute
    assert list(inspect.signature(compute).parameters) == OF_COMPUTE
    results = stage.module("model").RESULTS
    assert get_type_hints(compute)["return"] is results
    assert issubclass(results, Results)
    summary = get_type_hints(results)["summary"]
    assert issubclass(summary, Summary)
    assert summary is not Summary


def test_its_views_take_those_results(stage):
    for verb in ("record", "report"):
        view = getattr(stage.module(f"page.{verb}"), verb) if verb in stage.views else None
        if view:
            assert list(inspect.signature(view).parameters) == OF_VIEWS
            assert get_type_hints(view)["stored"] == Stored[stage.module("model").RESULTS]


def test_its_key_figures_have_names(stage):
    """A figure without a name in ``KEY_FIGURES`` would fail on the page alone; tests of the stages compute them all."""
    figures = import_module(stage.messages).KEY_FIGURES
    assert figures
    assert all(name.isidentifier() and words for name, words in figures.items())
