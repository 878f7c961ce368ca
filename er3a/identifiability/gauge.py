"""Combinations of entries that move no tool: the null space of the tool's Jacobian over many joint vectors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from er3a.identifiability.entries import TableNumber, shifted
from er3a.kinematics.table_batch import frames_of, tables_of
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.robots.robot import Robot

POSES = 32
STEP = 1e-5
NOTHING = 1e-7


@dataclass(frozen=True, eq=False)
class Gauge:
    """What of k entries moves no tool.

    Attributes
    ----------
    directions : (g, k), each a combination of steps (in units of the entries' scales) that moves nothing, in as few
        entries as it takes
    determined : (c, k), of the entries that occur in them, the combinations that do move the tool
    """

    directions: Reals
    determined: Reals

    def support(self) -> Flags:
        """(k,), whether an entry occurs in a combination that moves nothing."""
        found: Flags = np.asarray((np.abs(self.directions) > NOTHING).any(axis=0))
        return found


def gauge_of(robot: Robot, entries: Sequence[TableNumber]) -> Gauge:
    """Which combinations of entries the tool's pose can't tell from the table as it is."""
    k = len(entries)
    scale = np.array([entry.scale for entry in entries])
    q = quasi_random_points(np.minimum(robot.lower, robot.upper), np.maximum(robot.lower, robot.upper), POSES)
    steps = STEP * np.concatenate([np.eye(k), -np.eye(k)])
    T = frames_of(shifted(tables_of(robot), entries, steps * scale), robot, q)[:, :, -1] @ robot.tool
    rows = T[:, :, :3].reshape(2 * k, -1)
    J = ((rows[:k] - rows[k:]) / (2 * STEP)).T
    values, basis = np.linalg.svd(J, full_matrices=True)[1:]
    rank = int((values > NOTHING * values[0]).sum())
    directions = _few_entries(basis[rank:])
    own = (np.abs(directions) > NOTHING).any(axis=0)
    determined = np.zeros((0, k))
    if own.any():
        part = np.linalg.svd(directions[:, own])[2][len(directions) :]
        determined = np.zeros((len(part), k))
        determined[:, own] = _few_entries(part)
    return Gauge(directions, determined)


def _few_entries(basis: Reals) -> Reals:
    """The same space by reduced rows: each with a 1 where the others have none."""
    rows = basis.copy()
    at = 0
    for column in range(rows.shape[1]):
        if at == len(rows):
            break
        pivot = at + int(np.argmax(np.abs(rows[at:, column])))
        if abs(rows[pivot, column]) < NOTHING:
            continue
        rows[[at, pivot]] = rows[[pivot, at]]
        rows[at] /= rows[at, column]
        others = np.arange(len(rows)) != at
        rows[others] -= np.outer(rows[others, column], rows[at])
        at += 1
    rows[np.abs(rows) < NOTHING] = 0.0
    return rows
