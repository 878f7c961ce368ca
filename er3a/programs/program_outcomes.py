"""What a program can come to."""

from __future__ import annotations

from typing import Literal

ProgramOutcome = Literal["pass", "caution", "fail"]
