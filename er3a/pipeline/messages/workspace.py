"""What only the workspace stage's page says: names of figures, words for codes, and why capability is missing."""

from __future__ import annotations

from er3a.pipeline.messages import workspace_verdict as _verdict  # noqa: F401
from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import say, sentence
from er3a.pipeline.stages.workspace.model import NeedsClosedForm

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


@say.register
def _(found: NeedsClosedForm) -> str:
    return sentence(found.code, "it needs the closed-form inverse, and {lacks}", lacks=say(found.lacks))
