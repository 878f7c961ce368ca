"""The documents about results say what the models say, and what is written meets the schema."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from er3a.pipeline.dictionary import data_dictionary, summary_schema
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.tables import table_types

DOCS = Path(__file__).resolve().parents[1] / "docs" / "results"


@pytest.mark.parametrize("name", STAGES)
def test_committed_schema_is_the_model_s(name):
    committed = json.loads((DOCS / f"{name}.schema.json").read_text(encoding="utf-8"))
    assert committed == summary_schema(STAGES[name]), "run `make schema`"


def test_committed_dictionary_is_the_tables():
    assert (DOCS / "dictionary.md").read_text(encoding="utf-8") == data_dictionary(), "run `make schema`"


@pytest.mark.parametrize("name", STAGES)
def test_every_column_says_what_it_means(name):
    for table in table_types(STAGES[name].module("model").RESULTS).values():
        assert all(column.meaning for column in table.columns().values()), table.__name__
