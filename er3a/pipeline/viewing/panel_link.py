"""Links from joint vectors to the teach panel."""

from __future__ import annotations

from collections.abc import Iterable

from markupsafe import Markup


def panel_link(q_deg: Iterable[float], text: str) -> str:
    """A text that leads to the arm at joint values (deg; mm of joints that slide) in the teach panel."""
    joints = ",".join(f"{round(float(angle), 9) + 0.0:.9g}" for angle in q_deg)
    return Markup('<a href="teach.html#q={}">{}</a>').format(joints, text)
