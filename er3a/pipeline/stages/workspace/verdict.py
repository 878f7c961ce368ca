"""What the voids say about the model, in one sentence."""

from __future__ import annotations

from typing import Any

from er3a.pipeline.messages.language import N_, joined, said
from er3a.pipeline.results import Verdict
from er3a.workspace.hull import Hull
from er3a.workspace.sampled_voids import UNSEEN_SHARE

PROVEN = "proven empty"


def judge(hull: Hull, voids: list[dict[str, Any]], cells: dict[str, int], unseen: float, proof: bool) -> Verdict:
    """The stage's verdict.

    An enclosed void about the shoulder is what every arm leaves that can't fold onto itself. Any other one is a hole
    where none is expected, which points to a wrong limit or direction of joints 2 or 3.

    Parameters
    ----------
    voids : the summary's records; cells : numbers of cells; unseen : cells that more samples would touch
    proof : whether the arm's build allowed a proof
    """
    if hull.volume == 0:
        text = N_("The tool point moves on a plane, a line or not at all, so there is no volume to speak of.")
        return Verdict("caution", "workspace.flat", text)
    if not proof and unseen > UNSEEN_SHARE * cells["touched"]:
        share = 100 * unseen / (unseen + cells["touched"])
        text = said(
            "Too few samples for cells this small: about {share:.0f} % of the reachable cells were not touched yet, "
            "so nothing can be said about voids.",
            share=share,
        )
        return Verdict("caution", "workspace.undersampled", text, {"unseen_percent": share})
    enclosed = [void for void in voids if void["kind"] == "enclosed"]
    elsewhere = [void for void in enclosed if not void["holds_shoulder"]]
    astray = [void for void in elsewhere if void["status"] == PROVEN]
    if astray:
        return _about(
            astray[0],
            "caution",
            "workspace.void_unexpected",
            N_("An enclosed void of {litres:.3g} L lies at ({x}, {y}, {z}) mm, away from the shoulder, proven empty."),
            _advice(astray[0]["cause"]),
        )
    if elsewhere:
        return _about(
            elsewhere[0],
            "caution",
            "workspace.void_uncertain",
            N_(
                "An enclosed void of {litres:.3g} L may lie at ({x}, {y}, {z}) mm, away from the shoulder; there is no "
                "proof, and the samples can't tell."
            ),
        )
    if enclosed:
        return _about(
            enclosed[0],
            "pass",
            "workspace.void_at_shoulder",
            N_(
                "An enclosed void of {litres:.3g} L surrounds the arm's own shoulder, where it can't fold to; none "
                "elsewhere points to a wrong joint range."
            ),
        )
    if not proof:
        text = N_("The samples leave no enclosed void inside the hull; no proof.")
        return Verdict("pass", "workspace.no_void", text)
    return Verdict("pass", "workspace.no_void", N_("The workspace holds no enclosed void."))


def _advice(cause: str) -> str:
    """What to check, given a void's cause as :func:`er3a.workspace.causes.describe` words it."""
    if cause.startswith(("vanishes", "shrinks")):
        return said("It {cause}: check the limits, the zero and the direction of joints 2 and 3.", cause=cause)
    return said(
        "It has this cause: {cause}: check the limits, the zero and the direction of joints 2 and 3.", cause=cause
    )


def _about(void: dict[str, Any], status: str, code: str, finding: str, advice: str = "") -> Verdict:
    volume = void["volume_m3"]
    litres = 1000 * (volume["lower"] or volume["upper"])
    x, y, z = (1000 * value for value in void["centroid_m"])
    shown = {key: str(round(value)).replace("-", "−") for key, value in (("x", x), ("y", y), ("z", z))}
    params = {"litres": litres, "x_mm": x, "y_mm": y, "z_mm": z}
    return Verdict(status, code, joined([said(finding, litres=litres, **shown), advice], " "), params)
