"""What a page says first where the stage that it rests on does not simply pass."""

from __future__ import annotations

from collections.abc import Mapping

from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import word

FOUNDATIONS: Mapping[str, str] = {
    "fail": N_("Validation contradicts this table: these results are true of the table, not of the robot."),
    "caution": N_("Validation leaves part of this table open: these results hold only as far as the table does."),
    "no_reference": N_("Nothing was compared with this table: these results hold only as far as the table does."),
    "not_computed": N_("This table was not validated: these results hold only as far as the table does."),
}


def caveat(status: str) -> str:
    """The sentence for a status of validation; empty for ``pass``."""
    return word("foundation", FOUNDATIONS, status) if status in FOUNDATIONS else ""
