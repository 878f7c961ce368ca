"""A calibration as the stage's results hold it: mm and degrees."""

from __future__ import annotations

import numpy as np

from er3a.files.hand_eye_file import HandEyeFile, SeenImages
from er3a.geometry.transforms import rpy_of
from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.vision.model import (
    CalibrationResult,
    CornerRows,
    EntryCorrection,
    MethodResult,
    OffsetResult,
    PoseEstimate,
    SampleRows,
    TableResult,
    Three,
    TouchedPoint,
    TouchResult,
    ViewToAdd,
)
from er3a.vision.boards import projected
from er3a.vision.hand_eye import HandEye, MethodAnswer, spread_of
from er3a.vision.next_view import NextView
from er3a.vision.table_corrections import NoCorrections, TableCorrections
from er3a.vision.tangent import inverted, quaternion_of
from er3a.vision.time_offset import TimeOffset


def in_mm(position: Reals) -> Three:
    """Three lengths (m) in mm."""
    x, y, z = (1000 * np.asarray(position)).tolist()
    return x, y, z


def in_degrees(angles: Reals) -> Three:
    """Three angles (rad) in degrees."""
    x, y, z = np.degrees(angles).tolist()
    return x, y, z


def quaternion(T: Reals) -> tuple[float, float, float, float]:
    """Unit quaternion of a transform (4, 4), real part first."""
    w, x, y, z = quaternion_of(T).tolist()
    return w, x, y, z


def calibration_result(
    head: HandEyeFile,
    found: HandEye,
    view: NextView | None,
    offset: TimeOffset | None,
    table: TableCorrections | NoCorrections | None,
) -> CalibrationResult:
    """All that the summary says of a calibration."""
    spread, turned = spread_of(found)
    moved = found.without_suspects
    return CalibrationResult(
        title=head.title,
        source=head.source,
        setup=found.samples.setup,
        samples=len(found.samples),
        used=int(found.used.sum()),
        stated=found.samples.camera_covariance is not None,
        hand_eye=_estimate(found.X, found.half_width[:6]),
        board=_estimate(found.Y, found.half_width[6:]),
        scatter=found.scatter,
        camera_mm=float(1000 * found.deviations[0]),
        camera_deg=float(np.degrees(found.deviations[1])),
        spread_mm=1000 * spread,
        spread_deg=float(np.degrees(turned)),
        greatest_turn_deg=float(np.degrees(found.greatest_turn)),
        axes_apart_deg=float(np.degrees(found.axes_apart)),
        suspects=found.suspects,
        warnings=found.warnings,
        moved_mm=None if moved is None else float(1000 * moved[0]),
        moved_deg=None if moved is None else float(np.degrees(moved[1])),
        methods=tuple(map(_method, found.methods)),
        directions=found.directions,
        touch=_touch(found),
        next_view=_next(view) if view else None,
        time_offset=OffsetResult(offset.offset, offset.half_width, float(np.degrees(offset.rms))) if offset else None,
        table=_table(table) if isinstance(table, TableCorrections) else table,
    )


def _table(found: TableCorrections) -> TableResult:
    rows = zip(found.estimates, found.entry_half_width.tolist())
    return TableResult(
        level=found.level,
        entries=tuple(
            EntryCorrection(each.name, each.unit, each.nominal, each.correction, half) for each, half in rows
        ),
        held=found.held,
        close=found.close,
        scatter=found.scatter,
        scatter_before=found.scatter_before,
        probability=found.probability,
        moved_mm=float(1000 * found.moved[0]),
        moved_deg=float(np.degrees(found.moved[1])),
        hand_eye=_estimate(found.X, found.half_width[:6]),
    )


def _estimate(T: Reals, half_width: Reals) -> PoseEstimate:
    return PoseEstimate(
        in_mm(T[:3, 3]), in_degrees(rpy_of(T)), quaternion(T), in_mm(half_width[:3]), in_degrees(half_width[3:])
    )


def _method(answer: MethodAnswer) -> MethodResult:
    numbers = (answer.apart_mm, answer.apart_deg, answer.beyond, answer.rms_mm, answer.rms_deg)
    return MethodResult(answer.name, *(None if answer.X is None else number for number in numbers))


def _touch(found: HandEye) -> TouchResult | None:
    if found.touch is None:
        return None
    rows = zip(found.touch.difference, found.touch.half_width)
    points = tuple(TouchedPoint(in_mm(difference), in_mm(half)) for difference, half in rows)
    return TouchResult(points, found.touch.probability)


def _next(view: NextView) -> ViewToAdd:
    return ViewToAdd(
        q_deg=tuple(np.degrees(view.q).tolist()),
        clearance_mm=None if view.clearance is None else 1000 * view.clearance,
        error_before_mm=1000 * view.error_before,
        error_after_mm=1000 * view.error_after,
        tried=view.tried,
        in_view=view.in_view,
    )


def sample_rows(found: HandEye, joints: int) -> SampleRows:
    """One row for each sample."""
    samples, count = found.samples, len(found.samples)
    in_hand = samples.setup == "eye_in_hand"
    seen = (samples.flange if in_hand else np.eye(4)) @ found.X @ samples.target
    predicted = np.broadcast_to(found.Y, seen.shape) if in_hand else samples.flange @ found.Y
    others = np.where(np.eye(count, dtype=bool) | ~found.used, np.nan, found.mismatch)
    return SampleRows(
        sample=np.array(samples.names, object),
        used=found.used,
        residual_mm=1000 * found.residual[:, :3],
        residual_deg=np.degrees(found.residual[:, 3:]),
        mismatch_deg=np.degrees(np.nanmedian(others, axis=1)),
        flange_mm=1000 * samples.flange[:, :3, 3],
        seen_mm=1000 * seen[:, :3, 3],
        predicted_mm=1000 * predicted[:, :3, 3],
        q_deg=np.full((count, joints), np.nan) if samples.q is None else np.degrees(samples.q),
    )


def corner_rows(found: HandEye, images: SeenImages | None) -> CornerRows:
    """One row for each corner in each image."""
    if images is None:
        return CornerRows.empty()
    predicted = inverted(found.samples.hand @ found.X) @ found.Y
    views, tables = images.views, []
    for k, (name, points, seen, by_board) in enumerate(
        zip(images.names, views.points, views.corners, views.reprojected)
    ):
        count = len(points)
        tables.append(
            CornerRows(
                sample=np.full(count, found.samples.names[k], object),
                image=np.full(count, name, object),
                used=np.full(count, found.used[k]),
                seen_px=seen,
                by_board_px=by_board,
                by_arm_px=projected(points, predicted[k], views.camera),
            )
        )
    return CornerRows.stacked(tables)
