"""What the tool can do there: tables and summary of capability, dexterous core and placement of a box."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pandas as pd

from er3a.errors import NotWristPartitionedError
from er3a.kinematics.configuration import branch_labels
from er3a.pipeline.messages.kinematics import BRANCHES, say
from er3a.pipeline.messages.language import N_, said
from er3a.pipeline.study import CapabilitySettings
from er3a.robots.robot import Robot
from er3a.workspace.capability import Capability, map_capability
from er3a.workspace.dexterous import dexterous_core
from er3a.workspace.directions import Roll, cone_directions, roll_of
from er3a.workspace.placement import MIXED, NO, Field, Places, Task, fitting_places, narrowed, survey
from er3a.workspace.placement_proof import Chosen, choose_places, proven_bricks
from er3a.workspace.proof import ring_volumes
from er3a.workspace.section_arm import section_arm, section_frame

MOST_ACROSS = 64
LISTED = 5
_CELLS = ["rho_m", "z_m", "azimuth_deg", "share", "ways", "most_ways", "manipulability_m3"]
_PLACES = ["x_m", "y_m", "z_m", "turned", "slot", "manipulability_m3", "room_deg", "proven"]


@dataclass(frozen=True)
class CanDo:
    """Results of this part: its tables ``capability`` and ``places``, and its keys of the summary."""

    tables: dict[str, pd.DataFrame]
    summary: dict[str, Any]


def can_do(robot: Robot, settings: CapabilitySettings, cell: float) -> CanDo:
    """Work out what the tool can do.

    Parameters
    ----------
    cell : m, edge of the workspace's cells; taken coarser where more than ``MOST_ACROSS`` would span the reach
    """
    try:
        arm, roll = section_arm(robot), roll_of(robot, settings.rolls)
    except NotWristPartitionedError as error:
        reason = said("it needs the closed-form inverse, and {lacks}", lacks=say(error.property_missing))
        empty = {"capability": pd.DataFrame(columns=_CELLS, dtype=float)}
        empty["places"] = pd.DataFrame(columns=_PLACES, dtype=float)
        none = {"computed": False, "reason": reason}
        return CanDo(empty, {"capability": none, "placement": none})
    cell = max(cell, 2 * (arm.upper_length + arm.forearm_length + arm.d) / MOST_ACROSS)
    cells = rings(arm.reach, arm.heights, cell)
    middles = np.stack([cells[:, :2].mean(axis=1), cells[:, 2:].mean(axis=1)], axis=1)
    capability = map_capability(robot, middles, settings.directions, roll)
    core = dexterous_core(robot, cells, settings.directions, roll, settings.proof_poses)
    R, origin = section_frame(robot)
    treated = {"free": roll.free, "per_direction": len(roll.angles)}
    summary = {
        "computed": True,
        "settings": settings.model_dump(),
        "cell_m": cell,
        "frame": {"axes": R.tolist(), "origin_m": origin.tolist()},
        "sectors": capability.share.shape[1],
        "roll": treated,
        **_overall(capability, cells),
        "core_m3": asdict(core),
    }
    placed, places = _placement(robot, settings, roll, cell, float(capability.manipulability.max()))
    return CanDo(
        {"capability": _cell_table(middles, capability), "places": places},
        {"capability": summary, "placement": placed},
    )


def rings(reach: float, heights: tuple[float, float], cell: float) -> np.ndarray:
    """Square cells (n, 4) of the section that cover everything within reach."""
    count = int(np.ceil(reach / cell)), int(np.ceil((heights[1] - heights[0]) / cell))
    rho, z = np.arange(count[0]) * cell, (heights[0] + heights[1] - count[1] * cell) / 2 + np.arange(count[1]) * cell
    rho, z = (grid.ravel() for grid in np.meshgrid(rho, z, indexing="ij"))
    return np.stack([rho, rho + cell, z, z + cell], axis=1)


def _overall(capability: Capability, cells: np.ndarray) -> dict[str, Any]:
    """Figures over all reached cells, by volume."""
    volume = np.broadcast_to(ring_volumes(cells)[:, None], capability.share.shape)
    weight = np.where(capability.share > 0, volume, 0.0)
    total = float(weight.sum())
    if total == 0:
        return {"share": {"mean": 0.0, "best": 0.0}, "ways": {"mean": 0.0, "most": 0}, "manipulability_m3": 0.0}
    return {
        "share": {"mean": float((weight * capability.share).sum()) / total, "best": float(capability.share.max())},
        "ways": {
            "mean": float((weight * capability.ways).sum()) / total,
            "most": int(capability.most_ways.max()),
        },
        "manipulability_m3": float(capability.manipulability.max()),
    }


def _cell_table(middles: np.ndarray, capability: Capability) -> pd.DataFrame:
    """Reached cells and sectors; ``azimuth_deg`` is the sector's middle, 0 for all azimuths if there is one sector."""
    cell, sector = np.nonzero(capability.share)
    return pd.DataFrame(
        {
            "rho_m": middles[cell, 0],
            "z_m": middles[cell, 1],
            "azimuth_deg": 360.0 * sector / capability.share.shape[1],
            "share": capability.share[cell, sector].astype(np.float32),
            "ways": capability.ways[cell, sector].astype(np.float32),
            "most_ways": capability.most_ways[cell, sector].astype(np.int8),
            "manipulability_m3": capability.manipulability[cell, sector].astype(np.float32),
        }
    )


def _placement(robot: Robot, settings: CapabilitySettings, roll: Roll, cell: float, agile: float):
    """Summary and table of where the box can stand.

    Parameters
    ----------
    agile : m^3, the arm's best manipulability, which shares are of
    """
    asked = settings.placement
    axis = np.array(asked.tool_direction) / np.linalg.norm(asked.tool_direction)
    task = Task(
        box=np.array(asked.box_mm) / 1000,
        axis=axis,
        half_angle=float(np.radians(asked.cone_deg)),
        lowest=asked.lowest_mm / 1000,
        clear=asked.clear_of_axis_mm / 1000,
        margin=float(np.radians(asked.limit_margin_deg)),
    )
    robot = narrowed(robot, task.margin)
    field = survey(robot, task, roll, cell)
    places = fitting_places(field, proven_bricks(robot, task, field, roll), task.box)
    chosen = choose_places(robot, task, places, roll, LISTED, settings.proof_poses)
    places.proven[[row for row, proven in zip(chosen.row, chosen.proven) if proven]] = True
    summary = {
        "computed": True,
        "spacing_m": field.spacing.tolist(),
        "directions": len(cone_directions(axis, task.half_angle)),
        "points_serving": int((field.least_any > NO).sum()),
        "fitting": len(places.slot),
        "fitting_with_one_branch": int((places.slot != MIXED).sum()),
        "fitting_proven": int(places.proven.sum()),
        "refuted": chosen.refuted,
        "poses": chosen.poses,
        "places": _listed(robot, task, places, chosen, agile),
    }
    return summary, _place_table(places, field)


def _listed(robot: Robot, task: Task, places: Places, chosen: Chosen, agile: float) -> list[dict[str, Any]]:
    labels = [BRANCHES[label] for label in branch_labels(robot)]
    return [
        {
            "centre_m": places.centre[row].tolist(),
            "size_m": (task.box[[1, 0, 2]] if places.turned[row] else task.box).tolist(),
            "turned": bool(places.turned[row]),
            "status": _status(proven),
            "branch": None if slot == MIXED else labels[slot],
            "branch_status": _status(branch_proven),
            "manipulability_m3": float(places.least[row]),
            "share_of_best": float(places.least[row]) / agile if agile > 0 else 0.0,
            "room_deg": None if slot == MIXED else float(np.degrees(places.room[row] + task.margin)),
        }
        for row, slot, proven, branch_proven in zip(chosen.row, chosen.slot, chosen.proven, chosen.branch_proven)
    ]


def _status(proven: bool) -> str:
    return N_("proven") if proven else N_("sampled")


def _place_table(places: Places, field: Field) -> pd.DataFrame:
    """The better of both turns at each centre (the table's first row there)."""
    key = np.round((places.centre - field.origin) / field.spacing * 2).astype(np.int64)
    _, first = np.unique(key, axis=0, return_index=True)
    rows = np.sort(first)
    table = pd.DataFrame(places.centre[rows], columns=_PLACES[:3])
    return table.assign(
        turned=places.turned[rows],
        slot=places.slot[rows].astype(np.int8),
        manipulability_m3=places.least[rows].astype(np.float32),
        room_deg=np.degrees(places.room[rows]).astype(np.float32),
        proven=places.proven[rows],
    )
