"""The index's sentence that decides: what a robot's verdicts come to."""

from __future__ import annotations

from collections.abc import Sequence

from er3a.pipeline.messages.language import tr


def decision(
    table: str, failed: Sequence[str], instead: str | None = None, geometry: tuple[int, int] | None = None
) -> str:
    """What to do with a robot's model, from validation's status and the titles of the stages that failed.

    ``instead`` is a model of the same arm that evidence does not contradict; ``geometry``: how many of how many lengths
    and twists of a table that is not contradicted independent documents settle.
    """
    if table == "not_examined":
        return tr("Its table has not been examined yet: run the stage validation before you use it.")
    if table == "fail" and instead:
        return tr("Never use this table: evidence contradicts it. Use {robot} instead.", robot=instead)
    if table == "fail":
        return tr("Never use this table: evidence contradicts it, so nothing computed from it holds for the robot.")
    if failed:
        return tr("Do not use it as it is: see {stages}.", stages=", ".join(failed))
    if table == "pass":
        return tr(
            "Use it: every entry that moves the tool is settled by independent documents, and nothing here fails."
        )
    if table == "caution" and geometry and not geometry[0]:
        return tr("Not proven: nothing contradicts its table, but no independent document settles any of its geometry.")
    if table == "caution" and geometry:
        return tr(
            "Use it with care: nothing contradicts its table, and {settled} of {entries} entries of its geometry are "
            "settled, but not the whole table.",
            settled=geometry[0],
            entries=geometry[1],
        )
    if table == "caution":
        return tr("Use it with care: nothing contradicts its table, but part of it is not settled.")
    return tr("There is no evidence on its table: check it before you use it.")
