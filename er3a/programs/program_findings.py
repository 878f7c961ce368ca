"""Findings about a program's text, and about written programs."""

from __future__ import annotations

from er3a.by_value import Coded
from er3a.finding import Finding
from er3a.programs.instructions import Place


class NotUnderstood(Coded, code="program_not_understood"):
    """A piece of text that is kept, but not understood."""

    text: str
    place: Place


ProgramFinding = NotUnderstood | Finding


WriteFinding = Finding
