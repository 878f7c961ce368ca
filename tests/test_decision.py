"""The index's sentence that decides."""

from __future__ import annotations

import pytest

from er3a.pipeline.messages.pages import decision, next_step
from er3a.pipeline.viewing.page import LED, led


@pytest.mark.parametrize(
    ("table", "failed", "start"),
    [
        ("fail", ["trajectory"], "Never use this table"),
        ("pass", ["trajectory"], "Do not use it as it is: see trajectory"),
        ("caution", ["trajectory", "vision"], "Do not use it as it is: see trajectory, vision"),
        ("caution", [], "Use it for planning only"),
        ("pass", [], "Use it: "),
        ("no_reference", [], "There is no evidence on its table"),
        ("not_computed", [], "There is no evidence on its table"),
    ],
)
def test_the_table_decides_first_then_what_fails(table, failed, start):
    assert decision(table, failed).startswith(start)


def test_a_table_of_which_nothing_is_settled_is_told_from_one_that_is_nearly():
    assert decision("caution", [], unproven=True).startswith("Don't rely on it yet")
    assert decision("caution", []).startswith("Use it for planning only")
    assert decision("pass", [], unproven=True).startswith("Use it: ")


@pytest.mark.parametrize(
    ("unproven", "start"), [(True, "Don't rely on it yet: "), (False, "Use it for planning only: ")]
)
def test_where_references_contradict_each_other_nothing_is_said_to_contradict_the_table(unproven, start):
    said = decision("caution", [], unproven=unproven, conflict="592.8 mm or 600.0 mm")
    assert said.startswith(f"{start}references contradict each other (592.8 mm or 600.0 mm)")
    assert "nothing contradicts" not in said


@pytest.mark.parametrize(("end", "gap"), [(".", " "), (";", " "), ("。", ""), ("；", "")])
def test_a_long_verdict_is_cut_at_the_end_of_a_clause_and_loses_nothing(end, gap):
    clauses = [f"clause {k}, 1.5 mm off, which has no end of its own" + end for k in range(20)]
    lead, rest = led(gap.join(clauses))
    assert lead.endswith((".", "。"))  # a clause becomes a sentence
    assert LED - len(clauses[0]) - 2 < len(lead) <= LED
    assert (lead[:-1] + end + gap + rest).lower() == gap.join(clauses)


def test_a_short_verdict_and_one_without_clauses_stay_whole():
    assert led("All is well. Nothing is open.") == ("All is well. Nothing is open.", "")
    assert led("word " * 100) == ("word " * 100, "")


@pytest.mark.parametrize(
    ("table", "failed", "more", "page"),
    [
        ("fail", {"inverse": "inverse"}, {"instead": "other"}, "arm/validation.html#table-to-use"),
        ("fail", {}, {}, "arm/validation.html"),
        ("fail", {}, {"instead": "other", "same_arm": True}, "arm/validation.html"),
        ("caution", {"inverse": "inverse"}, {"measurement": "measure a1"}, "arm/inverse.html"),
        ("caution", {}, {"measurement": "measure a1", "entry": "a1"}, "arm/validation.html#entry-a1"),
        ("no_reference", {}, {}, "arm/validation.html"),
    ],
)
def test_the_next_step_leads_to_the_page_that_says_how(table, failed, more, page):
    found = next_step("arm", table, failed, **more)
    assert found is not None
    assert found.page == page


def test_nothing_is_next_where_nothing_is_open():
    assert next_step("arm", "pass", {}) is None
    assert next_step("arm", "caution", {}) is None
