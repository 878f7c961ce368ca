"""Scripts of a page as data addresses, because a page opened from a disk may not import other files."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable
from pathlib import Path

from markupsafe import Markup

TEACH = Path(__file__).parent


def import_map(files: Iterable[Path]) -> Markup:
    """A page's import map: each ES module as ``er3a/NAME``. It stands before the page's first module."""
    addresses = {f"er3a/{file.stem}": _address(file) for file in files}
    return Markup(f'<script type="importmap">{json.dumps({"imports": addresses})}</script>')


def _address(file: Path) -> str:
    return "data:text/javascript;base64," + base64.b64encode(file.read_bytes()).decode("ascii")
