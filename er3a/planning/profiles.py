"""Time laws: where along its way a motion is at a time. Seconds in, SI derivatives out.

References
----------
.. [1] J. J. Craig, *Introduction to Robotics*, 3rd ed., section 7.3, equations 7.17 and 7.18.
"""

from __future__ import annotations

import numpy as np


def quintic(
    t: np.ndarray,
    duration: float,
    start: np.ndarray,
    end: np.ndarray,
    start_velocity: np.ndarray | float = 0.0,
    end_velocity: np.ndarray | float = 0.0,
    start_acceleration: np.ndarray | float = 0.0,
    end_acceleration: np.ndarray | float = 0.0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Polynomial of fifth degree that meets position, velocity and acceleration at both ends [1]_.

    Parameters
    ----------
    t : (...,), s, from 0 to ``duration``
    duration : s, greater than 0
    start, end : (...,) or (k,), in any unit u; the boundary derivatives in u/s and u/s^2, of the same shape

    Returns
    -------
    position, velocity, acceleration : t.shape + start.shape, in u, u/s and u/s^2
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    tau = np.asarray(t, float).reshape(np.shape(t) + (1,) * start.ndim) / duration
    v0, v1 = np.asarray(start_velocity) * duration, np.asarray(end_velocity) * duration
    a0, a1 = np.asarray(start_acceleration) * duration**2, np.asarray(end_acceleration) * duration**2
    # What the cubic, quartic and quintic terms have to add to the parabola of the start values.
    position, velocity, acceleration = end - start - v0 - a0 / 2, v1 - v0 - a0, a1 - a0
    c3 = 10 * position - 4 * velocity + acceleration / 2
    c4 = -15 * position + 7 * velocity - acceleration
    c5 = 6 * position - 3 * velocity + acceleration / 2
    x = start + tau * (v0 + tau * (a0 / 2 + tau * (c3 + tau * (c4 + tau * c5))))
    dx = v0 + tau * (a0 + tau * (3 * c3 + tau * (4 * c4 + tau * 5 * c5)))
    ddx = a0 + tau * (6 * c3 + tau * (12 * c4 + tau * 20 * c5))
    return x, dx / duration, ddx / duration**2
