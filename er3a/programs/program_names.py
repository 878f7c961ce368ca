"""The names of robot languages and of a program's outcomes, for settings, input files and results."""

from __future__ import annotations

from typing import Literal

LanguageName = Literal["krl", "urscript", "rpl", "xpl", "rapid", "csv"]

ProgramOutcome = Literal["pass", "caution", "fail"]
