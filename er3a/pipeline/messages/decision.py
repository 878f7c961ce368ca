"""The index's sentence that decides: what a robot's verdicts come to."""

from __future__ import annotations

from collections.abc import Sequence

from er3a.pipeline.messages.language import tr


def decision(table: str, failed: Sequence[str]) -> str:
    """What to do with a robot's model, from validation's status and the titles of the stages that failed."""
    if table == "fail":
        return tr("Don't use this table: evidence contradicts it, and so what follows from it.")
    if failed:
        return tr("Not as it stands: see {stages}.", stages=", ".join(failed))
    if table == "pass":
        return tr("Use it: what moves the tool is settled, and nothing here fails.")
    if table == "caution":
        return tr("Use it with care: nothing contradicts its table, but part of it is not settled.")
    return tr("There is no evidence on its table: check it before you use it.")
