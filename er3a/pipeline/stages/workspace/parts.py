"""Part files: the tally of some blocks, with what it takes to know that they belong together."""

from __future__ import annotations

import hashlib
import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from er3a.errors import ResultError
from er3a.files.kept_files import read_checked, write_checked
from er3a.kinematics.chain import constant_links
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.stages.workspace.entry import WorkspaceSettings
from er3a.pipeline.study import Study
from er3a.robots.robot import Robot
from er3a.sampling.extreme_samples import Extremes
from er3a.sampling.tally import UNTOUCHED, Tally

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
    """Write a tally behind its checksum; equal tallies give equal bytes."""
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
