"""The verdict of the stage of programs as a sentence."""

from __future__ import annotations

import er3a.pipeline.messages.pairs  # noqa: F401
from er3a.pipeline.messages.expectations import demonstrated, outcome_word
from er3a.pipeline.messages.say import Plural, joined, say, sentence, texts
from er3a.pipeline.stages.programs.model import ProgramCounts
from er3a.programs.syntax import ProgramOutcome

TEXTS = texts(
    {
        "programs.none": "The robot's list of programs is empty.",
        "programs.programs": Plural("count", "{passed} of {count} program passes", "{passed} of {count} programs pass"),
        "programs.not_examined": "not all examined ({names})",
        "programs.fault": "{count} {word} ({names})",
    }
)


@say.register
def _(found: ProgramCounts) -> str:
    passed = sentence("programs.programs", count=found.programs + len(found.demonstrations), passed=found.passed)
    unsound: dict[ProgramOutcome, tuple[str, ...]] = {"fail": found.failed, "caution": found.caution}
    others = []
    for outcome, names in unsound.items():
        parts = {"count": len(names), "word": outcome_word(outcome), "names": ", ".join(names)}
        others.append(sentence("programs.fault", **parts) if names else "")
    missed = ", ".join(found.not_examined)
    open_parts = sentence("programs.not_examined", names=missed) if missed else ""
    told = [passed if found.programs else "", joined(others, ", "), open_parts, demonstrated(found.demonstrations)]
    return sentence("finding", finding=joined(told))
