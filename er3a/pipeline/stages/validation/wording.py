"""Typography of sentences on the page."""

from __future__ import annotations

import re


def typographic(text: str) -> str:
    """A text with minus signs instead of hyphens before numbers."""
    return re.sub(r"(?<![0-9A-Za-z])-(?=[0-9])", "−", text)
