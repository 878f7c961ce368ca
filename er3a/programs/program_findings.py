"""Findings about a program's text, and about written programs."""

from __future__ import annotations

from er3a.finding import Finding

ProgramFinding = Finding
"""``program_not_understood``: a piece of ``text`` at a ``place`` that is kept, but not understood."""


WriteFinding = Finding
