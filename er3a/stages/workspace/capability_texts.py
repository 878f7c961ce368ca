"""The page's words about what the tool can do."""

from __future__ import annotations

from typing import Any

import pandas as pd

from er3a.robots.robot import Robot
from er3a.stages.workspace.capability_plots import level_slices, placement_views, upright_slices
from er3a.viewing.numbers import fixed, number
from er3a.viewing.page import Picture


def capability_context(robot: Robot, summary: dict[str, Any], cells: pd.DataFrame, places: pd.DataFrame):
    """What the template include ``capability.html.j2`` needs."""
    can, placed = summary["capability"], summary["placement"]
    if not can["computed"]:
        return {"can": can, "placed": placed}
    return {
        "can": can,
        "placed": placed,
        "can_pictures": _pictures(robot, summary, cells) if len(cells) else [],
        "core_text": _core_text(can),
        "roll_text": _roll_text(can),
        "task_text": _task_text(can["settings"]["placement"]),
        "place_rows": [_place_row(n, place) for n, place in enumerate(placed["places"], start=1)],
        "place_picture": Picture(
            placement_views(robot, summary, places),
            "Where the middle of the box can stand, from above and from the side, with the best places",
            _places_caption(placed),
        )
        if len(places)
        else None,
    }


def _pictures(robot: Robot, summary: dict[str, Any], cells: pd.DataFrame) -> list[Picture]:
    can = summary["capability"]
    return [
        Picture(
            upright_slices(robot, summary, cells),
            "Slices through axis 1: share of tool directions, ways, manipulability",
            _slices_caption(can),
        ),
        Picture(
            level_slices(summary, cells),
            "Slices across axis 1: share of tool directions",
            "Where joint 1 is limited, the sector behind the arm loses directions first: "
            "put work that needs many tool angles in front."
            if can["sectors"] > 1
            else "Joint 1 makes a full turn, so what counts is the distance from axis 1 and the height alone.",
        ),
    ]


def _slices_caption(can: dict[str, Any]) -> str:
    return (
        f"A reached cell offers {number(100 * can['share']['mean'], 2)} % of all tool directions on average, the best "
        f"one {number(100 * can['share']['best'], 3)} %, each in {number(can['ways']['mean'], 2)} ways on average "
        f"(of {can['ways']['most']} at most). Plan work where all three are bright; dark rims are reached only with "
        "the arm stretched, folded or twisted."
    )


def _roll_text(can: dict[str, Any]) -> str:
    if can["roll"]["free"]:
        return (
            "The roll about the tool's own axis is left free: it turns joint 6 alone, so it takes no part in whether a "
            "direction is reached, nor in the number of ways."
        )
    rolls = can["roll"]["per_direction"]
    return (
        f"The tool stands beside the axis of joint 6, so the roll about the tool's own axis moves the wrist: {rolls} "
        "rolls are tried, and a direction counts if one of them is reached."
    )


def _core_text(can: dict[str, Any]) -> str:
    core = {key: 1000 * can["core_m3"][key] for key in ("lower", "upper", "estimate")}
    if core["upper"] == 0:
        return (
            "There is no dexterous core: in every part of the workspace some tool direction is proven unreachable at "
            "all its points. Work that needs the tool from every side needs a turntable."
        )
    return (
        "The dexterous core, where the tool can take every direction of the sphere, holds at least "
        f"{number(core['lower'], 2)} L and at most {number(core['upper'], 2)} L: both are proven, for all points and "
        f"directions in between too. By the {can['settings']['directions']} sampled directions alone it would be "
        f"{number(core['estimate'], 2)} L."
    )


def _task_text(task: dict[str, Any]) -> str:
    box = " × ".join(number(value, 4).rstrip(".") for value in map(_whole, task["box_mm"]))
    direction = ", ".join(fixed(value, 2).removesuffix(".00") for value in task["tool_direction"])
    return (
        f"A box of {box} mm must be served at every point with the tool's axis anywhere within "
        f"{fixed(task['cone_deg'], 1).removesuffix('.0')} deg of ({direction}), joints "
        f"{fixed(task['limit_margin_deg'], 1).removesuffix('.0')} deg within their limits. It stands level, as given "
        f"or turned by 90 deg, its underside at {fixed(task['lowest_mm'], 0)} mm or higher, and "
        f"{fixed(task['clear_of_axis_mm'], 0)} mm or more from axis 1."
    )


def _whole(value: float) -> float | int:
    return int(value) if value == int(value) else value


def _places_caption(placed: dict[str, Any]) -> str:
    return (
        f"Of {number(placed['fitting'])} positions on the lattice that pass by samples, "
        f"{number(placed['fitting_proven'])} are proven for every point and direction. Stand the box's middle on a "
        "bright spot; grey ones pass by samples only. The colour shows the best over what lies in the line of sight."
    )


def _place_row(row: int, place: dict[str, Any]) -> list[str]:
    if place["branch"] is None:
        branch = "changes within the box"
    elif place["status"] == place["branch_status"]:
        branch = place["branch"]
    else:
        branch = f"{place['branch']} (by samples)"
    return [
        str(row),
        ", ".join(fixed(1000 * value, 0) for value in place["centre_m"]),
        " × ".join(fixed(1000 * value, 0) for value in place["size_m"]),
        place["status"],
        branch,
        fixed(100 * place["share_of_best"], 1),
        fixed(place["room_deg"], 1),
    ]
