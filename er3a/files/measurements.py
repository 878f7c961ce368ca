"""Measured positions: CSV tables of joint angles and where a point was seen."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from er3a.calibration.measured import Measurement
from er3a.errors import InputError
from er3a.files.csv_file import CsvColumn, read_csv
from er3a.files.units import LEAST_SPAN_MM, WIDEST_IN_RADIANS
from er3a.references.quantities import Pose

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
