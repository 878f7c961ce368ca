"""Which of many arms a table is likely to be of, before it is compared with these few.

Every arm has numbers that no choice of base, flange, zeros, directions and senses changes: of neighbouring axes the
angle between them and their distance, and of three axes that are not parallel the distance of two common normals along
the middle one. A table with one wrong entry keeps all but one or two of them, so arms are ranked by how many differ.
A table in another unit or read in the other convention keeps them once that is undone, so these readings are tried.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from er3a.comparison import mechanism
from er3a.comparison.compare import LENGTH_FACTORS
from er3a.numerics.arrays import Reals
from er3a.robots.robot import CONVENTIONS, Robot

NEAR_M, NEAR_RAD = 2e-3, 5e-3  # a gap of so much counts half: more than tables are rounded by, less than arms differ by
MOST = 6  # arms compared in full


def invariants(robot: Robot, convention: str | None = None) -> tuple[Reals, Reals]:
    """What no choice of frames changes between neighbouring axes.

    Parameters
    ----------
    robot : with m rows
    convention : to read its table in; None for its own

    Returns
    -------
    lengths : (2 m - 3,), m, at least 0: distances of axes, then of common normals along axes that lie between others.
        Of parallel axes, along which these can be anywhere, the sum counts.
    angles : (m - 1,), rad, 0 to pi/2, between axes
    """
    arm = mechanism.by_normals(mechanism.mechanism_of(robot, ends=False, convention=convention or robot.convention))
    parallel = arm.between < mechanism.NEARLY_PARALLEL
    along = np.zeros(len(arm.d))
    for first, last, senses in mechanism.parallel_blocks(arm, parallel):
        if first > 0 and last < len(arm.d) - 1:  # with an end in it, the base or the flange holds the sum
            along[first] = abs(float(senses @ arm.d[first : last + 1]))
    return np.concatenate([np.abs(arm.a), along[1:-1]]), arm.between


def likely(robot: Robot, others: Mapping[str, Robot]) -> list[str]:
    """The arms that a table may be of, best first.

    Parameters
    ----------
    robot : the table
    others : by name

    Returns
    -------
    names : at most ``MOST``, and all whose numbers are as near as the best one's; those alone that have as many rows,
        of the same kinds
    """
    alike = [name for name, other in others.items() if np.array_equal(other.sliding, robot.sliding)]
    if not alike:
        return []
    misfit = misfits(robot, [others[name] for name in alike]).min(axis=0)
    order = np.argsort(misfit, kind="stable")
    count = max(MOST, int((misfit <= misfit[order[0]] + 1e-9).sum()))
    return [alike[k] for k in order[:count]]


def misfits(robot: Robot, others: Sequence[Robot]) -> Reals:
    """About how many numbers of several arms a table has otherwise, in the best unit.

    Parameters
    ----------
    robot : the table
    others : with as many rows, of the same kinds

    Returns
    -------
    misfit : (2, k), with the table read in each of ``CONVENTIONS``
    """
    lengths, angles = (np.array(each) for each in zip(*map(invariants, others)))
    return np.array([_misfits(robot, way, lengths, angles) for way in CONVENTIONS])


def _misfits(robot: Robot, convention: str, lengths: Reals, angles: Reals) -> Reals:
    """About how many numbers of each arm (k,) a table has otherwise, read in a convention and in the best unit."""
    own, turned = invariants(robot, convention)
    factors = np.array([1.0, *sorted(LENGTH_FACTORS)])
    gaps = np.abs(factors[:, None, None] * own - lengths)
    off = np.abs(turned - angles)
    far: Reals = (gaps / (gaps + NEAR_M)).sum(axis=2)
    return np.asarray(far.min(axis=0) + (off / (off + NEAR_RAD)).sum(axis=1))


def of_equal_geometry(name: str, others: Mapping[str, Robot], tolerances: mechanism.Tolerances) -> Sequence[str]:
    """The arms that no choice of frames tells from one of them.

    Parameters
    ----------
    name : of that arm
    others : by name, it among them

    Returns
    -------
    names : without its own
    """
    robot, found = others[name], []
    own = mechanism.mechanism_of(robot, ends=False)
    for other, arm in others.items():
        if other != name and np.array_equal(arm.sliding, robot.sliding) and arm.joints == robot.joints:
            there = mechanism.mechanism_of(arm, ends=False)
            if mechanism.is_same_mechanism(own, there, tolerances):
                found.append(other)
    return found
