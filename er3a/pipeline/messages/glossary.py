"""The terms that pages explain where they stand, as ``docs/glossary.md`` has them."""

from __future__ import annotations

from er3a.pipeline.messages.language import N_, tr

GLOSSARY = {
    N_("branch"): N_("one choice of shoulder, elbow and wrist among the joint angles that bring the tool to a pose"),
    N_("self-motion"): N_("a continuum of solutions: joints that move while the tool stays on its target"),
    N_("arm angle"): N_("where the elbow of an arm with spherical shoulder and wrist is on its circle"),
    N_("cuspidal"): N_("of an arm that can change between solutions of a pose without passing a singularity"),
    N_("manipulability"): N_(
        "the product of the Jacobian's singular values, lengths divided by the wrist's reach; 0 at a singularity"
    ),
    N_("condition number"): N_(
        "the Jacobian's largest singular value divided by its smallest; without bound at a singularity"
    ),
    N_("characteristic length"): N_(
        "by which the Jacobian's linear rows are divided, so that its singular values have no unit"
    ),
    N_("wrist centre"): N_("the point in which the last three axes meet"),
    N_("rank loss"): N_("where axes become dependent, so that the tool can't move in some direction"),
    N_("admissible"): N_("within the joint limits and free of collisions"),
    N_("singular segment"): N_("the part of a path where joint speeds grow without bound or beyond the joints' limits"),
    N_("avoidance strategy"): N_(
        "what can be done about a path's singular segment: slow down, another branch, a via point, damped least "
        "squares, a joint detour, stop"
    ),
    N_("most likely fault"): N_("the table entry whose correction explains the differences best"),
    N_("authoritative"): N_("of a source: official, CAD or exported; a verdict rests on such sources alone"),
    N_("settled"): N_(
        "of a table entry: what independent documents leave open for it moves the tool by less than the tolerance"
    ),
    N_("claim"): N_("what an article says; shown, but no verdict rests on it"),
    N_("margin"): N_("how far something is from a limit, in its unit"),
    N_("capability"): N_("what the tool can do at a place: share of directions, solutions, dexterity"),
    N_("void"): N_("a region that the tool point can't reach: enclosed, or an open pocket"),
    N_("undecided"): N_("what the bounds between two solved poses can't decide; never called safe"),
    N_("allowed collision matrix"): N_(
        "which pairs of bodies are checked for collisions: pairs that never collide are proven so, adjacent "
        "ones touch at their joint only; all others are checked"
    ),
    N_("penetration tolerance"): N_(
        "the depth of overlap below which a contact between checked points may go unnoticed"
    ),
    N_("acceleration time"): N_("the time in which each joint is taken to reach its greatest speed"),
    N_("hand-eye calibration"): N_("where a camera is: on the flange (eye-in-hand) or in the base (eye-to-hand)"),
    N_("holding torque"): N_("the torque or force by which a drive keeps a joint at rest in a pose"),
    N_("RMS torque"): N_("root-mean-square over a motion, which heats the motor; compared with the rated torque"),
    N_("armature"): N_("the rotor's inertia at the joint: times the gear ratio squared"),
    N_("utilisation"): N_("a value divided by its limit, in percent"),
    N_("load diagram"): N_("how far from flange and last axis a load's centre may be, a curve for each mass"),
    N_("quasi-random"): N_("spread more evenly than chance, as Sobol' points are"),
}


def glossary() -> dict[str, str]:
    """Each term and its meaning in the page's language."""
    return {tr(term): tr(meaning) for term, meaning in GLOSSARY.items()}
