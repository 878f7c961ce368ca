"""What users of the Robotics Toolbox know by these names: ``jtraj``, ``ctraj``, ``rpy``. Times are in seconds.

References
----------
.. [1] P. Corke, *Robotics, Vision and Control*, 2nd ed., sections 3.1 to 3.3.
"""

from __future__ import annotations

import numpy as np

from er3a.errors import Er3aError, ShapeError
from er3a.geometry.transforms import check_poses, rpy_of
from er3a.numerics.arrays import Reals, as_floats
from er3a.planning.moves import JointMove, line
from er3a.robots.usable import warn_of_degrees


def rpy(T: Reals) -> Reals:
    """Roll, pitch, yaw of poses: ``R = Rz(yaw) @ Ry(pitch) @ Rx(roll)``, as ``tr2rpy(T, 'zyx')`` gives them [1]_.

    Parameters
    ----------
    T : (..., 4, 4)

    Returns
    -------
    angles : (..., 3), rad; where the pitch is +-90 deg the roll is 0, as only their sum or difference counts there

    Raises
    ------
    PoseError, ShapeError
        if T is no rigid transform
    """
    T = check_poses(T)
    return np.array([rpy_of(each) for each in T.reshape(-1, 4, 4)]).reshape(*T.shape[:-2], 3)


def jtraj(
    q_start: Reals, q_end: Reals, t: Reals, velocities: tuple[Reals, Reals] | None = None
) -> tuple[Reals, Reals, Reals]:
    """Joint values on a quintic from one arm to another [1]_.

    Parameters
    ----------
    q_start, q_end : (n,), rad or m; values that can only be degrees are warned of
    t : (N,), s, rising: the move begins at the first and ends at the last
    velocities : (n,) each, rad/s or m/s, at start and end; None for rest

    Returns
    -------
    q, qd, qdd : (N, n), in rad, rad/s and rad/s^2 (m where joints slide)

    Raises
    ------
    Er3aError, ShapeError
        naming the argument: a number of steps is refused, as it says nothing of time
    """
    q_start, q_end, t = as_floats(q_start, "q_start"), as_floats(q_end, "q_end"), _times(t)
    if q_start.shape != q_end.shape or q_start.ndim != 1:
        raise ShapeError("q_end", q_end.shape, f"{q_start.shape}, as q_start")
    warn_of_degrees(q_start, "q_start", stacklevel=3)
    warn_of_degrees(q_end, "q_end", stacklevel=3)
    ends = (0.0, 0.0) if velocities is None else (velocities[0], velocities[1])
    return JointMove(q_start, q_end, float(t[-1] - t[0]), ends).joints(t - t[0])


def ctraj(T_start: Reals, T_end: Reals, t: Reals) -> Reals:
    """Poses on the straight line between two, on a quintic from rest to rest; the turn is about one axis.

    Parameters
    ----------
    T_start, T_end : (4, 4), m
    t : (N,), s, rising: the line begins at the first and ends at the last

    Returns
    -------
    T : (N, 4, 4), for :func:`er3a.solve` or :func:`er3a.inverse_batch`; :func:`er3a.follow` takes an ``er3a.line``

    Raises
    ------
    Er3aError, PoseError, ShapeError
        naming the argument
    """
    t = _times(t)
    return line(T_start, T_end, float(t[-1] - t[0])).at(t - t[0])


def _times(t: Reals) -> Reals:
    times = as_floats(t, "t")
    if times.ndim != 1 or len(times) < 2:
        raise Er3aError(f"t is {t!r}; expected times in s, such as np.linspace(0, 5, 50)")
    if not (np.diff(times) > 0).all():
        raise Er3aError("t does not rise; expected times in s, such as np.linspace(0, 5, 50)")
    return times
