"""KRL's record in the registry of languages."""

from __future__ import annotations

import re

from er3a.programs.evaluation import MAX_ROBOT_AXES
from er3a.programs.krl.dialect import KrlDialect
from er3a.programs.krl.reader import companions, read_krl
from er3a.programs.krl.writer import KrlWriter
from er3a.programs.program_language import Language

SIGN = r"(?im)^\s*(?:&ACCESS|(?:GLOBAL\s+)?DEF(?:FCT)?\s+[\w$\[\]\s]*\([^)]*\)\s*(?:;.*)?$|(?:S?PTP|S?LIN)\s+[{X])"
KRL = Language(
    title="KRL",
    suffixes=(".src", ".sub"),
    sign=re.compile(SIGN),
    reader=read_krl,
    dialect=KrlDialect,
    writer=KrlWriter,
    joints=range(1, MAX_ROBOT_AXES + 1),  # A1 to A6; E1 to E6 are axes beside the arm
    points=".dat",
    companions=companions,
)
