"""Target files (YAML or CSV): the poses that the inverse stage solves.

Targets as a CSV table: one row each, position in mm and the orientation in one of the named forms.

Columns: ``name``, ``x_mm``, ``y_mm``, ``z_mm``; the columns of one form (``FORMS``); optionally ``note``,
``expect`` (may stay empty), ``q1_ref_deg`` .. ``qn_ref_deg`` (of prismatic joints in mm), and ``units_checked``, with
yes in each row where small angles are degrees although they look like radians.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from er3a.errors import InputError
from er3a.files.csv_file import CHECKED_COLUMN, UNITS_CHECKED, CsvColumn, CsvRow, CsvRows, read_csv, read_header
from er3a.files.orientations import FORMS, POSITION, form_in, rotations
from er3a.files.robot_file import Name
from er3a.files.units import JointsDeg, PositionMm, RpyDeg, Triple, joint_values
from er3a.files.yaml_file import Content, InputFile, StrictModel, check_own_names, load, parse
from er3a.geometry.transforms import posed
from er3a.kinematics.forward import forward
from er3a.kinematics.solutions import Target, TargetOutcome
from er3a.robots.robot import MAX_JOINTS, Robot

KNOWN_FORMS = "; or ".join(", ".join(names[:4]) + (" ..." if len(names) > 4 else "") for names in FORMS.values())
TEXTS = ("note", "expect")
REFERENCE = tuple(f"q{joint}_ref_deg" for joint in range(1, MAX_JOINTS + 1))


def read_target_table(path: str | Path) -> CsvRows:
    """Rows of a CSV file as the mappings that a target file in YAML holds, each with the keys ``row`` (file line) and
    ``units_checked``.

    Raises
    ------
    InputError
        naming row and column; for a header without a known form of orientation, or with two
    """
    path = Path(path)
    header = read_header(path)
    present = set(header)
    form = form_in(path, header)
    if form is None:
        raise InputError(path, "header", _without_form(header), f"Give the columns {KNOWN_FORMS}")
    columns = {"name": CsvColumn(str)} | {name: CsvColumn() for name in (*POSITION, *FORMS[form])}
    columns |= {name: CsvColumn(str, optional=True) for name in TEXTS if name in present}
    last = max((number for number, name in enumerate(REFERENCE, 1) if name in present), default=0)
    columns |= {name: CsvColumn() for name in REFERENCE[:last]} | CHECKED_COLUMN
    return [_target(row, form, REFERENCE[:last]) for row in read_csv(path, columns)]


def _without_form(header: list[str]) -> str:
    if not header:
        return "the file is empty"
    strange = [name for name in header if name.strip() not in ("name", *TEXTS, *POSITION, *REFERENCE, UNITS_CHECKED)]
    return "the table has no orientation" + (f" that is known, but {', '.join(strange)}" if strange else "")


def _target(row: CsvRow, form: str, reference: tuple[str, ...]) -> Content:
    values = [row[name] for name in FORMS[form]]
    target = {"row": row["row"], "name": row["name"], "xyz_mm": [row[name] for name in POSITION]}
    target[form] = [values[0:3], values[3:6], values[6:9]] if form == "matrix" else values
    target |= {name: row[name] for name in TEXTS if row.get(name)}
    target[UNITS_CHECKED] = row[UNITS_CHECKED]
    if reference:
        target["q_ref_deg"] = [row[name] for name in reference]
    return target


MAX_TARGETS = 20_000
EULER_KEY = re.compile(r"euler\w*|[xyz]{3}(_(deg|rad))?", re.IGNORECASE)

Line = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\r\n]*$")]


class Orientation(StrictModel):
    """The orientation of a pose, in one of five forms.

    Attributes
    ----------
    rpy_deg : R = Rz(yaw) Ry(pitch) Rx(roll)
    zyz_deg : R = Rz(a) Ry(b) Rz(c)
    quaternion_wxyz : of unit length to 1e-6
    matrix : rotation matrix by rows, orthonormal to 1e-6; the nearest exact rotation is used
    rotation_vector_rad : axis times angle, a turn at most
    """

    rpy_deg: RpyDeg | None = None
    zyz_deg: RpyDeg | None = None
    quaternion_wxyz: Annotated[list[float], Field(min_length=4, max_length=4)] | None = None
    matrix: Annotated[list[Triple], Field(min_length=3, max_length=3)] | None = None

    @model_validator(mode="before")
    @classmethod
    def _known_euler_order(cls, content: Any) -> Any:
        for key in content if isinstance(content, dict) else ():
            if key != "zyz_deg" and EULER_KEY.fullmatch(str(key)):
                raise ValueError(
                    f"{key}: this order of Euler angles is not known | Write rpy_deg (roll, pitch, yaw: R = Rz Ry Rx, "
                    "the order ZYX), zyz_deg, quaternion_wxyz or matrix"
                )
        return content

    rotation_vector_rad: Triple | None = None

    @field_validator("quaternion_wxyz", "matrix", "rotation_vector_rad")
    @classmethod
    def _rotation(cls, values, info):
        if values is not None:
            rotations(info.field_name, [np.ravel(values)])
        return values

    def forms(self) -> list[str]:
        """The forms that are given."""
        return [key for key in FORMS if getattr(self, key) is not None]

    def check_one_form(self) -> None:
        """``ValueError`` if there is none, or more than one."""
        forms = self.forms()
        if not forms:
            raise ValueError(f"the orientation is missing | Add one of {', '.join(FORMS)}")
        if len(forms) > 1:
            raise ValueError(f"the orientation is given twice, as {' and '.join(forms)} | Keep one")

    def transform_at(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """The pose with this orientation at a position.

        Parameters
        ----------
        position : (3,), m

        Returns
        -------
        T : (4, 4), see :func:`er3a.files.orientations.rotations`
        """
        (form,) = self.forms()
        return posed(rotations(form, [np.ravel(getattr(self, form))])[0], position)


class PoseEntry(Orientation):
    """A pose: position, and one of the forms of orientation."""

    xyz_mm: PositionMm

    @model_validator(mode="after")
    def _one_orientation(self):
        self.check_one_form()
        return self

    def pose(self) -> NDArray[np.float64]:
        """The transform (4, 4), m."""
        return self.transform_at(np.array(self.xyz_mm) / 1000)


class TargetEntry(Orientation):
    """One pose of the tool, in the world frame in which the robot's base is placed.

    Either ``xyz_mm`` and one orientation form, or ``q_deg`` (the pose at these joint angles).

    Attributes
    ----------
    q_deg, q_ref_deg : joint values in degrees, of prismatic joints in mm; ``q_ref_deg`` are the joint values before
    expect : the expected outcome; another outcome is a fault, and the expected one is not
    """

    name: Name
    note: Line | None = None
    note_zh: Line | None = None
    xyz_mm: PositionMm | None = None
    q_deg: JointsDeg | None = None
    q_ref_deg: JointsDeg | None = None
    expect: TargetOutcome | None = None

    @model_validator(mode="after")
    def _one_pose(self):
        forms = self.forms()
        if self.q_deg is not None:
            if self.xyz_mm is not None or forms:
                extra = "xyz_mm" if self.xyz_mm is not None else forms[0]
                raise ValueError(f"q_deg and {extra} both give a pose | Keep one of the two")
            return self
        if self.xyz_mm is None:
            raise ValueError("the position is missing | Add xyz_mm and an orientation, or q_deg alone")
        self.check_one_form()
        return self

    def target(self, robot: Robot) -> Target:
        """The target in SI units.

        Parameters
        ----------
        robot : places a target that is given by joint angles, and says which joints slide

        Returns
        -------
        target : pose T_base_tool in m, reference joints in rad or m (zeros if none are given)

        Raises
        ------
        InputError
            if joint values are not as many as the robot's
        """
        reference = tuple(self.q_ref_deg or (0.0,) * robot.joints)
        q_ref = joint_values(robot, reference, f"target {self.name}: q_ref_deg")
        return Target(self.name, self._pose(robot), self.note, reference, self.expect, q_ref)

    def _pose(self, robot: Robot) -> NDArray[np.float64]:
        """T_base_tool (4, 4), m, read-only."""
        if self.q_deg is not None:
            T = forward(robot, joint_values(robot, self.q_deg, f"target {self.name}: q_deg"))
        else:
            T = self.transform_at(np.array(self.xyz_mm) / 1000)
        T.setflags(write=False)
        return T


class TargetFile(InputFile):
    """data/targets/ROBOT.yaml."""

    kind: Literal["targets"]
    targets: list[TargetEntry]

    @field_validator("targets")
    @classmethod
    def _some_but_not_many(cls, targets):
        if not targets:
            raise ValueError("the list is empty | Add a target, or take the robot out of the study")
        if len(targets) > MAX_TARGETS:
            raise ValueError(f"{len(targets)} targets are too many | Split the file; {MAX_TARGETS} at most")
        return targets

    @model_validator(mode="after")
    def _own_names(self):
        check_own_names("targets", [target.name for target in self.targets])
        return self


def load_targets(path: str | Path, robot: Robot) -> tuple[Target, ...]:
    """The targets of a YAML or CSV file, in file order; targets given by joint angles are placed with the robot's
    forward kinematics.

    Raises
    ------
    InputError
        naming file, field (or row and column) and remedy
    """
    try:
        return tuple(entry.target(robot) for entry in read_targets(path))
    except InputError as error:
        raise InputError(error.file or path, error.field, error.problem, error.remedy) from None


def read_targets(path: str | Path) -> tuple[TargetEntry, ...]:
    """The contents of a target file, checked.

    Raises
    ------
    InputError
        naming file, field (or row and column) and remedy
    """
    if str(path).endswith(".csv"):
        return _targets_of_table(Path(path))
    return tuple(load(TargetFile, path).targets)


def _targets_of_table(path: Path) -> tuple[TargetEntry, ...]:
    rows = read_target_table(path)
    lines, checked = ([row.pop(key) for row in rows] for key in ("row", UNITS_CHECKED))
    try:
        content = {"kind": "targets", "targets": rows, UNITS_CHECKED: all(checked)}
        return tuple(parse(TargetFile, content, path).targets)
    except InputError as error:
        where = re.match(r"targets\[(\d+)\]\.?(\w*)", error.field or "")
        if where is None:
            raise InputError(path, "rows", error.problem, error.remedy) from None
        columns = {"xyz_mm": POSITION, "q_ref_deg": REFERENCE, **FORMS}.get(where[2], (where[2],))
        column = f", column {', '.join(columns)}" if where[2] else ""
        problem = re.sub(r"targets\[(\d+)\]", lambda other: f"row {lines[int(other[1])]}", error.problem)
        raise InputError(path, f"row {lines[int(where[1])]}{column}", problem, error.remedy) from None
