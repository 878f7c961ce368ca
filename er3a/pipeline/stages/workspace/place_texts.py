"""The page's words about places for the box."""

from __future__ import annotations

import er3a.pipeline.messages.pairs  # noqa: F401
from er3a.pipeline.messages.kinematics import branch_word
from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.say import joined, say, word
from er3a.pipeline.messages.workspace import STATUS
from er3a.pipeline.stages.workspace.model import CapabilitySummary, PlacementSummary, PlaceSummary
from er3a.pipeline.viewing.numbers import fixed


def best_text(placement: PlacementSummary) -> str:
    """Where to put the box: the first place that is proven, else the first; what there is none of."""
    if not placement.places:
        return tr(
            "No position for a box of {box} mm was found.",
            box=" × ".join(fixed(value, 0) for value in placement.task.box_mm),
        )
    ranked = list(enumerate(placement.places, start=1))
    row, place = next((each for each in ranked if each[1].status == "proven"), ranked[0])
    told = [
        tr(
            "Put the box, {along_x} mm along x and {along_y} mm along y, with its centre at ({centre}) mm: number "
            "{row} of the best positions.",
            along_x=fixed(1000 * place.size_m[0], 0),
            along_y=fixed(1000 * place.size_m[1], 0),
            centre=", ".join(fixed(1000 * value, 0) for value in place.centre_m),
            row=row,
        ),
        tr("The whole task is proven to be reached there; collisions are judged at samples.")
        if place.status == "proven"
        else tr("The whole task is reached there, judged at samples."),
        tr("It can be moved by {room} mm, one direction at a time.", room=_room(place)) if _movable(place) else "",
        _nearest_limit(place),
        _nearest_bodies(place),
        tr("The box itself does not count as an obstacle."),
    ]
    return joined(told, " ")


def _nearest_limit(place: PlaceSummary) -> str:
    if place.limit_margin_deg is None:
        return ""
    margin = fixed(place.limit_margin_deg, 1)
    if place.limit_joint is None:
        return tr("Joints come within {margin} deg of their limits.", margin=margin)
    return tr("The joint nearest to its limit is J{joint}: {margin} deg.", joint=place.limit_joint, margin=margin)


def _nearest_bodies(place: PlaceSummary) -> str:
    if place.clearance_mm is None or place.clearance_pair is None:
        return ""
    pair, far = say(place.clearance_pair), fixed(place.clearance_mm, 0)
    return tr("The least clearance is {far} mm, between {pair}.", pair=pair, far=far)


def _movable(place: PlaceSummary) -> bool:
    return any((*place.room_down_m, *place.room_up_m))


def _room(place: PlaceSummary) -> str:
    """How far the box can be moved, such as ``x ±25, y -50 to 0``, mm."""
    if not _movable(place):
        return fixed(0, 0)
    parts = []
    for axis, down, up in zip("xyz", place.room_down_m, place.room_up_m):
        if down == up:
            parts.append(f"{axis} {'±' if up else ''}{fixed(1000 * up, 0)}")
        elif down or up:
            parts.append(
                tr("{axis} {least} to {most}", axis=axis, least=fixed(-1000 * down, 0), most=fixed(1000 * up, 0))
            )
    return ", ".join(parts)


def place_row(row: int, place: PlaceSummary, capability: CapabilitySummary) -> list[str]:
    if place.branch is None and capability.arm_angles > 1:
        branch = tr("with joints {joints} at several values", joints=numbers(capability.held_joints))
        branch = branch if capability.held_joints else tr("at several arm angles")
    elif place.branch is None:
        branch = tr("changes within the box") if capability.named_branches else tr("not told: branches have no names")
    elif place.status == place.branch_status:
        branch = branch_word(place.branch)
    else:
        branch = tr("{branch} (by samples)", branch=branch_word(place.branch))
    return [
        str(row),
        ", ".join(fixed(1000 * value, 0) for value in place.centre_m),
        " × ".join(fixed(1000 * value, 0) for value in place.size_m),
        word("workspace.status", STATUS, place.status),
        branch,
        fixed(100 * place.manipulability_ratio, 1),
        fixed(place.limit_margin_deg, 1) + (f" (J{place.limit_joint})" if place.limit_joint is not None else ""),
        fixed(place.clearance_mm, 0) + (f" ({say(place.clearance_pair)})" if place.clearance_pair is not None else ""),
        _room(place),
    ]


def numbers(joints: tuple[int, ...]) -> str:
    return ", ".join(str(joint) for joint in joints)
