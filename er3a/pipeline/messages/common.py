"""Sentences that all stages share."""

from __future__ import annotations

from er3a.pipeline.messages.say import say, sentence
from er3a.pipeline.results import NotComputed

__all__ = ["say"]


@say.register
def _(found: NotComputed) -> str:
    return sentence(found.code, "Not computed: {reason}", reason=found.reason)
