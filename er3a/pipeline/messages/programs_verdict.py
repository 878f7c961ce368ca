"""The verdict of the stage of programs as a sentence."""

from __future__ import annotations

import er3a.pipeline.messages.pairs  # noqa: F401
from er3a.pipeline.messages.expectations import demonstrated, outcome_word
from er3a.pipeline.messages.say import counted, joined, say, sentence
from er3a.pipeline.stages.programs.model import NoPrograms, ProgramCounts
from er3a.programs.syntax import ProgramOutcome


@say.register
def _(found: ProgramCounts) -> str:
    passed = counted(
        "programs.programs",
        "{passed} of {count} program passes",
        "{passed} of {count} programs pass",
        found.programs + len(found.demonstrations),
        passed=found.passed,
    )
    unsound: dict[ProgramOutcome, tuple[str, ...]] = {"fail": found.failed, "caution": found.caution}
    others = []
    for outcome, names in unsound.items():
        parts = {"count": len(names), "word": outcome_word(outcome), "names": ", ".join(names)}
        others.append(sentence("programs.fault", "{count} {word} ({names})", **parts) if names else "")
    missed = ", ".join(found.not_examined)
    open_parts = sentence("programs.not_examined", "not all examined ({names})", names=missed) if missed else ""
    told = [passed if found.programs else "", joined(others, ", "), open_parts, demonstrated(found.demonstrations)]
    return sentence("programs.verdict", "{finding}.", finding=joined(told))


@say.register
def _(found: NoPrograms) -> str:
    return sentence(found.code, "The robot's list of programs is empty.")
