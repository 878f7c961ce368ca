"""The trajectory stage's verdict as a sentence."""

from __future__ import annotations

from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import counted, joined, say, sentence, word
from er3a.pipeline.stages.trajectory.model import PathCounts, PathVerdict

VERDICTS: dict[PathVerdict, str] = {
    "unreachable": N_("unreachable"),
    "leaves limits": N_("leaves limits"),
    "collides": N_("collides"),
    "too fast": N_("too fast"),
    "singular": N_("singular"),
    "near-singular": N_("near-singular"),
    "safe": N_("safe"),
}


@say.register
def _(found: PathCounts) -> str:
    unsafe: dict[PathVerdict, tuple[str, ...]] = {
        "unreachable": found.unreachable,
        "leaves limits": found.leaves_limits,
        "collides": found.collides,
        "too fast": found.too_fast,
        "singular": found.singular,
        "near-singular": found.near_singular,
    }
    faults = []
    for verdict, names in unsafe.items():
        parts = {"count": len(names), "word": verdict_word(verdict), "names": ", ".join(names)}
        faults.append(sentence("trajectory.fault", "{count} {word} ({names})", **parts) if names else "")
    safe = counted(
        "trajectory.paths",
        "{safe} of {count} path is safe",
        "{safe} of {count} paths are safe",
        found.paths,
        safe=found.safe,
    )
    return sentence("trajectory.verdict", "{finding}.", finding=joined([safe, joined(faults, ", ")]))


def verdict_word(verdict: PathVerdict) -> str:
    """A path's verdict in words."""
    return word("trajectory.path", VERDICTS, verdict)
