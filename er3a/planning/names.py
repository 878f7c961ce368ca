"""The names of path verdicts and their order, and the names of strategies, for settings and results."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Literal, NamedTuple, get_args

PathVerdict = Literal[
    "unreachable",
    "none found",
    "leaves limits",
    "collides",
    "too fast",
    "singular",
    "too fast for the assumed limits",
    "undecided",
    "near-singular",
    "safe",
]
PATH_VERDICTS: tuple[PathVerdict, ...] = get_args(PathVerdict)
"""Most serious first."""
FAULTS = PATH_VERDICTS[: PATH_VERDICTS.index("singular")]
"""Of paths that fail whatever is assumed."""
NOT_TO_BE_RUN = PATH_VERDICTS[: PATH_VERDICTS.index("undecided")]
"""Of paths that no arm should run as they are; others pass near singular poses, or leave something open."""
TOO_FAST: tuple[PathVerdict, ...] = ("too fast", "too fast for the assumed limits")
UNFOLLOWED: tuple[PathVerdict, ...] = ("unreachable", "leaves limits")
"""Of paths that some joints can't follow at any pace."""


def gravest(found: Iterable[PathVerdict]) -> PathVerdict:
    """The most serious of what a path came to.

    Parameters
    ----------
    found : verdicts, in any order

    Returns
    -------
    verdict : the first of them in the order of ``PATH_VERDICTS``; safe if there are none
    """
    return min(found, key=PATH_VERDICTS.index, default="safe")


AT_EDGE, AROUND_EDGE = 0.001, 0.1
"""Shares of a path's duration: how near to the edge of the reach counts as at it, and how long before or after it
joints may be too fast because of it."""


class FirstFault(NamedTuple):
    """Where a motion first has a kind of fault.

    Attributes
    ----------
    follows : whether another kind leads to it each time
    start : s
    parts : numbers of the stretches that count, the first first: those that follow from no other kind, or all if each
        does
    """

    follows: bool
    start: float
    kind: PathVerdict
    parts: list[int]


def in_order(found: Mapping[PathVerdict, Sequence[tuple[float, float]]], duration: float) -> list[FirstFault]:
    """The order of a motion's faults, which verdicts, pages and players share.

    Parameters
    ----------
    found : from when to when (s) it has each kind of fault
    duration : s, of the whole motion

    Returns
    -------
    faults : one for each kind, in order of time; what only follows from others last

    Notes
    -----
    Where a path leaves the reach the arm is stretched, and joints are too fast at any pace. So a short stretch of that
    which runs up to the edge, or begins there, follows from being unreachable.
    """
    at, around = AT_EDGE * duration, AROUND_EDGE * duration
    edges = [edge for span in found.get("unreachable", ()) for edge in span]
    firsts = []
    for kind, spans in found.items():
        causes = edges if kind.startswith(("too fast", "singular")) else []
        own = [
            number
            for number, (start, end) in enumerate(spans)
            if not any(-around <= start - edge <= at and -at <= end - edge <= around for edge in causes)
        ]
        if parts := sorted(own or range(len(spans)), key=spans.__getitem__):
            firsts.append(FirstFault(not own, spans[parts[0]][0], kind, parts))
    return sorted(firsts, key=lambda each: each[:2])


StrategyName = Literal["slow", "branch", "via_shift", "via_tilt", "detour", "stop", "planned"]

ACCELERATION_TIME = 0.25
"""s in which joints are taken to reach their full speed, where nobody says otherwise."""
