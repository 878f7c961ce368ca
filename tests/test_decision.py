"""The index's sentence that decides."""

from __future__ import annotations

import pytest

from er3a.pipeline.messages.decision import decision


@pytest.mark.parametrize(
    ("table", "failed", "start"),
    [
        ("fail", ["trajectory"], "Don't use this table"),
        ("pass", ["trajectory"], "Not as it stands: see trajectory"),
        ("caution", ["trajectory", "vision"], "Not as it stands: see trajectory, vision"),
        ("caution", [], "Use it with care"),
        ("pass", [], "Use it: "),
        ("no_reference", [], "There is no evidence on its table"),
        ("not_computed", [], "There is no evidence on its table"),
    ],
)
def test_the_table_decides_first_then_what_fails(table, failed, start):
    assert decision(table, failed).startswith(start)
