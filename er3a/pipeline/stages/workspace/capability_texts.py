"""The page's words about what the tool can do."""

from __future__ import annotations

from typing import Any

import numpy as np

from er3a.collision.scene import Scene
from er3a.geometry.transforms import rpy_along
from er3a.pipeline.messages.kinematics import branch_word
from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.say import say, word
from er3a.pipeline.messages.workspace import STATUS
from er3a.pipeline.stages.workspace.capability_figures import (
    clear_percent,
    level_slices,
    placement_views,
    upright_slices,
)
from er3a.pipeline.stages.workspace.model import (
    CapabilitySummary,
    ClearSummary,
    NeedsClosedForm,
    PlacementSummary,
    PlaceSummary,
    TaskSummary,
    WorkspaceResults,
)
from er3a.pipeline.viewing.numbers import fixed, number
from er3a.pipeline.viewing.page import Picture
from er3a.robots.robot import Robot


def capability_context(robot: Robot, results: WorkspaceResults, scene: Scene | None = None) -> dict[str, Any]:
    """What the template include ``capability.html.j2`` needs."""
    capability, placement = results.summary.capability, results.summary.placement
    if isinstance(capability, NeedsClosedForm) or placement is None:
        return {"missing": say(capability)}
    return {
        "missing": "",
        "directions": capability.directions,
        "capability_pictures": _pictures(robot, results, capability) if len(results.capability) else [],
        "core_text": _core_text(capability),
        "roll_text": _roll_text(capability),
        "task_text": _task_text(placement.task),
        "try_text": _try_text(robot, placement.task),
        "best_text": _best_text(placement),
        "points_serving": placement.points_serving,
        "place_rows": [
            _place_row(n, place, capability.arm_angles) for n, place in enumerate(placement.places, start=1)
        ],
        "place_picture": Picture(
            placement_views(robot, capability, placement, results.places, scene),
            tr("Possible positions of the box centre, from above and from the side, with the best ones"),
            _places_caption(placement, capability.core_m3 is not None),
        )
        if len(results.places)
        else None,
    }


def _pictures(robot: Robot, results: WorkspaceResults, capability: CapabilitySummary) -> list[Picture]:
    return [
        Picture(
            upright_slices(robot, capability, results.capability),
            tr("Slices through axis 1: reachability, IK solutions, manipulability"),
            _slices_caption(capability),
        ),
        Picture(
            level_slices(
                capability,
                results.capability,
                100.0 * results.capability.reachability.astype(float),
                tr("tool directions reached (%)"),
            ),
            tr("Slices across axis 1: reachability"),
            tr(
                "Where joint 1 is limited, the sector behind the arm loses directions first: "
                "put work that needs many tool angles in front."
            )
            if capability.sectors > 1
            else tr("Joint 1 makes a full turn, so what counts is the distance from axis 1 and the height alone."),
        ),
        Picture(
            level_slices(
                capability,
                results.capability,
                clear_percent(results.capability),
                tr("reached poses held without collision (%)"),
            ),
            tr("Slices across axis 1: reached poses that can be held without collision"),
            _clear_caption(capability.clear),
        ),
    ]


def _clear_caption(clear: ClearSummary) -> str:
    if clear.scene is None:
        what = tr("An estimate: {share} % of the poses reached can be held without the arm touching itself.",
                  share=number(100 * clear.share, 2))  # fmt: skip
    else:
        what = tr(
            "An estimate: {share} % of the poses reached can be held without touching “{scene}” or the arm itself.",
            share=number(100 * clear.share, 2),
            scene=clear.scene,
        )
    tried = tr(
        "{tries} random poses were tried in each cell and sector: {reached} are reached, {clear} of them proven"
        " collision-free; in {without} cells and sectors none was found. Shares of so few tries distinguish "
        "good regions from bad ones, not single cells.",
        tries=clear.tries,
        reached=number(clear.reached),
        clear=number(clear.clear),
        without=number(clear.without),
    )
    return tr("{first} {rest}", first=what, rest=tried)


def _slices_caption(capability: CapabilitySummary) -> str:
    overall = capability.overall
    return tr(
        "A reached cell offers {mean} % of all tool directions on average, the best one {best} %, each with "
        "{solutions} IK solutions on average (of {most} at most). Plan work where all three are bright; dark rims are "
        "reached only with the arm stretched, folded or twisted.",
        mean=number(100 * overall.mean_reachability, 2),
        best=number(100 * overall.best_reachability, 3),
        solutions=number(overall.mean_solutions, 2),
        most=overall.most_solutions,
    )


def _roll_text(capability: CapabilitySummary) -> str:
    if capability.arm_angles > 1:
        return tr(
            "Each pose was tried at {angles} arm angles, and a direction counts if it is reached at one of them: more "
            "may be reached between them. Solutions are those of one arm angle. Rolls about the tool's own axis: "
            "{rolls}.",
            angles=capability.arm_angles,
            rolls=tr("left free") if capability.roll.free else capability.roll.per_direction,
        )
    if capability.roll.free:
        return tr(
            "The roll about the tool's own axis is left free: it turns joint 6 alone, so it takes no part in whether a "
            "direction is reached, nor in the number of solutions."
        )
    return tr(
        "The tool is off the axis of joint 6, so the roll about the tool's own axis moves the wrist: {rolls} "
        "rolls are tried, and a direction counts if one of them is reached.",
        rolls=capability.roll.per_direction,
    )


def _core_text(capability: CapabilitySummary) -> str:
    core = capability.core_m3
    if core is None:
        return tr("The dexterous workspace is bounded for arms with a spherical wrist only.")
    if core.upper == 0:
        return tr(
            "There is no dexterous workspace: in every part of the workspace some tool direction is proven "
            "unreachable at all points. Work that needs the tool from every side needs a turntable."
        )
    return tr(
        "The dexterous workspace, where the tool can take every direction of the sphere, is at least {lower} L "
        "and at most {upper} L; both bounds are proven for all points and directions. By the {directions} "
        "sampled directions alone it would be {estimate} L.",
        directions=capability.directions,
        lower=number(1000 * core.lower, 2),
        upper=number(1000 * core.upper, 2),
        estimate=number(1000 * core.estimate, 2),
    )


def _task_text(task: TaskSummary) -> str:
    box = " × ".join(number(value, 4).rstrip(".") for value in map(_whole, task.box_mm))
    direction = ", ".join(fixed(value, 2).removesuffix(".00") for value in task.tool_direction)
    return tr(
        "Task: a box of {box} mm in which the tool reaches every point, with its axis anywhere within {cone} "
        "deg of ({direction}) and the joints at least {margin} deg from their limits. The box is level, as "
        "given or rotated by 90 deg, with its underside at {lowest} mm or higher, at least {clear} mm from axis"
        " 1.",
        box=box,
        direction=direction,
        cone=fixed(task.cone_deg, 1).removesuffix(".0"),
        margin=fixed(task.limit_margin_deg, 1).removesuffix(".0"),
        lowest=fixed(task.lowest_mm, 0),
        clear=fixed(task.clear_of_axis_mm, 0),
    )


def _try_text(robot: Robot, task: TaskSummary) -> str:
    """How to see the arm at a place: the roll, pitch and yaw (ZYX) that point the tool along the task's direction."""
    roll, pitch, _ = np.degrees(rpy_along(np.array(task.tool_direction)))
    parts = {"roll": fixed(roll, 1).removesuffix(".0"), "pitch": fixed(pitch, 1).removesuffix(".0")}
    if np.allclose(robot.tool, np.eye(4)):
        return tr(
            "To see the arm at a position, type its centre, roll {roll}, pitch {pitch} and yaw 0 deg into the "
            "teach panel. The robot has no tool here: the centre of its flange goes there.",
            **parts,
        )
    return tr(
        "To see the arm at a position, type its centre, roll {roll}, pitch {pitch} and yaw 0 deg into the teach"
        " panel: the tool point goes there.",
        **parts,
    )


def _best_text(placement: PlacementSummary) -> str:
    """Where to put the box: the first place that is proven, else the first; what there is none of."""
    box = " × ".join(fixed(value, 0) for value in placement.task.box_mm)
    if not placement.places:
        return tr("No position for a box of {box} mm was found.", box=box)
    ranked = list(enumerate(placement.places, start=1))
    row, place = next((each for each in ranked if each[1].status == "proven"), ranked[0])
    return tr(
        "A box of {box} mm: put its centre at ({centre}) mm ({status}; number {row} of the best positions).",
        box=box,
        centre=", ".join(fixed(1000 * value, 0) for value in place.centre_m),
        status=word("workspace.status", STATUS, place.status),
        row=row,
    )


def _whole(value: float) -> float | int:
    return int(value) if value == int(value) else value


def _places_caption(placement: PlacementSummary, provable: bool) -> str:
    if not provable:
        return tr(
            "{fitting} grid positions pass by samples; proofs exist for arms with a spherical wrist only. Put "
            "the box centre well inside a bright region.",
            fitting=number(placement.fitting),
        )
    return tr(
        "Of {fitting} grid positions that pass by samples, {proven} are proven for every point and direction. "
        "Put the box centre on a bright spot; grey spots pass by samples only. The colour shows the best value "
        "along the line of sight.",
        fitting=number(placement.fitting),
        proven=number(placement.fitting_proven),
    )


def _place_row(row: int, place: PlaceSummary, arm_angles: int) -> list[str]:
    if place.branch is None:
        branch = tr("changes within the box") if arm_angles == 1 else tr("at several arm angles")
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
        fixed(place.limit_margin_deg, 1),
        fixed(place.clearance_mm, 0),
    ]
