"""Many D-H tables at once, and the frames of each at many poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from functools import cached_property

import numpy as np

from er3a.by_value import ByValue, frozen
from er3a.kinematics.forward import rows_of, slide_row, step_row, turn_row, write_rows
from er3a.numerics.arrays import Flags, Integers, Reals, for_kernel
from er3a.numerics.jit import kernel
from er3a.robots.robot import Robot


@frozen
class Tables(ByValue):
    """A batch of H tables of arms with the same base and flange.

    Attributes
    ----------
    modified : (H,) bool, whether the rows are read as modified (Craig) ones
    a, d : (H, m), m; alpha, beta, offset, lower, upper : (H, m), rad (limits of prismatic joints in m);
        direction : (H, m), +1 or -1; sliding : (H, m) bool
    """

    modified: Flags
    a: Reals
    alpha: Reals
    beta: Reals
    d: Reals
    direction: Reals
    offset: Reals
    lower: Reals
    upper: Reals
    sliding: Flags

    def __len__(self) -> int:
        return len(self.modified)

    def __getitem__(self, rows: slice | list[int] | Integers | Flags) -> Tables:
        return Tables(*(getattr(self, field.name)[rows] for field in fields(self)))

    def with_column(self, name: str, joints: slice | list[int] | Integers, values: Reals) -> Tables:
        """A copy with some entries of one column replaced.

        Parameters
        ----------
        name : of the column
        joints : k rows of the tables, from 0
        values : (H, k), m, rad or +-1

        Returns
        -------
        tables : H tables
        """
        column = getattr(self, name).copy()
        column[:, joints] = values
        return replace(self, **{name: column})

    @cached_property
    def kernel_columns(self) -> tuple[Reals, Reals, Reals, Reals, Reals, Reals, Flags]:
        """Tables of either convention as arguments of :func:`fill_frames`.

        Returns
        -------
        a, alpha, beta, d : (H, m + 1), of the link after each joint, the base's first, m and rad
        direction, offset, sliding : (H, m)
        """
        count, joints = self.d.shape
        a, alpha, beta, d = links = np.zeros((4, count, joints + 1))
        d[:, 1:] = self.d
        own = 0 if self.modified.all() else 1
        for link, column in ((a, self.a), (alpha, self.alpha), (beta, self.beta)):
            link[:, own : own + joints] = column
        if own and self.modified.any():
            rows = self.modified
            for link, column in ((a, self.a), (alpha, self.alpha), (beta, self.beta)):
                link[rows, :joints], link[rows, joints] = column[rows], 0.0
        a, alpha, beta, d = for_kernel(links)
        return a, alpha, beta, d, for_kernel(self.direction), for_kernel(self.offset), for_kernel(self.sliding)


COLUMNS = tuple(field.name for field in fields(Tables) if field.name != "modified")


def tables_of(robot: Robot) -> Tables:
    """The robot's own table, as a batch of one.

    Parameters
    ----------
    robot : m rows

    Returns
    -------
    tables : H = 1
    """
    return Tables(np.array([robot.convention == "modified"]), *(getattr(robot, name)[None] for name in COLUMNS))


def robot_of(tables: Tables, row: int, robot: Robot) -> Robot:
    """One table of the batch as a robot.

    Parameters
    ----------
    row : number of the table
    robot : what it is like otherwise

    Returns
    -------
    robot : a copy
    """
    columns = {name: getattr(tables, name)[row] for name in COLUMNS}
    return robot.replace(convention="modified" if tables.modified[row] else "standard", **columns)


def join(batches: Sequence[Tables]) -> Tables:
    """All tables of several batches, in order.

    Parameters
    ----------
    batches : of arms with the same number of rows

    Returns
    -------
    tables : as many as in all batches together
    """
    return Tables(*(np.concatenate([getattr(batch, field.name) for batch in batches]) for field in fields(Tables)))


def frames_of(tables: Tables, robot: Robot, q: Reals) -> Reals:
    """Frames of each table at row values.

    Parameters
    ----------
    tables : H tables
    robot : for base and flange
    q : (P, m), rad or m, row values

    Returns
    -------
    T : (H, P, m + 1, 4, 4), m, as :func:`er3a.kinematics.forward.frames` has them for one robot without tool; the last
        is the flange
    """
    out = np.empty((len(tables), len(q), tables.d.shape[1] + 1, 4, 4))
    fill_frames(for_kernel(robot.base), *tables.kernel_columns, np.array(q, order="C"), out)
    if not robot.flange_is_last_frame:
        out[:, :, -1] = out[:, :, -1] @ robot.flange
    return out


@kernel
def fill_frames(
    base: Reals,
    a: Reals,
    alpha: Reals,
    beta: Reals,
    d: Reals,
    direction: Reals,
    offset: Reals,
    sliding: Flags,
    q: Reals,
    out: Reals,
) -> None:
    """Fill frames of tables at row values. Kernel.

    Parameters
    ----------
    base : (4, 4), m
    a, alpha, beta, d, direction, offset, sliding : of :attr:`Tables.kernel_columns`
    q : (P, m), rad or m, row values
    out : (H, P, m + 1, 4, 4), filled, base frame
    """
    joints = q.shape[1]
    links = np.zeros((joints + 1, 4, 4))
    for h in range(out.shape[0]):
        for k in range(joints + 1):
            c, s = np.cos(alpha[h, k]), np.sin(alpha[h, k])
            cb, sb = np.cos(beta[h, k]), np.sin(beta[h, k])
            links[k, 0, 0], links[k, 0, 2], links[k, 0, 3] = cb, sb, a[h, k]
            links[k, 1, 0], links[k, 1, 1], links[k, 1, 2] = s * sb, c, -s * cb
            links[k, 2, 0], links[k, 2, 1], links[k, 2, 2], links[k, 2, 3] = -c * sb, s, c * cb, d[h, k]
        start = rows_of(base)
        for p in range(q.shape[0]):
            x, y, z = step_row(start[0], links[0]), step_row(start[1], links[0]), step_row(start[2], links[0])
            for k in range(joints):
                moved, angle, link = direction[h, k] * q[p, k], offset[h, k], links[k + 1]
                if sliding[h, k]:
                    x, y, z = slide_row(x, moved), slide_row(y, moved), slide_row(z, moved)
                    write_rows(x, y, z, out[h, p, k])
                else:
                    angle = moved + angle
                c, s = np.cos(angle), np.sin(angle)
                x, y, z = turn_row(x, c, s), turn_row(y, c, s), turn_row(z, c, s)
                if not sliding[h, k]:
                    write_rows(x, y, z, out[h, p, k])
                x, y, z = step_row(x, link), step_row(y, link), step_row(z, link)
            write_rows(x, y, z, out[h, p, joints])
