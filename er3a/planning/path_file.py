"""What a path file may hold (YAML, mm, degrees and seconds): data/paths/<robot>.yaml."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from er3a.errors import InputError
from er3a.inputs.units import JointsDeg, PositionMm, RpyDeg, Triple
from er3a.inputs.yaml_file import StrictModel, load
from er3a.robots.schema import Name, Text

Duration = Annotated[float, Field(gt=0, le=3600)]
Samples = Annotated[int, Field(ge=2, le=100_000)]


class PoseEntry(StrictModel):
    """A pose of the tool in the base frame; R = Rz(yaw) Ry(pitch) Rx(roll)."""

    xyz_mm: PositionMm
    rpy_deg: RpyDeg


class JointPath(StrictModel):
    """A joint move: quintic in time, all joints together."""

    kind: Literal["joint"]
    name: Name
    title: Text
    start_deg: JointsDeg
    end_deg: JointsDeg
    duration_s: Duration
    samples: Samples


class LinePath(StrictModel):
    """A straight line of the tool, from joint angles or from a pose.

    ``start_branch`` (only with a start pose) fixes the branch to begin on, in the words of the inverse's solutions.
    ``half_turn_axis`` chooses the sense of a rotation by exactly 180 deg.
    """

    kind: Literal["line"]
    name: Name
    title: Text
    start_deg: JointsDeg | None = None
    start: PoseEntry | None = None
    start_branch: Text | None = None
    end: PoseEntry
    half_turn_axis: Triple | None = None
    duration_s: Duration
    samples: Samples

    @model_validator(mode="after")
    def _one_start(self):
        if (self.start is None) == (self.start_deg is None):
            raise ValueError("give either start_deg (six joint angles) or start (a pose) | Keep one of the two")
        if self.start_branch is not None and self.start is None:
            raise ValueError("start_branch: start_deg already fixes the branch | Remove start_branch")
        return self


PathEntry = JointPath | LinePath


class PathFile(StrictModel):
    """A list of named paths."""

    kind: Literal["paths"]
    paths: Annotated[list[Annotated[PathEntry, Field(discriminator="kind")]], Field(min_length=1)]

    @model_validator(mode="after")
    def _names_differ(self):
        names = [entry.name for entry in self.paths]
        for i, name in enumerate(names):
            if name in names[:i]:
                raise ValueError(f"paths[{i}].name: '{name}' names an earlier path too | Give each path its own name")
        return self


def load_paths(path: str | Path) -> PathFile:
    """Read and check a path file.

    Raises
    ------
    InputError
        naming file, field and remedy
    """
    try:
        return load(PathFile, path)
    except InputError as error:
        field = error.field and re.sub(r"(paths\[\d+\])\.(?:joint|line)\b", r"\1", error.field)
        raise InputError(error.file, field, error.problem, error.remedy) from None
