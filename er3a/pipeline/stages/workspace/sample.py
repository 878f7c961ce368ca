"""Sampling in parts: each writes the counts of its blocks; results don't depend on the number of parts."""

from __future__ import annotations

import hashlib
import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from er3a.errors import InputError, ResultError
from er3a.files.kept_files import read_checked, write_checked
from er3a.kinematics.chain import constant_links
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.progress import shown_progress
from er3a.pipeline.stages.workspace.entry import WorkspaceSettings
from er3a.pipeline.study import Study
from er3a.robots.robot import Robot
from er3a.sampling.grid import Grid, make_grid
from er3a.sampling.random_joints import Draw
from er3a.sampling.tally import UNTOUCHED, Extremes, Tally, tally_blocks

FORMAT = "er3a workspace part 3"


def identity(study: Study, robot: Robot) -> dict[str, Any]:
    """What all part files of one run share: settings, seed, and digests of the robot's numbers and of the code."""
    arrays: tuple[Any, ...] = (constant_links(robot), robot.direction, robot.offset, robot.lower, robot.upper)
    if robot.coupling is not None:
        arrays = (*arrays, robot.coupling)
    sums = [(*limit.factors, limit.lower, limit.upper) for limit in robot.combined]
    arrays = (*arrays, robot.sliding, np.array(sums))
    settings = study.section(WorkspaceSettings).model_dump(exclude={"cloud_points"})
    return {
        "format": FORMAT,
        "robot": robot.name,
        "seed": study.seed,
        **settings,
        "table": hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest(),
        "code": code_digest("er3a.pipeline.stages.workspace.sample"),
    }


def write_part(path: Path, identity: dict[str, Any], tally: Tally) -> None:
    """Write a checksum, then its tally; equal tallies give equal bytes."""
    touched = np.flatnonzero(tally.counts)
    stream = io.BytesIO()
    np.savez_compressed(
        stream,
        identity=np.frombuffer(json.dumps(identity, sort_keys=True).encode(), dtype=np.uint8),
        blocks=tally.blocks,
        shape=np.array(tally.counts.shape),
        cells=touched,
        counts=tally.counts.ravel()[touched],
        first_block=tally.first_block.ravel()[touched],
        side=tally.side,
        support=tally.extremes.support,
        extreme_block=tally.extremes.block,
        extreme_sample=tally.extremes.sample,
    )
    write_checked(path, stream.getvalue())


def read_part(path: Path, expected: dict[str, Any]) -> Tally:
    """Read a part file of the run that ``expected`` identifies.

    Raises
    ------
    ResultError
        naming the file, if it is missing, damaged, or of another run
    """
    with np.load(io.BytesIO(read_checked(path)), allow_pickle=False) as file:
        arrays = {key: file[key] for key in file.files}
    _check_identity(path, json.loads(arrays["identity"].tobytes()), expected)
    counts = np.zeros(arrays["shape"], dtype=np.int64)
    first_block = np.full(arrays["shape"], UNTOUCHED, dtype=np.int32)
    counts.flat[arrays["cells"]] = arrays["counts"]
    first_block.flat[arrays["cells"]] = arrays["first_block"]
    extremes = Extremes(arrays["support"], arrays["extreme_block"], arrays["extreme_sample"])
    return Tally(arrays["blocks"], counts, first_block, arrays["side"], extremes)


def _check_identity(path: Path, found: dict[str, Any], expected: dict[str, Any]) -> None:
    for key, value in expected.items():
        if found.get(key) != value:
            words = {"table": "another table of the robot", "code": "another version of the code"}
            what = words.get(key, f"{key} {found.get(key)}, not {value}")
            raise ResultError(path, f"was sampled with {what}")


def gather(paths: list[Path], study: Study, robot: Robot) -> Tally:
    """Merge the part files of a run.

    Raises
    ------
    ResultError
        naming the file, if one is damaged or foreign, or brings a block that another file holds; naming the last file,
        if a block is missing
    """
    expected = identity(study, robot)
    total: Tally | None = None
    for path in paths:
        tally = read_part(path, expected)
        twice = np.intersect1d(tally.blocks, total.blocks) if total else np.array([])
        if twice.size:
            raise ResultError(path, f"holds block {int(twice[0])}, which another part file holds too")
        total = tally if total is None else total.merge(tally)
    held = total.blocks if total else np.array([])
    missing = np.setdiff1d(np.arange(study.section(WorkspaceSettings).blocks), held)
    if missing.size or total is None:
        where = paths[-1] if paths else "part files"
        raise ResultError(where, f"with this file and the others, block {int(missing[0])} is still missing")
    return total


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
