"""The study: robots, budgets, targets and paths, read from one YAML file."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import AfterValidator, Field, PrivateAttr, create_model, model_validator

from er3a.collision.scene import Scene
from er3a.errors import DoubtfulUnit, InputError
from er3a.files.annotations import catalogues_beside, translations_in
from er3a.files.kept_files import own_or_shipped, sha256, shown_path
from er3a.files.robot_file import Name, Placement, RobotFile, Text, check_placement
from er3a.files.robot_library import LoadFields, placement_transform, read_robot, robot_of, robot_path
from er3a.files.scene_file import load_scene
from er3a.files.units import JointsDeg, noted_doubts
from er3a.files.yaml_file import InputFile, StrictModel, load, read_yaml
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import LANGUAGES, LanguageCode
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.registry import STAGES as REGISTRY
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

STAGES = tuple(REGISTRY)
ExpectedStatus = Literal["pass", "caution", "fail", "no_reference"]
COMPARED = ("validation", "workspace")
SettingsT = TypeVar("SettingsT", bound=StrictModel)


def _known_stage(name: str) -> str:
    if name not in REGISTRY:
        raise ValueError(f"there is no stage '{name}' | Known: {', '.join(REGISTRY)}")
    return name


StageName = Annotated[Text, AfterValidator(_known_stage)]


class RobotEntry(StrictModel):
    """One robot of the study; ``vision``: the file of what its camera sees, if it has one; ``confirm``: joint values
    and the poses that its controller shows for them.

    ``base`` and ``tool`` replace those of its file, ``scene`` those of the stages. ``home_deg``: joint values (mm of
    joints that slide) from which its free space is explored; else joints at 0, or a pose that is chosen.

    ``tool_load`` and ``payload`` are the masses on its flange, which the stage dynamics alone looks at.

    ``expect`` says by stage what its verdict is to be: one that is as expected is no news, any other is a fault.

    ``stages``: those it goes through, if not all; validation and workspace, which robots are compared by, always.
    """

    file: Text | None = None
    targets: Text
    paths: Text
    programs: Text | None = None
    vision: Text | None = None
    confirm: Text | None = None
    scene: Text | None = None
    base: Placement | None = None
    tool: Placement | None = None
    tool_load: LoadFields | None = None
    payload: LoadFields | None = None
    expect: dict[Text, ExpectedStatus] = {}
    home_deg: JointsDeg | None = None
    stages: list[StageName] | None = None

    @model_validator(mode="after")
    def _check_compared_stages(self):
        if self.stages is not None and (left_out := [stage for stage in COMPARED if stage not in self.stages]):
            raise ValueError(f"stages: {left_out[0]} is missing | Robots are compared by it; add it to the list")
        return self

    @model_validator(mode="after")
    def _placements_plausible(self):
        check_placement("base", self.base)
        check_placement("tool", self.tool)
        return self


class ArticleTables(StrictModel):
    """Robots of the study that the page on the article compares.

    ``printed``: with the article's table; ``corrected``: with the entry changed that contradicts the article's own
    text; ``real``: the arm that the article names.
    """

    printed: Name
    corrected: Name
    real: Name

    @property
    def names(self) -> tuple[str, str, str]:
        """The three robots."""
        return self.printed, self.corrected, self.real


class ReportSettings(StrictModel):
    """How pages and recordings are written; no number depends on it."""

    language: LanguageCode = "en"


class StudyBase(InputFile):
    """A study file; the stages' own keys are added by the registry."""

    kind: Literal["study"]
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)]
    robots: Annotated[dict[Name, RobotEntry], Field(min_length=1)]
    article: ArticleTables | None = None
    report: ReportSettings = ReportSettings()
    _file: Path | None = PrivateAttr(default=None)
    _doubts: tuple[DoubtfulUnit, ...] = PrivateAttr(default=())

    @property
    def file(self) -> Path | None:
        """The file that the study was read from; None if it was made in Python."""
        return self._file

    @model_validator(mode="after")
    def _article_names_robots_of_the_study(self):
        for role, name in self.article or ():
            if name not in self.robots:
                raise ValueError(f"article.{role}: the study has no robot '{name}' | Known: {', '.join(self.robots)}")
            if (stages := self.robots[name].stages) is not None and "trajectory" not in stages:
                raise ValueError(f"article.{role}: '{name}' does not go through the stage trajectory | Add it")
        return self

    @model_validator(mode="after")
    def _expectations_are_of_stages_that_run(self):
        for name, entry in self.robots.items():
            if left_out := [stage for stage in entry.expect if stage not in self.stages(name)]:
                problem = f"robots.{name}.expect.{left_out[0]}: the robot does not go through this stage"
                raise ValueError(
                    f"{problem} | Give it what the stage reads, name it in its stages, or remove this line"
                )
        return self

    @property
    def names(self) -> list[str]:
        """All robots of the study, as they are written in it."""
        return [*self.robots]

    def stages(self, name: str) -> tuple[str, ...]:
        """The stages that a robot goes through, in their order.

        Parameters
        ----------
        name : of a robot

        Returns
        -------
        stages : those that its entry names, or all, as far as the study configures them for it
        """
        named = self.robots[name].stages
        asked = STAGES if named is None else tuple(named)
        return tuple(stage for stage in asked if REGISTRY[stage].is_configured(self, name))

    def pages(self, name: str) -> tuple[str, ...]:
        """The pages of a robot.

        Parameters
        ----------
        name : of a robot

        Returns
        -------
        pages : those of its stages, and the teach panel
        """
        return (*(stage for stage in self.stages(name) if "report" in REGISTRY[stage].views), "teach")

    def entry(self, name: str) -> RobotEntry:
        """The study's entry for a robot.

        Parameters
        ----------
        name : of a robot

        Raises
        ------
        InputError
            if the study has no such robot; it lists those that it has
        """
        if name not in self.robots:
            raise InputError(None, f"robots.{name}", "the study has no such robot", f"Known: {', '.join(self.robots)}")
        return self.robots[name]

    def robot_file(self, name: str) -> Path:
        """The file of a robot.

        Parameters
        ----------
        name : of a robot

        Raises
        ------
        InputError
            naming the study's entry, if there is no such file
        """
        try:
            return robot_path(self.entry(name).file or name)
        except InputError as error:
            raise InputError(error.file, error.field or f"robots.{name}", error.problem, error.remedy) from None

    def table(self, name: str) -> RobotFile:
        """What the robot's file holds.

        Parameters
        ----------
        name : of a robot

        Returns
        -------
        content : mm and deg, as in the file

        Raises
        ------
        InputError
            if the file can't be used
        """
        return read_robot(self.robot_file(name))

    def robot(self, name: str) -> Robot:
        """The robot with the study's base and tool, which take precedence over those of its file.

        Parameters
        ----------
        name : of a robot

        Returns
        -------
        robot : m and rad, under this name

        Raises
        ------
        InputError
            naming file and field that can't be used
        """
        entry, content = self.entry(name), self.table(name)
        self._doubt(name, "base", "tool")
        base, tool = entry.base or content.base, entry.tool or content.tool
        return robot_of(content).replace(name=name, base=placement_transform(base), tool=placement_transform(tool))

    def home(self, name: str) -> Reals | None:
        """The home that the study gives a robot, else that of its file.

        Parameters
        ----------
        name : of a robot

        Returns
        -------
        q : (n,), rad or m; None if neither gives one

        Raises
        ------
        InputError
            if it is not within the limits
        """
        entry, robot = self.entry(name), self.robot(name)
        if entry.home_deg is None:
            return robot.home
        field = f"robots.{name}.home_deg"
        if len(entry.home_deg) != robot.joints:
            raise InputError(None, field, f"{len(entry.home_deg)} joint values", f"The arm has {robot.joints}")
        q = meant(robot, np.array(entry.home_deg))
        if out := np.flatnonzero((q < robot.lower) | (q > robot.upper)).tolist():
            problem = f"J{out[0] + 1} at {entry.home_deg[out[0]]:g} is outside its limits"
            raise InputError(None, field, problem, "Give a pose that the arm can take")
        return q

    def loads(self, name: str) -> list[LoadFields]:
        """What hangs on the flange: the tool, then the payload, as far as the study says.

        Parameters
        ----------
        name : of a robot

        Returns
        -------
        loads : none, one or two; kg and mm, in the flange's frame
        """
        entry = self.entry(name)
        self._doubt(name, "tool_load", "payload")
        return [load for load in (entry.tool_load, entry.payload) if load]

    def _doubt(self, name: str, *keys: str) -> None:
        """Tell again what is doubtful of a robot's entry, to those who rest on it."""
        begins = tuple(f"robots.{name}.{key}." for key in keys)
        self._tell(each for each in self._doubts if each.key.startswith(begins))

    @staticmethod
    def _tell(doubts: Iterable[DoubtfulUnit]) -> None:
        for each in doubts:
            warnings.warn(each, stacklevel=4)

    def assumed_margin(self, name: str) -> float:
        """The distance from a robot's shapes within which nothing is settled if they are assumed.

        Parameters
        ----------
        name : of a robot; the margin is the same for all

        Returns
        -------
        margin : m
        """
        self.entry(name)
        return self.section(TrajectorySettings).assumed_margin_mm / 1000

    def references(self, name: str) -> list[str]:
        """The reference sets that a robot's file names.

        Parameters
        ----------
        name : of a robot

        Returns
        -------
        names : of folders below ``data/manual_refs``
        """
        return read_robot(self.robot_file(name)).references

    def other_tables(self, name: str) -> list[str]:
        """Other robots of the study, with validation, that one of this robot's reference sets is about.

        Parameters
        ----------
        name : of a robot

        Returns
        -------
        names : of robots; a set is about the robot of its own name
        """
        others = [other for other in self.references(name) if other != name and other in self.robots]
        return [other for other in others if "validation" in self.stages(other)]

    def inputs(self, name: str, stage: str) -> list[Path]:
        """The files that a stage, or the teach panel, reads for a robot.

        Parameters
        ----------
        name : of a robot
        stage : its name, or ``teach``

        Returns
        -------
        files : the robot's file first, then shapes that it names, then those of the stage; they may be missing
        """
        robot, vision = self.robot_file(name), self.entry(name).vision
        of_panel = [*self.scenes(name, "trajectory"), *([Path(vision)] if vision else [])]
        more = REGISTRY[stage].inputs(self, name) if stage in REGISTRY else of_panel
        return [robot, *shapes_named_in(robot), *more]

    def inputs_digest(self, name: str, stage: str) -> str:
        """One checksum of the files that a stage reads for a robot, by their names and contents.

        Parameters
        ----------
        name : of a robot

        Returns
        -------
        digest : SHA-256 in hex; files that are missing do not count
        """
        read = sorted((shown_path(file), sha256(file)) for file in self.inputs(name, stage) if file.is_file())
        return hashlib.sha256(repr(read).encode()).hexdigest()

    def section(self, kind: type[SettingsT]) -> SettingsT:
        """The resolved settings of one kind, with a warning of units in them that are in doubt.

        Parameters
        ----------
        kind : class of the settings, such as ``InverseSettings``

        Raises
        ------
        KeyError
            if no stage has such settings
        """
        for stage in REGISTRY.values():
            for key, model in stage.settings.items():
                if model is kind:
                    self._tell(each for each in self._doubts if each.key.startswith(f"{key}."))
                    return getattr(self, key)
        raise KeyError(kind.__name__)

    def computed_from(self, name: str, stage: str) -> dict[str, Any]:
        """The resolved parts of the study that a stage's results depend on.

        Parameters
        ----------
        name : of a robot

        Returns
        -------
        settings : plain data, kept with the results and compared to see whether these are up to date
        """
        found: dict[str, Any] = {}
        for key in REGISTRY[stage].settings:
            found |= self.settings(name, key)
        return found

    def settings(self, name: str, key: str) -> dict[str, Any]:
        """What of the study concerns one of its keys, for a robot.

        Parameters
        ----------
        name : of a robot
        key : of settings, such as ``trajectory``; of a key without settings seed and robot alone

        Returns
        -------
        settings : plain data: seed, the robot's entry without its files, and the key's settings
        """
        not_counted = {"targets", "paths", "programs", "vision", "confirm", "file", "scene", "expect"}
        not_counted |= {"tool_load", "payload"}
        entry = self.entry(name).model_dump(exclude=not_counted, exclude_none=True)
        own = getattr(self, key, None)
        settings = own.model_dump() if own else {}
        if "scene" in settings:
            scene = self.scene_file(name, key)
            settings["scene"] = str(scene) if scene else None
        if key in REGISTRY:
            settings |= REGISTRY[key].extra_inputs(self, name)
        checked = {"units_checked": True} if self.units_checked else {}
        return {"seed": self.seed, "robot": entry, key: settings} | checked

    def article_pages(self) -> dict[str, str]:
        """The files of the page on the article by language, the study's own first; none without ``article``."""
        if self.article is None:
            return {}
        own = self.report.language
        return {own: "article.html"} | {code: f"article_{code}.html" for code in LANGUAGES if code != own}

    def own_titles(self) -> dict[str, str]:
        """People's titles and notes in the language of the pages, by what they translate; none in English."""
        if self.report.language == "en":
            return {}
        return translations_in(sorted(self._input_files()), self.report.language)

    def own_catalogues(self, language: LanguageCode) -> list[Path]:
        """The catalogues of people's texts that pages in a language show.

        Parameters
        ----------
        language : of the pages

        Returns
        -------
        files : in the folders of the input files
        """
        return catalogues_beside(self._input_files(), language)

    def _input_files(self) -> set[Path]:
        return {file for name in self.robots for stage in self.stages(name) for file in self.inputs(name, stage)}

    def scenes(self, name: str, stage: str) -> list[Path]:
        """The file of :meth:`scene`, and the meshes that it names.

        Parameters
        ----------
        name : of a robot
        stage : or another key of the study with a scene

        Returns
        -------
        files : empty in open space
        """
        scene = self.scene_file(name, stage)
        return [scene, *shapes_named_in(scene)] if scene else []

    def scene(self, name: str, stage: str) -> Scene | None:
        """The solids that a robot may not touch in a stage.

        Parameters
        ----------
        name : of a robot
        stage : or another key of the study with a scene

        Returns
        -------
        scene : m; None in open space

        Raises
        ------
        InputError
            naming file and field that can't be used
        """
        file = self.scene_file(name, stage)
        return load_scene(file) if file else None

    def scene_file(self, name: str, stage: str) -> Path | None:
        """The file of :meth:`scene`: the robot's own, else the stage's.

        Parameters
        ----------
        name : of a robot
        stage : or another key of the study with a scene

        Returns
        -------
        path : None in open space
        """
        scene = self.entry(name).scene or getattr(self, stage).scene
        return Path(scene) if scene else None


def shapes_named_in(path: Path) -> list[Path]:
    """Files of shapes that a robot or scene file names.

    Parameters
    ----------
    path : of the file, which is checked elsewhere

    Returns
    -------
    files : meshes, and STL files relative to the file; each once, none of a file that can't
        be read
    """

    def named(part: Any) -> Iterator[Path]:
        if isinstance(part, dict):
            if isinstance(part.get("mesh"), str):
                yield own_or_shipped(part["mesh"])
            if isinstance(part.get("stl"), str):
                yield path.parent / part["stl"]
            part = [*part.values()]
        for inner in part if isinstance(part, list) else ():
            yield from named(inner)

    try:
        return list(dict.fromkeys(named(read_yaml(path))))
    except InputError:
        return []


def _sections() -> dict[str, Any]:
    """The stages' keys of a study file; those that need no entry have a default."""
    found = {}
    for stage in REGISTRY.values():
        for key, model in stage.settings.items():
            required = any(part.is_required() for part in model.model_fields.values())
            found[key] = (model, ...) if required else (model, model())
    return found


if TYPE_CHECKING:
    Study = StudyBase
else:
    Study = create_model("Study", __base__=StudyBase, __doc__=StudyBase.__doc__, **_sections())


def load_study(path: str | Path) -> Study:
    """Read and check a study file; the files it names are checked by the stages that read them.

    Returns
    -------
    study : it keeps what is in doubt about units, for those who rest on it

    Raises
    ------
    InputError
        naming the place in the file that can't be used
    """
    with noted_doubts() as doubts:
        study = load(Study, path)
    study._file, study._doubts = Path(path), tuple(doubts)
    return study
