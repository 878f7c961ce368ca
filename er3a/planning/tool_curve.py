"""Tool paths as curves of the joints: polynomials in time, piece by piece, that equal the closed form.

Angles, velocities and accelerations are interpolated at the Chebyshev points of a piece and compared with the closed
form between these points, where a polynomial that misses a function misses it most [1]_. Pieces that miss anything are
halved. All that is checked is then checked on the polynomials, exactly, like a move of the joints: limits, rates,
singular poses, and bounds of speed for clearances.

What the shortest pieces still miss is a gap: at a singular pose that the path crosses, where a branch ends, at the edge
of the reach. Rates are unknown there.

References
----------
.. [1] L. N. Trefethen, *Approximation Theory and Approximation Practice*, SIAM 2013, chapters 7 and 8.
"""

from __future__ import annotations

import numpy as np

from er3a.by_value import by_identity
from er3a.numerics.arrays import Flags, Reals
from er3a.planning.follow import WIDE_STEP, Followed, follow
from er3a.planning.moves import ToolPath
from er3a.planning.piecewise import PiecewiseMotion, chebyshev_times, evaluated_between, interpolated
from er3a.planning.profiles import times_at
from er3a.robots.robot import Robot

DEGREE = 16  # of the polynomials, piece by piece
FIRST_PIECES = 32  # evenly over the path, before any is halved
SHORTEST = 1e-6, 1e-9  # share of the duration and of the path, of pieces that miss rates, and that miss angles or reach
SAME_TIME = 1e-9  # share of the duration
CLOSE = np.array([1e-9, 1e-8, 1e-7])[:, None]  # rad, rad/s, rad/s^2; relative where a rate is greater than 1
MAX_PIECES = 20_000  # that are tried
MAX_ROUNDS = 3


@by_identity
class _Tried:
    """Pieces (m,), and the series (m, d + 1, 3, n) through what was solved on them.

    ``met`` says whether they equal the closed form, ``split`` whether halves are to be tried.
    """

    start: Reals
    end: Reals
    series: Reals
    met: Flags
    split: Flags


def follow_as_curve(
    robot: Robot, line: ToolPath, t: Reals, q_start: Reals | None = None, start_slot: int | None = None
) -> tuple[Followed, PiecewiseMotion]:
    """Follow a path of the tool, and make the joints' motion of it.

    Parameters
    ----------
    t, q_start, start_slot : see :func:`er3a.planning.follow.follow`, which raises the same errors

    Returns
    -------
    followed : the branches taken; where a pose proves out of reach between others that are not, they are chosen again
        with that pose among them
    curve : the motion, with gaps where nothing is known (:class:`er3a.planning.piecewise.PiecewiseMotion`)
    """
    for _ in range(MAX_ROUNDS):
        followed = follow(robot, line, t, q_start, start_slot)
        curve, lost = curve_of(followed)
        if not lost.size:
            break
        t = np.union1d(followed.t, lost)
    return followed, curve


def curve_of(followed: Followed) -> tuple[PiecewiseMotion, Reals]:
    """The motion of the joints along a followed path, as polynomials that equal the closed form.

    Parameters
    ----------
    followed : the path, and the branches along it

    Returns
    -------
    motion : (6 joints), rad and s, with NaN rates in gaps
    lost : (k,), s, times out of reach between two grid points of the path that are not
    """
    law, duration = followed.line.law, followed.line.duration
    even = np.linspace(0.0, duration, FIRST_PIECES + 1)
    edges = np.unique(np.concatenate([even, law.breaks, times_at(law, followed.line.edges)]))
    edges = edges[np.concatenate([[True], np.diff(edges) > SAME_TIME * duration])]
    edges[-1] = duration
    start, end, count = edges[:-1], edges[1:], 0
    done: list[_Tried] = []
    lost: list[Reals] = []
    while len(start):
        tried = _tried(followed, start, end, lost)
        count += len(start)
        again = tried.split & (count <= MAX_PIECES)
        done.append(_Tried(*(part[~again] for part in vars(tried).values())))
        middle = (start + end)[again] / 2
        start, end = np.concatenate([start[again], middle]), np.concatenate([middle, end[again]])
    starts, series, met = (
        np.concatenate([getattr(part, name) for part in done]) for name in ("start", "series", "met")
    )
    order = np.argsort(starts)
    series[~met, :, 1:] = np.nan
    motion = PiecewiseMotion(np.append(starts[order], duration), *np.moveaxis(series[order], 2, 0))
    return motion, np.concatenate([np.empty(0), *lost])


def _tried(followed: Followed, start: Reals, end: Reals, lost: list[Reals]) -> _Tried:
    """Pieces from ``start`` to ``end`` (m,); times out of reach that the path's own do not show are added to ``lost``.

    A piece on which the angles leap has no angles, one that is out of reach has nothing; neither has one on which the
    path is singular throughout any rates.
    """
    nodes, between = chebyshev_times(start, end, DEGREE)
    t = np.concatenate([nodes, between], axis=1)
    rates = [part.reshape(*t.shape, -1) for part in followed.rates(t.ravel())]
    values = np.stack(rates, axis=2)  # (m, points, 3, n)
    flat = values.reshape(*t.shape, -1)
    series = interpolated(flat[:, : DEGREE + 1])
    miss = np.abs(evaluated_between(series) - flat[:, DEGREE + 1 :]).reshape(len(t), -1, *values.shape[2:])
    size = np.maximum(1.0, np.abs(values).max(axis=1))
    size[:, 0] = 1.0
    with np.errstate(invalid="ignore"):
        close = (miss.max(axis=1) <= CLOSE * size).all(axis=2)
    reached = np.isfinite(rates[0][..., 0])
    leaps = np.ptp(rates[0], axis=1).max(axis=1) > WIDE_STEP
    never = ~reached.any(axis=1) | (close[:, 0] & np.isnan(rates[1][..., 0]).all(axis=1))
    at = t[~reached]
    after = np.clip(np.searchsorted(followed.t, at), 1, len(followed.t) - 1)
    known = np.isfinite(followed.q[:, 0])
    lost.append(at[known[after] & known[after - 1]])
    series = series.reshape(len(t), DEGREE + 1, *values.shape[2:])
    met, line = close.all(axis=1), followed.line
    share = np.minimum((end - start) / line.duration, line.progress(end)[0] - line.progress(start)[0])
    long = share > 2 * np.where(close[:, 0], *SHORTEST)
    series[~close[:, 0] & leaps, :, 0] = np.nan
    return _Tried(start, end, series, met, ~met & ~never & long)
