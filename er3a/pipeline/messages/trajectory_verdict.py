"""The trajectory stage's verdict as a sentence."""

from __future__ import annotations

import er3a.pipeline.messages.pairs  # noqa: F401
from er3a.pipeline.messages.expectations import demonstrated, outcome_word
from er3a.pipeline.messages.say import Plural, joined, say, sentence, texts
from er3a.pipeline.stages.trajectory.model import PathCounts
from er3a.planning.intervals import PathVerdict

TEXTS = texts(
    {
        "trajectory.paths": Plural("count", "{safe} of {count} path is safe", "{safe} of {count} paths are safe"),
        "trajectory.not_followed": "{count} not followed to the end ({names})",
        "trajectory.fault": "{count} {word} ({names})",
    }
)


@say.register
def _(found: PathCounts) -> str:
    unsafe: dict[PathVerdict, tuple[str, ...]] = {
        "unreachable": found.unreachable,
        "none found": found.none_found,
        "leaves limits": found.leaves_limits,
        "collides": found.collides,
        "too fast": found.too_fast,
        "singular": found.singular,
        "too fast for the assumed limits": found.too_fast_if_assumed,
        "undecided": found.undecided,
        "near-singular": found.near_singular,
    }
    faults = []
    for verdict, names in unsafe.items():
        parts = {"count": len(names), "word": outcome_word(verdict), "names": ", ".join(names)}
        faults.append(sentence("trajectory.fault", **parts) if names else "")
    safe = sentence("trajectory.paths", count=found.paths + len(found.demonstrations), safe=found.safe)
    if found.not_followed:
        parts = {"count": len(found.not_followed), "names": ", ".join(found.not_followed)}
        faults.append(sentence("trajectory.not_followed", **parts))
    told = [safe if found.paths else "", joined(faults, ", "), demonstrated(found.demonstrations)]
    return sentence("finding", finding=joined(told))
