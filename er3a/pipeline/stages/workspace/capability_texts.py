"""The page's words about what the tool can do."""

from __future__ import annotations

from typing import Any

import pandas as pd

from er3a.pipeline.messages.language import tr
from er3a.pipeline.stages.workspace.capability_figures import level_slices, placement_views, upright_slices
from er3a.pipeline.viewing.numbers import fixed, number
from er3a.pipeline.viewing.page import Picture
from er3a.robots.robot import Robot


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
            tr("Where the middle of the box can stand, from above and from the side, with the best places"),
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
            tr("Slices through axis 1: share of tool directions, ways, manipulability"),
            _slices_caption(can),
        ),
        Picture(
            level_slices(summary, cells),
            tr("Slices across axis 1: share of tool directions"),
            tr(
                "Where joint 1 is limited, the sector behind the arm loses directions first: "
                "put work that needs many tool angles in front."
            )
            if can["sectors"] > 1
            else tr("Joint 1 makes a full turn, so what counts is the distance from axis 1 and the height alone."),
        ),
    ]


def _slices_caption(can: dict[str, Any]) -> str:
    return tr(
        "A reached cell offers {mean} % of all tool directions on average, the best one {best} %, each in {ways} ways "
        "on average (of {most} at most). Plan work where all three are bright; dark rims are reached only with the arm "
        "stretched, folded or twisted.",
        mean=number(100 * can["share"]["mean"], 2),
        best=number(100 * can["share"]["best"], 3),
        ways=number(can["ways"]["mean"], 2),
        most=can["ways"]["most"],
    )


def _roll_text(can: dict[str, Any]) -> str:
    if can["roll"]["free"]:
        return tr(
            "The roll about the tool's own axis is left free: it turns joint 6 alone, so it takes no part in whether a "
            "direction is reached, nor in the number of ways."
        )
    return tr(
        "The tool stands beside the axis of joint 6, so the roll about the tool's own axis moves the wrist: {rolls} "
        "rolls are tried, and a direction counts if one of them is reached.",
        rolls=can["roll"]["per_direction"],
    )


def _core_text(can: dict[str, Any]) -> str:
    core = {key: 1000 * can["core_m3"][key] for key in ("lower", "upper", "estimate")}
    if core["upper"] == 0:
        return tr(
            "There is no dexterous core: in every part of the workspace some tool direction is proven unreachable at "
            "all its points. Work that needs the tool from every side needs a turntable."
        )
    return tr(
        "The dexterous core, where the tool can take every direction of the sphere, holds at least {lower} L and at "
        "most {upper} L: both are proven, for all points and directions in between too. By the {directions} sampled "
        "directions alone it would be {estimate} L.",
        directions=can["settings"]["directions"],
        **{key: number(litres, 2) for key, litres in core.items()},
    )


def _task_text(task: dict[str, Any]) -> str:
    box = " × ".join(number(value, 4).rstrip(".") for value in map(_whole, task["box_mm"]))
    direction = ", ".join(fixed(value, 2).removesuffix(".00") for value in task["tool_direction"])
    return tr(
        "A box of {box} mm must be served at every point with the tool's axis anywhere within {cone} deg of "
        "({direction}), joints {margin} deg within their limits. It stands level, as given or turned by 90 deg, its "
        "underside at {lowest} mm or higher, and {clear} mm or more from axis 1.",
        box=box,
        direction=direction,
        cone=fixed(task["cone_deg"], 1).removesuffix(".0"),
        margin=fixed(task["limit_margin_deg"], 1).removesuffix(".0"),
        lowest=fixed(task["lowest_mm"], 0),
        clear=fixed(task["clear_of_axis_mm"], 0),
    )


def _whole(value: float) -> float | int:
    return int(value) if value == int(value) else value


def _places_caption(placed: dict[str, Any]) -> str:
    return tr(
        "Of {fitting} positions on the lattice that pass by samples, {proven} are proven for every point and "
        "direction. Stand the box's middle on a bright spot; grey ones pass by samples only. The colour shows the best "
        "over what lies in the line of sight.",
        fitting=number(placed["fitting"]),
        proven=number(placed["fitting_proven"]),
    )


def _place_row(row: int, place: dict[str, Any]) -> list[str]:
    if place["branch"] is None:
        branch = tr("changes within the box")
    elif place["status"] == place["branch_status"]:
        branch = place["branch"]
    else:
        branch = tr("{branch} (by samples)", branch=place["branch"])
    return [
        str(row),
        ", ".join(fixed(1000 * value, 0) for value in place["centre_m"]),
        " × ".join(fixed(1000 * value, 0) for value in place["size_m"]),
        place["status"],
        branch,
        fixed(100 * place["share_of_best"], 1),
        fixed(place["room_deg"], 1),
    ]
