"""The study: which robots, which budgets, which targets and paths. Read from one YAML file."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, PrivateAttr, field_validator, model_validator

from er3a.errors import InputError
from er3a.files.robot_file import NAME_PATTERN, Name, Placement, RobotFile, Text, check_placement
from er3a.files.robot_library import DATA, placement_transform, read_robot, robot_of, robot_path
from er3a.files.units import FARTHEST_MM, Triple, check_millimetres
from er3a.files.yaml_file import StrictModel, load, read_yaml
from er3a.pipeline.sweeps import StageName, Sweep, Variant
from er3a.planning.avoidance import StrategyName
from er3a.robots.robot import Robot

STAGES: tuple[str, ...] = get_args(StageName)
REFERENCES = DATA / "manual_refs"
SAMPLES_PER_JOB = 1_000_000_000
"""About ten seconds, of which starting is a tenth."""


RuleName = Literal["nearest", "weighted", "time", "manipulability", "limits", "clearance"]


class RobotEntry(StrictModel):
    """One robot of the study. ``base`` and ``tool`` replace those of its file, ``scene`` those of the stages."""

    file: Text | None = None
    targets: Text
    paths: Text
    scene: Text | None = None
    base: Placement | None = None
    tool: Placement | None = None

    @model_validator(mode="after")
    def _placements_plausible(self):
        check_placement("base", self.base)
        check_placement("tool", self.tool)
        return self


class ValidationSettings(StrictModel):
    """``round_trips``: random joint vectors taken to a pose and back. ``reach_starts``: starts of each reach search."""

    round_trips: Annotated[int, Field(ge=1, le=10_000_000)]
    reach_starts: Annotated[int, Field(ge=1, le=10_000)]


class WorkspaceSettings(StrictModel):
    """Monte Carlo budget and grid.

    ``samples`` are drawn in ``blocks`` seeded blocks, uniform in the joints or (``sampling: sobol``) more evenly than
    chance as points of a Sobol' sequence; ``cells_across`` cells span the bounding box's longest side,
    the hull is taken over the extreme samples in ``hull_directions`` directions, the recording shows ``cloud_points``.
    The proof looks at ``proof_cells`` cells of the section; ``volume_points`` uniform points estimate the volume.
    """

    samples: Annotated[int, Field(ge=1, le=100_000_000_000)]
    blocks: Annotated[int, Field(ge=1, le=100_000)]
    cells_across: Annotated[int, Field(ge=8, le=1024)]
    hull_directions: Annotated[int, Field(ge=1000, le=100_000)]
    cloud_points: Annotated[int, Field(ge=1, le=300_000)]
    proof_cells: Annotated[int, Field(ge=1, le=10_000_000)] = 8000
    volume_points: Annotated[int, Field(ge=100, le=10_000_000)] = 100_000
    sampling: Literal["uniform", "sobol"] = "uniform"

    @model_validator(mode="after")
    def _a_sample_per_block(self):
        if self.samples < self.blocks:
            raise ValueError(f"{self.samples} samples can't fill {self.blocks} blocks | Lower workspace.blocks")
        return self

    @property
    def parts(self) -> int:
        """The number of jobs that the blocks are grouped into."""
        return min(self.blocks, math.ceil(self.samples / SAMPLES_PER_JOB))


class BoxTask(StrictModel):
    """A box that the tool must serve, in the frame that the robot's base is placed in.

    ``box_mm`` are its edges along x, y and z (it may stand turned by 90 deg about z), ``lowest_mm`` the least height of
    its underside, ``clear_of_axis_mm`` the least distance of its points from axis 1. At every point the tool must reach
    all directions within ``cone_deg`` of ``tool_direction`` (z of the tool frame), ``limit_margin_deg`` within limits.
    """

    box_mm: Annotated[list[Annotated[float, Field(gt=0)]], Field(min_length=3, max_length=3)] = [200, 150, 50]
    tool_direction: Triple = [0, 0, -1]
    cone_deg: Annotated[float, Field(ge=0, le=180)] = 30
    limit_margin_deg: Annotated[float, Field(ge=0, le=45)] = 2
    lowest_mm: Annotated[float, Field(ge=-FARTHEST_MM, le=FARTHEST_MM)] = 0
    clear_of_axis_mm: Annotated[float, Field(ge=0, le=FARTHEST_MM)] = 150

    @field_validator("box_mm")
    @classmethod
    def _no_metres(cls, values):
        check_millimetres(values)
        return values

    @field_validator("tool_direction")
    @classmethod
    def _has_length(cls, values):
        if max(map(abs, values)) < 1e-6:
            raise ValueError("the vector has no direction | Write for example [0, 0, -1]: the tool points down")
        return values


class CapabilitySettings(StrictModel):
    """What the tool can do in each cell of the workspace.

    ``directions`` are spread over the sphere, with ``rolls`` about each where the roll matters (a tool beside axis 6,
    which takes as many times longer). The proofs of the dexterous core and of the listed places may look at
    ``proof_poses`` neighbourhoods of poses each.
    """

    directions: Annotated[int, Field(ge=12, le=10_000)] = 300
    rolls: Annotated[int, Field(ge=1, le=360)] = 8
    proof_poses: Annotated[int, Field(ge=1, le=1_000_000_000)] = 100_000
    placement: BoxTask = BoxTask()


class TrajectorySettings(StrictModel):
    """Where a path counts as near-singular, and how many points are checked between two samples.

    ``repair`` chooses the way around singular regions, or compares all of them. Joints of unknown speed are taken to do
    ``assumed_speed_deg_s``; all joints to reach full speed in ``full_speed_after_s``.
    ``scene`` holds the obstacles; no overlap with them deeper than ``overlap_mm`` goes unnoticed between points.
    """

    checks_per_sample: Annotated[int, Field(ge=1, le=1000)]
    near_wrist_deg: Annotated[float, Field(gt=0, le=90)]
    near_elbow_deg: Annotated[float, Field(gt=0, le=90)]
    near_shoulder_mm: Annotated[float, Field(gt=0, le=10_000)]
    repair: Literal["compare"] | StrategyName = "compare"
    assumed_speed_deg_s: Annotated[
        list[Annotated[float, Field(gt=0, le=10_000)]], Field(min_length=6, max_length=6)
    ] = [180, 180, 180, 360, 360, 360]
    full_speed_after_s: Annotated[float, Field(gt=0, le=10)] = 0.25
    scene: Text | None = None
    overlap_mm: Annotated[float, Field(ge=0.05, le=100)] = 1.0


class InverseSettings(StrictModel):
    """``round_trips``: random poses solved back. ``map_cells``: cells across the maps of the number of solutions.

    ``scene`` holds the obstacles that clearance is measured from and that solutions may not touch; ``mix`` weighs
    rules against each other as one more rule (names: er3a/selection/rules.py).
    """

    round_trips: Annotated[int, Field(ge=1, le=10_000_000)] = 2000
    map_cells: Annotated[int, Field(ge=8, le=512)] = 80
    scene: Text | None = None
    mix: Annotated[dict[RuleName, Annotated[float, Field(ge=0, le=1000)]], Field(min_length=1)] = {"nearest": 1}


class ReportSettings(StrictModel):
    """How pages and recordings are written; no number depends on it."""

    language: Literal["en", "zh"] = "en"


class Study(StrictModel):
    """config/config.yaml."""

    kind: Literal["study"]
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)]
    robots: Annotated[dict[Name, RobotEntry], Field(min_length=1)]
    sweeps: Annotated[dict[Name, Sweep], Field(max_length=100)] = {}
    validation: ValidationSettings
    workspace: WorkspaceSettings
    capability: CapabilitySettings = CapabilitySettings()
    inverse: InverseSettings = InverseSettings()
    trajectory: TrajectorySettings
    report: ReportSettings = ReportSettings()
    _file: Path | None = PrivateAttr(default=None)

    @property
    def file(self) -> Path | None:
        """The file that the study was read from; None if it was made in Python."""
        return self._file

    @model_validator(mode="after")
    def _variants_have_names_of_their_own(self):
        taken = set(self.robots)
        for name, sweep in self.sweeps.items():
            if sweep.robot not in self.robots:
                problem = f"sweeps.{name}.robot: the study has no robot '{sweep.robot}'"
                raise ValueError(f"{problem} | Known: {', '.join(self.robots)}")
            for variant in sweep.variants(name):
                if variant.name in taken:
                    problem = f"sweeps.{name}: '{variant.name}' is the name of another robot already"
                    raise ValueError(f"{problem} | Give the sweep another name")
                if not re.match(NAME_PATTERN, variant.name):
                    problem = f"sweeps.{name}: '{variant.name}' is too long for a robot's name"
                    raise ValueError(f"{problem} | Give the sweep a shorter name")
                taken.add(variant.name)
        return self

    @property
    def variants(self) -> dict[str, Variant]:
        """The robots that the sweeps make, by name."""
        return {variant.name: variant for name, sweep in self.sweeps.items() for variant in sweep.variants(name)}

    @property
    def names(self) -> list[str]:
        """All robots of the study, variants after those that are written in it."""
        return [*self.robots, *self.variants]

    def stages(self, name: str) -> tuple[str, ...]:
        """The stages that a robot goes through."""
        variant = self.variants.get(name)
        return STAGES if variant is None else tuple(self.sweeps[variant.sweep].stages)

    def pages(self, name: str) -> tuple[str, ...]:
        """The pages of a robot: its stages', and the teach panel of one that is no variant."""
        return self.stages(name) if name in self.variants else (*STAGES, "teach")

    def entry(self, name: str) -> RobotEntry:
        """The study's entry for a robot, for a variant that of its base; :class:`InputError` if it has none."""
        base = self._base(name)
        if base not in self.robots:
            raise InputError(None, f"robots.{name}", "the study has no such robot", f"Known: {', '.join(self.robots)}")
        return self.robots[base]

    def _base(self, name: str) -> str:
        variant = self.variants.get(name)
        return variant.base if variant else name

    def robot_file(self, name: str) -> Path:
        """The file of a robot, or of a variant's base; :class:`InputError` naming the entry if there is none."""
        base = self._base(name)
        try:
            return robot_path(self.entry(name).file or base)
        except InputError as error:
            raise InputError(error.file, error.field or f"robots.{base}", error.problem, error.remedy) from None

    def table(self, name: str) -> RobotFile:
        """What the robot's file holds, with a variant's title and varied entry."""
        content = read_robot(self.robot_file(name))
        variant = self.variants.get(name)
        return variant.table(content) if variant else content

    def robot(self, name: str) -> Robot:
        """The robot with the study's base and tool."""
        entry, content = self.entry(name), self.table(name)
        base, tool = entry.base or content.base, entry.tool or content.tool
        if variant := self.variants.get(name):
            tool = variant.tool(tool)
        return robot_of(content).replace(name=name, base=placement_transform(base), tool=placement_transform(tool))

    def inputs(self, name: str, stage: str) -> list[Path]:
        """The files that a stage reads for a robot."""
        entry = self.entry(name)
        files = [self.robot_file(name)]
        kinds = {"validation": "*.csv", "workspace": "envelope.csv"}
        if stage in kinds:
            for reference in read_robot(files[0]).references:
                files += sorted((REFERENCES / reference).glob(kinds[stage]))
        if stage == "inverse":
            files.append(Path(entry.targets))
            if scene := self.scene(name, stage):
                files.append(scene)
        if stage == "trajectory":
            files += [Path(entry.paths), *_tables_of(entry.paths)]
            if scene := self.scene(name, stage):
                files.append(scene)
        return files

    def computed_from(self, name: str, stage: str) -> dict[str, Any]:
        """The resolved parts of the study that a stage's results depend on; plain data."""
        more = self.settings(name, "capability") if stage == "workspace" else {}
        return more | self.settings(name, stage)

    def settings(self, name: str, stage: str) -> dict[str, Any]:
        """The resolved part of the study that a stage's numbers depend on, or one that is no stage's; plain data."""
        entry = self.entry(name).model_dump(exclude={"targets", "paths", "file", "scene"}, exclude_none=True)
        if variant := self.variants.get(name):
            entry["varied"] = {variant.vary: variant.value}
        own = getattr(self, stage, None)
        settings = own.model_dump() if own else {}
        if "scene" in settings:
            scene = self.scene(name, stage)
            settings["scene"] = str(scene) if scene else None
        return {"seed": self.seed, "robot": entry, stage: settings}

    def scene(self, name: str, stage: str) -> Path | None:
        """The file of the solids that a robot may not touch in a stage; None for open space."""
        scene = self.entry(name).scene or getattr(self, stage).scene
        return Path(scene) if scene else None


def _tables_of(path_file: str) -> list[Path]:
    """The CSV tables that a path file names; the file is checked elsewhere."""
    paths = read_yaml(path_file).get("paths")
    named = [path.get("file") for path in paths if isinstance(path, dict)] if isinstance(paths, list) else []
    return [Path(file) for file in named if isinstance(file, str)]


def load_study(path: str | Path) -> Study:
    """Read and check a study file; the files it names are checked by the stages that read them."""
    study = load(Study, path)
    study._file = Path(path)
    return study
