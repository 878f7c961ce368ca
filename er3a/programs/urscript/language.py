"""URScript among the languages of robot programs."""

from __future__ import annotations

import re

from er3a.programs.program_language import SIX_ANGLES, Language
from er3a.programs.urscript.dialect import UrScriptDialect
from er3a.programs.urscript.reader import read_urscript
from er3a.programs.urscript.writer import UrScriptWriter

URSCRIPT = Language(
    title="URScript",
    suffixes=(".script", ".urscript"),
    sign=re.compile(r"(?m)^\s*(?:def\s+\w+\(.*\)\s*:|move[jlpc]\(|set_tcp\()"),
    reader=read_urscript,
    dialect=UrScriptDialect,
    writer=UrScriptWriter,
    joints=SIX_ANGLES,
)
