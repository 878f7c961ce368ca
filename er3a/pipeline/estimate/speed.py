"""How fast one core samples while all cores of this machine do."""

from __future__ import annotations

import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

from er3a.pipeline.estimate.timings import FEW_SAMPLES
from er3a.pipeline.stages.workspace.entry import WorkspaceSettings
from er3a.pipeline.study import Study
from er3a.sampling.grid import make_grid
from er3a.sampling.random_joints import Draw
from er3a.sampling.tally import tally_blocks

MANY_SAMPLES = 1 << 25
ROUNDS = 4


@dataclass(frozen=True)
class SamplingSpeed:
    """Samples per second and core: mean, least and greatest of those measured."""

    mean: float
    least: float
    greatest: float


def sampling_speed(study: Study, robot: str) -> SamplingSpeed:
    """Speed of a robot's sampling at the study's settings, measured in as many processes as there are cores.

    It is the slope from few samples, timed at their best, to many: what a job takes before its first sample counts with
    the job.
    """
    cores = os.cpu_count() or 1
    with ProcessPoolExecutor(cores, mp_context=multiprocessing.get_context("spawn")) as pool:
        found = [speed for speeds in pool.map(_speeds, [study] * cores, [robot] * cores) for speed in speeds]
    return SamplingSpeed(sum(found) / len(found), min(found), max(found))


def _speeds(study: Study, name: str) -> list[float]:
    robot, settings = study.robot(name), study.section(WorkspaceSettings)
    grid = make_grid(robot, settings.cells_across)

    def seconds(samples: int) -> float:
        start = time.perf_counter()
        tally_blocks(robot, grid, Draw(study.seed, samples, 1, settings.sampling), [0], settings.hull_directions)
        return time.perf_counter() - start

    seconds(1 << 16)
    begin = min(seconds(FEW_SAMPLES) for _ in range(ROUNDS))
    return [(MANY_SAMPLES - FEW_SAMPLES) / (seconds(MANY_SAMPLES) - begin) for _ in range(ROUNDS)]
