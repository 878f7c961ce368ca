"""The names of path verdicts and of strategies, for settings and results."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, get_args

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


StrategyName = Literal["slow", "branch", "via_shift", "via_tilt", "detour", "stop", "planned"]

ACCELERATION_TIME = 0.25
"""s in which joints are taken to reach their full speed, where nobody says otherwise."""
