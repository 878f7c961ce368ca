"""Sentences about which joint solution is taken, and the names of the rules."""

from __future__ import annotations

import er3a.pipeline.messages.pairs  # noqa: F401
from er3a.kinematics.solutions import SideUnsolved, Unsolved
from er3a.pipeline.messages.kinematics import SIDES, branch_word
from er3a.pipeline.messages.language import N_, as_text
from er3a.pipeline.messages.say import joined, listed, say, say_as, sentence, texts, word
from er3a.selection.nearest import (
    AllOutsideLimits,
    LowerBranchNumber,
    MovesLess,
    MovesLessTogether,
    NoSolution,
    OtherBranch,
)
from er3a.selection.select import RULES, BestByRules, Measure, Placed

RULE_NAMES = {
    "nearest": N_("nearest"),
    "weighted": N_("weighted"),
    "time": N_("time"),
    "manipulability": N_("manipulability"),
    "limits": N_("limits"),
    "clearance": N_("clearance"),
    "mix": N_("mix"),
}
RULE_TITLES = {
    "nearest": N_("smallest maximum joint motion"),
    "weighted": N_("least joint moves, weighted by how far each joint swings the tool"),
    "time": N_("least time at the joint speeds"),
    "manipulability": N_("farthest from singularities (manipulability)"),
    "limits": N_("farthest from the joint limits"),
    "clearance": N_("farthest from obstacles and from itself"),
}


TEXTS = texts(
    {
        "greatest_move": "greatest joint move {angle_deg:.1f} deg (J{joint})",
        "only_admissible": "{move}; the only admissible solution",
        "joint_turned": "J{joint} turned by {turn_deg:+d} deg",
        "other_turns": "the same branch, {joints:, }",
        "other_free_joint": "the same branch, its free joint at another angle",
        "all_collide": "all {count} solutions within the limits collide: {overlap}",
        "moves_less": "{move}, {less_deg:.3g} deg less than {other}",
        "moves_less_together": "{move}, as with {other}; all joints taken together move {less_deg:.3g} deg less",
        "lower_branch_number": "{move}; {other} is just as near, and the lower branch number decides",
        "next_best": "the next best ({branch})",
        "no_solution": "out of reach: {fault}",
        "all_outside_limits#several": (
            "all {count} solutions leave the limits; the nearest to them is {branch}: {reason}"
        ),
        "all_outside_limits#one": "the only solution leaves them: {branch}: {reason}",
        "placed": "place {place}: {measures}",
        "best_by_rules#ranked": "{measures}; the next best has {next_best}",
        "best_by_rules#only": "{measures}; the only admissible solution",
    }
)


@say.register
def _(found: MovesLess) -> str:
    return say_as(found, other=_next_best(found))


@say.register
def _(found: MovesLessTogether) -> str:
    return say_as(found, other=_next_best(found))


@say.register
def _(found: LowerBranchNumber) -> str:
    return say_as(found, other=_next_best(found))


def _next_best(found: MovesLess | MovesLessTogether | LowerBranchNumber) -> str:
    return sentence("next_best", branch=say(found.next_best))


@say.register
def _(found: OtherBranch) -> str:
    return branch_word(found.label, found.branch)


@say.register
def _(found: NoSolution) -> str:
    if len(found.unsolved) == 1:
        return say(found.unsolved[0])
    faults = list(dict.fromkeys(say(part.why) for part in found.unsolved))
    fault = faults[0] if len(faults) == 1 else joined(map(_of_side, found.unsolved))
    return say_as(found, fault=fault)


def _of_side(found: Unsolved) -> str:
    side = word("side", SIDES, found.side) if isinstance(found, SideUnsolved) else ""
    return joined((side, say(found.why)), ", ")


@say.register
def _(found: AllOutsideLimits) -> str:
    label, reason = branch_word(found.label, found.branch), say(found.exceeded)
    if found.count == 1:
        return say_as(found, "one", branch=label, reason=reason)
    return say_as(found, "several", branch=label, reason=reason)


@say.register
def _(found: Measure) -> str:
    return f"{RULE_NAMES[found.rule]} {as_text(found.value, '.3g')} {RULES[found.rule].unit}".removesuffix(" 1")


@say.register
def _(found: Placed) -> str:
    measures = joined(listed(found.measures), ", ")
    return say_as(found, measures=measures)


@say.register
def _(found: BestByRules) -> str:
    measures = joined(listed(found.measures), ", ")
    if not found.next_best:
        return say_as(found, "only", measures=measures)
    next_best = joined(listed(found.next_best), ", ")
    return say_as(found, "ranked", measures=measures, next_best=next_best)
