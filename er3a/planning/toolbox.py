"""Functions that users of the Robotics Toolbox know; times are in seconds, angles in radians.

``pose`` (``transl(...) * rpy2tr(...)``), ``rpy`` (``tr2rpy``), ``zyz`` (``tr2eul``), ``quaternion``, ``jtraj`` and
``ctraj``.

References
----------
.. [1] P. Corke, *Robotics, Vision and Control*, 2nd ed., sections 3.1 to 3.3.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from er3a.errors import Er3aError, ShapeError
from er3a.geometry.transforms import check_poses, quaternion_of, rpy_of, transform
from er3a.numerics.arrays import Reals, as_floats
from er3a.planning.moves import JointMove, line
from er3a.robots.usable import warn_of_degrees

RAMP = 1 / 3  # of the time, of ctraj's trapezoid
LOCKED = 1e-9  # sine of a tilt below which only the sum or difference of ZYZ's outer angles counts


def pose(
    position: Reals, rpy: Reals | None = None, *, zyz: Reals | None = None, quaternion: Reals | None = None
) -> Reals:
    """The pose at a position, as ``transl(position) * rpy2tr(rpy, 'zyx')`` gives it [1]_.

    Parameters
    ----------
    position : (3,), m
    rpy : (3,), rad, roll, pitch, yaw: ``R = Rz(yaw) @ Ry(pitch) @ Rx(roll)``
    zyz : (3,), rad, Euler angles instead: ``R = Rz(phi) @ Ry(theta) @ Rz(psi)``
    quaternion : (4,), w, x, y, z instead, of any length but 0. Without any of the three the axes are parallel to the
        base's

    Returns
    -------
    T : (4, 4), m

    Raises
    ------
    Er3aError, PoseError, ShapeError
        naming the argument
    """
    place = _numbers(position, "position", 3)
    given = {"rpy": (rpy, 3), "zyz": (zyz, 3), "quaternion": (quaternion, 4)}
    turned = {name: _numbers(values, name, size) for name, (values, size) in given.items() if values is not None}
    if len(turned) > 1:
        raise Er3aError(f"{' and '.join(turned)} each give an orientation; expected one of rpy, zyz and quaternion")
    T = transform(place, turned.get("rpy", np.zeros(3)))
    if "zyz" in turned:
        T[:3, :3] = Rotation.from_euler("ZYZ", turned["zyz"]).as_matrix()
    if "quaternion" in turned:
        if not turned["quaternion"].any():
            raise Er3aError("quaternion is 0; expected w, x, y, z, such as [1, 0, 0, 0]")
        T[:3, :3] = Rotation.from_quat(turned["quaternion"], scalar_first=True).as_matrix()
    return T


def rpy(T: Reals) -> Reals:
    """Roll, pitch, yaw of poses: ``R = Rz(yaw) @ Ry(pitch) @ Rx(roll)``, as ``tr2rpy(T, 'zyx')`` gives them [1]_.

    Parameters
    ----------
    T : (..., 4, 4)

    Returns
    -------
    angles : (..., 3), rad; if the pitch is +-90 deg the roll is 0, because only the sum or difference of roll and yaw
        matters there

    Raises
    ------
    PoseError, ShapeError
        if T is no rigid transform
    """
    return rpy_of(check_poses(T)) + 0.0  # no -0


def zyz(T: Reals) -> Reals:
    """Euler angles phi, theta, psi of poses: ``R = Rz(phi) @ Ry(theta) @ Rz(psi)``, as ``tr2eul(T)`` gives them [1]_.

    Parameters
    ----------
    T : (..., 4, 4)

    Returns
    -------
    angles : (..., 3), rad; theta is between 0 and pi. If theta is 0 or pi, psi is 0, because only the sum or difference
        of phi and psi matters there

    Raises
    ------
    PoseError, ShapeError
        if T is no rigid transform
    """
    R = check_poses(T)[..., :3, :3]
    tilt = np.hypot(R[..., 0, 2], R[..., 1, 2])
    locked = tilt < LOCKED
    phi = np.where(locked, np.arctan2(-R[..., 0, 1], R[..., 1, 1]), np.arctan2(R[..., 1, 2], R[..., 0, 2]))
    psi = np.where(locked, 0.0, np.arctan2(R[..., 2, 1], -R[..., 2, 0]))
    return np.stack([phi, np.arctan2(tilt, R[..., 2, 2]), psi], axis=-1)


def quaternion(T: Reals) -> Reals:
    """Unit quaternions of poses.

    Parameters
    ----------
    T : (..., 4, 4), m

    Returns
    -------
    q : (..., 4), in the order w, x, y, z with w >= 0

    Raises
    ------
    PoseError, ShapeError
        if T is no rigid transform
    """
    return quaternion_of(check_poses(T))


def jtraj(
    q_start: Reals, q_end: Reals, t: Reals, velocities: tuple[Reals, Reals] | None = None
) -> tuple[Reals, Reals, Reals]:
    """Joint values on a quintic from one joint vector to another [1]_.

    Parameters
    ----------
    q_start, q_end : (n,), rad or m; values that can only be degrees give a warning
    t : (N,), s, rising: the move begins at the first and ends at the last
    velocities : (n,) each, rad/s or m/s, at start and end; None for rest

    Returns
    -------
    q, qd, qdd : (N, n), in rad, rad/s and rad/s^2 (m for prismatic joints)

    Raises
    ------
    Er3aError, ShapeError
        naming the argument; a number of steps instead of times is refused
    """
    q_start, q_end, t = as_floats(q_start, "q_start"), as_floats(q_end, "q_end"), _times(t)
    if q_start.shape != q_end.shape or q_start.ndim != 1:
        raise ShapeError("q_end", q_end.shape, f"{q_start.shape}, as q_start")
    warn_of_degrees(q_start, "q_start", stacklevel=3)
    warn_of_degrees(q_end, "q_end", stacklevel=3)
    ends = (0.0, 0.0) if velocities is None else (velocities[0], velocities[1])
    return JointMove(q_start, q_end, float(t[-1] - t[0]), ends).joints(t - t[0])


def ctraj(T_start: Reals, T_end: Reals, t: Reals) -> Reals:
    """Poses on the straight line between two poses, from rest to rest, with a rotation about one axis.

    The time law is the Toolbox's: a trapezoid of speed with ramps of a third of the time (``lspb``) [1]_.

    Parameters
    ----------
    T_start, T_end : (4, 4), m
    t : (N,), s, rising: the line begins at the first and ends at the last

    Returns
    -------
    T : (N, 4, 4), for :func:`er3a.solve` or :func:`er3a.inverse_batch`; :func:`er3a.follow` takes an ``er3a.line``,
        which has this time law with ``ramp=1/3``

    Raises
    ------
    Er3aError, PoseError, ShapeError
        naming the argument
    """
    t = _times(t)
    return line(T_start, T_end, float(t[-1] - t[0]), ramp=RAMP).at(t - t[0])


def _numbers(values: Reals, argument: str, size: int) -> Reals:
    found = as_floats(values, argument)
    if found.shape != (size,):
        raise ShapeError(argument, found.shape, f"({size},)")
    if not np.isfinite(found).all():
        raise Er3aError(f"{argument} holds NaN or infinity")
    if argument in ("rpy", "zyz"):
        warn_of_degrees(found, argument, stacklevel=4)
    return found


def _times(t: Reals) -> Reals:
    times = as_floats(t, "t")
    if times.ndim != 1 or len(times) < 2:
        raise Er3aError(f"t is {t!r}; expected times in s, such as np.linspace(0, 5, 50)")
    if not (np.diff(times) > 0).all():
        raise Er3aError("t does not rise; expected times in s, such as np.linspace(0, 5, 50)")
    return times
