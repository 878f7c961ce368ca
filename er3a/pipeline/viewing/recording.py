"""Rerun recordings: opened arranged, written whole or not at all."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
import scipy

from er3a.collision.scene import Box, Cylinder, Mesh, Plane, Scene, Sphere
from er3a.files.kept_files import write_atomically
from er3a.files.scene_file import load_scene
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.palette import MUTED, rgb
from er3a.robots.joint_limits import size_of

TIMELINE = "t"
ARM = "/arm/**"
SHOWN_S = rr.TimeRange(
    start=rr.TimeRangeBoundary.cursor_relative(seconds=-4), end=rr.TimeRangeBoundary.cursor_relative(seconds=12)
)
AXES = ((255, 80, 80), (80, 200, 80), (110, 130, 255))
"""Colours of a frame's x, y and z."""


@contextmanager
def recording(output: Path, robot: str, stage: str, layout: rrb.View | rrb.Container) -> Iterator[rr.RecordingStream]:
    """Open a recording for logging; ``output`` appears when the block ends without an error.

    Viewers keep one blueprint for each application id, so every stage of every robot is an application of its own:
    opened together, each keeps its own layout and camera.

    Parameters
    ----------
    robot, stage : name the recording: application ``<stage> <robot>``, recording ``<robot>``
    layout : what the blueprint shows
    """
    rr.set_strict_mode(True)
    blueprint = rrb.Blueprint(
        layout,
        rrb.TimePanel(timeline=TIMELINE, state="collapsed", play_state="paused"),
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
        stream.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        yield stream
        content = collected.read(flush=True)
    assert content is not None  # all of it was flushed
    write_atomically(output, lambda file: file.write_bytes(content))


def log_text(stream: rr.RecordingStream, entity: str, markdown: str, static: bool = False) -> None:
    """Log a text."""
    stream.log(entity, rr.TextDocument(markdown, media_type=rr.MediaType.MARKDOWN), static=static)


def log_note(stream: rr.RecordingStream, stage: str, markdown: str) -> None:
    """Log the text that says what to look at, ``/<stage>/note``."""
    log_text(stream, f"{stage}/note", markdown, static=True)


def log_now(stream: rr.RecordingStream, stage: str, t: float, markdown: str) -> None:
    """Log what is to be seen from a time (s) on, ``/<stage>/now``."""
    stream.set_time(TIMELINE, duration=t)
    log_text(stream, f"{stage}/now", markdown)


def log_event(stream: rr.RecordingStream, stage: str, t: float, text: str, level: rr.TextLogLevel) -> None:
    """Log an event at a time (s), ``/<stage>/events``."""
    stream.set_time(TIMELINE, duration=t)
    stream.log(f"{stage}/events", rr.TextLog(text, level=level))


def note_view(stage: str) -> rrb.View:
    """The view of a stage's note."""
    return rrb.TextDocumentView(origin=f"/{stage}/note", name="What to look at")


def words_view(
    stage: str, now: str, *more: rrb.View, row_shares: Sequence[float] | None = None, name: str = "Words"
) -> rrb.Vertical:
    """A stage's note, below it what is to be seen now, under that name, and more views."""
    shown = rrb.TextDocumentView(origin=f"/{stage}/now", name=now)
    return rrb.Vertical(note_view(stage), shown, *more, row_shares=row_shares, name=name)


def curves_view(origin: str, name: str, legend: bool | None = None) -> rrb.View:
    """A view of curves, some seconds around the time shown."""
    shown = None if legend is None else rrb.PlotLegend(visible=legend)
    return rrb.TimeSeriesView(origin=origin, name=name, axis_x=rrb.TimeAxis(view_range=SHOWN_S), plot_legend=shown)


def events_view(stage: str, name: str) -> rrb.View:
    """The view of what is logged at ``/<stage>/events``; texts tell the time themselves, in words."""
    columns = rrb.TextLogColumns(
        timeline_columns=rrb.encodings.TimelineColumn(TIMELINE, visible=False), text_log_columns=["loglevel", "body"]
    )
    return rrb.TextLogView(origin=f"/{stage}/events", name=name, columns=columns)


def escaped(text: str) -> str:
    """A text from an input file for a Markdown document: shown as it is, on one line, with nothing fetched for it."""
    return re.sub(r"([\\`*_{}\[\]<>#!|~])", r"\\\1", " ".join(text.split()))


def seconds(times: np.ndarray) -> rr.TimeColumn:
    """A time column (s) for ``send_columns``."""
    return rr.TimeColumn(TIMELINE, duration=np.asarray(times, dtype=float))


def send_series(
    stream: rr.RecordingStream, entity: str, times: np.ndarray, values: np.ndarray, names: list[str], colours: list[str]
) -> None:
    """Log curves as one entity.

    Parameters
    ----------
    times : (N,), s
    values : (N, k); a row with NaN is a gap in all curves (NaN itself would never compare equal between recordings)
    names, colours : k of each
    """
    stream.log(entity, rr.SeriesLines(names=names, colors=[rgb(colour) for colour in colours]), static=True)
    times, known = np.asarray(times, dtype=float), np.isfinite(values).all(axis=1)
    stream.send_columns(entity, [seconds(times[known])], rr.Scalars.columns(scalars=np.asarray(values)[known]))
    gap_starts = times[~known & np.append(True, known[:-1])]
    cleared = rr.Clear.columns(is_recursive=np.zeros(len(gap_starts), dtype=bool))  # type: ignore[arg-type]
    stream.send_columns(entity, [seconds(gap_starts)], cleared)


def send_run(
    stream: rr.RecordingStream, entity: str, times: np.ndarray, values: np.ndarray, names: list[str], colours: list[str]
) -> None:
    """As :func:`send_series`, with a gap behind the last point, so that the next run's curves don't join these."""
    gap = np.full((1, values.shape[1]), np.nan)
    send_series(stream, entity, np.append(times, times[-1] + 1e-3), np.concatenate([values, gap]), names, colours)


_PLANE_THICKNESS = 0.002  # m


def log_scene(stream: rr.RecordingStream, study: Study, name: str, stage: str, below: str | None = None) -> None:
    """Log the solids of a robot's scene in a stage, each an entity below it (or ``below``); of planes the near part."""
    file = study.scene(name, stage)
    if file is None:
        return
    robot = study.robot(name)
    for solid, T, shape in _solids(load_scene(file), robot.base[:3, 3], 3 * size_of(robot)):
        place = rr.Transform3D(translation=T[:3, 3], mat3x3=T[:3, :3])
        stream.log(f"{below or stage}/scene/{solid}", place, shape, static=True)


def _solids(
    scene: Scene, base: Reals, plane_size: float
) -> Iterator[tuple[str, Reals, rr.Boxes3D | rr.Cylinders3D | rr.Ellipsoids3D | rr.Mesh3D]]:
    """Name, place (4, 4) and shape of each solid; planes are squares of ``plane_size`` (m) nearest to the base (3,)."""
    style: dict[str, Any] = {"colors": [(*rgb(MUTED), 120)], "fill_mode": "transparentfillmajorwireframe"}
    for solid in scene.solids:
        match solid:
            case Box():
                yield solid.name, solid.T, rr.Boxes3D(sizes=[solid.size], **style)
            case Cylinder():
                shape = rr.Cylinders3D(lengths=[solid.length], radii=[solid.radius], **style)
                yield solid.name, solid.T, shape
            case Sphere():
                yield solid.name, solid.T, rr.Ellipsoids3D(radii=[solid.radius], **style)
            case Mesh():
                yield solid.name, solid.T, pieces_mesh(solid.pieces, (*rgb(MUTED), 120))
            case Plane():
                slab = rr.Boxes3D(sizes=[[plane_size, plane_size, _PLANE_THICKNESS]], **style)
                yield solid.name, _below(solid, base), slab


def pieces_mesh(pieces: Sequence[Reals], colour: tuple[int, ...]) -> rr.Mesh3D:
    """Convex pieces (k, 3) each, m, as one mesh."""
    hulls = [scipy.spatial.ConvexHull(piece) for piece in pieces]
    starts = np.cumsum([0, *(len(piece) for piece in pieces)])
    triangles = [start + _outward(hull) for start, hull in zip(starts, hulls)]
    return rr.Mesh3D(
        vertex_positions=np.concatenate(pieces), triangle_indices=np.concatenate(triangles), albedo_factor=colour
    )


def _outward(hull: scipy.spatial.ConvexHull) -> Integers:
    """A hull's triangles with their corners in order around the outward normal."""
    corners = hull.points[hull.simplices]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("ij,ij->i", normal, hull.equations[:, :3]) < 0
    return np.where(inward[:, None], hull.simplices[:, ::-1], hull.simplices)


def _below(plane: Plane, base: Reals) -> Reals:
    """Where a slab lies whose upper side is in the plane, its middle next to the base."""
    normal = plane.normal
    x = np.linalg.svd(normal[None])[2][1]
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(normal, x), normal], axis=1)
    T[:3, 3] = base - (normal @ base - plane.offset + _PLANE_THICKNESS / 2) * normal
    return T
