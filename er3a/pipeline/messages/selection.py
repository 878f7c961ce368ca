"""Sentences about which joint solution is taken, and the names of the rules."""

from __future__ import annotations

import er3a.pipeline.messages.pairs  # noqa: F401
from er3a.kinematics.solutions import SideUnsolved, Unsolved
from er3a.pipeline.messages.kinematics import SIDES, branch_word
from er3a.pipeline.messages.language import N_, as_text
from er3a.pipeline.messages.say import joined, listed, say, sentence, word
from er3a.selection.nearest import (
    AllCollide,
    AllOutsideLimits,
    GreatestMove,
    JointTurned,
    LowerBranchNumber,
    MovesLess,
    MovesLessTogether,
    NoSolution,
    OnlyAdmissible,
    OtherBranch,
    OtherFreeJoint,
    OtherTurns,
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


@say.register
def _(found: GreatestMove) -> str:
    return sentence(
        found.code, "greatest joint move {angle:.1f} deg (J{joint})", angle=found.angle_deg, joint=found.joint
    )


@say.register
def _(found: OnlyAdmissible) -> str:
    return sentence(found.code, "{move}; the only admissible solution", move=say(found.move))


@say.register
def _(found: MovesLess) -> str:
    return sentence(
        found.code,
        "{move}, {angle:.3g} deg less than {other}",
        move=say(found.move),
        angle=found.less_deg,
        other=_next_best(found),
    )


@say.register
def _(found: MovesLessTogether) -> str:
    return sentence(
        found.code,
        "{move}, as with {other}; all joints taken together move {angle:.3g} deg less",
        move=say(found.move),
        other=_next_best(found),
        angle=found.less_deg,
    )


@say.register
def _(found: LowerBranchNumber) -> str:
    return sentence(
        found.code,
        "{move}; {other} is just as near, and the lower branch number decides",
        move=say(found.move),
        other=_next_best(found),
    )


def _next_best(found: MovesLess | MovesLessTogether | LowerBranchNumber) -> str:
    return sentence("next_best", "the next best ({branch})", branch=say(found.next_best))


@say.register
def _(found: OtherBranch) -> str:
    return branch_word(found.label, found.branch)


@say.register
def _(found: JointTurned) -> str:
    return sentence(found.code, "J{joint} turned by {turn:+d} deg", joint=found.joint, turn=found.turn_deg)


@say.register
def _(found: OtherTurns) -> str:
    return sentence(found.code, "the same branch, {turned}", turned=joined(listed(found.joints), ", "))


@say.register
def _(found: OtherFreeJoint) -> str:
    return sentence(found.code, "the same branch, its free joint at another angle")


@say.register
def _(found: NoSolution) -> str:
    if len(found.unsolved) == 1:
        return say(found.unsolved[0])
    faults = list(dict.fromkeys(say(part.why) for part in found.unsolved))
    fault = faults[0] if len(faults) == 1 else joined(map(_of_side, found.unsolved))
    return sentence(found.code, "out of reach: {fault}", fault=fault)


def _of_side(found: Unsolved) -> str:
    side = word("side", SIDES, found.side) if isinstance(found, SideUnsolved) else ""
    return joined((side, say(found.why)), ", ")


@say.register
def _(found: AllOutsideLimits) -> str:
    label, reason = branch_word(found.label, found.branch), say(found.exceeded)
    if found.count == 1:
        return sentence(found.code, "the only solution leaves them: {branch}: {reason}", branch=label, reason=reason)
    return sentence(
        found.code,
        "all {count} solutions leave the limits; the nearest to them is {branch}: {reason}",
        count=found.count,
        branch=label,
        reason=reason,
    )


@say.register
def _(found: AllCollide) -> str:
    return sentence(
        found.code,
        "all {count} solutions within the limits collide: {reason}",
        count=found.count,
        reason=say(found.overlap),
    )


@say.register
def _(found: Measure) -> str:
    rule = word("rule", RULE_NAMES, found.rule)
    return f"{rule} {as_text(found.value, '.3g')} {RULES[found.rule].unit}".removesuffix(" 1")


@say.register
def _(found: Placed) -> str:
    measures = joined(listed(found.measures), ", ")
    return sentence(found.code, "place {place}: {measures}", place=found.place, measures=measures)


@say.register
def _(found: BestByRules) -> str:
    measures = joined(listed(found.measures), ", ")
    if not found.next_best:
        return sentence(found.code, "{measures}; the only admissible solution", measures=measures)
    next_best = joined(listed(found.next_best), ", ")
    return sentence(found.code, "{measures}; the next best has {next_best}", measures=measures, next_best=next_best)
