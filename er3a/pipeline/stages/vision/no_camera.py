"""Why the stage is not computed for a robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class NoCamera:
    """The study names no vision file for this robot."""

    code: Literal["no_camera"] = "no_camera"
