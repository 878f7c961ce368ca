"""Diagnosis, evidence and calibration with names and paths of the files that they take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from er3a.calibration import calibrate as calibration
from er3a.calibration.calibrate import Calibration
from er3a.calibration.measured import Measurement, check_poses
from er3a.diagnosis import diagnose as diagnosis
from er3a.diagnosis.diagnose import Hypotheses
from er3a.files.measurements import load_measurements
from er3a.files.reference_documents import check_robot_origins
from er3a.files.reference_sets import load_references
from er3a.identifiability.entry_evidence import Evidence, Tolerance
from er3a.identifiability.evidence import evidence_of
from er3a.references.documents import Document, Documents
from er3a.references.reference import Reference, ReferenceSet
from er3a.robots.robot import Robot, Source


def diagnose(robot: Robot, references: ReferenceSet | Sequence[Reference] | str | Path) -> Hypotheses:
    """Hypotheses about what is wrong with a table, best first; see :func:`er3a.diagnosis.diagnose.diagnose`.

    Parameters
    ----------
    references : a reference set, its name or its folder

    Raises
    ------
    InputError
        if there is no such reference set, or it can't be read
    """
    return diagnosis.diagnose(robot, load_references(references) if isinstance(references, str | Path) else references)


References = ReferenceSet | Sequence[Reference] | Sequence[ReferenceSet] | Sequence[str] | str | Path


def evidence(robot: Robot, references: References | None = None, tolerance: Tolerance | None = None) -> Evidence:
    """What independent documents settle of a robot's table; see :func:`er3a.identifiability.evidence.evidence_of`.

    Parameters
    ----------
    references : a reference set, its name or folder, several of them, or single references; those that the robot's file
        names by default
    tolerance : how far the tool may be off for what counts as settled

    Raises
    ------
    InputError
        if there is no such reference set, it can't be read, or the robot's own sets don't know a document that its
        values name
    """
    wanted = robot.references if references is None else references
    parts: list[Any] = [wanted] if isinstance(wanted, ReferenceSet | str | Path) else list(wanted)
    stated: list[Reference] = []
    documents: dict[str, Document] = {}
    for part in parts:
        own = load_references(part) if isinstance(part, str | Path) else part
        stated += own.references if isinstance(own, ReferenceSet) else [own]
        documents |= own.documents.by_name if isinstance(own, ReferenceSet) else {}
    if references is None:
        check_robot_origins(robot, documents)
    return evidence_of(robot, stated, Documents(documents), tolerance)


def calibrate(robot: Robot, measurements: Sequence[Measurement] | ReferenceSet | str | Path) -> Calibration:
    """Estimate corrections to a robot's table; see :func:`er3a.calibration.calibrate.calibrate`.

    Parameters
    ----------
    measurements : a CSV file of measured positions (:mod:`er3a.files.measurements`), its rows, or a reference set,
        whose key poses are used then

    Returns
    -------
    found : its robot says in its sources where the corrections come from

    Raises
    ------
    InputError
        if the file can't be used, or holds poses outside the joint limits
    CalibrationError
        if the positions determine too little, or no corrections make the table fit
    """
    if isinstance(measurements, str | Path):
        path, measurements = measurements, load_measurements(measurements)
        check_poses(measurements, robot, path)
    found = calibration.calibrate(robot, measurements)
    text = f"Calibrated with {found.coordinates} measured coordinates, starting from the table of {robot.name}"
    source = Source(text, "inferred")
    return replace(found, robot=found.robot.replace(sources={**robot.sources, "dh": source, "zero": source}))
