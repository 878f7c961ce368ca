"""Which ways of reading joints and orientations come near, by closed forms, thousands at once.

With orientations R_C of the controller and R_F of the arm, ``R_C = R_Y R_F R_X``. The sum of the traces of
``R_C^T R_Y R_F R_X`` is bilinear in R_Y and R_X; its matrix has the largest singular value N if all N poses agree, and
its singular vectors are the two rotations [1]_. Positions are then linear in the rest, and in the unit of length.
Without orientations, positions are linear in the inverse of the base, if its rotation may be any matrix, and in the
tool's point.

References
----------
.. [1] M. Shah, "Solving the robot-world/hand-eye calibration problem using the Kronecker product", J. Mechanisms and
   Robotics 5(3), 2013.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product

import numpy as np

from er3a.by_value import by_identity
from er3a.confirmation.fit import Fitter, JointReading
from er3a.confirmation.pairs import Pairs
from er3a.finding import Finding, fact
from er3a.geometry.transforms import inverted, nearest_rotations, posed, transposed
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot

NEAR = 60  # ways of reading whose positions are looked at
BLOCK = 1_000
LEAST_M, LEAST_RAD = 2e-4, 2e-4  # m and rad: within digits, so that none is preferred for less


@by_identity
class Near:
    """A way of reading, with the frames that bring it near.

    Attributes
    ----------
    form, joints : how it is read; factor : of positions, if the arm is right
    Y, X : (4, 4), m; turned : rad, root mean square of what is left of orientations; away : m, of positions
    """

    form: str
    joints: JointReading
    factor: float
    Y: Reals
    X: Reals
    turned: float
    away: float

    @property
    def score(self) -> float:
        """The lower, the nearer."""
        return float(np.log10(max(self.turned, LEAST_RAD)) + np.log10(max(self.away, LEAST_M)))


def plain(robot: Robot) -> JointReading:
    """Joint values taken as they are.

    Parameters
    ----------
    robot : n joints
    """
    return JointReading(np.eye(robot.joints), np.zeros(robot.joints))


def single_readings(robot: Robot) -> list[JointReading]:
    """Ways in which one thing is other in the pendant's joints than in the model's.

    Parameters
    ----------
    robot : n joints

    Returns
    -------
    readings : senses, what is counted from the ground, swapped columns, quarter turns of zeros, units of angles
    """
    n, turning, eye = robot.joints, ~robot.slides, np.eye(robot.joints)
    found = []

    def add(fault: Finding, factors: Reals = eye, shift: Reals | None = None) -> None:
        found.append(JointReading(factors, np.zeros(n) if shift is None else shift, (fault,)))

    for j in range(n):
        add(fact("turns_other_way", joint=j + 1), eye - 2 * np.outer(eye[j], eye[j]))
    for low, sign, up in product(range(n - 1), (-1.0, 1.0), (True, False)):
        j, i = (low + 1, low) if up else (low, low + 1)
        if turning[i] == turning[j]:
            add(fact("counted_from", joint=j + 1, by=i + 1, factor=sign), eye + sign * np.outer(eye[j], eye[i]))
    for i, j in combinations(range(n), 2):
        swapped = eye.copy()
        swapped[[i, j]] = eye[[j, i]]
        add(fact("columns_swapped", first=i + 1, second=j + 1), swapped)
    for j, deg in product(np.flatnonzero(turning).tolist(), (180.0, 90.0, -90.0)):
        add(fact("zero_elsewhere", joint=j + 1, deg=deg), shift=np.radians(deg) * eye[j])
    for unit, size in (("rad", 180 / np.pi), ("deg", np.pi / 180)):
        add(fact("joints_in", unit=unit), np.diag(np.where(turning, size, 1.0)))
    return found


def joined(first: JointReading, second: JointReading) -> JointReading:
    """Two ways of reading, one after the other.

    Parameters
    ----------
    first : what the pendant's values go through first
    """
    return JointReading(
        second.factors @ first.factors, second.factors @ first.shift + second.shift, (*first.faults, *second.faults)
    )


def likeliest_form(robot: Robot, pairs: Pairs) -> str:
    """The form of orientation, of those that the columns' names allow, by which a controller's poses come nearest.

    Parameters
    ----------
    robot : whose joint values are taken as they are, with any base and tool

    Returns
    -------
    form : an empty name without orientations
    """
    return nearest(Fitter(robot, pairs), [plain(robot)], pairs.forms[: pairs.named])[0].form


def nearest(fitter: Fitter, readings: Sequence[JointReading], forms: Sequence[str]) -> list[Near]:
    """Ways of reading, the nearest first.

    Parameters
    ----------
    readings : of joints, each tried with each form of orientation

    Returns
    -------
    near : at most ``NEAR`` for each form
    """
    found = []
    for form in forms:
        kept = list(range(len(readings)))
        if form and len(kept) > NEAR:
            K = [_products(fitter, readings[k : k + BLOCK], form)[0] for k in kept[::BLOCK]]
            # Of the largest singular values, 1 if rotations agree.
            squares = np.concatenate([np.linalg.eigvalsh(each @ transposed(each))[:, -1] for each in K])
            kept = np.argsort(-squares, kind="stable")[:NEAR].tolist()
        chosen = [readings[k] for k in kept]
        found += _with_orientations(fitter, chosen, form) if form else _positions_alone(fitter, chosen)
    return sorted(found, key=lambda each: each.score)


def _products(fitter: Fitter, readings: Sequence[JointReading], form: str) -> tuple[Reals, Reals]:
    """The matrices (H, 9, 9) of the bilinear forms, and the flanges."""
    F, C = fitter.flanges(readings), fitter.pairs.turns[form]
    K = C.reshape(-1, 9).T @ F[..., :3, :3].reshape(*F.shape[:2], 9)  # (H, ab, cd)
    K = K.reshape(-1, 3, 3, 3, 3).transpose(0, 1, 3, 4, 2).reshape(-1, 9, 9)  # (a, c), (d, b)
    return K / len(C), F


def _with_orientations(fitter: Fitter, readings: Sequence[JointReading], form: str) -> list[Near]:
    K, F = _products(fitter, readings, form)
    U, _, Vt = np.linalg.svd(K)
    first, last = U[..., 0].reshape(-1, 3, 3), Vt[:, 0].reshape(-1, 3, 3)  # of (a, c), and of (d, b)
    sign = np.sign(np.linalg.det(first))[:, None, None]
    R_Y, R_X = nearest_rotations(sign * first), nearest_rotations(sign * last)
    traces = np.einsum("hac,hacdb,hdb->h", R_Y, K.reshape(-1, 3, 3, 3, 3), R_X)
    turned = np.sqrt(np.maximum(3 - traces, 0.0))
    R, t = R_Y[:, None] @ F[..., :3, :3], np.einsum("hij,hnj->hni", R_Y, F[..., :3, 3])
    xyz = np.broadcast_to(fitter.pairs.xyz[..., None], (*t.shape, 1))
    A = np.concatenate([xyz, -R, -np.broadcast_to(np.eye(3), R.shape)], axis=-1).reshape(len(t), -1, 7)
    values, away = _solved(A, t.reshape(len(t), -1))
    return [
        Near(form, each, float(value[0]), posed(base, value[4:]), posed(tool, value[1:4]), float(turn), float(far))
        for each, value, base, tool, turn, far in zip(readings, values, R_Y, R_X, turned, away)
    ]


def _positions_alone(fitter: Fitter, readings: Sequence[JointReading]) -> list[Near]:
    """By ``M m + s - R t = x`` with any matrix M."""
    found = []
    for first in range(0, len(readings), BLOCK):
        some = readings[first : first + BLOCK]
        F, m = fitter.flanges(some), fitter.pairs.xyz
        by_place = np.einsum("ij,nk->nijk", np.eye(3), m).reshape(len(m), 3, 9)
        by_place = np.broadcast_to(by_place, (len(F), *by_place.shape))
        shift = np.broadcast_to(np.eye(3), F[..., :3, :3].shape)
        A = np.concatenate([by_place, shift, -F[..., :3, :3]], axis=-1).reshape(len(F), -1, 15)
        values, away = _solved(A, F[..., :3, 3].reshape(len(F), -1))
        M = values[:, :9].reshape(-1, 3, 3)
        size = np.cbrt(np.abs(np.linalg.det(M)))
        R = nearest_rotations(M)
        for k, each in enumerate(some):
            inverse = posed(R[k], values[k, 9:12])
            tool = posed(np.eye(3), values[k, 12:])
            skewed = float(np.abs(M[k] @ M[k].T / max(size[k] ** 2, 1e-12) - np.eye(3)).max())
            far = float(away[k]) + 0.3 * skewed
            found.append(Near("", each, float(size[k]), inverted(inverse), tool, LEAST_RAD, far))
    return found


def _solved(A: Reals, b: Reals) -> tuple[Reals, Reals]:
    """Least squares of each (H, p, k), and what is left, root mean square of a pose's distance."""
    At = transposed(A)
    scale = np.maximum(np.linalg.norm(A, axis=1), 1e-12)
    normal = (At @ A) / (scale[:, :, None] * scale[:, None, :]) + 1e-13 * np.eye(A.shape[-1])
    values = np.linalg.solve(normal, (np.einsum("hkp,hp->hk", At, b) / scale)[..., None])[..., 0] / scale
    rest = np.einsum("hpk,hk->hp", A, values) - b
    return values, np.sqrt(3 * (rest**2).mean(axis=1))
