"""Sweeps of a study: variants of one of its robots that differ in a single entry of the robot's file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from er3a.errors import InputError
from er3a.inputs.yaml_file import StrictModel, parse
from er3a.language import N_, tr
from er3a.robots.schema import Name, Placement, RobotFile, Text, check_placement

StageName = Literal["validation", "workspace", "inverse", "trajectory"]
MOST_VALUES = 1000
DECIMALS = 9
Value = Annotated[float, Field(ge=-1e6, le=1e6)]
_TOOL = "tool"


class Entry(NamedTuple):
    """Where an entry stands in a robot's file (group and column, or key and index of the tool), and its unit."""

    group: str
    column: str | int
    label: str
    unit: str


_JOINT_ENTRIES = {
    "a_mm": Entry("dh", "a_mm", "a", "mm"),
    "alpha_deg": Entry("dh", "alpha_deg", "alpha", "deg"),
    "d_mm": Entry("dh", "d_mm", "d", "mm"),
    "offset_deg": Entry("zero", "offset_deg", N_("offset"), "deg"),
    "lower_deg": Entry("limits", "lower_deg", N_("lower limit"), "deg"),
    "upper_deg": Entry("limits", "upper_deg", N_("upper limit"), "deg"),
    "speed_deg_s": Entry("speeds", "speed_deg_s", N_("greatest speed"), "deg/s"),
}
_TURNS = {"roll": N_("roll"), "pitch": N_("pitch"), "yaw": N_("yaw")}
_TOOL_ENTRIES = {
    **{f"{axis}_mm": Entry("xyz_mm", i, axis, "mm") for i, axis in enumerate("xyz")},
    **{f"{turn}_deg": Entry("rpy_deg", i, word, "deg") for i, (turn, word) in enumerate(_TURNS.items())},
}


def _known_entry(path: str) -> str:
    first, _, rest = path.partition(".")
    joint, _, key = rest.partition(".")
    if (first == "joints" and joint in tuple("123456") and key in _JOINT_ENTRIES) or (
        first == _TOOL and rest in _TOOL_ENTRIES
    ):
        return path
    remedy = f"Write joints.1 to joints.6 with one of {', '.join(_JOINT_ENTRIES)}; or tool with one of "
    raise ValueError(f"'{path}' is no entry that can be varied | {remedy}{', '.join(_TOOL_ENTRIES)}")


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
    def title(self) -> str:
        """What is varied, and the value, in the language in use."""
        return f"{entry_label(self.vary)} = {self.value:.9g} {entry_unit(self.vary)}"

    def table(self, content: RobotFile) -> RobotFile:
        """A robot's file with the variant's title and the varied joint entry (a varied tool is no part of it).

        Capsules that the file gives for its own link lengths don't fit others: a varied D-H entry leaves the default.
        """
        data = content.model_dump(exclude_none=True) | {"title": f"{content.title[:1000]}, {self.title}"}
        if self.vary.startswith(_TOOL):
            return RobotFile.model_validate(data)
        joint, _ = _joint_and_key(self.vary)
        entry = _entry_of(self.vary)
        if entry.group not in data:
            problem = f"the robot's file gives no {entry.group}"
            raise self._refusal(problem, f"Add the group {entry.group} to it")
        group: dict[str, Any] = data[entry.group]
        group["rows"][joint - 1][entry.column] = self.value
        group |= {"source": f"{group['source'][:1000]}; {self.vary} as varied by the study", "grade": "inferred"}
        if entry.group == "dh":
            data.pop("envelopes", None)
        try:
            return parse(RobotFile, data, None)
        except InputError as error:
            raise self._refusal(f"{error.field}: {error.problem}", error.remedy) from None

    def tool(self, tool: Placement | None) -> Placement | None:
        """The tool with the varied entry; a varied joint leaves it as it is."""
        if not self.vary.startswith(_TOOL):
            return tool
        entry = _entry_of(self.vary)
        placement = (tool or Placement()).model_dump(include={"xyz_mm", "rpy_deg"})
        placement[entry.group][entry.column] = self.value
        try:
            check_placement(_TOOL, Placement(**placement))
        except ValueError as error:
            raise self._refusal(*str(error).split(" | ")) from None
        return Placement(**placement)

    def replaced(self, content: RobotFile, tool: Placement | None) -> float | None:
        """The value that the base robot itself has, given its file and its tool; None if it has none."""
        entry = _entry_of(self.vary)
        if self.vary.startswith(_TOOL):
            return getattr(tool or Placement(), entry.group)[entry.column]
        group = getattr(content, entry.group)
        return getattr(group.rows[_joint_and_key(self.vary)[0] - 1], entry.column) if group else None

    def _refusal(self, problem: str, remedy: str) -> InputError:
        return InputError(None, f"sweeps.{self.sweep}", f"{self.vary} = {self.value:.9g}: {problem}", remedy)


def _distinct(values: list[Any]) -> list[Any]:
    for value in values:
        if values.count(value) > 1:
            raise ValueError(f"{value} stands there twice | Remove one of the two")
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
    steps: Annotated[int, Field(ge=2, le=MOST_VALUES)] | None = None
    values: Annotated[list[Value], Field(min_length=1, max_length=MOST_VALUES), AfterValidator(_distinct)] | None = None
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
        return self.values or np.linspace(self.first, self.to, self.steps).round(DECIMALS).tolist()

    def variants(self, name: str) -> Iterator[Variant]:
        """The variants of the sweep of this name."""
        for number, value in enumerate(self.resolved, start=1):
            yield Variant(f"{self.robot}-{name}-{number:02d}", self.robot, name, self.vary, value)


def entry_label(vary: str) -> str:
    """An entry's path in words, in the language in use."""
    label = tr(_entry_of(vary).label)
    return tr("tool {axis}", axis=label) if vary.startswith(_TOOL) else f"J{_joint_and_key(vary)[0]} {label}"


def entry_unit(vary: str) -> str:
    """The unit of an entry."""
    return _entry_of(vary).unit


def _entry_of(vary: str) -> Entry:
    if vary.startswith(_TOOL):
        return _TOOL_ENTRIES[vary.partition(".")[2]]
    return _JOINT_ENTRIES[_joint_and_key(vary)[1]]


def _joint_and_key(vary: str) -> tuple[int, str]:
    _, joint, key = vary.split(".")
    return int(joint), key
