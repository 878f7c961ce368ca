"""What pages share: captions for the report, the sentence that decides, what to know first, and the glossary."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from er3a.pipeline.language import N_, tr
from er3a.pipeline.messages.say import word

# Words of the lists in which a reader of the report chooses pages; the workflow's rules use them.
PAGE, INDEX, ALL_ROBOTS = N_("page"), N_("index"), N_("All robots")
TEACH_PANEL = N_("teach panel")
ARTICLE = N_("the article, item by item")
FOUNDATIONS: Mapping[str, str] = {
    "fail": N_("Never use this table: evidence contradicts it. Run no path, repair or program that was made by it."),
    "caution": N_("Part of this D-H table is not settled: confirm it before the arm moves."),
    "unsettled": N_(
        "No entry of this D-H table is settled by an independent document: confirm it before the arm moves."
    ),
    "no_reference": N_("This D-H table was compared with no data: confirm it before the arm moves."),
    "not_computed": N_("This D-H table was not validated: confirm it before the arm moves."),
}
GRADE_NAMES = {
    "official": N_("official"),
    "measured": N_("measured"),
    "cad": N_("cad"),
    "export": N_("export"),
    "claim": N_("claim"),
    "inferred": N_("inferred"),
}
GROUP_NAMES = {  # of a robot file
    "dh": N_("D-H table"),
    "zero": N_("zero pose and directions"),
    "limits": N_("limits"),
    "speeds": N_("joint speeds"),
    "coupling": N_("coupling"),
    "base": N_("base"),
    "flange": N_("flange"),
    "tool": N_("tool"),
    "envelopes": N_("shapes of links"),
    "inertia": N_("masses"),
    "drives": N_("drives"),
    "wrist_load": N_("wrist load"),
    "weight": N_("weight"),
}
SIDES = {"lower": N_("lower limit"), "upper": N_("upper limit")}
GLOSSARY = {
    N_("branch"): N_("one choice of shoulder, elbow and wrist among the joint angles that bring the tool to a pose"),
    N_("branch and bound"): N_(
        "a search that divides what is possible and drops what bounds exclude; not the arm's branches"
    ),
    N_("self-motion"): N_("a continuum of solutions: joints that move while the tool stays on its target"),
    N_("arm angle"): N_("where the elbow of an arm with spherical shoulder and wrist is on its circle"),
    N_("manipulability"): N_(
        "the product of the Jacobian's singular values, lengths divided by the wrist's reach (in the workspace "
        "undivided, in m³); 0 at a singularity"
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
        "what can be done about a path's singular segment: slow down, another branch, a via point, a joint detour, stop"
    ),
    N_("most likely fault"): N_("the table entry whose correction explains the differences best"),
    N_("authoritative"): N_("of a source: official, CAD or exported; a verdict rests on such sources alone"),
    N_("settled"): N_("of a table entry: independent documents give it to within the tolerance"),
    N_("but for signs"): N_(
        "of a settled table entry: keep it, unless an open entry turns out otherwise, which may change a sign or "
        "half turn here"
    ),
    N_("claim"): N_("what an article says; shown, but no verdict rests on it"),
    N_("margin"): N_("how far something is from a limit, in its unit"),
    N_("capability"): N_("what the tool can do at a place: share of directions, solutions, dexterity"),
    N_("tray"): N_(
        "the space, as of a bin or a pallet's load, that the workspace page places where the tool reaches all of it"
    ),
    N_("void"): N_("a region that the tool point can't reach: enclosed, or an open pocket"),
    N_("undecided"): N_("what the computed bounds can't decide; never called safe"),
    N_("allowed collision matrix"): N_(
        "which pairs of bodies are checked for collisions: all but those proven never to collide and neighbours at "
        "their joint"
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
    N_("quasi-random"): N_("spread more evenly than chance, as Sobol' points are"),
}


def of_study() -> str:
    """The report's first page."""
    sentences = (
        tr("Evidence on kinematic models of robots: can each table be trusted, and what can the arm do?"),
        tr(
            "Start with the index: verdicts and key figures of every robot and stage. Links between pages do not work "
            "inside this report: choose pages from the lists here."
        ),
        tr(
            "A fail is a result, not a broken run. The foot of each page lists its inputs and the command that "
            "reproduces it."
        ),
    )
    return "\n\n".join(sentences)


def of_stage(robot: str, question: str) -> str:
    """A stage's page: what it answers."""
    return tr(
        "{robot}: {question} The verdict comes first, then its figures.",
        robot=robot,
        question=tr(question),
    )


def of_teach_panel(robot: str) -> str:
    """The teach panel."""
    return tr(
        "Move {robot} by hand: joints, poses, jogging, way points, singularities, and all IK solutions.",
        robot=robot,
    )


def of_index() -> str:
    """The index."""
    return tr("What to do with each robot's model, and the verdicts and key figures behind that.")


def of_article() -> str:
    """The page on the article."""
    return tr("What the article says, step by step, and what er3a computes from its table.")


@dataclass(frozen=True)
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
