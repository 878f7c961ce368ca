"""The verdict of the trajectory stage, and what its page and recording say of paths."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.collision.pairs import LinkAndSolid
from er3a.pipeline.messages.expectations import demonstrated, outcome_word
from er3a.pipeline.messages.kinematics import singularity_word
from er3a.pipeline.messages.language import N_, as_text, with_unit
from er3a.pipeline.messages.left_out import names_in_words
from er3a.pipeline.messages.planning import STRATEGIES as ADVICE
from er3a.pipeline.messages.planning import rate_needed
from er3a.pipeline.messages.say import Plural, joined, listed, say, say_first, sentence, texts, word
from er3a.pipeline.stages.trajectory import model
from er3a.planning.motion_faults import JerkTooGreat, RateCause
from er3a.planning.names import PathVerdict, StrategyName

KEY_FIGURES = {
    "safe": N_("Paths that pass in the model, of those meant to"),
    "singular_poses": N_("Singular poses met, on paths meant to be safe (joint moves pass them unharmed)"),
    "near_passes": N_("Near-singular passes, on paths meant to be safe"),
    "colliding": N_("Paths with a collision, of those meant to be safe"),
    "max_joint_speed": N_("Joint speed nearest its limit, on paths meant to be safe"),
    "assumed_speed_ratio": N_("Ratio to that joint's assumed limit"),
    "speed_ratio": N_("Ratio to that joint's limit"),
    "velocity_check": N_("Velocity check, greatest error"),
    "characteristic_length": N_("Characteristic length of the Jacobian"),
}
KINDS: dict[model.PathKind, str] = {
    "joint": N_("joint move"),
    "joint_sequence": N_("joint moves in sequence"),
    "line": N_("straight line"),
    "arc": N_("circular arc"),
    "sequence": N_("lines and arcs in sequence"),
    "table": N_("path from a table"),
    "plan": N_("planned motion"),
}
STRATEGIES: dict[StrategyName, str] = {
    "slow": N_("slow down on the path"),
    "branch": N_("another IK solution first"),
    "via_shift": N_("via point, tool point shifted"),
    "via_tilt": N_("via point, tool tilted"),
    "damped": N_("damped least squares"),
    "detour": N_("joint move across the region"),
    "stop": N_("stop before it, with an alarm"),
    "planned": N_("planned motion of the joints"),
}
BY_JOINTS: tuple[StrategyName, ...] = ("branch", "detour", "planned")  # ways that no path of the tool shows
MAX_PAIRS = 3
NO_DEVIATION = 0.005  # mm or deg
NO_TIME = 0.005  # s
AT_EDGE = 1e-3  # s, before the edge of the reach, where the arm is stretched
MOMENT = 0.001  # s
LEAST_CHANGE = 0.5  # deg or mm
ADJOINING = 0.05  # s, between stretches that are told as one
FULL_SPEED = 0.995  # of a joint's limit, which rounds to 100 %
WHOLE = 10.0  # from which on numbers are rounded to whole ones
IF_ASSUMED = "_if_assumed"  # ends the codes of faults against assumed limits
PACE_MARGIN = 1.01  # by which a slower pace stays below the limits


TEXTS = texts(
    {
        "trajectory.paths": Plural(
            "count", "{safe} of {count} path passes in the model", "{safe} of {count} paths pass in the model"
        ),
        "trajectory.not_followed": "{count} not followed to the end ({names})",
        "trajectory.fault": "{word}: {count} ({names})",
        "trajectory.near_assumed": "within the margin of assumed shapes: {count}",
        "dependent_axes": "axes {axes} dependent",
        "smallest_singular_value": "smallest singular value {value:.3g}",
        "path.safe": "far from singular poses, within limits and reach",
        "path.shown": "the figure shows the straight joint move",
        "path.harmless": "passes singular poses ({places}); joint moves are unaffected by singularities",
        "path.no_fault": "no fault",
        "path.pace#profile": (
            "only the speed profile is at fault, not the path: slower there and faster elsewhere, the "
            "{programmed:.2f} s programmed are enough (at its fastest it takes {fastest:.2f} s)"
        ),
        "path.pace#least": "it takes at least {fastest:.2f} s",
        "path.speeds#unbounded": "no finite joint speed follows the path there",
        "path.speeds#bounded": (
            "joint speeds stay finite there, but a controller may stop or change to another configuration"
        ),
        "singularity.passed": "{type} singularity within {distance} at t = {when} s",
        "dependent.passed": "close to {type} at t = {when} s ({distance})",
        "singularity.met": "{type} singularity at t = {when} s",
        "dependent.met": "{type} at t = {when} s",
        "path.jump": "the branch in use ends at t = {t:.4g} s, J{joint} would jump",
        "path.stretch": "{when}: {cause}",
        "path.worst": "{cause} at t = {t:.4g} s",
        "path.when": "from t = {start:.4g} to {end:.4g} s",
        "pair_touches": "{pair} overlap from t = {t0_s:.4g} s, up to {depth_mm:.1f} mm at t = {t_s:.4g} s",
        "bodies_overlap.more": "{touches}; and more later",
        "path.either_way": "{open}; the path is not safe in either case",
        "path.singular": "{type} singularity",
        "path.rates": Plural(
            "joints",
            "{named} exceeds {limits} until t = {end:.4g} s: {worst:; }",
            "{named} exceed {limits} until t = {end:.4g} s: {worst:; }",
        ),
        "path.rates#known": "the stated limits",
        "path.rates#assumed": "the assumed limits",
        "path.rate": "at worst {needed} at t = {t:.4g} s",
        "path.rates#again": "{rates}; and again from t = {again:.4g} s",
        "advice.out_of_reach": "it is out of reach {when}",
        "advice.only": "{way}, as the study requires, does not repair it: {reason}",
        "advice.none": "No avoidance strategy completes this path: {why}",
        "advice.no_strategy": "No avoidance strategy works: {reason}",
        "advice.slower": (
            "If its speed can't vary along the path, run all of it at {percent:.3g} % of the programmed speed: "
            "duration_s {needed:.4g} in the path file"
        ),
        "advice.clear_until": (
            "It keeps {margin:.1f} mm of clearance up to t = {t:.4g} s ({far:.1f} mm) and in a stop from there "
            "({stop:.2f} s): end the path there, with the tool at x, y, z = {xyz} mm and roll, pitch, yaw = {rpy} deg "
            "(joints {q}), or move its end or the body that it hits: {pair} touch at {contact} mm"
        ),
        "advice.clear_until#links": (
            "It keeps {margin:.1f} mm of clearance up to t = {t:.4g} s ({far:.1f} mm) and in a stop from there "
            "({stop:.2f} s): end the path there, with the tool at x, y, z = {xyz} mm and roll, pitch, yaw = {rpy} deg "
            "(joints {q}), or move the path: {pair} touch at {contact} mm"
        ),
        "advice.within_reach": (
            "It is within reach up to t = {t:.4g} s ({far:.1f} mm of the path): move its end or the workpiece nearer "
            "to the arm"
        ),
        "advice.within_reach#later": (
            "From t = {first:.4g} s: {what}; from t = {t:.4g} s ({far:.1f} mm of the path) it is out of reach besides"
        ),
        "advice.sound": (
            "End it at t = {t:.4g} s, with the tool at x, y, z = {xyz} mm, {left:.2f} s before the first fault (a stop "
            "takes {stop:.2f} s), or move the path"
        ),
        "advice.no_part": "No part of it may be run as it is",
        "advice.end": (
            "End it there, with the tool at x, y, z = {xyz} mm: {left:.2f} s before the first fault (a stop takes "
            "{stop:.2f} s)."
        ),
        "advice.end#clear": (
            "End it there, with the tool at x, y, z = {xyz} mm: {margin:.1f} mm clear, also after a stop from there "
            "({stop:.2f} s)."
        ),
        "advice.end#assumed": (
            "End it there, with the tool at x, y, z = {xyz} mm: {margin:.1f} mm clear of assumed shapes, also after a "
            "stop from there ({stop:.2f} s); it touches if the true shapes are larger by more than that."
        ),
        "advice.chosen": "{way}: {tool}; {time}",
        "advice.chosen#clear": "{way}: {tool}; {time}; the arm keeps {clearance:.1f} mm of clearance",
        "advice.of_assumed": "Clearance is that of assumed shapes: the true ones may come nearer",
        "advice.slowly": "This is its shortest time, quicker than the {programmed:.2f} s programmed: another motion",
        "advice.near": "No part of it is safe: the arm is near-singular at the start",
        "advice.near#met": "No part of it is safe: the arm is singular at the start",
        "advice.region": "It still passes near the singular pose",
        "advice.full_speed": "A joint moves at full speed: start slowly",
        "limits_assumed#both": "Joint speeds and accelerations are assumed: what passes may be too fast for the arm.",
        "limits_assumed#speed": "Joint speeds are assumed: what passes may be too fast for the arm.",
        "limits_assumed#acceleration": "Joint accelerations are assumed: what passes may be too fast for the arm.",
        "advice.limits#both": (
            "It uses up to {speed:.0f} % of the assumed joint speeds and {acceleration:.0f} % of the assumed "
            "accelerations; the controller's own 100 % may be faster: begin at 10 % override"
        ),
        "advice.limits#speed": (
            "It uses up to {speed:.0f} % of the assumed joint speeds; the controller's own 100 % may be faster: begin "
            "at 10 % override"
        ),
        "advice.limits#acceleration": "It uses up to {acceleration:.0f} % of the assumed joint accelerations",
        "advice.tool#both": "the tool leaves the path by {far} mm and {turned} deg",
        "advice.tool#none": "the tool stays on the path",
        "advice.tool#far": "the tool leaves the path by {far} mm",
        "advice.tool#turned": "the tool leaves the path by {turned} deg",
        "advice.swing": "{tool}; J{joint} turns most, by {swing:.0f} deg",
        "advice.switch#before": (
            "It begins at other joint angles than programmed ({changes}): the way there is not part of it and was not "
            "checked"
        ),
        "advice.switch#within": "The move to the other solution is part of it and was checked",
        "advice.time#less": "{takes:.2f} s instead of {programmed:.2f} s",
        "advice.time#same": "same time as programmed",
        "advice.time#slower_there": "same time as programmed, slower there and faster elsewhere",
        "advice.time#more": "{longer:.2f} s longer than programmed",
    }
)


@say.register
def _(found: model.PathCounts) -> str:
    unsafe: dict[PathVerdict, tuple[str, ...]] = {
        "unreachable": found.unreachable,
        "none found": found.none_found,
        "leaves limits": found.leaves_limits,
        "collides": found.collides,
        "too fast": found.too_fast,
        "singular": found.singular,
        "too fast for the assumed limits": found.too_fast_if_assumed,
        "undecided": found.undecided,
        "near-singular": found.near_singular,
    }
    faults = []
    for verdict, names in unsafe.items():
        parts = {"count": len(names), "word": outcome_word(verdict), "names": joined(names, ", ")}
        faults.append(sentence("trajectory.fault", **parts) if names else "")
    safe = sentence("trajectory.paths", count=found.paths + len(found.demonstrations), safe=found.safe)
    if found.not_followed:
        parts = {"count": len(found.not_followed), "names": joined(found.not_followed, ", ")}
        faults.append(sentence("trajectory.not_followed", **parts))
    if near := found.paths - found.safe - len(found.not_followed) - sum(map(len, unsafe.values())):
        faults.append(sentence("trajectory.near_assumed", count=near))
    sentences = [safe if found.paths else "", joined(faults, ", "), demonstrated(found.demonstrations, found.paths)]
    return sentence("finding", finding=joined(sentences))


def kind_word(kind: model.PathKind) -> str:
    """What kind of path it is."""
    return word("trajectory.kind", KINDS, kind)


def event_word(event: model.Singularity) -> str:
    """A singularity's type, or the axes that become dependent where the field has no name for it."""
    if event.type != "dependent_axes":
        return singularity_word(event.type)
    return sentence("dependent_axes", axes=", ".join(map(str, event.axes)))


def event_distance(event: model.Singularity) -> str:
    """How far from the singular set a pass is, with its unit."""
    if event.distance_deg is not None:
        return with_unit(f"{event.distance_deg:.3g}", "deg")
    if event.distance_mm is not None:
        return f"{event.distance_mm:.3g} mm"
    return sentence("smallest_singular_value", value=event.smallest_singular_value)


names_in_words("strategies", "trajectory.strategy", STRATEGIES)


def strategy_word(name: StrategyName) -> str:
    """A strategy's name."""
    return word("trajectory.strategy", STRATEGIES, name)


def path_text(path: model.PathSummary) -> str:
    """Where a path is singular or has faults, or that it has none."""
    if not path.collisions:
        return _apart_from_collisions(path)
    collisions = joined(map(say, path.collisions))
    if path.verdict == "collides":
        other = path.too_fast or path.jumps or (path.singularities and not path.in_joint_space)
        return joined([collisions, _apart_from_collisions(path) if other else ""])
    starts = [part.t0_s for part in path.unreachable]
    starts += [*(part.t0_s for part in path.out_of_limits), *(part.t0_s for part in path.too_fast)]
    first = min(starts, default=0.0)
    both = _apart_from_collisions(path), collisions
    return joined(both[::-1] if path.collisions[0].t0_s < first else both)


def _apart_from_collisions(path: model.PathSummary) -> str:
    if path.not_planned:
        shown = sentence("path.shown")
        return joined([say(path.not_planned), shown])
    if path.unreachable:
        return joined(map(say, path.unreachable))
    if faults := path.out_of_limits or _first_and_worst(path.too_fast):
        return joined([*map(say, faults), *map(say, path.singularities), _at_another_pace(path)])
    if path.undecided:
        return joined([*map(say, adjoined(path.undecided)), *map(say, path.singularities)])
    met = [say(event) for event in path.singularities if event.crossing]
    if path.in_joint_space:
        if not met:
            return sentence("path.no_fault")
        return sentence("path.harmless", places=joined(met))
    if met or path.jumps:
        return joined([*met, *map(say, path.jumps), _speeds(path.joint_speed_bounded)])
    if path.singularities:
        return joined(map(say, path.singularities))
    return sentence("path.safe")


def _first_and_worst(stretches: tuple[model.Stretch[RateCause], ...]) -> list[model.Stretch[RateCause]]:
    """Of each kind of limit the stretch that exceeds it first and, if it is another, the one that exceeds it most."""
    found: list[model.Stretch[RateCause]] = []
    for code in dict.fromkeys(part.cause.code for part in stretches):
        alike = [part for part in stretches if part.cause.code == code]
        found += [min(alike, key=lambda part: part.t0_s), max(alike, key=lambda part: part.cause.ratio)]
    return sorted(dict.fromkeys(found), key=lambda part: part.t0_s)


def _at_another_pace(path: model.PathSummary) -> str:
    """What the shortest time of a path that is too fast means; empty where its pace is not its only fault."""
    if path.fastest_s is None or not _only_too_fast(path):
        return ""
    if path.fastest_s > path.duration_s:
        return sentence("path.pace#least", fastest=path.fastest_s)
    return sentence("path.pace#profile", fastest=path.fastest_s, programmed=path.duration_s)


def _only_too_fast(path: model.PathSummary) -> bool:
    """Whether speed and acceleration are all that is wrong with a path."""
    other = path.unreachable or path.out_of_limits or path.collisions or path.jumps
    return bool(path.too_fast) and not other and not any(isinstance(e.cause, JerkTooGreat) for e in path.too_fast)


def _speeds(bounded: bool) -> str:
    if bounded:
        return sentence("path.speeds#bounded")
    return sentence("path.speeds#unbounded")


@say.register
def _(event: model.Singularity) -> str:
    when = f"{event.t_s:.4g}" if event.t_s == event.until_s else f"{event.t_s:.4g} – {event.until_s:.4g}"
    parts = {"type": event_word(event), "when": when, "distance": event_distance(event)}
    if event.type == "dependent_axes":
        if event.crossing:
            return sentence("dependent.met", **parts)
        return sentence("dependent.passed", **parts)
    if event.crossing:
        return sentence("singularity.met", **parts)
    return sentence("singularity.passed", **parts)


@say.register
def _(jump: model.Jump) -> str:
    parts = {"t": jump.t_s, "joint": jump.joint}
    return sentence("path.jump", **parts)


@say.register
def _(stretch: model.Stretch) -> str:  # type: ignore[type-arg]  # singledispatch takes no parametrised class
    return sentence("path.stretch", when=_when(stretch), cause=_with_worst(stretch, say(stretch.cause)))


def _when(stretch: model.Stretch) -> str:  # type: ignore[type-arg]
    return sentence("path.when", start=stretch.t0_s, end=stretch.t1_s)


@say.register
def _(found: model.BodiesOverlap) -> str:
    touches = joined(listed(found.touches[:MAX_PAIRS]))
    if len(found.touches) > MAX_PAIRS:
        return sentence("bodies_overlap.more", touches=touches)
    return touches


def cause_text(path: model.PathSummary, part: model.Stretch) -> str:  # type: ignore[type-arg]
    """Why a stretch of a path is listed; what is undecided is no open question where something else decides."""
    cause = _with_worst(part, say(part.cause))
    if part in path.undecided and path.verdict != "undecided":
        return sentence("path.either_way", open=cause)
    return cause


def first_faults(path: model.PathSummary) -> list[tuple[float, str]]:
    """When (s) a path is wrong first, and how; then where it leaves reach or limits or collides, or else its gravest
    fault. What is undecided counts only where it comes before all that is not."""
    fast = [[part for part in path.too_fast if part.cause.code.endswith(IF_ASSUMED) is each] for each in (False, True)]
    grave: list[Sequence[model.Stretch[Any]]] = [path.unreachable, path.out_of_limits, path.collisions]
    firsts = [min(each, key=lambda part: part.t0_s) for each in grave if each]
    found = [(part.t0_s, _with_worst(part, say_first(part.cause))) for part in firsts]
    found += [(min(part.t0_s for part in each), _rates(each)) for each in fast if each]
    edge = min((part.t0_s for part in path.unreachable), default=math.inf) - AT_EDGE
    events = [] if path.in_joint_space else [each for each in path.singularities if each.crossing and each.t_s < edge]
    found += [(event.t_s, sentence("path.singular", type=event_word(event))) for event in events[:1]]
    found += [(jump.t_s, say(jump)) for jump in path.jumps[:1]]
    open_ = min(path.undecided, key=lambda part: part.t0_s, default=None)
    if open_ and open_.t0_s < min(found, default=(math.inf,))[0]:
        found.append((open_.t0_s, cause_text(path, open_)))
    return sorted({*found[: max(1, sum(map(bool, grave)))], *sorted(found)[:1]})


def adjoined(stretches: Sequence[model.Stretch[Any]]) -> list[model.Stretch[Any]]:
    """Stretches in order of time, those of one cause that adjoin as one."""
    found: list[model.Stretch[Any]] = []
    for part in sorted(stretches, key=lambda part: part.t0_s):
        k = next((k for k, each in enumerate(found) if each.cause == part.cause), None)
        if k is not None and part.t0_s <= found[k].t1_s + ADJOINING:
            found[k] = replace(found[k], t1_s=max(found[k].t1_s, part.t1_s), s1_m=max(found[k].s1_m, part.s1_m))
        else:
            found.insert(0, part)
    return sorted(found, key=lambda part: part.t0_s)


def _rates(stretches: Sequence[model.Stretch[RateCause]]) -> str:
    """What is too fast first, of all joints: stretches that adjoin are one, and each kind of limit has its worst."""
    first, *later = sorted(stretches, key=lambda part: part.t0_s)
    run = [first]
    end, again = first.t1_s, None
    for part in later:
        if part.t0_s > end + ADJOINING:
            again = part.t0_s
            break
        run.append(part)
        end = max(end, part.t1_s)
    if len(run) == 1 and not _lasts(first):
        return say(first.cause)
    kinds = dict.fromkeys((part.cause.code, part.cause.slides) for part in run)
    worst = [
        max((part for part in run if (part.cause.code, part.cause.slides) == kind), key=lambda part: part.cause.ratio)
        for kind in sorted(kinds, key=lambda kind: not kind[0].startswith("too_fast"))
    ]
    joints = sorted({part.cause.joint for part in run})
    limits = "path.rates#assumed" if first.cause.code.endswith(IF_ASSUMED) else "path.rates#known"
    rates = sentence(
        "path.rates",
        joints=joints,
        named=", ".join(f"J{joint}" for joint in joints),
        limits=sentence(limits),
        end=end,
        worst=tuple(map(_worst_rate, worst)),
    )
    return rates if again is None else sentence("path.rates#again", rates=rates, again=again)


def _worst_rate(part: model.Stretch[RateCause]) -> str:
    needed = rate_needed(part.cause)
    return needed if part.worst_s is None else sentence("path.rate", needed=needed, t=part.worst_s)


def _with_worst(part: model.Stretch[Any], cause: str) -> str:
    """A cause, and when it is worst on a stretch that is not but a moment."""
    if part.worst_s is None or not _lasts(part):
        return cause
    return sentence("path.worst", cause=cause, t=part.worst_s)


def _lasts(part: model.Stretch[Any]) -> bool:
    return part.t1_s - part.t0_s >= MOMENT


def advice(path: model.PathSummary, limits: model.LimitsUsed | None = None, *, assumed: bool = False) -> str | None:
    """What to do about a path; None where nothing is to be done. ``limits``: of the joints, whose assumed ones are
    named; ``assumed``: whether clearance is that of assumed shapes."""
    if not path.avoidance:
        return None
    if path.chosen:
        slower = _slower_throughout(path) if path.strategy == "slow" else ""
        return joined([repair_text(path, limits, assumed=assumed), slower], ". ")
    if path.unreachable:
        when = joined(map(_when, path.unreachable), ", ")
        why = sentence("advice.out_of_reach", when=when)
    else:
        causes = [say(part.cause) for part in path.out_of_limits] or [reasons(tried) for tried in path.avoidance]
        why = joined(dict.fromkeys(causes))
    if len(path.avoidance) == 1:
        (only,) = path.avoidance
        if only.name == "planned":
            none = sentence("advice.no_strategy", reason=reasons(only))
            return joined([none, _until(path), _of_assumed(path, assumed)], ". ")
        parts = {"way": word("advice", ADVICE, only.name), "reason": reasons(only)}
        return sentence("advice.only", **parts)
    none = _within_reach(path) or sentence("advice.none", why=why)
    return joined([none, _until(path), _of_assumed(path, assumed)], ". ")


def _of_assumed(path: model.PathSummary, assumed: bool) -> str:
    """That the clearance up to where a path may be run is that of assumed shapes; empty where none is named."""
    end, last = path.sound_end, path.clear_until
    named = end is not None and last is not None and end.t_s >= last.t_s and not path.unreachable
    return sentence("advice.of_assumed") if assumed and named else ""


def _until(path: model.PathSummary) -> str:
    """Up to where a path may be run: to the last point with the margin, unless something else is wrong before."""
    end = path.sound_end
    if end is None:
        return ""
    if path.clear_until and end.t_s >= path.clear_until.t_s:
        return _clear(path)
    return sentence("advice.sound", t=end.t_s, **_end(end))


def end_text(path: model.PathSummary, end: model.SoundEnd, *, assumed: bool) -> str:
    """That a path may be run to a point of it, and by how much it is clear up to there, if that was measured, of
    ``assumed`` shapes or of given ones."""
    if last := path.clear_until:
        parts = {"xyz": _numbers(end.xyz_mm, 1), "margin": last.margin_mm, "stop": last.stop_s}
        return sentence("advice.end#assumed" if assumed else "advice.end#clear", **parts)
    return sentence("advice.end", **_end(end))


def _end(end: model.SoundEnd) -> dict[str, Any]:
    return {"xyz": _numbers(end.xyz_mm, 1), "left": end.left_s, "stop": end.stop_s}


def _slower_throughout(path: model.PathSummary) -> str:
    """The pace at which the whole path keeps the limits, and the setting that gives it; empty where none does."""
    speed, acceleration = path.max_joint_speed_ratio, path.max_joint_acceleration_ratio
    if speed is None or acceleration is None or not _only_too_fast(path):
        return ""
    longer = PACE_MARGIN * max(1.0, speed, acceleration**0.5)
    return sentence("advice.slower", percent=100 / longer, needed=path.duration_s * longer)


def _within_reach(path: model.PathSummary) -> str:
    """How far a path that leaves the reach could be used; empty for others."""
    part = min(path.unreachable, key=lambda part: part.t0_s, default=None)
    if part is None or part.s0_m <= 0:
        return ""
    first, what = first_faults(path)[0]
    form = "advice.within_reach#later" if first < part.t0_s else "advice.within_reach"
    return sentence(form, t=part.t0_s, far=part.s0_m * 1000, first=first, what=what)


def _clear(path: model.PathSummary) -> str:
    """How far a path that collides could be used; empty for others."""
    last = path.clear_until
    if last is None or path.unreachable:
        return ""
    parts = {
        "xyz": _numbers(last.xyz_mm, 1),
        "rpy": _numbers(last.rpy_deg, 2),
        "q": _numbers(last.q_deg, 2),
        "contact": _numbers(last.contact_mm, 0),
    }
    pair = path.collisions[0].cause.touches[0].pair
    form = "advice.clear_until" if isinstance(pair, LinkAndSolid) else "advice.clear_until#links"
    parts["pair"] = say(pair)
    return sentence(form, margin=last.margin_mm, t=last.t_s, far=last.s_m * 1000, stop=last.stop_s, **parts)


def _numbers(values: tuple[float, ...], digits: int) -> str:
    return ", ".join(as_text(value + 0.0, f".{digits}f") for value in values)


def reasons(tried: model.TriedStrategy) -> str:
    """Why a strategy is not possible or not usable; empty where it is."""
    return joined(listed(tried.reasons))


def repair_text(path: model.PathSummary, limits: model.LimitsUsed | None = None, *, assumed: bool = False) -> str:
    """What the strategy that was chosen does, what it costs, and what it takes of ``limits`` that are assumed;
    ``assumed``: whether clearance is that of assumed shapes."""
    tried = path.chosen
    if tried is None or tried.motion is None:
        raise ValueError(f"{path.name} has no motion that repairs it")
    motion = tried.motion
    tool = _leaves(motion.max_deviation_mm, motion.max_deviation_deg)
    swings = {j: swing for j, swing in enumerate(motion.joint_swing_deg, 1) if j not in path.sliding}
    if tried.name in BY_JOINTS and swings:
        joint = max(swings, key=swings.__getitem__)
        tool = sentence("advice.swing", tool=tool, joint=joint, swing=swings[joint])
    clearance = None if motion.clearance_mm is None else math.floor(10 * motion.clearance_mm) / 10
    chosen = sentence(
        "advice.chosen" if clearance is None else "advice.chosen#clear",
        way=word("advice", ADVICE, tried.name),
        tool=tool,
        time=_takes(motion.duration_s, path.duration_s, tried.name),
        clearance=clearance,
    )
    passes = path.singularities and not path.in_joint_space and not motion.keeps_clear
    near = sentence("advice.region") if passes else ""
    other, slowly = tried.name == "planned", ""
    if other and motion.duration_s < path.duration_s:
        slowly = sentence("advice.slowly", programmed=path.duration_s)
    unsaid = limits is None or not any(limits.speed_assumed)
    full = sentence("advice.full_speed") if unsaid and (motion.max_joint_speed_ratio or 0.0) >= FULL_SPEED else ""
    shapes = sentence("advice.of_assumed") if assumed and clearance is not None else ""
    return joined([chosen, shapes, slowly, near, _of_limits(motion, limits) if limits else "", full], ". ")


def _of_limits(motion: model.StrategyMotion, limits: model.LimitsUsed) -> str:
    """What of assumed limits a motion takes; empty where none is assumed."""
    speeds, speed, acceleration = any(limits.speed_assumed), limits.speed_deg_s, limits.acceleration_assumed
    if not speeds and not acceleration:
        return ""
    form = _assumed_form(speeds, acceleration)
    pairs = zip(motion.max_joint_speed_deg_s, speed, limits.speed_assumed)
    return sentence(
        f"advice.limits#{form}",
        speed=100 * max((most / limit for most, limit, assumed in pairs if assumed), default=0.0),
        acceleration=100 * motion.max_joint_acceleration_ratio,
    )


def _assumed_form(speed: bool, acceleration: bool) -> str:
    return "both" if speed and acceleration else "speed" if speed else "acceleration"


def limits_assumed(speed: Sequence[bool], acceleration: bool) -> str:
    """That passing rests on assumed limits of the joints; empty where none is assumed."""
    if not any(speed) and not acceleration:
        return ""
    return sentence(f"limits_assumed#{_assumed_form(any(speed), acceleration)}")


def _leaves(far_mm: float, turned_deg: float) -> str:
    if far_mm < NO_DEVIATION and turned_deg < NO_DEVIATION:
        return sentence("advice.tool#none")
    if turned_deg < NO_DEVIATION:
        return sentence("advice.tool#far", far=_shortly(far_mm))
    if far_mm < NO_DEVIATION:
        return sentence("advice.tool#turned", turned=_shortly(turned_deg))
    both = {"far": _shortly(far_mm), "turned": _shortly(turned_deg)}
    return sentence("advice.tool#both", **both)


def _shortly(value: float) -> str:
    return f"{value:.2g}" if value < WHOLE else f"{value:.0f}"


def switch_text(change: Sequence[float], sliding: Sequence[int]) -> str:
    """Whether the move to another IK solution is part of the motion that takes it, and how far it is if not.

    ``change``: of each joint between the programmed start and the motion's, deg, mm where it is one of ``sliding``.
    """
    moved = [(joint, value) for joint, value in enumerate(change, 1) if abs(value) >= LEAST_CHANGE]
    if not moved:
        return sentence("advice.switch#within")
    parts = (with_unit(f"J{j} {as_text(value, '+.0f')}", "mm" if j in sliding else "deg") for j, value in moved)
    return sentence("advice.switch#before", changes=joined(parts, ", "))


def _takes(takes_s: float, programmed_s: float, strategy: StrategyName) -> str:
    if abs(takes_s - programmed_s) < NO_TIME:
        return sentence("advice.time#slower_there" if strategy == "slow" else "advice.time#same")
    if takes_s > programmed_s:
        return sentence("advice.time#more", longer=takes_s - programmed_s)
    return sentence("advice.time#less", takes=takes_s, programmed=programmed_s)
