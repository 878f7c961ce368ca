"""KRL's positions as targets: axis form, whole and partial poses, relative ones."""

from __future__ import annotations

import math

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.programs.angle_conventions import numbers_of, pose_of
from er3a.programs.evaluation import ProgramMemory
from er3a.programs.instructions import JointTarget, NamedFrame, PoseTarget, Target, UnresolvedTarget
from er3a.programs.values import Record, Unclear, Value, finite, number

FRAME_KEYS = ("X", "Y", "Z", "A", "B", "C")
AXIS_KEYS = ("A1", "A2", "A3", "A4", "A5", "A6")
AXIS_KINDS = ("AXIS", "E6AXIS")
EXTERNAL_KEYS = ("E1", "E2", "E3", "E4", "E5", "E6")
NOT_NUMBERS = ("NAN", "INF", "INFINITY")
Frames = tuple[NamedFrame, NamedFrame]


def _has_axes(value: Record) -> bool:
    return value.kind in AXIS_KINDS or any(key in AXIS_KEYS for key, _ in value.items)


def is_frame(value: Value | None) -> bool:
    """Whether a value has a coordinate of a frame."""
    return isinstance(value, Record) and any(value.get(key) is not None for key in FRAME_KEYS)


def record_pose(value: Value | None) -> Reals | None:
    """The transform (4, 4) in m of a frame, with 0 for what it leaves out; None for anything else."""
    if not isinstance(value, Record):
        return None
    given = [0.0 if value.get(key) is None else number(value.get(key)) for key in FRAME_KEYS]
    plain = tuple(each for each in given if each is not None)
    return pose_of(plain, "kuka") if len(plain) == 6 and finite(plain) else None


def frame_record(pose: Reals, kind: str = "FRAME") -> Record:
    """A transform (4, 4) in m as a frame."""
    return Record(kind, tuple(zip(FRAME_KEYS, numbers_of(pose, "kuka"))))


def target(memory: ProgramMemory, value: Value, frames: Frames, said: tuple[str, bool]) -> Target:
    """What a position in a motion means; ``said`` is the line, and whether a relative position is meant by the tool."""
    text = said[0]
    if isinstance(value, Unclear):
        return _unresolved(value)
    if not isinstance(value, Record):
        return UnresolvedTarget(text, "not_understood")
    if memory.read("$IPO_MODE") == "#TCP":
        return UnresolvedTarget(text, "external_tool")
    if _has_axes(value):
        return UnresolvedTarget(text, "not_understood") if is_frame(value) else _joints(memory, value, text)
    return _pose(memory, value, frames, text)


def relative(memory: ProgramMemory, value: Value, frames: Frames, said: tuple[str, bool]) -> Target:
    """A target given by its difference from where the arm stands."""
    text, in_tool = said
    if isinstance(value, Unclear) or not isinstance(value, Record):
        return _unresolved(value) if isinstance(value, Unclear) else UnresolvedTarget(text, "not_understood")
    if _has_axes(value):
        change = _joints(memory, value, text, missing=0.0)
        if memory.here.joints is None or not isinstance(change, JointTarget):
            return UnresolvedTarget(text, "position_unknown")
        return JointTarget(memory.here.joints + change.joints)
    moved, seen = record_pose(value), memory.here.seen(*frames, memory.cell.flange)
    if moved is None or seen is None:
        return UnresolvedTarget(text, "position_unknown")
    if in_tool:
        return PoseTarget(seen @ moved)
    found = seen.copy()
    found[:3, 3] += moved[:3, 3]
    found[:3, :3] = moved[:3, :3] @ seen[:3, :3]
    return PoseTarget(found)


def _unresolved(value: Unclear) -> UnresolvedTarget:
    reason = value.text.upper().lstrip("+-") in NOT_NUMBERS
    return UnresolvedTarget(value.text, "not_finite" if reason else "undefined")


def _components(value: Record, keys: tuple[str, ...], text: str) -> list[float | None] | UnresolvedTarget:
    """Numbers of a record, None for what it leaves out."""
    found: list[float | None] = []
    given = dict(value.items)
    for key in keys:
        part = given.get(key)
        if isinstance(part, Unclear):
            return _unresolved(part)
        plain = number(part)
        if part is not None and plain is None:
            return UnresolvedTarget(text, "not_understood")
        if plain is not None and not math.isfinite(plain):
            return UnresolvedTarget(text, "not_finite")
        found.append(plain)
    return found


def _external(value: Record) -> tuple[tuple[str, float], ...]:
    parts = dict(value.items)
    given = ((key, number(parts[key])) for key in EXTERNAL_KEYS if key in parts)
    return tuple((key, part) for key, part in given if part)


def _joints(memory: ProgramMemory, value: Record, text: str, missing: float | None = None) -> Target:
    degrees = _components(value, AXIS_KEYS, text)
    if isinstance(degrees, UnresolvedTarget):
        return degrees
    count = memory.cell.joints
    if any(degrees[count:]):
        return UnresolvedTarget(text, "too_many_joints")
    here = memory.here.joints
    kept = np.full(count, np.nan) if here is None else here
    if missing is not None:
        kept = np.full(count, missing)
    joints = [kept[i] if each is None else math.radians(each) for i, each in enumerate(degrees[:count])]
    return JointTarget(np.array(joints), _external(value))


def _pose(memory: ProgramMemory, value: Record, frames: Frames, text: str) -> Target:
    given = _components(value, FRAME_KEYS, text)
    if isinstance(given, UnresolvedTarget):
        return given
    if None in given:
        seen = memory.here.seen(*frames, memory.cell.flange)
        if seen is None:
            return UnresolvedTarget(text, "position_unknown")
        given = [old if each is None else each for each, old in zip(given, numbers_of(seen, "kuka"))]
    plain = tuple(each for each in given if each is not None)
    configuration = tuple((key, part) for key in ("S", "T") if (part := number(value.get(key))) is not None)
    return PoseTarget(pose_of(plain, "kuka"), configuration, external=_external(value))
