"""The page of ``er3a confirm``: how far each pose is off before and after, both arms, and what to write where."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from er3a.confirmation.confirm import Confirmation
from er3a.files.kept_files import sha256
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.language import own_title, with_unit
from er3a.pipeline.messages.confirm import lines_of
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import joined
from er3a.pipeline.results import Input, Provenance
from er3a.pipeline.viewing import page
from er3a.pipeline.viewing.answer import Group, ListRow, Part, lengths
from er3a.pipeline.viewing.side_view import UPRIGHT, beyond, flanges_off, seen_arm, side_view
from er3a.robots.robot import Robot

STATUS = {"agrees": "pass", "open": "fail"}


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
    _, headline, *lines = lines_of(found, nearest=nearest)
    kind, _, said = headline.partition(";")[0].partition(": ")  # the key figures say the rest
    arms = [seen_arm(robot, own_title(robot.title), "model", "right" if found.verdict == "agrees" else "wrong")]
    if found.verdict not in ("agrees", "open"):
        arms.insert(0, seen_arm(found.corrected, "Controller", "", "right"))
    page.render(
        Path(__file__).with_name("confirmation.html.j2"),
        output,
        command=command,
        provenance=Provenance(tuple(Input(str(file), sha256(file), {}) for file in files), code_digest()),
        title=own_title(robot.title),
        status=STATUS.get(found.verdict, "caution"),
        kind=kind.lower(),
        headline=said,
        lines=[headline, *(line.strip() for line in lines)],
        keys=_keys(found),
        arms=side_view(arms, ratio=UPRIGHT, labels=flanges_off(arms), column_mm=beyond(arms)),
        poses=[_poses(found)],
    )


def _keys(found: Confirmation) -> list[tuple[str, str]]:
    off = [found.before_mm.max(), found.left_mm[found.fits].max(initial=0.0)]
    words = "as it is, at worst", "explained, at worst"
    return [(with_unit(fixed(float(value), 2), "mm"), said) for value, said in zip(off, words)]


def _poses(found: Confirmation) -> Group:
    """How far each pose is off, by the model as it is, with its bar, and with what was found."""
    shares = lengths(found.before_mm.tolist())
    rows = []
    for line, before, left, share in zip(found.lines, found.before_mm, found.left_mm, shares):
        off = joined([fixed(float(value), 2) for value in ((before, left) if found.layers else (left,))], " → ")
        mark: Literal["pass", "caution", "fail"] = (
            "pass" if before <= found.digits_mm else "caution" if left <= found.digits_mm else "fail"
        )
        rows.append(ListRow(mark, str(line), with_unit(off, "mm"), length=share, parts=[Part(0.0, 1.0, mark)]))
    return Group("flange off, by line of the file", rows)
