"""Random paths of every kind, the trajectory stage's verdicts on them, and which of these the oracle contradicts."""

from __future__ import annotations

import csv
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from er3a.collision.along import ClearanceAlong
from er3a.collision.matrix import collision_matrix
from er3a.collision.scene import Box, Cylinder, Plane, Sphere
from er3a.collision.shapes import arm_shapes
from er3a.files.path_file import PathFile
from er3a.files.yaml_file import parse
from er3a.geometry.transforms import rpy_of
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import TYPES, NearSingular
from er3a.pipeline.stages.trajectory.judgement import Judgement
from er3a.pipeline.stages.trajectory.judgement import judged as judgement_of
from er3a.pipeline.stages.trajectory.motion import Motion, MotionTask, motion_of
from er3a.planning.commands import CommandSource
from er3a.planning.motion_faults import RATES
from er3a.planning.names import TOO_FAST, PathVerdict
from er3a.planning.timing import JointLimits, joint_limits
from testing.dense_contacts import Contacts
from testing.motion_oracle import GRAZING, GRAZING_JERK, TOUCH, Truth, arm_of, factors, joint_path, truth

NEAR = NearSingular(float(np.radians(5)), float(np.radians(5)), 0.03)
ASSUMED = np.radians([180, 180, 180, 360, 360, 360])
JOINT_KINDS = ("joint moves", "joint sequences", "joint tables")
TOOL_KINDS = ("lines", "arcs", "rounded sequences")
JERK_TIME_S = 0.1  # in which a joint may reach its full acceleration, of paths with a limit of jerk
GRAVITY: tuple[PathVerdict, ...] = ("safe", "near-singular", "undecided", "too fast for the assumed limits", "singular")
BESIDE = 3  # points of the oracle by which its times may be off
CHECKS = 4


@dataclass
class Tally:
    """Counts over paths: what the oracle finds, what of it is missed, what is invented, paths left undecided.

    ``milder`` are verdicts that are milder than what the oracle finds.
    """

    paths: int = 0
    crossings: int = 0
    missed_crossings: int = 0
    invented_crossings: int = 0
    stretches: list[int] = field(default_factory=lambda: [0, 0, 0, 0])
    missed: list[int] = field(default_factory=lambda: [0, 0, 0, 0])
    invented: list[int] = field(default_factory=lambda: [0, 0, 0, 0])
    unreachable: int = 0
    missed_unreachable: int = 0
    undecided: int = 0
    safe: int = 0
    milder: int = 0


def table_of(robot) -> dict:
    """An arm's table as plain numbers."""
    names = ("convention", "a", "alpha", "d", "offset", "direction", "lower", "upper", "base", "tool")
    return {name: getattr(robot, name) for name in names}


def random_spec(robot, kind, random, folder: Path) -> tuple[dict, dict]:
    """A path as plain numbers, and as the path file writes it; some with a limit of jerk, some accelerations known."""
    made = _joint_spec(robot, kind, random, folder) if kind in JOINT_KINDS else _tool_spec(robot, kind, random)
    made[0].update(limits_jerk=bool(random.random() < 0.4), known_acceleration=bool(random.random() < 0.5))
    return made


def limits_of(robot, spec) -> JointLimits:
    """The limits of a path's rates."""
    limits = joint_limits(robot, ASSUMED, 0.25)
    jerk = limits.acceleration / JERK_TIME_S if spec["limits_jerk"] else None
    return replace(limits, jerk=jerk, acceleration_assumed=not spec["known_acceleration"])


def _joint_spec(robot, kind, random, folder):
    low, high = np.degrees([robot.lower, robot.upper])
    wide = random.uniform(0.7, 1.02)
    if kind == "joint moves":
        ends = random.uniform(low, high, (2, 6)) * wide
        rates = random.normal(0, [[60] * 6, [60] * 6, [150] * 6, [150] * 6])
        spec = {"kind": "joint", "start_deg": ends[0], "end_deg": ends[1], "duration_s": random.uniform(0.6, 3)}
        names = ("start_velocity_deg_s", "end_velocity_deg_s", "start_acceleration_deg_s2", "end_acceleration_deg_s2")
        spec |= dict(zip(names, rates))
        return spec, _written(spec)
    count = int(random.integers(3, 20))
    points = random.uniform(low, high, (count, 6)) * wide
    shortest = np.abs(np.diff(points, axis=0)).max(axis=1).min()
    blend = random.choice([0.0, random.uniform(0, 0.5) * shortest])
    duration = count * random.uniform(0.3, 1.5)
    if kind == "joint sequences":
        spec = {"kind": "joint_sequence", "points_deg": points, "blend_deg": blend, "duration_s": duration}
        written = _written(spec)
        if random.random() < 0.5:
            spec["ramp_share"] = written["ramp_share"] = float(random.uniform(0.1, 0.5))
            written["profile"] = "trapezoid"
        return spec, written
    times = np.concatenate([[0.0], np.cumsum(random.uniform(0.3, 1.5, count - 1))])
    file = folder / f"{random.integers(1 << 40)}.csv"
    with file.open("w", newline="") as out:
        rows = csv.writer(out)
        rows.writerow(["t_s", *(f"q{j}_deg" for j in range(1, 7))])
        rows.writerows([repr(float(t)), *map(repr, map(float, q))] for t, q in zip(times, points))
    spec = {"kind": "table", "points_deg": points, "blend_deg": blend, "times_s": times}
    return spec, {"kind": "table", "file": str(file), "blend_deg": float(blend)}


def _tool_spec(robot, kind, random):
    q = random.uniform(robot.lower, robot.upper) * 0.9
    count = {"lines": 1, "arcs": 2, "rounded sequences": int(random.integers(2, 5))}[kind]
    q = q + np.concatenate([np.zeros((1, 6)), np.cumsum(random.uniform(-0.3, 0.3, (count, 6)), axis=0)])
    T = forward(robot, q)
    values = np.concatenate([T[:, :3, 3] * 1000, np.degrees([rpy_of(pose) for pose in T])], axis=1)
    spec = {"poses": values, "duration_s": count * random.uniform(0.3, 3.0), "q_start": q[0], "kind": kind}
    start = {"start_deg": np.degrees(q[0]).tolist()}
    ends = [{"xyz_mm": v[:3].tolist(), "rpy_deg": v[3:].tolist()} for v in values]
    if kind == "arcs":
        spec |= {"kind": "arc", "via_mm": values[1, :3], "poses": values[[0, 2]]}
        written = {"kind": "arc", "via_mm": ends[1]["xyz_mm"], "end": ends[2]}
    elif kind == "lines":
        written = {"kind": "line", "end": ends[1]}
    else:
        sizes = np.linalg.norm(np.diff(values[:, :3], axis=0), axis=1)
        blends = random.uniform(0, 0.5, count - 1) * np.minimum(sizes[:-1], sizes[1:])
        spec["blends_mm"] = blends
        parts = [{"kind": "line", "end": end, "blend_mm": float(b)} for end, b in zip(ends[1:], [*blends, 0.0])]
        written = {"kind": "sequence", "segments": parts}
    written |= start | {"duration_s": float(spec["duration_s"])}
    if random.random() < 0.3:
        spec["ramp_share"] = written["ramp_share"] = float(random.uniform(0.1, 0.5))
        written["profile"] = "trapezoid"
    return spec, written


def _written(spec):
    return {key: value.tolist() if isinstance(value, np.ndarray) else float(value) if key != "kind" else value
            for key, value in spec.items()}  # fmt: skip


NO_BODIES: Any = None
NOTHING_MET = ClearanceAlong(np.empty(0), np.empty(0), (), np.empty(0, int), (), 0)


def judged(robot, written, samples, limits: JointLimits) -> tuple[Motion, Judgement]:
    """What the stage says of a path by the joints alone, at so many samples."""
    whole = {"name": "x", "title": "x", "samples": samples, **written}
    entry = parse(PathFile, {"kind": "paths", "paths": [whole]}, None).paths[0]
    motion = motion_of(robot, entry, CHECKS, CommandSource(None, ""), {})
    return motion, judgement_of(MotionTask(robot, NO_BODIES, 0.0, limits, 0, near=NEAR), motion, NOTHING_MET)


def looked_at(robot, spec, points: int) -> Truth:
    """What the oracle sees of a path at so many points."""
    limits = limits_of(robot, spec)
    rates = [limits.speed, limits.acceleration, *([] if limits.jerk is None else [limits.jerk])]
    return truth(spec, arm_of(table_of(robot)), rates, spec.get("q_start"), points)


def compare(robot, spec, written, samples, tally: Tally, seen: Truth) -> list[str]:
    """Add a path to the tally; what is missed or invented, in words."""
    limits, arm = limits_of(robot, spec), arm_of(table_of(robot))
    motion, found = judged(robot, written, samples, limits)
    wrong: list[str] = []
    tally.paths += 1
    tally.undecided += found.verdict == "undecided"
    tally.safe += found.verdict == "safe"
    beyond = found.faults.get("unreachable")
    ends = bool(beyond) or bool(motion.followed and motion.followed.jumps)
    if seen.out_of_reach or beyond:
        tally.unreachable += 1
        if not (seen.out_of_reach and ends and found.verdict != "safe"):
            tally.missed_unreachable += 1
            wrong.append(f"reach: oracle {seen.out_of_reach}, stage {ends}")
        return wrong
    if any(event.crossing for event in found.events) and "q_start" in spec:
        return wrong  # which branch goes on behind it is a choice
    near = BESIDE * (seen.t[1] - seen.t[0])
    claimed = [
        (_order(part.cause.code), part.cause.joint - 1, part.start, part.end)
        for kind in ("leaves limits", *TOO_FAST)
        for part in found.faults.get(kind, ())
    ]
    for order, joint, start, end in seen.stretches:
        tally.stretches[order] += 1
        if not any(c[:2] == (order, joint) and c[2] <= end + near and c[3] >= start - near for c in claimed):
            tally.missed[order] += 1
            wrong.append(f"missed order {order} J{joint + 1} {start:.6f}..{end:.6f}")
    shown = [(order, joint, start, end) for order, joint, start, end in seen.stretches]
    for order, joint, start, end in claimed:
        if end - start > 2 * near and not any(
            s[:2] == (order, joint) and s[2] <= end + near and s[3] >= start - near for s in shown
        ):
            ratio = _ratio(motion, limits, seen, order, joint, start, end)
            if ratio > 1 + 3 * GRAZING + seen.blur[order] / _limit(limits, order, joint):
                tally.invented[order] += 1
                wrong.append(f"invented order {order} J{joint + 1} {start:.6f}..{end:.6f} ratio {ratio}")
    least = max((_shown(limits, order, joint) for order, joint, *_ in seen.stretches), default=0)
    if _gravity(found.verdict) < least:
        tally.milder += 1
        wrong.append(f"milder: {found.verdict}")
    if "q_start" not in spec:
        _crossings(arm, spec, seen, found, tally, wrong)
    return wrong


def _gravity(verdict: PathVerdict) -> int:
    """How grave a verdict is; those that no limit of a rate leads to are as grave as known ones."""
    return GRAVITY.index(verdict) if verdict in GRAVITY else len(GRAVITY)


def _shown(limits: JointLimits, order: int, joint: int) -> int:
    """How grave the verdict has to be where a limit is exceeded."""
    assumed = {1: limits.speed_assumed is not None and limits.speed_assumed[joint], 2: limits.acceleration_assumed}
    return GRAVITY.index("too fast for the assumed limits") if assumed.get(order) else len(GRAVITY)


def _ratio(motion, limits, seen, order, joint, start, end):
    if order == 0:
        return 2.0
    if order == 3:  # above the limit, where the oracle's means are not even near
        here = (seen.t[: len(seen.jerk)] >= start - seen.jerk_span) & (seen.t[: len(seen.jerk)] <= end)
        near = np.abs(seen.jerk[here, joint]).max(initial=0.0) > limits.jerk[joint] * (1 - GRAZING_JERK)
        return 1.0 if near or end - start < 3 * seen.jerk_span else 2.0
    values = motion.rates(np.linspace(start, end, 50))[order][:, joint]
    return float(np.nanmax(np.abs(values)) / _limit(limits, order, joint))


def _limit(limits: JointLimits, order: int, joint: int) -> float:
    """Of a speed or an acceleration; others are not measured in these."""
    return float((np.inf, *limits.speed[[joint]], *limits.acceleration[[joint]], np.inf)[order])


def _order(code: str) -> int:
    return 1 + [*RATES].index(code) if code in RATES else 0


def _crossings(arm, spec, seen, found, tally, wrong):
    """One to one: of two next to each other with no way between them, either may be called a touch."""
    near = 1e-6 * seen.t[-1]
    joints = joint_path(spec)[0]
    for kind, name in enumerate(TYPES):
        theirs = [time for k, time in seen.crossings if k == kind]
        ours = [(event.t, event.until) for event in found.events if event.crossing and event.type == name]
        tally.crossings += len(theirs)
        for time in theirs:
            at = next((event for event in ours if event[0] - near <= time <= event[1] + near), None)
            if at is None:
                tally.missed_crossings += 1
                wrong.append(f"missed {name} crossing at {time:.9f}")
            elif at[0] == at[1]:
                ours.remove(at)
        for start, _ in ours:
            size = abs(factors(arm, joints(np.array([start])))[0, kind])
            if size > TOUCH:
                tally.invented_crossings += 1
                wrong.append(f"invented {name} crossing at {start:.9f}, distance {size:.2e}")


def contacts_of(robot, scene) -> Contacts:
    """An arm in a scene, for distances that rest on nothing of er3a but what the arm and the scene are."""
    capsules = [(part.link, part.start, part.end, part.radius) for part in arm_shapes(robot).capsules]
    solids = []
    for solid in scene.solids:
        match solid:
            case Box():
                solids.append(("box", tuple(solid.size), solid.T))
            case Cylinder():
                solids.append(("cylinder", (solid.radius, solid.length), solid.T))
            case Sphere():
                solids.append(("sphere", (solid.radius,), solid.T))
            case Plane():
                solids.append(("plane", (solid.normal, solid.offset), None))
            case _:
                raise TypeError(f"{solid.name}: the dense check has no distance to a {type(solid).__name__}")
    met = {(row.first, row.second) for row in collision_matrix(robot).rows if row.state == "meets"}
    named = ["base" if capsule.link == 0 else f"link_{capsule.link}" for capsule in arm_shapes(robot).capsules]
    pairs = [(i, j) for i, first in enumerate(named) for j, second in enumerate(named) if (first, second) in met]
    return Contacts(table_of(robot), capsules, tuple(pairs), solids)
