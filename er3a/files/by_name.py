"""Diagnosis, evidence and calibration, called with names or paths of their input files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np

from er3a.calibration import calibrate as calibration
from er3a.calibration.calibrate import Calibration
from er3a.calibration.fit import aligned
from er3a.calibration.observations import PLACEMENTS, Measurement, TouchKind, check_poses
from er3a.calibration.parameters import FixedName, all_parameters, corrected
from er3a.calibration.terms import CorrectedModel, JointErrors, JointTerm, starting_table, terms_of
from er3a.diagnosis.diagnose import Diagnosis, diagnosis_of
from er3a.errors import ArgumentError, InputError
from er3a.files.csv_file import METRES, CsvColumn, columns_of, read_csv, read_header, refuse_unit
from er3a.files.orientations import POSITION
from er3a.files.reference_sets import check_robot_origins, load_references
from er3a.files.units import joint_names, refuse_radians
from er3a.identifiability import statements
from er3a.identifiability.entry_evidence import Evidence, Tolerance
from er3a.identifiability.evidence import evidence_of
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.references.predict import with_rounding
from er3a.references.reference import Document, Documents, Reference, ReferenceSet
from er3a.robots.joint_limits import joint_columns, meant
from er3a.robots.robot import Robot, Source

SAME = 1e-9  # m, rad, kg
WRITE_CALIBRATION = "Write one: er3a calibrate ROBOT MEASUREMENTS.csv --json > FILE.json"


def measurement_columns(joints: Sequence[str]) -> dict[str, CsvColumn]:
    """Columns of a table of measured positions: joint values, the measured point, and where it was.

    Parameters
    ----------
    joints : the columns of joint values, ``q1_deg`` .. (``q3_mm`` of a joint that slides)

    Returns
    -------
    columns : by name; joint values and ``point`` are required. ``x_mm``, ``y_mm``, ``z_mm`` may hold empty cells;
        standard deviation, place and plane may also be left out as columns
    """
    own = "point:flange|tool x_mm? y_mm? z_mm? standard_deviation_mm~ place:word?~ plane:word?~"
    return columns_of(f"{' '.join(joints)} {own}")


SIX = tuple(f"q{joint}_deg" for joint in range(1, 7))
COLUMNS = measurement_columns(SIX)
POSES_TO_JUDGE_SCALE = 4
OTHER_UNITS_MM = {"metres": 1000.0, "feet": 304.8, "inches": 25.4, "cm": 10.0, "micrometres": 1e-3}
MUCH, LEFT_BY_SCALE = 1.25, 0.05
"""Times a unit that points may be apart beside it, and the share of their squares that it may leave."""


def load_measurements(path: str | Path, robot: Robot | None = None) -> tuple[Measurement, ...]:
    """Read measured positions: joint values ``q1_deg`` ... (``q3_mm`` of a prismatic joint), ``point`` (flange or
    tool), ``x_mm``, ``y_mm``, ``z_mm``, and, if it is known, ``standard_deviation_mm``. Instead of coordinates, a row
    may name a ``place`` or ``plane`` (a fixed point or plane at an unknown location that was touched).

    Parameters
    ----------
    robot : the robot that was measured; without it, the header decides the number of joints

    Raises
    ------
    InputError
        naming file, row and column: a wrong unit, a number missing or not finite, a deviation that is not positive,
        or values that can only be metres or radians
    """
    path = Path(path)
    joints = joint_columns(robot) if robot else joint_names(path, read_header(path)) or SIX
    table = read_csv(path, measurement_columns(joints))
    if not table:
        raise InputError(path, None, "the table has a header but no rows", "Add a row for each measured position")
    rows = []
    for fields in table:
        xyz, deviation = tuple(fields[name] for name in POSITION), fields["standard_deviation_mm"]
        names = {kind: fields[kind] for kind in get_args(TouchKind)}
        given = [kind for kind, value in names.items() if value]
        if given and (len(given) > 1 or xyz != (None, None, None)):
            problem = "a touched place or plane beside another, or beside coordinates"
            raise InputError(path, f"row {fields['row']}, column {given[-1]}", problem, "Give one of them")
        if xyz == (None, None, None) and not given:
            raise InputError(path, f"row {fields['row']}, column x_mm", "no coordinate is given", "Give at least one")
        if deviation is not None and deviation <= 0:
            where, problem = f"row {fields['row']}, column standard_deviation_mm", f"{deviation:g} is not positive"
            remedy = "Write the measuring device's standard deviation, or leave the column out to have it estimated"
            raise InputError(path, where, problem, remedy)
        pose = tuple(fields[name] for name in joints)
        rows.append(Measurement(fields["row"], pose, fields["point"], xyz, deviation, **names))
    refuse_unit(path, table, POSITION, METRES, mixed=False)
    _check_units(path, rows, joints)
    if robot is not None:
        _check_scale(path, rows, robot)
    return tuple(rows)


def load_joint_values(path: str | Path, robot: Robot) -> Reals:
    """Joint values (P, n), rad or m, of a table with the joints' columns of measured positions; its other columns may
    be there, and are not read.

    Raises
    ------
    InputError
        naming file, row and column: a number missing or not finite, radians, or a value outside the joint limits
    """
    path, joints = Path(path), joint_columns(robot)
    unread = {name: replace(each, optional=True, always=False) for name, each in measurement_columns(joints).items()}
    table = read_csv(path, unread | columns_of(" ".join(joints)))
    rows = [Measurement(each["row"], tuple(each[q] for q in joints), "tool", (None, None, None)) for each in table]
    values = _check_units(path, rows, joints)
    check_poses(rows, robot, path)
    return meant(robot, values)


def _check_units(path: Path, rows: list[Measurement], joints: Sequence[str]) -> Reals:
    """The joint values (P, n), deg and mm, of which none can be radians."""
    turning = np.array([name.endswith("_deg") for name in joints])
    poses = np.array([row.pose for row in rows], dtype=float).reshape(-1, len(joints))
    refuse_radians(path, f"columns {joints[0]} to {joints[-1]}", poses[:, turning])
    return poses


def _check_scale(path: Path, rows: list[Measurement], robot: Robot) -> None:
    """Refuse coordinates that are as the robot's table has them but for a factor that a unit explains."""
    whole = [row for row in rows if None not in row.xyz_mm]
    q = meant(robot, np.array([row.pose for row in whole], dtype=float).reshape(-1, robot.joints))
    if len(np.unique(q, axis=0)) < POSES_TO_JUDGE_SCALE:
        return
    on_tool = np.array([row.point == "tool" for row in whole])
    points = np.where(on_tool[:, None], *(forward(each, q)[:, :3, 3] for each in (robot, robot.without_tool())))
    measured = np.array([row.xyz_mm for row in whole], dtype=float)
    _, scale, left = aligned(1000 * points, measured)
    unit = next((unit for unit, size in OTHER_UNITS_MM.items() if 1 / MUCH < scale * size < MUCH), None)
    if unit and left < LEFT_BY_SCALE:
        problem = f"the points are {scale:.3g} times as far apart as {robot.name}'s table puts them: these are {unit}"
        remedy = f"Multiply by {OTHER_UNITS_MM[unit]:g}"
        raise InputError(path, "columns x_mm, y_mm, z_mm", problem, remedy)


def diagnose(robot: Robot, references: ReferenceSet | Sequence[Reference] | str | Path) -> Diagnosis:
    """Hypotheses about the faults of a table, best first; see
    :func:`er3a.identifiability.statements.diagnose`.

    Parameters
    ----------
    references : a reference set, its name or its folder

    Raises
    ------
    InputError
        if the reference set doesn't exist or can't be read
    """
    return statements.diagnose(robot, _of_arm(references, robot).references)


def _of_arm(given: ReferenceSet | Sequence[Reference] | str | Path, robot: Robot) -> ReferenceSet:
    """References with what joint values' last digits leave open on an arm; single ones as a set without a name."""
    if isinstance(given, str | Path):
        return load_references(given, robot)
    found = given if isinstance(given, ReferenceSet) else ReferenceSet("", tuple(given), {})
    return replace(found, references=with_rounding(robot, found.references))


References = ReferenceSet | Sequence[Reference] | Sequence[ReferenceSet] | Sequence[str] | str | Path


def evidence(robot: Robot, references: References | None = None, tolerance: Tolerance | None = None) -> Evidence:
    """Which entries of a robot's table independent documents settle; see
    :func:`er3a.identifiability.evidence.evidence_of`.

    Parameters
    ----------
    references : a reference set, its name or folder, several of these, or single references; default: those that the
        robot's file names
    tolerance : an entry is settled if what is unknown of it moves the tool by less than this

    Raises
    ------
    InputError
        if the reference set doesn't exist, it can't be read, or a document that the robot's values name is not declared
        in its sets
    """
    wanted = robot.references if references is None else references
    parts: list[Any] = [wanted] if isinstance(wanted, ReferenceSet | str | Path) else list(wanted)
    stated: list[Reference] = []
    documents: dict[str, Document] = {}
    for part in parts:
        own = _of_arm([part] if isinstance(part, Reference) else part, robot)
        stated += own.references
        documents |= own.documents.by_name
    if references is None:
        check_robot_origins(robot, documents)
    best = diagnosis_of(robot, stated)[:1]
    right = [each.corrected for each in best if each.explains]
    return evidence_of(robot, stated, Documents(documents), tolerance, corrected=right)


def calibrate(
    robot: Robot, measurements: Sequence[Measurement] | str | Path, fixed: Sequence[FixedName] = ()
) -> Calibration:
    """Estimate corrections to a robot's table, base and tool; see :func:`er3a.calibration.calibrate.calibrate`.

    Parameters
    ----------
    measurements : a CSV file of measured positions (:func:`er3a.load_measurements`), or its rows
    fixed : ``"base"``, ``"tool"``, ``"ratios"``: not to be estimated but kept as in the robot's file; default: none

    Returns
    -------
    found : corrections and corrected robot, whose sources name the measurements

    Raises
    ------
    InputError
        if the file can't be used, or holds poses outside the joint limits
    CalibrationError
        if the positions determine too little, or no corrections make the table fit
    """
    if isinstance(fixed, str) or not set(fixed) <= set(get_args(FixedName)):
        raise ArgumentError("fixed", fixed, f"several of {', '.join(map(repr, get_args(FixedName)))}")
    if isinstance(measurements, str | Path):
        path, measurements = measurements, load_measurements(measurements, robot)
        check_poses(measurements, robot, path)
    found = calibration.calibrate(robot, measurements, fixed)
    text = f"Calibrated with {found.coordinates} measured coordinates, starting from the table of {robot.name}"
    source = Source(text, "inferred")
    own, before = vars(found.robot), vars(robot)
    named = ["dh", "zero"] + [name for name in PLACEMENTS if not np.array_equal(own[name], before[name])]
    named += ["coupling"] if found.ratios else []
    return replace(found, robot=found.robot.replace(sources=dict(robot.sources) | dict.fromkeys(named, source)))


def load_calibration(path: str | Path, robot: Robot) -> CorrectedModel:
    """The whole calibrated model, with all error terms, from the output of ``er3a calibrate ROBOT MEASUREMENTS.csv
    --json``.

    Parameters
    ----------
    robot : the robot from which the calibration started

    Raises
    ------
    InputError
        if the file holds no calibration, or a calibration of another table
    """
    try:
        record = json.loads(Path(path).read_text(encoding="utf-8"))
        own = record["beyond"] or {"entries": record["entries"], "terms": record["ratios"]}
        for name, value in starting_table(robot).items():
            then = record["start"][name]
            if then != value and not _are_near(then, value):
                problem = f"the calibration did not start from {robot.name}'s {name}"
                remedy = "Give the robot that was calibrated, not the corrected one"
                raise InputError(path, f"start, {name}", problem, remedy)
        by_name = {each.name: each for each in all_parameters(robot)}
        kept = [_known(path, "entries", by_name, each["name"]) for each in own["entries"]]
        amounts = np.array([float(each["correction"]) for each in own["entries"]]) / [each.in_unit for each in kept]
        by_term = {each: each for each in terms_of(robot)}
        stated = [JointTerm(each["kind"], each["joint"], each["turns"], each["by"]) for each in own["terms"]]
        terms = tuple(_known(path, "terms", by_term, each) for each in stated)
        coefficients = [[float(value) / 1000 for value in each["coefficients"]] for each in own["terms"]]
        for term, values in zip(terms, coefficients, strict=True):
            if len(values) != term.count:
                problem = f"{len(values)} coefficients of '{term.kind}' of joint {term.joint}, which has {term.count}"
                raise InputError(path, "terms", problem, WRITE_CALIBRATION)
        errors = JointErrors(robot, terms, np.concatenate([np.empty(0), *coefficients]))
        if not (np.isfinite(amounts).all() and np.isfinite(errors.coefficients).all()):
            raise InputError(path, None, "a correction or coefficient is not finite", WRITE_CALIBRATION)
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        raise InputError(path, None, "is not a calibration file", WRITE_CALIBRATION) from None
    return CorrectedModel(corrected(robot, kept, amounts), errors)


def _are_near(first: Any, second: Any) -> bool:
    shapes = np.shape(first), np.shape(second)
    return shapes[0] == shapes[1] != () and np.allclose(first, second, rtol=0, atol=SAME)


def _known(path: str | Path, where: str, known: dict[Any, Any], wanted: object) -> Any:
    if wanted not in known:
        raise InputError(path, where, f"the robot has no {wanted}", WRITE_CALIBRATION)
    return known[wanted]
