"""Studies, robot files and arms that the tests of the workspace stage share."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml

from er3a.files.robot_library import ROBOTS
from er3a.pipeline.study import Study
from er3a.robots.robot import Robot
from er3a.sampling.grid import make_grid
from er3a.sampling.random_joints import Draw
from er3a.sampling.tally import tally_blocks

SEED = 20261120


def make_study(files: dict[str, Path] | None = None, **workspace) -> Study:
    entry = {"targets": "targets.yaml", "paths": "paths.yaml"}
    robots = {name: {**entry, "file": str(file)} for name, file in (files or {}).items()} or {"er3_600": entry}
    small = {"samples": 60_001, "blocks": 7, "cells_across": 16, "cloud_points": 500}
    small["proof_cells"] = 400
    return Study.model_validate(
        {
            "kind": "study",
            "seed": SEED,
            "robots": robots,
            "validation": {"round_trips": 1, "reach_starts": 1},
            "workspace": small | workspace,
            "trajectory": {
                "checks_per_sample": 1,
                "near_wrist_deg": 5.0,
                "near_elbow_deg": 5.0,
                "near_shoulder_mm": 30.0,
            },
        }
    )


def locked_file(folder: Path, locked: dict[int, float]) -> Path:
    """A copy of the ER3-600's file with some joints locked at angles in deg."""
    content = yaml.safe_load((ROBOTS / "er3_600.yaml").read_text(encoding="utf-8"))
    for joint, angle in locked.items():
        content["limits"]["rows"][joint - 1] |= {"lower_deg": angle, "upper_deg": angle}
    content["name"] = "locked"
    path = folder / "locked.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def skew_file(folder: Path) -> Path:
    """A copy of the ER3-600's file whose wrist axes don't meet."""
    content = yaml.safe_load((ROBOTS / "er3_600.yaml").read_text(encoding="utf-8"))
    content["dh"]["rows"][4]["a_mm"] = 40
    content["name"] = "skew"
    path = folder / "skew.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def two_link_arm(lower: list[float], upper: list[float]) -> Robot:
    """Shoulder 0.3 m up, upper arm 0.6 m, forearm 0.4 m, wrist and tool of no length: the tool is the wrist centre."""
    right = np.pi / 2
    return Robot(
        name="two_link",
        title="two links",
        convention="standard",
        a=[0, 0.6, 0, 0, 0, 0],
        alpha=[-right, 0, -right, right, -right, 0],
        d=[0.3, 0, 0, 0.4, 0, 0],
        direction=np.ones(6),
        offset=np.zeros(6),
        lower=np.radians(lower),
        upper=np.radians(upper),
    )


def tally_of(robot: Robot, samples: int, blocks: int, across: int):
    grid, draw = make_grid(robot, across), Draw(SEED, samples, blocks)
    return grid, draw, tally_blocks(robot, grid, draw, range(blocks))
