"""What can be said of a path."""

from __future__ import annotations

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
"""The gravest first."""
