"""Sampling in parts: each writes the tally of its blocks, and the results don't depend on how many parts there are."""

from __future__ import annotations

from pathlib import Path

from er3a.errors import InputError
from er3a.pipeline.progress import shown_progress
from er3a.pipeline.stages.workspace.entry import WorkspaceSettings
from er3a.pipeline.stages.workspace.parts import identity, write_part
from er3a.pipeline.study import Study
from er3a.robots.robot import Robot
from er3a.sampling.grid import Grid, make_grid
from er3a.sampling.random_joints import Draw
from er3a.sampling.tally import Tally, tally_blocks


def sample(study: Study, name: str, part: int, parts: int, output: Path) -> None:
    """Sample the blocks of one part out of ``parts`` and write them to ``output`` (.npz).

    Parameters
    ----------
    part : from 1 to parts; a part may be without blocks if there are more parts than blocks

    Raises
    ------
    InputError
        if there is no such part, or the grid does not fit into memory
    """
    if not 1 <= part <= parts:
        raise InputError(None, "part", f"there is no part {part} of {parts}", f"Give a number from 1 to {parts}")
    robot = study.robot(name)
    count = study.section(WorkspaceSettings).blocks
    blocks = range((part - 1) * count // parts, part * count // parts)
    grid = make_grid(robot, study.section(WorkspaceSettings).cells_across)
    write_part(Path(output), identity(study, robot), sampled(study, robot, grid, blocks))


def draw_of(study: Study) -> Draw:
    """How the study draws its samples."""
    settings = study.section(WorkspaceSettings)
    return Draw(study.seed, settings.samples, settings.blocks, settings.sampling)


def sampled(study: Study, robot: Robot, grid: Grid, blocks: range) -> Tally:
    """The tally of some blocks of the study, with progress on standard error."""
    draw = draw_of(study)
    total = int(draw.sizes[blocks.start : blocks.stop].sum())
    with shown_progress(total, f"{robot.name}: samples") as advance:
        return tally_blocks(robot, grid, draw, blocks, study.section(WorkspaceSettings).hull_directions, advance)
