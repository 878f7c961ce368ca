"""What only the workspace stage's page says: names of figures, words for codes, and why capability is missing."""

from __future__ import annotations

from er3a.pipeline.messages import workspace_verdict as _verdict  # noqa: F401
from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import Plural, say, say_as, texts
from er3a.pipeline.stages.workspace.model import CapabilityMissing, ToolPointsElsewhere

FIGURES = {
    "greatest_reach": N_("greatest reach from axis 1"),
    "enclosed_voids_lower": N_("enclosed voids, at least"),
    "volume": N_("reached volume"),
    "volume_lower": N_("reached volume, at least"),
    "volume_upper": N_("reached volume, at most"),
    "area_lower": N_("reached area, at least"),
    "area_upper": N_("reached area, at most"),
    "hull_volume": N_("convex hull of the samples"),
    "least_reach": N_("least distance from axis 1"),
    "samples": N_("samples"),
}
VOID_STATUS = {"proven_empty": N_("proven empty"), "undersampled": N_("undersampled")}
VOID_KINDS = {"enclosed": N_("enclosed"), "open": N_("open pocket")}
STATUS = {"proven": N_("proven"), "sampled": N_("sampled")}
SWEEPS = {"joint_2": N_("joint 2"), "joint_3": N_("joint 3"), "wrist": N_("wrist")}
POINTS = {"tool_point": N_("tool point"), "wrist_centre": N_("wrist centre"), "flange": N_("flange")}


TEXTS = texts(
    {
        "workspace.pockets": Plural("count", "{count} open pocket", "{count} open pockets"),
        "workspace.voids": Plural("count", "{count} enclosed void", "{count} enclosed voids"),
        "workspace.rule": Plural(
            "count",
            "The rule that an unexpected hole points to a wrong limit or direction of joint 2 or 3 was applied: "
            "{count} enclosed void lies away from the shoulder. Relaxing one limit at a time names joint 2 or 3 "
            "in {named} of {count} cases.",
            "The rule that an unexpected hole points to a wrong limit or direction of joint 2 or 3 was applied: "
            "{count} enclosed voids lie away from the shoulder. Relaxing one limit at a time names joint 2 or 3 "
            "in {named} of {count} cases.",
        ),
        "inverse_unknown": "no method here finds all inverse solutions of this arm",
        "joint_one_shared": (
            "joint 1 is coupled with other joints or limited together with them, so that what holds at one azimuth "
            "does not follow from another"
        ),
        "orientations_unknown": (
            "with its {joints} joints the arm takes only few orientations at each point, and which these are is not "
            "known for its kind"
        ),
        "workspace.placement_too_long": (
            "Not computed: a pose takes milliseconds with this arm, and within seconds only points wider apart than "
            "the box could be asked. A larger box or a narrower cone may do."
        ),
        "workspace.tool_points_elsewhere": (
            "Nowhere: the arm can't tilt its tool, which points along ({x:.2f}, {y:.2f}, {z:.2f}) and not within the "
            "cone."
        ),
    }
)


@say.register
def _(found: CapabilityMissing) -> str:
    return say(found.lacks)


@say.register
def _(found: ToolPointsElsewhere) -> str:
    x, y, z = found.direction
    return say_as(found, x=x, y=y, z=z)
