"""Many candidate D-H tables at once, and what they predict for a list of references."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from er3a.kinematics.forward import rows_of, step_row, turn_row, write_rows
from er3a.kinematics.jit import kernel
from er3a.references.predict import poses_of, read
from er3a.references.quantities import ModelState
from er3a.references.reference import Reference
from er3a.robots.robot import Robot

CHUNK = 2048


@dataclass(frozen=True, eq=False)
class Tables:
    """A batch of H tables of arms with the same base.

    Attributes
    ----------
    modified : (H,) bool, whether the rows are read as modified (Craig) ones
    a, d : (H, 6), m; alpha, offset, lower, upper : (H, 6), rad; direction : (H, 6), +1 or -1
    """

    modified: np.ndarray
    a: np.ndarray
    alpha: np.ndarray
    d: np.ndarray
    direction: np.ndarray
    offset: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    def __len__(self) -> int:
        return len(self.modified)

    def __getitem__(self, rows) -> Tables:
        return Tables(*(getattr(self, field.name)[rows] for field in fields(self)))

    def with_column(self, name: str, joints, values: np.ndarray) -> Tables:
        """A copy with the given joints' entries (H, len(joints)) of one column replaced."""
        column = getattr(self, name).copy()
        column[:, joints] = values
        return replace(self, **{name: column})


def tables_of(robot: Robot) -> Tables:
    """The robot's own table, as a batch of one."""
    columns = (getattr(robot, name)[None] for name in ("a", "alpha", "d", "direction", "offset", "lower", "upper"))
    return Tables(np.array([robot.convention == "modified"]), *columns)


def robot_of(tables: Tables, row: int, robot: Robot) -> Robot:
    """One table of the batch as a robot that is otherwise like ``robot``."""
    columns = {field.name: getattr(tables, field.name)[row] for field in fields(tables)}
    return robot.replace(convention="modified" if columns.pop("modified") else "standard", **columns)


def join(batches: Sequence[Tables]) -> Tables:
    """All tables of several batches, in order."""
    return Tables(*(np.concatenate([getattr(batch, field.name) for batch in batches]) for field in fields(Tables)))


def predictions(tables: Tables, robot: Robot, references: Sequence[Reference]) -> np.ndarray:
    """What each table says about each reference (none of them about an extreme over the limits).

    Returns
    -------
    values : (H, n), in the references' units
    """
    poses = poses_of(references)
    values = np.empty((len(tables), len(references)))
    for start in range(0, len(tables), CHUNK):
        part = tables[start : start + CHUNK]
        state = ModelState(
            frames=_frames_of(part, robot.base, np.radians(poses)),
            index={pose: i for i, pose in enumerate(poses)},
            direction=part.direction,
            lower=part.lower,
            upper=part.upper,
            speed=robot.speed,
            extremes={},
        )
        values[start : start + CHUNK] = read(references, state)
    return values


def _frames_of(tables: Tables, base: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Frames (H, P, 7, 4, 4) of each table at joint angles (P, 6) in rad, as ``kinematics.forward.frames`` has them for
    one robot; entry 6 is the flange."""
    out = np.empty((len(tables), len(q), 7, 4, 4))
    none = np.zeros((len(tables), 1))
    shifted = tables.modified[:, None]
    a = np.where(shifted, np.hstack([tables.a, none]), np.hstack([none, tables.a]))
    alpha = np.where(shifted, np.hstack([tables.alpha, none]), np.hstack([none, tables.alpha]))
    d = np.hstack([none, tables.d])
    _fill_frames(np.ascontiguousarray(base), a, alpha, d, tables.direction, tables.offset, q, out)
    return out


@kernel
def _fill_frames(base, a, alpha, d, direction, offset, q, out):
    links = np.zeros((7, 4, 4))
    for h in range(out.shape[0]):
        for k in range(7):
            c, s = np.cos(alpha[h, k]), np.sin(alpha[h, k])
            links[k, 0, 0], links[k, 0, 3] = 1.0, a[h, k]
            links[k, 1, 1], links[k, 1, 2] = c, -s
            links[k, 2, 1], links[k, 2, 2], links[k, 2, 3] = s, c, d[h, k]
        start = rows_of(base)
        for p in range(q.shape[0]):
            x, y, z = step_row(start[0], links[0]), step_row(start[1], links[0]), step_row(start[2], links[0])
            for k in range(6):
                angle, link = direction[h, k] * q[p, k] + offset[h, k], links[k + 1]
                c, s = np.cos(angle), np.sin(angle)
                x, y, z = turn_row(x, c, s), turn_row(y, c, s), turn_row(z, c, s)
                write_rows(x, y, z, out[h, p, k])
                x, y, z = step_row(x, link), step_row(y, link), step_row(z, link)
            write_rows(x, y, z, out[h, p, 6])
