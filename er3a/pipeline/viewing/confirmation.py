"""The page of ``er3a confirm``: how far each pose is off before and after, both arms, and what to write where."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from er3a.confirmation.confirm import Confirmation
from er3a.files.kept_files import sha256
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.language import own_title, with_unit
from er3a.pipeline.messages.confirm import lines_of
from er3a.pipeline.messages.numbers import number
from er3a.pipeline.messages.say import bracketed
from er3a.pipeline.results import Input, Provenance
from er3a.pipeline.viewing import page
from er3a.pipeline.viewing.figures import house_style, new_figure
from er3a.pipeline.viewing.page import Picture
from er3a.pipeline.viewing.palette import VERDICTS
from er3a.pipeline.viewing.side_view import seen_arm, side_view
from er3a.robots.robot import Robot

STATUS = {"agrees": "pass", "open": "fail"}
LEAST_MM = 1e-4  # drawn, on a scale by powers of ten


def write_confirmation(
    robot: Robot, found: Confirmation, output: Path, *, nearest: str, command: str, files: Sequence[Path]
) -> None:
    """Write the page of a confirmation.

    Parameters
    ----------
    robot : the model as it is
    output : the page, written whole or not at all
    nearest : the name of the arm that the corrected table is, if one is
    command : that made it; files : what it was made from
    """
    _, headline, *lines = lines_of(found, robot, nearest=nearest)
    arms = [seen_arm(robot, own_title(robot.title), "model", "right" if found.verdict == "agrees" else "wrong")]
    if found.verdict not in ("agrees", "open"):
        arms.append(seen_arm(found.corrected, "Controller", "", "right"))
    with house_style():
        page.render(
            Path(__file__).with_name("confirmation.html.j2"),
            output,
            command=command,
            provenance=Provenance(tuple(Input(str(file), sha256(file), {}) for file in files), code_digest()),
            title=own_title(robot.title),
            status=STATUS.get(found.verdict, "caution"),
            headline=re.split("[;；]", headline)[0],  # the key figures say the rest
            lines=[headline, *(line.strip() for line in lines)],
            keys=_keys(found),
            arms=side_view(arms),
            bars=_bars(found),
        )


def _keys(found: Confirmation) -> list[tuple[str, str]]:
    off = [found.before_mm.max(), found.left_mm[found.fits].max(initial=0.0)]
    words = "as it is, at worst", "explained, at worst"
    return [(with_unit(number(float(value), 3), "mm"), said) for value, said in zip(off, words)]


def _bars(found: Confirmation) -> Picture:
    """How far each pose is off, by the model as it is and with what was found."""
    figure, ax = new_figure(width=8.5, height=5.4)
    at = np.arange(len(found.lines))
    rows = (found.before_mm, -0.2, "fail", "as it is"), (found.left_mm, 0.2, "pass", "explained")
    for values, aside, colour, label in rows if found.layers else rows[1:]:
        ax.bar(at + aside, np.maximum(values, LEAST_MM), 0.4, bottom=0.0, color=VERDICTS[colour], label=label)
    ax.axhline(found.digits_mm, color="black", linewidth=0.8, linestyle="--", label="rounding explains")
    ax.set_yscale("log")
    ax.set_ylabel(bracketed("flange off", "mm"))
    ax.set_xlabel("line of the file")
    shown = at[:: max(1, len(at) // 20)]
    ax.set_xticks(shown, [str(found.lines[k]) for k in shown])
    figure.legend(loc="outside lower center", ncols=3)
    return Picture(figure, "How far each pose is off, before and after", "Each pose before and after.")
