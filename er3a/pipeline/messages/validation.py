"""What only the validation page says: names of key figures, and why something is not judged."""

from __future__ import annotations

import er3a.pipeline.messages.kinematics
import er3a.pipeline.messages.validation_verdict  # noqa: F401
from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.references import GROUP_WORDS, MISSING_WORDS
from er3a.pipeline.messages.say import say, texts, word
from er3a.pipeline.stages.validation.model import (
    NamedPose,
    WholeGroup,
)

FIGURES = {
    "independent_checks": N_("Independent checks passed"),
    "consistency_checks": N_("Consistency checks passed"),
    "zero_pose_flange_error": N_("Zero pose: flange off by"),
    "farthest_axis": N_("Joint axes: largest distance"),
    "most_tilted_axis": N_("Joint axes: largest angle"),
    "worst_drawing_label": N_("Workspace drawing: worst label off by"),
    "wrist_centre_reach": N_("Wrist centre: reach from axis 1"),
    "flange_reach": N_("Flange: reach from axis 1"),
    "round_trip_joint_error": N_("Round trips: worst joint error"),
}
GRADES = {
    "official": N_("the manufacturer's own document"),
    "measured": N_("measured on the arm"),
    "cad": N_("measured on a CAD model that carries the model's name"),
    "export": N_("a URDF exported from CAD"),
    "claim": N_("an article's text"),
    "inferred": N_("inferred, not stated"),
}
GRADE_NAMES = {
    "official": N_("official"),
    "measured": N_("measured"),
    "cad": N_("cad"),
    "export": N_("export"),
    "claim": N_("claim"),
    "inferred": N_("inferred"),
}
CONVENTIONS = {"standard": N_("standard"), "modified": N_("modified")}
GROUPS = GROUP_WORDS | {"table_sanity": N_("table sanity"), "round_trips": N_("round trips")}


TEXTS = texts(
    {
        "not_in_robot_file": "the robot's file gives no value",
        "source_gives_none": "the source gives none",
        "set_has_no_data": "{reference_set} has no data",
        "in_no_set": "no reference set gives it",
        "numbers_missing": "numbers are missing",
        "no_closed_form": "no closed-form inverse, because {missing}",
        "near_singular_left_out": (
            "{judged} of {poses} random poses; the others lie within {wrist_deg:g} deg (wrist, elbow) or "
            "{shoulder_mm:g} mm (shoulder) of a singularity, where joints follow from a pose less exactly"
        ),
    }
)


@say.register
def _(found: NamedPose) -> str:
    return found.name


@say.register
def _(found: WholeGroup) -> str:
    return word(found.code, MISSING_WORDS, found.group)
