"""A controller's poses as a document about an arm, by which the stage validation judges the arm's table."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from er3a.confirmation.confirm import Confirmation, confirm
from er3a.confirmation.pairs import Pairs, spread
from er3a.confirmation.poses import read_pairs
from er3a.errors import InputError
from er3a.geometry.transforms import inverted, posed
from er3a.numerics.arrays import Reals
from er3a.references.predict import with_rounding
from er3a.references.quantities import Rotation3
from er3a.references.reference import Document, Documents, ReferenceSet
from er3a.references.rows import PositionRow, reference_set
from er3a.robots.joint_limits import shown
from er3a.robots.robot import Robot

MOST = 24  # rows, evenly over the file: more say the same again, and each is searched for in every entry
HALF = 0.5  # of the last digit, by which rounding is off at most
MM = 1000.0


def controller_set(robot: Robot, model: Robot, file: Path) -> ReferenceSet:
    """References from joint values and the poses that a controller shows for them.

    Parameters
    ----------
    robot : with its base and tool, which the controller has to have, too
    model : the same arm as its file has it, without tool, of which references speak
    file : of at least four pairs, in any form that :mod:`er3a.confirmation.poses` reads

    Returns
    -------
    references : the flange's position and orientation at up to ``MOST`` poses, of a document named as the file

    Raises
    ------
    InputError
        if the file can't be read, or the controller has another tool or base
    """
    pairs = read_pairs(file, robot)
    found = confirm(robot, pairs)
    if found.verdict == "frames":
        problem = "the controller has a tool or base set that the study has not"
        raise InputError(file, None, problem, "Choose the flange and base 0 there, or give the robot `tool` and `base`")
    name = file.stem
    documents = Documents.of([Document(name, f"Poses of the controller ({file.name})", "")])
    rows = {PositionRow.kind: tuple(_rows(robot, model.base, pairs, found, name))}
    made = reference_set(name, rows, documents)
    return ReferenceSet(name, with_rounding(robot, made.references), made.rows, documents)


def _rows(robot: Robot, base: Reals, pairs: Pairs, found: Confirmation, name: str) -> list[PositionRow]:
    chosen = np.flatnonzero(found.fits)
    chosen = chosen[spread(len(chosen), MOST)]
    turns = pairs.turns.get(found.form)
    xyz = pairs.xyz / found.factor
    q_deg = shown(robot, pairs.q)
    digits, off_mm = HALF * shown(robot, pairs.q_digit), MM * HALF * pairs.xyz_digit.max(axis=1)
    off_deg = np.degrees(HALF * np.asarray(pairs.turn_digit)[:, 0])
    rows = []
    for k in chosen:
        R = np.eye(3) if turns is None else turns[k]
        flange = base @ inverted(robot.base) @ posed(R, xyz[k]) @ inverted(robot.tool)
        row = PositionRow(
            int(pairs.lines[k]),
            f"Poses of the controller, line {pairs.lines[k]}",
            "measured",
            name=f"line {pairs.lines[k]}",
            point="flange",
            pose=tuple(q_deg[k].tolist()),
            xyz_mm=tuple((MM * flange[:3, 3]).tolist()),
            uncertainty_mm=float(off_mm[k]),
            orientation=None if turns is None else _matrix(flange),
            uncertainty_deg=float(off_deg[k]),
            origin=name,
            rounding=tuple(digits[k].tolist()),
        )
        rows.append(row)
    return rows


def _matrix(T: Reals) -> Rotation3:
    x, y, z = (tuple(row) for row in T[:3, :3].tolist())
    return x, y, z
