"""Corrections to the table from the positions that a reference set states."""

from __future__ import annotations

from er3a.calibration.calibrate import Calibration, calibrate
from er3a.calibration.outcomes import CalibrationError
from er3a.pipeline.stages.validation.diagnosis_model import Calibrated, Corrections, SetCalibration
from er3a.references.reference import ReferenceSet
from er3a.robots.robot import Robot


def calibrate_from_sets(robot: Robot, sets: list[ReferenceSet]) -> tuple[tuple[SetCalibration, ...], Corrections]:
    """Estimate corrections to the table from each reference set's positions."""
    found, tables = [], []
    for references in sets:
        try:
            calibration = calibrate(robot, references)
        except CalibrationError as error:
            found.append(SetCalibration(references.name, error.finding))
            continue
        found.append(SetCalibration(references.name, _record(calibration)))
        if calibration.fits:
            tables.append(_corrections(references.name, calibration))
    return tuple(found), Corrections.stacked(tables)


def _record(found: Calibration) -> Calibrated:
    return Calibrated(
        conclusion=found.conclusion,
        level=found.level,
        coordinates=found.coordinates,
        poses=found.poses,
        held=found.held,
        close=found.close,
        singular_values=tuple(found.singular_values.tolist()),
        rms_before_mm=found.rms_before_mm,
        rms_after_mm=found.rms_after_mm,
        scatter=found.scatter,
        more=found.more,
    )


def _corrections(reference_set: str, found: Calibration) -> Corrections:
    return Corrections.of_rows(
        (reference_set, each.name, each.unit, each.nominal, each.correction, each.standard_error, each.half_width)
        for each in found.estimates
    )
