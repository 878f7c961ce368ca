"""What a calibration could not estimate, and which measurements are missing."""

from __future__ import annotations

from typing import Literal

from er3a.errors import Er3aError
from er3a.finding import Finding

LevelName = Literal["lengths", "lengths_and_offsets", "all_entries"]
"""Which entries are estimated: lengths that aren't 0, joint offsets besides, or all."""

PlacementName = Literal["base", "tool"]
"""Where the arm stands, and which point of the tool was measured: estimated too, unless they are fixed."""

FixedName = Literal["base", "tool", "ratios"]
"""What can be taken as the robot's file has it: places, and by how much joints turn for what is commanded."""

TermVerdict = Literal["taken", "not_lower", "noise", "wrong_way"]
"""Whether a term beyond the table was taken; or left, because poses left out are not met better with it, because noise
may have made it, or because a load would have to lift the arm."""


class CalibrationError(Er3aError):
    """Measurements determine too little of a table, or no corrections make the table fit them; see ``finding``."""

    def __init__(self, finding: Finding, problem: str):
        self.finding = finding
        super().__init__(problem)
