"""Rerun recordings: an arm and its scene, its runs one after another, with curves and events.

A stage passes data; this module lays out the views, times the runs, and writes the file atomically.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import field, replace
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from er3a.by_value import by_identity, frozen
from er3a.collision.scene import Plane, Scene
from er3a.files.kept_files import write_atomically
from er3a.kinematics.forward import skeleton
from er3a.numerics.arrays import Flags, Reals
from er3a.pipeline.messages.say import say, say_all
from er3a.pipeline.player.motions import Mark, PlayedEvent, PlayedMotion, Weight, at_rest
from er3a.pipeline.player.player import picture_at
from er3a.pipeline.results import AbsentResults, Stored
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.arm import (
    ARM,
    SWOLLEN,
    TIMELINE,
    arm_view,
    log_arm,
    seconds,
    send_motion,
    solid_parts,
    touching_parts,
)
from er3a.pipeline.viewing.drawn import SCENE_COLOUR, drawn_scene
from er3a.pipeline.viewing.palette import HIGHLIGHT, JOINT_NAMES, JOINTS, LINK, VERDICTS, legible, rgb
from er3a.robots.joint_limits import joint_names, size_of
from er3a.robots.joint_limits import shown as in_units
from er3a.robots.robot import Robot
from er3a.version import __version__

PAUSE_S = 1.0  # between two runs
SHOWN_S = rr.TimeRange(
    start=rr.TimeRangeBoundary.cursor_relative(seconds=-4), end=rr.TimeRangeBoundary.cursor_relative(seconds=12)
)
IN_SIGHT = 60  # poses that the view holds when it opens
SCENE_ALPHA, TOUCHING_ALPHA = 120, 170
BRIEFLY_S = 1e-3  # by which two events at one time stand apart
LEVELS: dict[Weight, rr.TextLogLevel] = {
    "plain": rr.TextLogLevel.INFO,
    "caution": rr.TextLogLevel.WARN,
    "fail": rr.TextLogLevel.ERROR,
}
LANE_COLOURS: dict[Weight, str] = {**{each: VERDICTS[each] for each in ("caution", "fail")}, "plain": VERDICTS["pass"]}
NOTHING = "nothing found"  # of a run, as long as no event is on
WEIGHTS: tuple[Weight, ...] = ("plain", "caution", "fail")
LIMIT_ALPHA, LIMIT_WIDTH = 110, 1.0
SPACE_SHARE = 9.0  # of the height that a view of space has, a lane 1
NEAR_LIMIT = 0.75  # of the way from the middle of a range to its end: from there on the limit is drawn
GONE = rr.Clear(recursive=False)
Logged = rr.AsComponents | Sequence[rr.AsComponents]


@frozen
class Curves:
    """A panel of curves over time.

    Attributes
    ----------
    entity : below ``<stage>/curves``
    title : with the unit
    names, colours : of each curve; the joints' by default
    whole : show all of the time, not some seconds around the moment
    limits : lower and upper, (2, k), in the unit of the title; drawn where a curve comes near; NaN for none
    """

    entity: str
    title: str
    names: Sequence[str] = JOINT_NAMES
    colours: Sequence[str] = JOINTS
    whole: bool = False
    limits: Reals | None = None

    @classmethod
    def of_joints(cls, robot: Robot, entity: str, name: str, per: str = "") -> Curves:
        """A panel with a curve for each joint.

        Parameters
        ----------
        robot : its joints that slide are in mm, and the title says so
        entity : of the panel, below the stage's curves
        name : "angle" or "velocity"
        per : of the unit, such as "/s"
        """
        ends = np.stack([-robot.speed, robot.speed] if per else [robot.lower, robot.upper])
        slides = ", ".join(joint for joint, is_slide in zip(joint_names(robot), robot.slides) if is_slide)
        if robot.slides.all():
            title = f"Joint {'position' if name == 'angle' else name} (mm{per})"
        elif slides:  # short enough for the head of a panel
            title = f"{name.capitalize()} (°{per}, {slides}: mm{per})"
        else:
            title = f"Joint {name} (°{per})"
        return cls(entity, title, limits=in_units(robot, ends))


@by_identity
class Run(PlayedMotion):
    """What the arm does in one go; its times begin at 0, and where ``q`` is NaN it stays as it is.

    ``text`` is Markdown, shown from the start on. Entities stand below the stage, with a leading ``/``
    below the root.

    Attributes
    ----------
    outcome, status : how it ends, in words; logged as its first event, and listed in the note
    curves : by the entity of a panel: (N, k), a row with NaN is a gap in all its curves
    columns : by entity what Rerun's ``columns`` make of N values, one for each time
    shapes : (s, entity, what is to be seen there from then on); gone when the next run starts
    texts : (s, Markdown) that takes the place of ``text``
    lanes : by name, (s, state, its weight) from then on; a lane "verdict" is made of the events
    pause_s : until the next run
    """

    outcome: str = ""
    status: Weight = "plain"
    curves: Mapping[str, Reals] = field(default_factory=dict)
    columns: Mapping[str, Any] = field(default_factory=dict)
    shapes: Sequence[tuple[float, str, Logged]] = ()
    texts: Sequence[tuple[float, str]] = ()
    lanes: Mapping[str, Sequence[tuple[float, str, Weight]]] = field(default_factory=dict)
    pause_s: float = PAUSE_S


@by_identity
class Recorded:
    """What a recording holds.

    Attributes
    ----------
    robot, name, stage : the arm, its name and the stage's, which name the recording: application ``<stage> <name>``
    note : Markdown that says what to look at
    home : (n,), where the arm stands if no run moves it
    views : by title, the entities below the stage that a 3-D view shows beside the arm; all in one by default
    shapes : by entity, what is to be seen all the time
    points : arrays (N, 3), m, to be in sight when the views open, besides the arm
    ghost : a further arm, see-through, that moves along; at ``<stage>/corrected``
    now : title of the text on what is shown now
    verdict : of the stage, one of the recording's properties
    """

    robot: Robot
    name: str
    stage: str
    note: str
    runs: Sequence[Run] = ()
    curves: Sequence[Curves] = ()
    scene: Scene | None = None
    home: Reals | None = None
    views: Mapping[str, Sequence[str]] = field(default_factory=lambda: {"Arm": ("**",)})
    shapes: Mapping[str, Logged] = field(default_factory=dict)
    points: Sequence[Reals] = ()
    ghost: Robot | None = None
    now: str = "Now"
    verdict: str = ""


def write_recording(shown: Recorded, output: Path) -> None:
    """Write a recording of a stage, which opens at the start of the first run, and its picture beside it.

    The joint values have a panel of their own in every recording; the events make a lane of states.

    Parameters
    ----------
    shown : the arm, its runs one after another, and curves
    output : the recording, written whole or not at all

    Raises
    ------
    WriteError
        if the disk is full or permission is missing
    """
    robot, stage = shown.robot, shown.stage
    shown = replace(shown, curves=[Curves.of_joints(robot, "angle", "angle"), *shown.curves])
    runs = [replace(r, curves={"angle": in_units(robot, r.q), **r.curves}) if len(r.t) else r for r in shown.runs]
    shown = replace(shown, runs=runs)
    starts = np.cumsum([0.0, *(_end(run) + run.pause_s for run in shown.runs)]).tolist()
    title = f"{robot.title}: {stage}"
    first = (0.0, _end(shown.runs[0])) if shown.runs else None
    with recording(output, shown.name, stage, _layout(shown), title, first) as stream:
        said = rr.AnyValues(robot=robot.title, stage=stage, verdict=shown.verdict, version=__version__)
        stream.send_property("er3a", said)
        _log_text(stream, f"{stage}/note", shown.note + _timetable(shown.runs, starts))
        q = np.concatenate([run.q for run in shown.runs] or [np.empty((0, robot.joints))])
        known = q[np.isfinite(q).all(axis=1)]
        home = shown.home if shown.home is not None else np.zeros(robot.joints)
        log_arm(stream, robot, known[0] if len(known) else home)
        if shown.ghost is not None:
            log_arm(stream, shown.ghost, home, f"{stage}/corrected", ghost=True)
        _log_scene(stream, shown)
        for entity, shape in shown.shapes.items():
            _log(stream, stage, entity, shape, static=True)
        for curves in _panels(shown):
            _log_styles(stream, shown, curves)
        _log_lanes(stream, shown)
        before: set[str] = set()
        for run, start in zip(shown.runs, starts):
            before = _log_run(stream, shown, run, start, before)
    draw_picture(shown, output)


def draw_picture(shown: Recorded, output: Path) -> None:
    """Write the arm and its scene as a WebP picture, when the gravest event begins: a collision before others, rather
    with what is around the arm than with itself; without events at the start of the first run that moves the arm.

    Parameters
    ----------
    output : the recording; the picture has its name and ``.webp``
    """
    around = {solid.name for solid in shown.scene.solids} if shown.scene else set()
    known = [(run, np.isfinite(run.q).all(axis=1)) for run in shown.runs]
    moving: list[PlayedMotion] = [replace(run, t=run.t[rows], q=run.q[rows]) for run, rows in known if rows.any()]
    moving = moving or [at_rest(shown.robot, "", q=shown.home)]
    _, motion, t = max(
        (
            ((WEIGHTS.index(each.status), bool(around.intersection(each.bodies)), bool(each.bodies)), motion, each.t)
            for motion in moving
            for each in motion.events
        ),
        key=itemgetter(0),
        default=(None, moving[0], 0.0),
    )
    picture = picture_at(shown.robot, motion, t, shown.scene)
    write_atomically(output.with_suffix(".webp"), lambda file: file.write_bytes(picture))


def _log_styles(stream: rr.RecordingStream, shown: Recorded, curves: Curves) -> None:
    """Names and colours of a panel's curves, and of the limits that some run comes near."""
    entity = f"{shown.stage}/curves/{curves.entity}"
    count = max((run.curves[curves.entity].shape[1] for run in shown.runs if curves.entity in run.curves), default=0)
    colours = [rgb(each) for each in curves.colours[:count]]
    stream.log(entity, rr.SeriesLines(names=curves.names[:count], colors=colours), static=True)
    if len(near := _limits_near(shown, curves)):
        names, tints = zip(*((f"{curves.names[j]} limit", (*rgb(curves.colours[j]), LIMIT_ALPHA)) for j, _ in near))
        stream.log(f"{entity}/limits", rr.SeriesLines(names=names, colors=tints, widths=LIMIT_WIDTH), static=True)


def _limits_near(shown: Recorded, curves: Curves) -> list[tuple[int, float]]:
    """Joints (from 0) and limits that a curve comes near or passes: all of them would flatten what there is to see."""
    values = np.concatenate([run.curves[curves.entity] for run in shown.runs if curves.entity in run.curves])
    if curves.limits is None or not np.isfinite(values).any():
        return []
    found = []
    for j, ends in enumerate(curves.limits.T[: values.shape[1]]):
        if not np.isfinite(ends).all():
            continue
        middle, known = ends.mean(), values[:, j][np.isfinite(values[:, j])]
        shares = (known - middle) / (ends[1] - middle)
        found += [(j, end) for side, end in zip((-1, 1), ends) if (side * shares > NEAR_LIMIT).any()]
    return found


def _log_lanes(stream: rr.RecordingStream, shown: Recorded) -> None:
    """The colours of the states that the runs' lanes go through."""
    weights: dict[str, dict[str, Weight]] = {}
    for run in shown.runs:
        for lane, changes in _lanes(run).items():
            known = weights.setdefault(lane, {})
            for _, state, weight in changes:  # one colour for a state: that of its worst
                known[state] = max(known.get(state, weight), weight, key=WEIGHTS.index)
    for lane, states in weights.items():
        colours = [rgb(LANE_COLOURS[weight]) for weight in states.values()]
        stream.log(f"{shown.stage}/states/{lane}", rr.StateConfiguration(values=[*states], colors=colours), static=True)


def _lanes(run: Run) -> dict[str, list[tuple[float, str, Weight]]]:
    """The states of a run by lane, each from its time on; none of a run without a course."""
    if len(run.t) < 2:
        return {}
    own = {lane: [*changes] for lane, changes in run.lanes.items() if changes}
    return ({"verdict": _verdicts(run)} if run.events or run.outcome else {}) | own


def _verdicts(run: Run) -> list[tuple[float, str, Weight]]:
    """At each time the worst of what is on then, by the word before its colon; without events how the run ends."""
    quiet = (NOTHING, WEIGHTS[0]) if run.events or run.status == "plain" else (run.outcome, run.status)
    ends = {each.t: each.until for each in run.events}
    times = sorted({0.0, *ends, *(until for until in ends.values() if until < _end(run))})
    changes: list[tuple[float, str, Weight]] = []
    for t in times:
        on = [each for each in run.events if each.t <= t < max(each.until, each.t + BRIEFLY_S)]
        worst = max(on, key=lambda each: WEIGHTS.index(each.status), default=None)
        state, weight = (worst.text.partition(":")[0], worst.status) if worst else quiet
        if not changes or changes[-1][1:] != (state, weight):
            changes.append((t, state, weight))
    return changes


@contextmanager
def recording(
    output: Path,
    robot: str,
    stage: str,
    layout: rrb.View | rrb.Container,
    title: str | None = None,
    first_s: tuple[float, float] | None = None,
) -> Iterator[rr.RecordingStream]:
    """Open a recording for logging; ``output`` appears when the block ends without an error.

    Viewers keep one blueprint for each application id, so every stage of every robot is an application of its own:
    opened together, each keeps its own layout and camera.

    Parameters
    ----------
    robot, stage : name the recording: application ``<stage> <robot>``, recording ``<robot>``
    layout : what the blueprint shows
    title : what the viewer calls the recording in its list of sources
    first_s : the stretch of time that is selected when it opens
    """
    rr.set_strict_mode(True)
    nanoseconds = None if first_s is None else [round(1e9 * t) for t in first_s]
    blueprint = rrb.Blueprint(
        layout,
        rrb.TimePanel(
            timeline=TIMELINE,
            state="collapsed",
            play_state="paused",
            time_selection=None if nanoseconds is None else rrb.components.AbsoluteTimeRange(*nanoseconds),
        ),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="expanded"),
        auto_views=False,
    )

    # No chunk is cut by the clock: recordings of equal data then compare equal on a busy machine too.
    never = rr.ChunkBatcherConfig.NEVER()
    stream = rr.RecordingStream(f"{stage} {robot}", recording_id=robot, send_properties=False, batcher_config=never)
    with stream:
        # Rerun's own file writer waits for ever when the disk is full; bytes can be written like any other file.
        collected = stream.binary_stream()  # type: ignore[misc]
        # The viewer in a browser shows a blueprint only if it is active, not if it is merely the default.
        stream.send_blueprint(blueprint, make_active=True, make_default=True)
        stream.set_log_time_enabled(False)
        if title:
            stream.send_recording_name(title)
        stream.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        yield stream
        content = collected.read(flush=True)
    assert content is not None  # all of it was flushed
    write_atomically(output, lambda file: file.write_bytes(content))


def escaped(text: str) -> str:
    """A text from an input file for a Markdown document.

    Parameters
    ----------
    text : of any content

    Returns
    -------
    text : on one line, shown as it is, with nothing fetched for it
    """
    return re.sub(r"([\\`*_{}\[\]<>#!|~])", r"\\\1", " ".join(text.split()))


def record_stage(study: Study, stored: Stored[Any], output: Path, note: str, **shown: Any) -> None:
    """Write the recording of a stage.

    Parameters
    ----------
    note : with places for the robot's ``title`` and the verdict's ``findings``
    shown : what else :class:`Recorded` holds
    """
    robot, findings = study.robot(stored.robot), say_all(stored.results.summary.verdict.findings)
    text = note.format(title=escaped(robot.title), findings=escaped(findings))
    shown = {"robot": robot, "verdict": stored.results.summary.verdict.status} | shown
    write_recording(Recorded(name=stored.robot, stage=stored.stage, note=text, **shown), output)


def _end(run: Run) -> float:
    return float(run.t[-1]) if len(run.t) else 0.0


def _panels(shown: Recorded) -> list[Curves]:
    """The panels that some run has curves for."""
    return [each for each in shown.curves if any(each.entity in run.curves for run in shown.runs)]


def _layout(shown: Recorded) -> rrb.Container:
    """The views of space, the curves, and the words: the note, what is shown now, and the events."""
    robot, stage, runs = shown.robot, shown.stage, shown.runs
    q = np.concatenate([run.q for run in runs] or [np.empty((0, robot.joints))])
    q = q[np.isfinite(q).all(axis=1)]
    poses = q[np.unique(np.linspace(0, len(q) - 1, IN_SIGHT).astype(int))] if len(q) else q
    points = [*shown.points, *(skeleton(robot, joints) for joints in poses)]
    views = [
        arm_view(robot, title, [ARM, *(f"/{stage}/{entity}" for entity in entities)], points)
        for title, entities in shown.views.items()
    ]
    curves = [
        rrb.TimeSeriesView(
            origin=f"/{stage}/curves/{each.entity}",
            name=each.title,
            axis_x=None if each.whole else rrb.TimeAxis(view_range=SHOWN_S),
            plot_legend=rrb.PlotLegend(visible=k == 0),
        )
        for k, each in enumerate(_panels(shown))
    ]
    words: list[rrb.View] = [_note_view(stage)]
    if runs:
        words.append(rrb.TextDocumentView(origin=f"/{stage}/now", name=shown.now))
    if any(run.events or run.outcome for run in runs):
        columns = rrb.TextLogColumns(
            timeline_columns=rrb.encodings.TimelineColumn(TIMELINE, visible=False),
            text_log_columns=["loglevel", "body"],
        )
        words.append(rrb.TextLogView(origin=f"/{stage}/events", name="Events", columns=columns))
    texts = rrb.Vertical(*words, name="Words")
    if len(views) > 2:
        return rrb.Grid(*views, texts, grid_columns=2, name=stage)
    lanes = {lane for run in runs for lane in _lanes(run)}
    seen = [*views, rrb.StateTimelineView(origin=f"/{stage}/states", name="States")] if lanes else views
    shares = [SPACE_SHARE] * len(views) + [1.0 + len(lanes)] * bool(lanes)
    left = rrb.Vertical(*seen, row_shares=shares)  # side by side they would cut the arm off
    if len(curves) > 1:
        middle = rrb.Vertical(*curves, name="Curves")
        return rrb.Horizontal(left, middle, texts, column_shares=[2.0, 1.0, 1.3], name=stage)
    return rrb.Horizontal(left, rrb.Vertical(*curves, *words, name="Words"), column_shares=[2.0, 1.3], name=stage)


def _note_view(stage: str) -> rrb.View:
    return rrb.TextDocumentView(origin=f"/{stage}/note", name="What to look at")


def _timetable(runs: Sequence[Run], starts: Sequence[float]) -> str:
    """When each run starts and how it ends, of those that end somehow."""
    rows = [f"| {start:.0f} s | {run.name} | {run.outcome} |" for run, start in zip(runs, starts) if run.outcome]
    return "\n".join(["\n\n| from | run | outcome |", "|---|---|---|", *rows]) if rows else ""


def _log_text(stream: rr.RecordingStream, entity: str, markdown: str) -> None:
    stream.log(entity, rr.TextDocument(markdown, media_type=rr.MediaType.MARKDOWN), static=True)


def _log(stream: rr.RecordingStream, stage: str, entity: str, shape: Logged, static: bool = False) -> None:
    shapes = shape if isinstance(shape, Sequence) else [shape]
    stream.log(entity[1:] if entity.startswith("/") else f"{stage}/{entity}", *shapes, static=static)


def _log_scene(stream: rr.RecordingStream, shown: Recorded) -> None:
    """The solids, each an entity, and what the tool carries."""
    if shown.scene is None:
        return
    groups = (shown.scene.solids, f"{shown.stage}/scene", SCENE_COLOUR), (shown.scene.carried, "arm/tool/carried", LINK)
    for solids, below, colour in groups:
        for shape in drawn_scene(solids, shown.robot):
            stream.log(f"{below}/{shape['name']}", *solid_parts(shape, (*rgb(colour), SCENE_ALPHA)), static=True)


def _log_run(stream: rr.RecordingStream, shown: Recorded, run: Run, start: float, before: set[str]) -> set[str]:
    """Log a run; returns the entities of its shapes, which go when the next one starts, as those ``before`` go now."""
    stage, clock, known = shown.stage, Clock(run, start), np.isfinite(run.q).all(axis=1)
    if known.any():
        for robot, entity in ((shown.robot, "arm"), (shown.ghost, f"{stage}/corrected")):
            if robot is not None:
                send_motion(stream, robot, clock.columns(run.t[known]), run.q[known], entity)
    for entity, columns in run.columns.items():
        path = entity[1:] if entity.startswith("/") else f"{stage}/{entity}"
        stream.send_columns(path, clock.columns(run.t), columns)
    for curves in _panels(shown):
        if curves.entity in run.curves:
            _send_curves(stream, f"{stage}/curves/{curves.entity}", clock, run.curves[curves.entity])
            if near := _limits_near(shown, curves):
                both = rr.Scalars.columns(scalars=np.tile([end for _, end in near], (2, 1)))
                ends = clock.columns(run.t[[0, -1]])
                stream.send_columns(f"{stage}/curves/{curves.entity}/limits", ends, both)
    for lane, changes in _lanes(run).items():
        states = [*changes, (_end(run), "", WEIGHTS[0])]
        times = clock.columns(np.array([t for t, _, _ in states]))
        columns = rr.StateChange.columns(state=[state for _, state, _ in states])
        stream.send_columns(f"{stage}/states/{lane}", times, columns)
    last = dict([(0.0, run.text), *run.texts])  # of several at one time
    said = rr.TextDocument.columns(text=list(last.values()), media_type=[rr.MediaType.MARKDOWN] * len(last))
    stream.send_columns(f"{stage}/now", clock.columns(np.array(list(last))), said)
    _send_events(stream, f"{stage}/events", clock)
    marks = _marks(run.marks, size_of(shown.robot))
    shapes = [*run.shapes, *marks, *_touching(shown, run.events)]
    at_once = {entity for t, entity, _ in shapes if t == 0}
    for t, entity, shape in [*((0.0, entity, GONE) for entity in sorted(before - at_once)), *shapes]:
        with clock.at(stream, t):
            _log(stream, stage, entity, shape)
    return {entity for _, entity, _ in shapes}


@by_identity
class Clock:
    """The times of a run: on the timeline of all runs, where it begins at ``start`` (s), and on one of its own."""

    run: Run
    start: float

    def columns(self, times: Reals) -> list[rr.TimeColumn]:
        """Time columns for ``send_columns``.

        Parameters
        ----------
        times : (N,), s from the run's start
        """
        own = [rr.TimeColumn(self.run.name, duration=times)] if len(self.run.t) > 1 else []
        return [seconds(self.start + times), *own]

    @contextmanager
    def at(self, stream: rr.RecordingStream, t: float) -> Iterator[None]:
        """What is logged meanwhile is at ``t`` (s from the run's start)."""
        stream.set_time(TIMELINE, duration=self.start + t)
        if len(self.run.t) > 1:
            stream.set_time(self.run.name, duration=t)
        yield
        stream.reset_time()


def _send_curves(stream: rr.RecordingStream, entity: str, clock: Clock, values: Reals) -> None:
    """Curves, with a gap after the last point, so that the next run's don't join them."""
    known: Flags = np.asarray(np.isfinite(values).all(axis=1))
    times = clock.run.t
    if known.any():
        stream.send_columns(entity, clock.columns(times[known]), rr.Scalars.columns(scalars=values[known]))
    gaps = times[~known & np.append(True, known[:-1])]
    if known[-1]:
        gaps = np.append(gaps, times[-1] + BRIEFLY_S)
    if len(gaps):  # a chunk without rows makes the viewer panic
        cleared = rr.Clear.columns(is_recursive=np.zeros(len(gaps), dtype=bool))  # type: ignore[arg-type]
        stream.send_columns(entity, clock.columns(gaps), cleared)


def _send_events(stream: rr.RecordingStream, entity: str, clock: Clock) -> None:
    """The run's outcome, then its events, each with its time here and on the run's own clock; of those alike by the
    word before the colon, such as rates of several joints near one pose, the first while any lasts."""
    run, start = clock.run, clock.start
    rows: list[tuple[float, str, Weight]] = (
        [(0.0, f"{start:.3f} s: {run.name}: {run.outcome}", run.status)] if run.outcome else []
    )
    ends: dict[tuple[str, Weight], float] = {}
    for each in sorted(run.events, key=lambda each: each.t):
        kind = each.text.partition(":")[0], each.status
        if each.t > ends.get(kind, -1.0):
            rows.append((each.t, f"{start + each.t:.3f} s: {each.text} ({each.t:.3f} s into it)", each.status))
        ends[kind] = max(each.until, ends.get(kind, 0.0))
    if rows:
        columns = rr.TextLog.columns(
            text=[text for _, text, _ in rows],
            level=[str(LEVELS[status]) for _, _, status in rows],
            color=[legible(VERDICTS["pass" if status == "plain" else status]) for _, _, status in rows],
        )
        stream.send_columns(entity, clock.columns(np.array([t for t, _, _ in rows])), columns)


def _marks(marks: Sequence[Mark], size: float) -> Iterator[tuple[float, str, Logged]]:
    """Each mark from its time until it goes or the next comes: a line with its word, or a ball where it is a point."""
    colour = rgb(HIGHLIGHT)
    for mark, then in zip(marks, [*(mark.t0 for mark in marks[1:]), np.inf]):
        strip = rr.LineStrips3D([[mark.start, mark.end]], radii=0.006 * size, colors=colour, labels=[mark.text])
        ball = rr.Points3D([mark.start], radii=0.015 * size, colors=colour, labels=[mark.text], show_labels=True)
        yield mark.t0, "nearest", ball if mark.start == mark.end else strip
        if mark.t1 < then:
            yield max(mark.t1, mark.t0 + BRIEFLY_S), "nearest", GONE


def _touching(shown: Recorded, events: Sequence[PlayedEvent]) -> Iterator[tuple[float, str, Logged]]:
    """Red, from when they touch until they part: bodies of the arm and solids, as they were measured; no planes, of
    which all would be red."""
    red = (*rgb(VERDICTS["fail"]), TOUCHING_ALPHA)
    shapes: dict[str, list[tuple[str, Logged]]] = {}
    for name, entity, parts in touching_parts(shown.robot, red):
        shapes.setdefault(name, []).append((entity, parts))
    if shown.scene is not None:
        for solids, below in ((shown.scene.solids, "scene"), (shown.scene.carried, "/arm/tool/carried")):
            bounded = [solid for solid in solids if not isinstance(solid, Plane)]
            for shape in drawn_scene(bounded, shown.robot):
                parts = solid_parts(shape | {"T": np.eye(4)}, red, True, SWOLLEN)  # in its own place
                shapes.setdefault(shape["name"], []).append((f"{below}/{shape['name']}/touching", parts))
    spans = [(each.t, max(each.until, each.t + BRIEFLY_S), set(each.bodies)) for each in events if each.bodies]
    before: set[str] = set()
    for t in sorted({t for t0, t1, _ in spans for t in (t0, t1)}):
        now = set().union(*(bodies for t0, t1, bodies in spans if t0 <= t < t1))
        for name in sorted(now ^ before):
            yield from ((t, entity, shape if name in now else GONE) for entity, shape in shapes.get(name, ()))
        before = now


def record_absent(study: Study, stored: Stored[AbsentResults], output: Path) -> None:
    """Write the recording of a stage that was not computed, which holds the reason alone; its picture shows the arm.

    Parameters
    ----------
    stored : with the reason
    output : the recording, written whole or not at all
    """
    with recording(output, stored.robot, stored.stage, _note_view(stored.stage)) as stream:
        _log_text(stream, f"{stored.stage}/note", escaped(say(stored.results.summary.verdict.finding)))
    draw_picture(Recorded(study.robot(stored.robot), stored.robot, stored.stage, ""), output)
