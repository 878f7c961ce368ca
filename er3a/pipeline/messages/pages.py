"""What pages share: the sentence that decides, what to know first, and the glossary."""

from __future__ import annotations

from collections.abc import Mapping

from er3a.by_value import frozen
from er3a.pipeline.language import terms, tr, words
from er3a.pipeline.messages.say import word

FOUNDATIONS: Mapping[str, str] = words(
    {
        "fail": "Never use this table: evidence contradicts it. Run no path, repair or program that was made by it.",
        "caution": "Part of this D-H table is not settled: confirm it before the arm moves.",
        "unsettled": (
            "No entry of this D-H table is settled by an independent document: confirm it before the arm moves."
        ),
        "no_reference": "This D-H table was compared with no data: confirm it before the arm moves.",
        "not_computed": "This D-H table was not validated: confirm it before the arm moves.",
    }
)
GRADE_NAMES = words(
    {
        "official": "official",
        "measured": "measured",
        "cad": "CAD",
        "export": "exported",
        "claim": "claim",
        "inferred": "inferred",
    }
)
GROUP_NAMES = words(
    {  # of a robot file
        "dh": "D-H table",
        "zero": "zeros and directions",
        "limits": "limits",
        "speeds": "joint speeds",
        "coupling": "coupling",
        "base": "base",
        "flange": "flange",
        "tool": "tool",
        "envelopes": "shapes of links",
        "inertia": "masses",
        "drives": "drives",
        "wrist_load": "wrist load",
        "weight": "weight",
    }
)
SIDES = words({"lower": "lower limit", "upper": "upper limit"})
GLOSSARY = terms(
    {
        "branch": "one choice of shoulder, elbow and wrist among the joint angles that bring the tool to a pose",
        "branch and bound": (
            "a search that divides what is possible and drops what bounds exclude; not the arm's branches"
        ),
        "self-motion": "a continuum of solutions: joints that move while the tool stays on its target",
        "arm angle": "where the elbow of an arm with spherical shoulder and wrist is on its circle",
        "manipulability": (
            "the product of the Jacobian's singular values, lengths divided by the wrist's reach (in the workspace "
            "undivided, in m³); 0 at a singularity"
        ),
        "condition number": (
            "the Jacobian's largest singular value divided by its smallest; without bound at a singularity"
        ),
        "characteristic length": (
            "by which the Jacobian's linear rows are divided, so that its singular values have no unit"
        ),
        "wrist centre": "the point in which the last three axes meet",
        "settled": "of a table entry: independent documents give it to within the tolerance",
        "but for signs": (
            "of a settled table entry: keep it, unless an open entry turns out otherwise, which may change a sign or "
            "half turn here"
        ),
        "claim": "what an article says; shown, but no verdict rests on it",
        "capability": "what the tool can do at a place: share of directions, solutions, dexterity",
        "tray": (
            "the space, as of a bin or a pallet's load, that the workspace page places where the tool reaches all of it"
        ),
        "void": "a region that the tool point can't reach: enclosed, or open to the outside",
        "undecided": "what the computed bounds can't decide; never called safe",
        "holding torque": "the torque or force by which a drive keeps a joint at rest in a pose",
        "RMS torque": "root-mean-square over a motion, which heats the motor; compared with the rated torque",
    }
)


@frozen
class Caveat:
    """What to know first, and what validation found that it comes from."""

    status: str
    text: str


def caveat(found: str) -> Caveat | None:
    """What validation's foundation says to know first; None for ``pass``."""
    return Caveat(found, word("foundation", FOUNDATIONS, found)) if found in FOUNDATIONS else None


def glossary() -> dict[str, str]:
    """Each term and its meaning in the page's language."""
    return {tr(term): tr(meaning) for term, meaning in GLOSSARY.items()}
