"""Sweeps of a study: variants of one of its robots that differ in a single entry of the robot's file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from er3a.errors import InputError
from er3a.files.robot_file import Name, Placement, RobotFile, Text, check_placement
from er3a.files.yaml_file import StrictModel, parse
from er3a.pipeline.language import N_, tr
from er3a.pipeline.stages.registry import STAGES
from er3a.robots.robot import MAX_JOINTS

MAX_VALUES = 1000
DECIMALS = 9
Value = Annotated[float, Field(ge=-1e6, le=1e6)]


class VariedEntry(NamedTuple):
    """An entry that can be varied: of a joint, or of the tool (``joint`` None); its place, name and unit.

    ``group`` and ``column`` are those of a joint's row in a robot's file, or the key and index of a tool's placement.
    """

    joint: int | None
    group: str
    column: str | int
    label: str
    unit: str


_OF_A_JOINT = {
    "a_mm": ("dh", "a", "mm"),
    "alpha_deg": ("dh", "alpha", "deg"),
    "d_mm": ("dh", "d", "mm"),
    "offset_deg": ("zero", N_("offset"), "deg"),
    "lower_deg": ("limits", N_("lower limit"), "deg"),
    "upper_deg": ("limits", N_("upper limit"), "deg"),
    "speed_deg_s": ("speeds", N_("greatest speed"), "deg/s"),
}
_OF_THE_TOOL = {
    "x_mm": ("xyz_mm", 0, "x", "mm"),
    "y_mm": ("xyz_mm", 1, "y", "mm"),
    "z_mm": ("xyz_mm", 2, "z", "mm"),
    "roll_deg": ("rpy_deg", 0, N_("roll"), "deg"),
    "pitch_deg": ("rpy_deg", 1, N_("pitch"), "deg"),
    "yaw_deg": ("rpy_deg", 2, N_("yaw"), "deg"),
}
ENTRIES = {
    f"joints.{joint}.{column}": VariedEntry(joint, group, column, label, unit)
    for joint in range(1, MAX_JOINTS + 1)
    for column, (group, label, unit) in _OF_A_JOINT.items()
} | {f"tool.{key}": VariedEntry(None, *where) for key, where in _OF_THE_TOOL.items()}


def _known_entry(path: str) -> str:
    if path not in ENTRIES:
        remedy = f"Write joints.1 to joints.{MAX_JOINTS} with one of {', '.join(_OF_A_JOINT)}; or tool with one of "
        raise ValueError(f"'{path}' can't be varied | {remedy}{', '.join(_OF_THE_TOOL)}")
    return path


@dataclass(frozen=True)
class Variant:
    """A robot of the study with another value for one entry.

    Attributes
    ----------
    name : of the variant; base : of the robot it is made from; sweep : of the sweep
    vary : the entry's path; value : in the entry's unit
    """

    name: str
    base: str
    sweep: str
    vary: str
    value: float

    @property
    def entry(self) -> VariedEntry:
        """The entry that is varied."""
        return ENTRIES[self.vary]

    @property
    def title(self) -> str:
        """What is varied, and the value, in the language in use."""
        return f"{entry_label(self.entry)} = {self.value:.9g} {self.entry.unit}"

    def table(self, content: RobotFile) -> RobotFile:
        """A robot's file with the variant's title and the varied joint entry (a varied tool is not part of it).

        Capsules that the file gives for its own link lengths don't fit others: a varied D-H entry leaves the default.

        Returns
        -------
        content : mm and deg; the group's source says that the study varies it, and its grade is inferred

        Raises
        ------
        InputError
            if the file has no such group or joint, or refuses the value
        """
        entry, title = self.entry, f"{content.title[:1000]}, {self.title}"
        if entry.joint is None:
            return content.model_copy(update={"title": title})
        data = content.model_dump(exclude_none=True) | {"title": title}
        if entry.group not in data:
            raise self._refusal(f"the robot's file gives no {entry.group}", f"Add the group {entry.group} to it")
        group: dict[str, Any] = data[entry.group]
        if entry.joint > len(group["rows"]):
            raise self._refusal(f"the robot has {len(group['rows'])} joints", "Name one of them")
        group["rows"][entry.joint - 1][entry.column] = self.value
        group |= {"source": f"{group['source'][:1000]}; {self.vary} as varied by the study", "grade": "inferred"}
        if entry.group == "dh":
            data.pop("envelopes", None)
        try:
            return parse(RobotFile, data, None)
        except InputError as error:
            raise self._refusal(f"{error.field}: {error.problem}", error.remedy) from None

    def tool(self, tool: Placement | None) -> Placement | None:
        """The tool with the varied entry; a varied joint does not change it.

        Parameters
        ----------
        tool : mm and deg; None for none

        Raises
        ------
        InputError
            for a tool that is too far away
        """
        entry = self.entry
        if entry.joint is not None:
            return tool
        placement = (tool or Placement()).model_dump(include={"xyz_mm", "rpy_deg"})
        placement[entry.group][entry.column] = self.value
        try:
            check_placement("tool", Placement(**placement))
        except ValueError as error:
            raise self._refusal(*str(error).split(" | ")) from None
        return Placement(**placement)

    def _refusal(self, problem: str, remedy: str) -> InputError:
        return InputError(None, f"sweeps.{self.sweep}", f"{self.vary} = {self.value:.9g}: {problem}", remedy)


def _known_stage(name: str) -> str:
    if name not in STAGES:
        raise ValueError(f"there is no stage '{name}' | Known: {', '.join(STAGES)}")
    return name


StageName = Annotated[Text, AfterValidator(_known_stage)]


def _distinct(values: list[Any]) -> list[Any]:
    for value in values:
        if values.count(value) > 1:
            raise ValueError(f"{value} is listed twice | Remove one of the two")
    return values


class Sweep(StrictModel):
    """Variants of a robot that differ in one entry: ``values``, or ``steps`` evenly ``from`` one ``to`` another.

    ``vary`` is the entry's path: ``joints.3.a_mm``, ``joints.2.upper_deg``, ``tool.z_mm``. Variants have the robot's
    targets, paths and scene; they go through ``stages``.
    """

    robot: Name
    vary: Annotated[Text, AfterValidator(_known_entry)]
    first: Annotated[Value | None, Field(alias="from")] = None
    to: Value | None = None
    steps: Annotated[int, Field(ge=2, le=MAX_VALUES)] | None = None
    values: Annotated[list[Value], Field(min_length=1, max_length=MAX_VALUES), AfterValidator(_distinct)] | None = None
    stages: Annotated[list[StageName], Field(min_length=1), AfterValidator(_distinct)] = ["validation", "workspace"]

    @model_validator(mode="after")
    def _values_or_a_range(self):
        range_ = {"from": self.first, "to": self.to, "steps": self.steps}
        missing = [key for key, value in range_.items() if value is None]
        if self.values is not None and len(missing) < len(range_):
            raise ValueError("values: given beside a range | Write values, or from, to and steps")
        if self.values is None and missing:
            raise ValueError(f"{missing[0]}: missing | Write from, to and steps, or values")
        if len(set(self.resolved)) < len(self.resolved):
            raise ValueError(f"to: the range from {self.first:g} to {self.to:g} is empty | Write two different numbers")
        return self

    @property
    def resolved(self) -> list[float]:
        """The values, in the order in which they are written."""
        if self.first is None or self.to is None or self.steps is None:
            return self.values or []
        return np.linspace(self.first, self.to, self.steps).round(DECIMALS).tolist()

    def variants(self, name: str) -> Iterator[Variant]:
        """The variants of the sweep, one for each value.

        Parameters
        ----------
        name : of the sweep in the study

        Returns
        -------
        variants : named ROBOT-SWEEP-01 and so on, in the order of the values
        """
        for number, value in enumerate(self.resolved, start=1):
            yield Variant(f"{self.robot}-{name}-{number:02d}", self.robot, name, self.vary, value)


def entry_label(entry: VariedEntry) -> str:
    """An entry in words, in the language in use.

    Parameters
    ----------
    entry : of a joint or of the tool

    Returns
    -------
    label : such as ``J3 a`` or ``tool z``, without unit
    """
    label = tr(entry.label)
    return tr("tool {axis}", axis=label) if entry.joint is None else f"J{entry.joint} {label}"
