"""RPL among the languages of robot programs: as text, and as the controller's XML."""

from __future__ import annotations

import re

from er3a.programs.program_language import SIX_ANGLES, Language
from er3a.programs.rpl.dialect import RplDialect
from er3a.programs.rpl.reader import companions, read_rpl
from er3a.programs.rpl.writer import RplWriter, XplWriter
from er3a.programs.rpl.xml_reader import read_xpl

RPL = Language(
    title="RPL",
    suffixes=(".pgm",),
    sign=re.compile(r"(?m)\bM(?:JOINT|LIN)\s*\(|:=|^\s*END_\w+\s*;"),
    reader=read_rpl,
    dialect=RplDialect,
    writer=RplWriter,
    joints=SIX_ANGLES,
    points=".var",
    companions=companions,
)
XPL = Language("XPL", (".xpl",), None, read_xpl, RplDialect, XplWriter, SIX_ANGLES, opening="<")
