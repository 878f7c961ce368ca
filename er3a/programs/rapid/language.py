"""RAPID among the languages of robot programs."""

from __future__ import annotations

import re

from er3a.programs.program_language import SIX_ANGLES, Language
from er3a.programs.rapid.dialect import RapidDialect
from er3a.programs.rapid.reader import SUFFIXES, modules_of, read_rapid
from er3a.programs.rapid.writer import RapidWriter

SIGN = r"(?im)^\s*(?:%%%\s*$|MODULE\s+\w+|(?:LOCAL\s+)?PROC\s+\w+\s*\(|(?:CONST|PERS|VAR)\s+\w+\s+\w+.*:=\s*\[)"
RAPID = Language(
    title="RAPID",
    suffixes=SUFFIXES,
    sign=re.compile(SIGN),
    reader=read_rapid,
    dialect=RapidDialect,
    writer=RapidWriter,
    joints=SIX_ANGLES,
    contents=".pgf",
    companions=modules_of,
)
