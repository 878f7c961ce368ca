"""The dictionary of results says what the models say."""

from __future__ import annotations

from pathlib import Path

import pytest

from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.tables import table_types
from testing.schemas import data_dictionary

DOCS = Path(__file__).resolve().parents[1] / "docs" / "results"


def test_committed_dictionary_is_the_tables():
    assert (DOCS / "dictionary.md").read_text(encoding="utf-8") == data_dictionary(), "run `make schema`"


@pytest.mark.parametrize("name", STAGES)
def test_every_column_says_what_it_means(name):
    for table in table_types(STAGES[name].module("model").RESULTS).values():
        assert all(column.meaning for column in table.columns().values()), table.__name__
