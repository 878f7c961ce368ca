"""The trajectory stage's verdict as a sentence."""

from __future__ import annotations

import er3a.pipeline.messages.pairs  # noqa: F401
from er3a.pipeline.messages.expectations import demonstrated, outcome_word
from er3a.pipeline.messages.say import counted, joined, say, sentence
from er3a.pipeline.stages.trajectory.model import PathCounts
from er3a.planning.path_verdicts import PathVerdict


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
        faults.append(sentence("trajectory.fault", "{count} {word} ({names})", **parts) if names else "")
    safe = counted(
        "trajectory.paths",
        "{safe} of {count} path is safe",
        "{safe} of {count} paths are safe",
        found.paths + len(found.demonstrations),
        safe=found.safe,
    )
    if found.not_followed:
        parts = {"count": len(found.not_followed), "names": ", ".join(found.not_followed)}
        faults.append(sentence("trajectory.not_followed", "{count} not followed to the end ({names})", **parts))
    told = [safe if found.paths else "", joined(faults, ", "), demonstrated(found.demonstrations)]
    return sentence("trajectory.verdict", "{finding}.", finding=joined(told))
