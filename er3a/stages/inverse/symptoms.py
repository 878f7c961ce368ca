"""The usual symptoms of a failing inverse, their causes, and what this run found of each."""

from __future__ import annotations

from typing import Any

SYMPTOM_COLUMNS = ["Symptom", "Usual cause", "What was tried here", "What helps"]


def symptoms(summary: dict[str, Any]) -> list[list[str]]:
    """Rows of ``SYMPTOM_COLUMNS``, from the summary's targets alone."""
    targets = summary["targets"]
    unreachable = [target["name"] for target in targets if not target["solutions"]]
    limited = [target["name"] for target in targets if target["solutions"] and not target["within_limits"]]
    free = [target["name"] for target in targets if target["families"]]
    iterated = [target["name"] for target in targets if target["method"] != "closed form"]
    return [
        [
            "No solution anywhere",
            "The target is out of reach, or given in metres or radians where mm and degrees are meant",
            f"Units were checked on reading. Out of reach: {_names(unreachable)}",
            "The text of the target says by how many mm, and which shift or turn of the tool is enough",
        ],
        [
            "Solutions, but none allowed",
            "Joint limits too tight, wrong, or with the wrong sign",
            f"Every branch in every turn that the limits allow. Refused by limits alone: {_names(limited)}",
            "Compare the limits with the manual (validation page); turn the tool or move the part as the target says",
        ],
        [
            "Solver stalls or jumps near one pose",
            "A singularity: joints can turn with the tool at rest",
            f"The continuum of solutions is computed in explicit form. Found at: {_names(free)}",
            "Keep the joints near the reference, pass in joint space, or bend the path around the pose",
        ],
        [
            "Result depends on the start guess",
            "Iteration from a poor guess ends in another branch or in none",
            f"The closed form needs no guess. Solved by iteration instead, from many starts: {_names(iterated)}",
            "Start near the branch wanted, allow restarts, and check limits inside the iteration",
        ],
        [
            "Sudden wrist flip between two targets",
            "The solver takes the nearest branch target by target",
            _greed(summary["sequence"]),
            "Choose the branches of a sequence as a whole",
        ],
    ]


def _names(names: list[str]) -> str:
    return ", ".join(names) if names else "no target"


def _greed(sequence: dict[str, Any] | None) -> str:
    if sequence is None:
        return "Fewer than two targets can be reached, so there is no sequence"
    more = sequence["greedy_cost"] - sequence["cost"]
    unit = sequence["unit"]
    return f"All targets in order: {sequence['cost']:.3g} {unit} as a whole, greedily {more:.3g} {unit} more"
