"""Diagnosis, evidence and calibration with names and paths of the files that they take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from er3a.calibration import calibrate as calibration
from er3a.calibration.calibrate import Calibration, Measurement, check_poses
from er3a.diagnosis import diagnose as diagnosis
from er3a.diagnosis.diagnose import Hypotheses
from er3a.errors import InputError
from er3a.files.csv_file import CsvColumn, read_csv
from er3a.files.reference_sets import check_robot_origins, load_references
from er3a.files.units import LEAST_SPAN_MM, WIDEST_IN_RADIANS
from er3a.identifiability.entry_evidence import Evidence, Tolerance
from er3a.identifiability.evidence import evidence_of
from er3a.references.quantities import Pose
from er3a.references.reference import Document, Documents, Reference, ReferenceSet
from er3a.robots.robot import Robot, Source

_NUMBER = CsvColumn(float)
COLUMNS = {
    **{f"q{joint}_deg": _NUMBER for joint in range(1, 7)},
    "point": CsvColumn(str, choices=("flange", "tool")),
    **{f"{c}_mm": CsvColumn(float, optional=True) for c in "xyz"},
    "standard_deviation_mm": _NUMBER,
}
POSES_TO_JUDGE_UNITS = 3
APART_DEVIATIONS = 8.0


def load_measurements(path: str | Path) -> tuple[Measurement, ...]:
    """Read measured positions.

    Raises
    ------
    InputError
        naming file, row and column: a wrong unit, a number missing or not finite, a deviation that is not positive,
        values that can only be metres or radians, or rows that contradict each other
    """
    path = Path(path)
    table = read_csv(path, COLUMNS)
    if not table:
        raise InputError(path, None, "the table has a header but no rows", "Add a row for each measured position")
    rows = []
    for fields in table:
        xyz = tuple(fields[f"{c}_mm"] for c in "xyz")
        if xyz == (None, None, None):
            raise InputError(path, f"row {fields['row']}, column x_mm", "no coordinate is given", "Give one at least")
        if fields["standard_deviation_mm"] <= 0:
            problem = f"{fields['standard_deviation_mm']:g} is not positive"
            where = f"row {fields['row']}, column standard_deviation_mm"
            raise InputError(path, where, problem, "Write the measuring device's standard deviation")
        pose = tuple(fields[f"q{joint}_deg"] for joint in range(1, 7))
        rows.append(Measurement(fields["row"], pose, fields["point"], xyz, fields["standard_deviation_mm"]))
    _check_units(path, rows)
    _check_contradictions(path, rows)
    return tuple(rows)


def _check_units(path: Path, rows: list[Measurement]) -> None:
    for row in rows:
        span = max(abs(value) for value in row.xyz_mm if value is not None)
        if None not in row.xyz_mm and span < LEAST_SPAN_MM:
            problem = f"the point is {span:g} mm from the base's origin at most, which can only be metres"
            raise InputError(path, f"row {row.row}, columns x_mm, y_mm, z_mm", problem, "Multiply by 1000")
    widest = max(abs(angle) for row in rows for angle in row.pose)
    if len({row.pose for row in rows}) >= POSES_TO_JUDGE_UNITS and 0 < widest <= WIDEST_IN_RADIANS:
        problem = f"the widest angle is {widest:g} deg, which can only be radians"
        raise InputError(path, "columns q1_deg to q6_deg", problem, "Convert to degrees")


def _check_contradictions(path: Path, rows: list[Measurement]) -> None:
    by_pose: dict[tuple[Pose, str], list[Measurement]] = {}
    for row in rows:
        by_pose.setdefault((row.pose, row.point), []).append(row)
    for same in (rows for rows in by_pose.values() if len(rows) > 1):
        xyz = np.array([row.xyz_mm for row in same], dtype=float)  # None becomes NaN, which is never far from anything
        deviation = np.array([row.deviation_mm for row in same])
        for n, row in enumerate(same):
            apart = np.abs(xyz[:n] - xyz[n])
            far = np.argwhere(apart > APART_DEVIATIONS * np.hypot(deviation[:n], deviation[n])[:, None])
            if len(far):
                k, c = far[0]
                problem = (
                    f"contradicts row {same[k].row}: same joints, {apart[k, c]:.3g} mm apart in {'xyz'[c]}, "
                    f"far beyond the stated standard deviations"
                )
                raise InputError(path, f"row {row.row}", problem, "Remove the wrong one, or state its deviation")


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
    measurements : a CSV file of measured positions (:mod:`er3a.files.by_name`), its rows, or a reference set,
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


def load_table(path: str | Path) -> pd.DataFrame:
    """A table of results, such as ``results/er3_600/validation/checks.parquet``, as it was written.

    Returns
    -------
    frame : ``frame.attrs["columns"]`` has unit and meaning of each column by its name

    Raises
    ------
    InputError
        naming the file that is missing, or none of er3a's tables
    """
    remedy = "Give a .parquet file of a study's results"
    try:
        stored = pq.ParquetFile(pa.BufferReader(Path(path).read_bytes())).read()
    except OSError as error:
        raise InputError(path, None, error.strerror or str(error), remedy) from None
    except ValueError:
        raise InputError(path, None, "this is no Parquet file", remedy) from None
    columns = {part.name: {k.decode(): v.decode() for k, v in (part.metadata or {}).items()} for part in stored.schema}
    if not all({"unit", "meaning"} <= set(described) for described in columns.values()):
        raise InputError(path, None, "its columns don't say unit and meaning", remedy)
    frame = stored.to_pandas()
    frame.attrs["columns"] = columns
    return frame
