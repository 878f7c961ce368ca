"""Options of commands that read D-H tables; kept out of ``options.py``, so that help needs no reader of tables."""

from __future__ import annotations

from typing import Annotated

import typer

from er3a.files.dh_table import AngleUnit, LengthUnit
from er3a.robots.robot import Convention

Lengths = Annotated[
    LengthUnit | None, typer.Option(help="unit of lengths in a D-H table (default: that of its columns)")
]
Conventions = Annotated[
    Convention | None, typer.Option(help="D-H convention of a table (default: standard, if it can be)")
]
Angles = Annotated[AngleUnit | None, typer.Option(help="unit of angles in a D-H table (default: that of its columns)")]
