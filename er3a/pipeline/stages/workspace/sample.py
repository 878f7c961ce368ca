"""The study's samples: drawn in blocks by a counter, so that they do not depend on how they are grouped."""

from __future__ import annotations

from er3a.numerics.arrays import Integers
from er3a.pipeline.progress import shown_work
from er3a.pipeline.stages.workspace.entry import WorkspaceSettings
from er3a.pipeline.study import Study
from er3a.robots.robot import Robot
from er3a.sampling.grid import Grid
from er3a.sampling.random_joints import Draw
from er3a.sampling.tally import tally_blocks


def draw_of(study: Study) -> Draw:
    """How the study draws its samples.

    Returns
    -------
    draw : seed, number of samples, and blocks; samples do not depend on how blocks are grouped into jobs
    """
    settings = study.section(WorkspaceSettings)
    return Draw(study.seed, settings.samples, settings.blocks)


def sampled(study: Study, robot: Robot, grid: Grid, blocks: range) -> Integers:
    """Counts of some blocks of the study's samples, with progress on standard error.

    Parameters
    ----------
    grid : of the section's cells, m
    blocks : their numbers, from 0, without gaps

    Returns
    -------
    counts : samples of these blocks in each cell of the section
    """
    draw = draw_of(study)
    total = int(draw.sizes[blocks.start : blocks.stop].sum())
    with shown_work(f"{robot.name}: drawing {total:,} samples"):
        return tally_blocks(robot, grid, draw, blocks)
