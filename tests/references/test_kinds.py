"""A new kind of reference is one row class, its columns and the words of its group."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import er3a.pipeline.messages.references  # noqa: F401
from er3a.files.csv_file import CsvColumn, Written
from er3a.files.reference_sets import FORMATS, Format, load_references
from er3a.files.robot_library import load_robot
from er3a.finding import fact
from er3a.pipeline.messages import references as words
from er3a.pipeline.messages.say import say
from er3a.references.predict import predict
from er3a.references.quantities import ModelState, Quantity
from er3a.references.reference import Row
from er3a.references.rows import GROUPS, KINDS
from er3a.references.subjects import key_of


@dataclass(frozen=True)
class StandingHeight(Quantity):
    """Height of axis 2 over the base in the zero pose."""

    def value(self, state: ModelState) -> np.ndarray:
        return state.axis(2)[1][..., 2]


@dataclass(frozen=True)
class HeightRow(Row):
    """A height that a source states."""

    kind: ClassVar[str] = "heights"
    height_mm: float
    uncertainty_mm: float

    def scalars(self):
        yield fact("shoulder"), "heights", StandingHeight(), self.height_mm, self.uncertainty_mm


@pytest.fixture
def with_heights(monkeypatch):
    columns = {"height_mm": CsvColumn(Written), "uncertainty_mm": CsvColumn(Written, optional=True)}
    monkeypatch.setitem(GROUPS, "heights", 8)
    monkeypatch.setitem(KINDS, "heights", HeightRow)
    monkeypatch.setitem(FORMATS, "heights", Format(columns))


@pytest.mark.usefixtures("with_heights")
def test_a_new_kind_is_read_and_predicted(tmp_path):
    (tmp_path / "documents.csv").write_text("name,title,publisher,derived_from\nd,a drawing,a maker,\n")
    (tmp_path / "heights.csv").write_text("height_mm,uncertainty_mm,source,grade,origin\n321.5,,a drawing,official,d\n")
    (reference,) = load_references(tmp_path).references
    assert (reference.group, key_of(reference.subject), reference.uncertainty) == ("heights", "shoulder()", 0.05)
    assert predict(load_robot("er3a_c60"), (reference,)) == pytest.approx([321.5])


def test_every_kind_has_columns_and_every_group_words_and_a_rank():
    assert KINDS.keys() == FORMATS.keys()
    assert GROUPS.keys() == words.GROUP_WORDS.keys()
    assert len(set(GROUPS.values())) == len(GROUPS)


@pytest.mark.parametrize("name", ["er3a_c60", "er3a_c60_article", "er3_600"])
def test_every_subject_has_a_sentence_and_a_key(name):
    references = load_references(name).references
    for reference in references:
        assert say(reference.subject)
        assert reference.group in GROUPS
    keys = {key_of(reference.subject): reference.subject for reference in references}
    assert all(keys[key_of(reference.subject)] == reference.subject for reference in references)
