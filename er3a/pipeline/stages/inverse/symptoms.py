"""The usual symptoms of a failing inverse, their causes, and what this run found of each."""

from __future__ import annotations

from er3a.kinematics.solutions import Iteration
from er3a.pipeline.messages.language import tr
from er3a.pipeline.stages.inverse.model import InverseSummary, Sequence
from er3a.pipeline.viewing.numbers import number
from er3a.selection.rules import RULES

NAMED = 12  # targets that a cell names


def symptoms(summary: InverseSummary) -> list[list[str]]:
    """Rows of symptom, usual cause, what was tried here and what helps, from the summary's targets alone."""
    targets = summary.targets
    unreachable = [target.name for target in targets if not target.solutions]
    limited = [target.name for target in targets if target.solutions and not target.within_limits]
    free = [target.name for target in targets if target.families]
    iterated = [target.name for target in targets if isinstance(target.method, Iteration)]
    return [
        [
            tr("No solution anywhere"),
            tr("The target is out of reach, or given in metres or radians where mm and degrees are meant"),
            tr("Units were checked on reading. Out of reach: {own_names}", own_names=_names(unreachable)),
            tr("The text of the target says by how many mm, and which shift or turn of the tool is enough"),
        ],
        [
            tr("Solutions, but none allowed"),
            tr("Joint limits too tight, wrong, or with the wrong sign"),
            tr(
                "Every branch in every turn that the limits allow. Refused by limits alone: {own_names}",
                own_names=_names(limited),
            ),
            tr(
                "Compare the limits with the manual (validation page); turn the tool or move the part as the target "
                "says"
            ),
        ],
        [
            tr("Solver stalls or jumps near one pose"),
            tr("A singularity: joints can turn with the tool at rest"),
            tr(
                "The continuum of solutions is computed in explicit form. Found at: {own_names}", own_names=_names(free)
            ),
            tr("Keep the joints near the reference, pass in joint space, or bend the path around the pose"),
        ],
        [
            tr("Result depends on the start guess"),
            tr("Iteration from a poor guess ends in another branch or in none"),
            tr(
                "The closed form needs no guess. Solved by iteration instead, from many starts: {own_names}",
                own_names=_names(iterated),
            ),
            tr("Start near the branch wanted, allow restarts, and check limits inside the iteration"),
        ],
        [
            tr("Sudden wrist flip between two targets"),
            tr("The solver takes the nearest branch target by target"),
            _greed(summary.sequence),
            tr("Choose the branches of a sequence as a whole"),
        ],
    ]


def _names(names: list[str]) -> str:
    if len(names) > NAMED:
        return tr("{own_names} and {count} more", own_names=", ".join(names[:NAMED]), count=number(len(names) - NAMED))
    return ", ".join(names) if names else tr("no target")


def _greed(sequence: Sequence | None) -> str:
    if sequence is None:
        return tr("Fewer than two targets can be reached, so there is no sequence")
    return tr(
        "All targets in order: {cost:.3g} {unit} as a whole, greedily {more:.3g} {unit} more",
        cost=sequence.cost,
        more=sequence.greedy_cost - sequence.cost,
        unit=RULES[sequence.rule].unit,
    )
