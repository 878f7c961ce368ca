"""What a page says first where the stage that it rests on does not simply pass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import word

FOUNDATIONS: Mapping[str, str] = {
    "fail": N_("Never use this table: evidence contradicts it. These results are true of the table, not of the robot."),
    "caution": N_("Validation leaves part of this D-H table open: these results hold only as far as it does."),
    "no_reference": N_("Nothing was compared with this D-H table: these results hold only as far as it does."),
    "not_computed": N_("This D-H table was not validated: these results hold only as far as it does."),
}


@dataclass(frozen=True)
class Caveat:
    """What to know first, and the status of validation that it comes from."""

    status: str
    text: str


def caveat(status: str) -> Caveat | None:
    """What a status of validation says to know first; None for ``pass``."""
    return Caveat(status, word("foundation", FOUNDATIONS, status)) if status in FOUNDATIONS else None
