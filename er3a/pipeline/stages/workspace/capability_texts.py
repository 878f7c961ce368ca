"""The page's words about what the tool can do."""

from __future__ import annotations

from typing import Any

import numpy as np

from er3a.collision.scene import Scene
from er3a.geometry.transforms import rpy_along
from er3a.pipeline.messages.language import tr
from er3a.pipeline.messages.say import joined, say
from er3a.pipeline.stages.workspace.capability_figures import (
    asked_ratio,
    clear_percent,
    level_slices,
    placement_views,
    upright_slices,
)
from er3a.pipeline.stages.workspace.model import (
    CapabilityMissing,
    CapabilitySummary,
    ClearSummary,
    Placement,
    PlacementSummary,
    TaskSummary,
    WorkspaceResults,
)
from er3a.pipeline.stages.workspace.place_texts import best_text, numbers, place_row
from er3a.pipeline.viewing.numbers import fixed, number
from er3a.pipeline.viewing.page import Picture
from er3a.robots.robot import Robot


def capability_context(robot: Robot, results: WorkspaceResults, scene: Scene | None = None) -> dict[str, Any]:
    """What the template include ``capability.html.j2`` needs."""
    capability, placement = results.summary.capability, results.summary.placement
    if isinstance(capability, CapabilityMissing) or placement is None:
        return {"missing": say(capability)}
    return {
        "missing": "",
        "asked_text": _asked_text(capability),
        "capability_pictures": _pictures(robot, results, capability) if len(results.capability) else [],
        "core_text": _core_text(capability),
        "collisions_text": tr("Reachability and dexterous workspace ignore collisions.")
        if capability.core_m3
        else tr("Reachability ignores collisions."),
        "task_text": _task_text(placement.task, capability),
    } | _placement_context(robot, results, capability, placement, scene)


def _placement_context(
    robot: Robot, results: WorkspaceResults, capability: CapabilitySummary, placement: Placement, scene: Scene | None
) -> dict[str, Any]:
    if not isinstance(placement, PlacementSummary):
        return {"nowhere": say(placement), "best_text": ""}
    rows = [place_row(n, place, capability) for n, place in enumerate(placement.places, start=1)]
    return {
        "nowhere": "",
        "placing_scene": placement.scene,
        "try_text": _try_text(robot, placement.task) if capability.asked == "directions" else "",
        "best_text": best_text(placement),
        "points_serving": placement.points_serving,
        "place_rows": rows,
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
            tr("Slices across the slide of joint 1: reachability, IK solutions, manipulability")
            if capability.bar_m
            else tr("Slices through axis 1: reachability, IK solutions, manipulability"),
            _slices_caption(capability),
        ),
        Picture(
            level_slices(
                capability,
                results.capability,
                100.0 * results.capability.reachability.astype(float),
                asked_ratio(capability),
            ),
            tr("Slices along the slide of joint 1: reachability")
            if capability.bar_m
            else tr("Slices across axis 1: reachability"),
            _level_caption(capability),
        ),
        Picture(
            level_slices(
                capability,
                results.capability,
                clear_percent(results.capability),
                tr("reached poses held without collision (%)"),
            ),
            tr("Slices along the slide of joint 1: reached poses that can be held without collision")
            if capability.bar_m
            else tr("Slices across axis 1: reached poses that can be held without collision"),
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


def _level_caption(capability: CapabilitySummary) -> str:
    if capability.bar_m:
        return tr("The arm can do the same everywhere along the slide, up to its ends.")
    if capability.sectors == 1:
        return tr("Joint 1 makes a full turn, so what counts is the distance from axis 1 and the height alone.")
    if capability.asked == "directions":
        return tr(
            "Where joint 1 is limited, the sector behind the arm loses directions first: "
            "put work that needs many tool angles in front."
        )
    return tr("Joint 1 is limited: blank sectors are out of its reach.")


def _slices_caption(capability: CapabilitySummary) -> str:
    overall = capability.overall
    numbers = {
        "mean": number(100 * overall.mean_reachability, 2),
        "best": number(100 * overall.best_reachability, 3),
        "solutions": number(overall.mean_solutions, 2),
        "most": overall.most_solutions,
    }
    first = {
        "directions": tr(
            "A reached cell offers {mean} % of all tool directions on average, the best one {best} %, each with "
            "{solutions} IK solutions on average (of {most} at most).",
            **numbers,
        ),
        "tilts": tr(
            "A reached cell offers {mean} % of all tilts on average, the best one {best} %, each with {solutions} IK "
            "solutions on average (of {most} at most).",
            **numbers,
        ),
        "turns": tr(
            "A reached cell offers {mean} % of all turns on average, the best one {best} %, each with {solutions} IK "
            "solutions on average (of {most} at most).",
            **numbers,
        ),
        "points": tr(
            "A reached cell has {solutions} IK solutions on average (of {most} at most).",
            **numbers,
        ),
    }[capability.asked]
    if capability.asked == "points":
        return first
    return joined(
        [
            first,
            tr("Plan work where all three are bright; dark rims are reached only with the arm stretched, folded or "
               "twisted."),
        ],
        " ",
    )  # fmt: skip


def _asked_text(capability: CapabilitySummary) -> str:
    """What was asked of the cells, and how."""
    count = capability.directions
    asked = {
        "directions": tr(
            "At each cell's centre {directions} tool directions, spread evenly over the sphere, were tried; the share "
            "that is reached is its reachability index (Zacharias, Borst and Hirzinger 2007).",
            directions=count,
        ),
        "tilts": tr(
            "This arm can't point its tool in every direction: all its tilting joints turn about one direction, so the "
            "tool stays within a plane that joint 1 turns. At each cell's centre {directions} tilts, spread evenly "
            "over the full turn in that plane, were tried; reachability is the share that is reached.",
            directions=count,
        ),
        "turns": tr(
            "This arm can't tilt its tool, but turn it about the direction of its axes. At each cell's centre "
            "{directions} rotations, spread evenly, were tried; reachability is the share that is reached.",
            directions=count,
        ),
        "points": tr(
            "This arm has no joints to spare for the tool's orientation, which follows from the position. The "
            "centre of each cell was tried as a point alone: it is reached or not."
        ),
    }[capability.asked]
    return joined([asked, _roll_text(capability), _effort_text(capability)], " ")


def _effort_text(capability: CapabilitySummary) -> str:
    if not capability.coarse:
        return ""
    return tr(
        "The inverse of this arm takes long, so cells are {cell} mm wide and directions fewer than the study says.",
        cell=fixed(1000 * capability.cell_m, 0),
    )


def _roll_text(capability: CapabilitySummary) -> str:
    if capability.asked != "directions":
        return ""
    rolls = tr("left free") if capability.roll.free else capability.roll.per_direction
    if capability.held_joints:
        return tr(
            "Joints that the pose leaves open ({joints}) were tried at {values} values, and a direction counts if it "
            "is reached at one of them: more may be reached between them. Solutions are those of one value. Rolls "
            "about the tool's own axis: {rolls}.",
            joints=numbers(capability.held_joints),
            values=capability.arm_angles,
            rolls=rolls,
        )
    if capability.arm_angles > 1:
        return tr(
            "Each pose was tried at {angles} arm angles, and a direction counts if it is reached at one of them: more "
            "may be reached between them. Solutions are those of one arm angle. Rolls about the tool's own axis: "
            "{rolls}.",
            angles=capability.arm_angles,
            rolls=rolls,
        )
    if capability.roll.free and not capability.roll.last_joint:
        return tr("The roll about the tool's own axis is left out: with five joints the arm can't choose it.")
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
        if capability.asked != "directions":
            return ""
        return tr(
            "The dexterous workspace is bounded only for arms of six revolute joints with a spherical wrist, none of "
            "them coupled."
        )
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


def _task_text(task: TaskSummary, capability: CapabilitySummary) -> str:
    box = " × ".join(number(value, 4).rstrip(".") for value in map(_whole, task.box_mm))
    direction = ", ".join(fixed(value, 2).removesuffix(".00") for value in task.tool_direction)
    shown = {
        "box": box,
        "direction": direction,
        "cone": fixed(task.cone_deg, 1).removesuffix(".0"),
        "margin": fixed(task.limit_margin_deg, 1).removesuffix(".0"),
    }
    served = {
        "directions": tr(
            "Task: a box of {box} mm in which the tool reaches every point, with its axis anywhere within {cone} deg "
            "of ({direction}) and the joints at least {margin} deg from their limits.",
            **shown,
        ),
        "tilts": tr(
            "Task: a box of {box} mm in which the tool reaches every point at every tilt within {cone} deg of "
            "({direction}) that the arm's plane allows, with the joints at least {margin} deg from their limits.",
            **shown,
        ),
        "turns": tr(
            "Task: a box of {box} mm in which the tool reaches every point at some rotation about its axis; the axis "
            "must lie within {cone} deg of ({direction}), where it always points. Revolute joints stay at least "
            "{margin} deg from their limits.",
            **shown,
        ),
        "points": tr(
            "Task: a box of {box} mm in which the tool reaches every point in any orientation. Revolute joints stay at "
            "least {margin} deg from their limits.",
            **shown,
        ),
    }[capability.asked]
    lowest, clear = fixed(task.lowest_mm, 0), fixed(task.clear_of_axis_mm, 0)
    if capability.bar_m:
        stands = tr(
            "The box is level, as given or rotated by 90 deg, with its underside at {lowest} mm or higher.",
            lowest=lowest,
        )
    else:
        stands = tr(
            "The box is level, as given or rotated by 90 deg, with its underside at {lowest} mm or higher, at least "
            "{clear} mm from axis 1.",
            lowest=lowest,
            clear=clear,
        )
    return joined([served, stands], " ")


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


def _whole(value: float) -> float | int:
    return int(value) if value == int(value) else value


def _places_caption(placement: PlacementSummary, provable: bool) -> str:
    if not provable:
        return tr(
            "{fitting} grid positions pass by samples; proofs exist only for arms of six revolute joints with a "
            "spherical wrist. Put the box centre well inside a bright region.",
            fitting=number(placement.fitting),
        )
    return tr(
        "Of {fitting} grid positions that pass by samples, {proven} are proven for every point and direction. "
        "Put the box centre on a bright spot; grey spots pass by samples only. The colour shows the best value "
        "along the line of sight.",
        fitting=number(placement.fitting),
        proven=number(placement.fitting_proven),
    )
