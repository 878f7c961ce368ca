"""The verdict of the trajectory stage, and what its page and recording say of paths."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.finding import is_one
from er3a.pipeline.language import as_text, with_unit, words
from er3a.pipeline.messages import expectations  # noqa: F401
from er3a.pipeline.messages.kinematics import singular_pose, singularity_word
from er3a.pipeline.messages.planning import STRATEGIES
from er3a.pipeline.messages.say import joined, listed, say, say_first, sentence, texts, word
from er3a.pipeline.stages.trajectory import model
from er3a.planning.motion_faults import by_kind, rate_ratio
from er3a.planning.names import FAULTS, FirstFault, StrategyName, in_order

KEY_FIGURES = words(
    {
        "safe": "Paths that pass in the model, of those meant to",
        "singular_poses": "Singular poses met, on paths meant to be safe (joint moves pass them unharmed)",
        "colliding": "Paths with a collision, of those meant to be safe",
        "max_joint_speed": "Joint speed nearest its limit, on paths meant to be safe",
        "assumed_speed_ratio": "Ratio to that joint's assumed limit",
        "speed_ratio": "Ratio to that joint's limit",
    }
)
KINDS: dict[model.PathKind, str] = words(
    {
        "joint": "joint move",
        "joint_sequence": "joint moves in sequence",
        "line": "straight line",
        "arc": "circular arc",
        "sequence": "lines and arcs in sequence",
        "table": "path from a table",
        "plan": "planned motion",
    }
)
NO_DEVIATION = 0.005  # mm or deg
NO_TIME = 0.005  # s
AT_EDGE = 1e-3  # s, before the edge of the reach, where the arm is stretched
MOMENT = 0.001  # s
LEAST_CHANGE = 0.5  # deg or mm
ADJOINING = 0.05  # s, between stretches that are told as one
WHOLE = 10.0  # from which on numbers are rounded to whole ones
PACE_MARGIN = 1.01  # by which a slower pace stays below the limits


TEXTS = texts(
    {
        "trajectory.paths": (
            "[{paths:?}{safe} of {paths} paths pass.][ Not safe: {faults:; }.][ Not followed to the end: "
            "{not_followed:, }.][ Doubt or fault in the program: {of_program:, }.][{near_assumed:?} Within the margin "
            "of assumed shapes: {near_assumed}.][ Expected to fail, and did: {demonstrations:, }.]"
        ),
        "paths_of": "{outcome:outcome}: {names:, }",
        "dependent_axes": "axes {axes:, } dependent",
        "smallest_singular_value": "smallest singular value {value:.3g}",
        "path.shown": "the figure shows the straight joint move",
        "path.harmless": "passes singular poses, which joint moves may: {places}",
        "path.no_fault": "no fault",
        "path.from": "from {t:.4g} s: {text}",
        "path.passed": "{type} within {distance} at t = {when} s",
        "path.stretch": "from t = {start:.4g} to {end:.4g} s",
        "path.worst": "{cause} at t = {t} s",
        "pair_touches": "{pair} overlap from t = {t0_s:.4g} s, up to {depth_mm:.1f} mm at t = {t_s:.4g} s",
        "path.singular": "{type} singularity",
        "bodies_overlap": "{touches:3; }",
        "path.rates": "until t = {end:.4g} s {rates}[; again from t = {again:.4g} s]",
        "path.rates_at_edge": "{named:, } too fast from there on, without bound towards the edge of the reach",
        "path.edge": "the edge of the reach: stretched towards it, the arm needs speeds without bound",
        "advice.none": "No repair: {why}",
        "advice.slower": (
            "Or run all of it at {percent:.3g} % of the programmed speed: {needed:.4g} s in all, its times × "
            "{longer:.4g}"
        ),
        "advice.within_reach": (
            "[From t = {first:.4g} s: {what}; ]out of reach from t = {t:.4g} s ({far:.1f} mm)[: move its end or the "
            "workpiece nearer{first:!}]"
        ),
        "advice.end": (
            "End early, at {t_s:.4g} s, [{margin:.1f} mm clear after the stop][{margin:!}{left_s:.2f} s before faults]"
            ". It is at ({xyz_mm:.1f, }) mm then; a stop takes {stop_s:.2f} s"
        ),
        "advice.slow_there": "Slow to {percent} % from {start:.2f} to {end:.2f} s",
        "advice.no_part": "Run no part of it",
        "advice.near": "it begins near a singular pose",
        "advice.region": "It still passes near the singular pose",
        "advice.repair": (
            "{way}[: {far} mm off]. [{takes:.2f} s, not {programmed:.2f} s]"
            "[Same time{takes:!}][; the tool turned by {turned}°][; {clearance:.1f} mm clear]"
        ),
        "advice.switch": (
            "[It begins at other joint angles ({changes:, }): the way there was not checked][The move to the other "
            "solution is part of it and was checked{changes:!}]"
        ),
    }
)


def kind_word(kind: model.PathKind) -> str:
    """What kind of path it is."""
    return word("trajectory.kind", KINDS, kind)


def event_word(event: model.Singularity) -> str:
    """A singularity's type, or the axes that become dependent where the field has no name for it."""
    if event.type != "dependent_axes":
        return singularity_word(event.type)
    return sentence("dependent_axes", axes=event.axes)


def event_distance(event: model.Singularity) -> str:
    """How far from the singular set a pass is, with its unit."""
    if event.distance_deg is not None:
        return with_unit(f"{event.distance_deg:.3g}", "deg")
    if event.distance_mm is not None:
        return f"{event.distance_mm:.3g} mm"
    return sentence("smallest_singular_value", value=event.smallest_singular_value)


def strategy_word(name: StrategyName) -> str:
    """A strategy's name."""
    return word("strategy", STRATEGIES, name)


def path_text(path: model.PathSummary) -> str:
    """What is wrong with a path, each fault after its time; or which singular poses it passes, or that it has no
    fault."""
    if path.not_planned:
        return joined([say(path.not_planned), sentence("path.shown")])
    if found := first_faults(path):
        return joined(sentence("path.from", t=each.t_s, text=each.text) for each in found)
    if not path.in_joint_space and path.singularities:
        return joined(map(say, path.singularities))
    met = [say(event) for event in path.singularities if event.crossing]
    return sentence("path.harmless", places=joined(met)) if met else sentence("path.no_fault")


@say.register
def _(event: model.Singularity) -> str:
    when = f"{event.t_s:.4g}" if event.t_s == event.until_s else f"{event.t_s:.4g} – {event.until_s:.4g}"
    if event.crossing:
        return sentence("path.worst", cause=_kind(event), t=when)
    return sentence("path.passed", type=_kind(event), when=when, distance=event_distance(event))


def _kind(event: model.Singularity) -> str:
    """What a singular pose is called in a sentence."""
    return event_word(event) if event.type == "dependent_axes" else sentence("path.singular", type=event_word(event))


@say.register
def _(jump: model.Jump) -> str:
    return sentence("branch_ends", t_s=jump.t_s, joint=jump.joint)


def cause_text(part: model.Stretch) -> str:
    """Why a stretch of a path is listed."""
    return _with_worst(part, say(part.cause))


class FaultText(NamedTuple):
    """A fault of a path: when it begins (s), how it is said, when it is best seen, and whether another one of the path
    leads to it."""

    t_s: float
    text: str
    seen_s: float
    follows: bool = False


def first_faults(path: model.PathSummary) -> list[FaultText]:
    """What makes a path fail, and what is wrong first: where each begins, in the library's order
    (:func:`er3a.planning.names.in_order`)."""
    stretches = by_kind(path.faults)
    spans = {kind: [(part.t0_s, part.t1_s) for part in parts] for kind, parts in stretches.items()}
    found = in_order(spans | {"singular": [(event.t_s, event.t_s) for event in path.singular]}, path.duration_s)
    first = min(found, key=lambda each: each.start, default=None)
    shown = [each for each in found if each is first or (each.kind in FAULTS and not each.follows)]
    return [
        _said(path, each, [stretches[each.kind][i] for i in each.parts if each.kind in stretches]) for each in shown
    ]


def _said(path: model.PathSummary, fault: FirstFault, parts: list[model.Stretch]) -> FaultText:
    seen = fault.start
    if fault.kind == "singular":
        event = path.singular[fault.parts[0]]
        text = _kind(event) if isinstance(event, model.Singularity) else say(event)
    elif fault.kind.startswith("too fast"):
        text, worst = _rates(parts, fault.follows), _worst_of_kinds(_run(parts)[0])[0].worst_s
        seen = seen if worst is None else worst
    else:
        text = _with_worst(parts[0], say_first(parts[0].cause))
    return FaultText(fault.start, text, seen, fault.follows)


def _edge(path: model.PathSummary) -> float:
    """When (s) a path first leaves the reach; infinite where it does not."""
    return min((part.t0_s for part in path.of("unreachable")), default=math.inf)


def cause_of(path: model.PathSummary) -> str:
    """The singular pose, or the edge of the reach, that a path's faults come from; empty where none is known."""
    if path.in_joint_space or path.not_planned:
        return ""
    edge = _edge(path)
    for event in path.singularities:
        if event.t_s < edge - AT_EDGE and any(_beside(event, part) for part in path.too_fast):
            pose = singular_pose(event.type)
            return sentence("path.cause", event=say(event), pose=pose) if pose else say(event)
    if path.verdict in ("singular", "near-singular") and path.singularities:
        return singular_pose(path.singularities[0].type)
    return sentence("path.edge") if any(each.follows for each in first_faults(path)) and path.of("unreachable") else ""


def _beside(event: model.Singularity, part: model.Stretch) -> bool:
    return part.t0_s - ADJOINING <= event.until_s and event.t_s <= part.t1_s + ADJOINING


def _run(stretches: Sequence[model.Stretch]) -> tuple[list[model.Stretch], float | None]:
    """The first of stretches with those that adjoin, and when (s) the next one begins."""
    first, *later = sorted(stretches, key=lambda part: part.t0_s)
    run = [first]
    for part in later:
        if part.t0_s > _end_of(run) + ADJOINING:
            return run, part.t0_s
        run.append(part)
    return run, None


def _end_of(run: Sequence[model.Stretch]) -> float:
    return max(part.t1_s for part in run)


def _worst_of_kinds(run: Sequence[model.Stretch]) -> list[model.Stretch]:
    """Of each kind of limit the stretch that exceeds it most, speeds first."""
    kinds: dict[str, list[model.Stretch]] = {}
    for part in sorted(run, key=lambda part: not is_one(part.cause, "too_fast")):
        kinds.setdefault(f"{part.cause.code} {part.cause.limit.unit}", []).append(part)
    return [max(alike, key=lambda part: rate_ratio(part.cause)) for alike in kinds.values()]


def _rates(stretches: Sequence[model.Stretch], at_edge: bool = False) -> str:
    """What is too fast first, of all joints: stretches that adjoin are one, and each kind of limit has its worst.

    ``at_edge``: whether it follows from leaving the reach; towards its edge speeds have no bound.
    """
    run, again = _run(stretches)
    first, end = run[0], _end_of(run)
    named = [f"J{joint}" for joint in sorted({part.cause.joint for part in run})]
    if at_edge:
        return sentence("path.rates_at_edge", named=named)
    if len(run) == 1 and not _lasts(first):
        return say(first.cause)
    worst = [_with_worst(part, say(part.cause)) for part in _worst_of_kinds(run)]
    return sentence("path.rates", end=end, rates=sentence("rates", joints=named, worst=worst), again=again)


def _with_worst(part: model.Stretch, cause: str) -> str:
    """A cause, and when it is worst on a stretch that is not but a moment."""
    if part.worst_s is None or not _lasts(part):
        return cause
    return sentence("path.worst", cause=cause, t=f"{part.worst_s:.4g}")


def _lasts(part: model.Stretch) -> bool:
    return part.t1_s - part.t0_s >= MOMENT


class Slowed(NamedTuple):
    """From when to when (s, as programmed) a motion on the path is slower than programmed, and to what part of it."""

    start_s: float
    end_s: float
    part: float


def no_repair(path: model.PathSummary) -> str:
    """Why no strategy repairs a path."""
    if len(path.avoidance) == 1:
        (only,) = path.avoidance
        if only.name == "planned":
            return sentence("advice.none", why=reasons(only))
        why = sentence("path.cause", event=strategy_word(only.name), pose=reasons(only))
        return sentence("advice.none", why=why)
    if path.of("unreachable"):
        spans = [sentence("path.stretch", start=each.t0_s, end=each.t1_s) for each in path.of("unreachable")]
        why = sentence("path.cause", event=joined(spans, ", "), pose=sentence("beyond_reach"))
    else:
        causes = [say(part.cause) for part in path.of("leaves limits")] or [reasons(tried) for tried in path.avoidance]
        why = joined(dict.fromkeys(causes))
    return _within_reach(path) or sentence("advice.none", why=why)


def end_text(path: model.PathSummary, end: model.SoundEnd) -> str:
    """That a path may be run to a point of it, and by how much it is clear up to there, if that was measured; then why
    no motion repairs it."""
    last, parts = path.clear_until, vars(end) | {"margin": None}
    if last and end.t_s >= last.t_s:
        parts |= {"margin": last.margin_mm, "stop_s": last.stop_s}
    return sentence("finding", finding=joined([sentence("advice.end", **parts), no_repair(path)], ". "))


def whole_pace(path: model.PathSummary) -> str:
    """The pace at which the whole path keeps the limits, and the setting that gives it; empty where none does."""
    speed, acceleration = path.max_joint_speed_ratio, path.max_joint_acceleration_ratio
    other = bool(path.of("unreachable") or path.of("leaves limits") or path.of("collides") or path.jumps)
    other = other or any(is_one(each.cause, "jerk_too_great") for each in path.too_fast)
    if path.strategy != "slow" or speed is None or acceleration is None or other or not path.too_fast:
        return ""
    longer = PACE_MARGIN * max(1.0, speed, acceleration**0.5)
    return sentence("advice.slower", percent=100 / longer, needed=path.duration_s * longer, longer=longer)


def _within_reach(path: model.PathSummary) -> str:
    """How far a path that leaves the reach could be used; empty for others."""
    part = min(path.of("unreachable"), key=lambda part: part.t0_s, default=None)
    if part is None or part.s0_m <= 0:
        return ""
    first = min(first_faults(path))
    before = first.t_s if first.t_s < part.t0_s else None
    return sentence("advice.within_reach", t=part.t0_s, far=part.s0_m * 1000, first=before, what=first.text)


def reasons(tried: model.TriedStrategy) -> str:
    """Why a strategy is not possible or not usable; empty where it is."""
    return joined(listed(tried.reasons))


def repair_text(path: model.PathSummary, slowed: Slowed | None = None, switch: str = "") -> str:
    """All that is said of the strategy that was chosen; ``switch``: of its start, as :func:`switch_text` says it."""
    motion = _chosen(path).motion
    passes = path.singularities and not path.in_joint_space and motion and not motion.keeps_clear
    near = sentence("advice.region") if passes else ""
    return sentence("finding", finding=joined([repair_lead(path, slowed), near, switch, whole_pace(path)], ". "))


def repair_lead(path: model.PathSummary, slowed: Slowed | None = None) -> str:
    """What the strategy that was chosen does, and what it costs."""
    return strategy_text(path, _chosen(path), slowed)


def strategy_text(path: model.PathSummary, tried: model.TriedStrategy, slowed: Slowed | None = None) -> str:
    """What a strategy that is possible does, and what it costs."""
    motion = tried.motion
    if motion is None:
        raise ValueError(f"{path.name} has no motion by {tried.name}")
    clearance = math.floor(10 * motion.clearance.least_mm) / 10 if motion.clearance else None
    way = strategy_word(tried.name)
    if slowed:
        percent = math.floor(100 * slowed.part)
        way = sentence("advice.slow_there", start=slowed.start_s, end=slowed.end_s, percent=percent)
    return sentence(
        "advice.repair",
        way=way,
        far=_shortly(motion.max_deviation_mm),
        turned=_shortly(motion.max_deviation_deg),
        takes=None if abs(motion.duration_s - path.duration_s) < NO_TIME else motion.duration_s,
        programmed=path.duration_s,
        clearance=clearance,
    )


def _chosen(path: model.PathSummary) -> model.TriedStrategy:
    if path.chosen is None:
        raise ValueError(f"{path.name} has no motion that repairs it")
    return path.chosen


def _shortly(value: float) -> str | None:
    """A deviation, mm or deg, in two digits; None where there is none."""
    if value < NO_DEVIATION:
        return None
    return f"{value:.2g}" if value < WHOLE else f"{value:.0f}"


def switch_text(change: Sequence[float], sliding: Sequence[int]) -> str:
    """Whether the move to another IK solution is part of the motion that takes it, and how far it is if not.

    ``change``: of each joint between the programmed start and the motion's, deg, mm where it is one of ``sliding``.
    """
    moved = [(joint, value) for joint, value in enumerate(change, 1) if abs(value) >= LEAST_CHANGE]
    changes = [with_unit(f"J{j} {as_text(value, '+.0f')}", "mm" if j in sliding else "deg") for j, value in moved]
    return sentence("advice.switch", changes=changes)
