"""What a page says first where the stage that it rests on does not simply pass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import word

FOUNDATIONS: Mapping[str, str] = {
    "fail": N_("Never use this table: evidence contradicts it. These results hold for the table, not for the robot."),
    "caution": N_("Validation leaves part of this D-H table open: these results are only as good as the table."),
    "no_reference": N_("This D-H table was compared with no data: these results are only as good as the table."),
    "not_computed": N_("This D-H table was not validated: these results are only as good as the table."),
}


@dataclass(frozen=True)
class Caveat:
    """What to know first, and the status of validation that it comes from."""

    status: str
    text: str


def caveat(status: str) -> Caveat | None:
    """What a status of validation says to know first; None for ``pass``."""
    return Caveat(status, word("foundation", FOUNDATIONS, status)) if status in FOUNDATIONS else None
