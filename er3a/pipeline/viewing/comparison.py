"""The page of ``er3a compare``: both tables side by side, both arms in one picture, the corrected table."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from er3a.comparison.compare import Comparison, in_units
from er3a.files.kept_files import sha256
from er3a.files.robot_writer import robot_file, robot_text
from er3a.kinematics.chain import constant_links, joint_starts
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.language import own_title, tr, with_unit
from er3a.pipeline.messages.comparison import HEADLINES, doubt_rows, layer_rows
from er3a.pipeline.messages.numbers import number
from er3a.pipeline.messages.say import bracketed, joined, say, word
from er3a.pipeline.results import Input, Provenance
from er3a.pipeline.viewing import page
from er3a.pipeline.viewing.side_view import UPRIGHT, Kind, seen_arm, side_view
from er3a.robots.joint_limits import joint_shown
from er3a.robots.robot import Robot

COLUMNS = ("a", "alpha", "d", "offset", "direction")


def write_comparison(
    one: tuple[str, Robot],
    other: tuple[str, Robot],
    found: Comparison,
    output: Path,
    tolerances: tuple[float, float],
    doubts: Sequence[str] = (),
) -> None:
    """Write the page of a comparison of two arms.

    Parameters
    ----------
    one, other : as they were named on the command line, and read
    found : their comparison
    output : the page, written whole or not at all
    tolerances : mm and deg, with which they were compared
    doubts : about units in them, in words
    """
    corrected = found.corrected
    slips = found.units.causes if found.units else ()
    text = "" if corrected is None else robot_text(robot_file(corrected))
    lengths, angles = (f"{value:g}" for value in tolerances)
    words = ["--tolerance-mm", lengths, "--tolerance-deg", angles, "--html", str(output)]
    files = [Path(name) for name, _ in (one, other) if Path(name).is_file()]
    page.render(
        Path(__file__).with_name("comparison.html.j2"),
        output,
        command=shlex.join(["er3a", "compare", one[0], other[0], *words]),
        provenance=Provenance(tuple(Input(str(file), sha256(file), {}) for file in files), code_digest()),
        names=(one[0], other[0]),
        verdict=found.verdict,
        headline=joined([*doubts, *map(say, (*slips, *found.causes)), word("comparison", HEADLINES, found.verdict)]),
        keys=_keys(found),
        seen=_seen(in_units(one[1], slips, "a"), in_units(other[1], slips, "b"), same=found.verdict == "equal"),
        layers=[*doubt_rows(doubts), *layer_rows(found)],
        columns=_columns(),
        rows=[] if corrected is None else _rows(one[1], corrected),
        corrected=text,
        corrected_address=page.text_address(text),
        arms=None if corrected is None else _arms(in_units(one[1], slips, "a"), in_units(other[1], slips, "b"), found),
        compare_script=Path(__file__).with_name("comparison.js").read_text(encoding="utf-8"),
    )


def _keys(found: Comparison) -> list[tuple[str, str]]:
    """How far the flanges are off each other, and how far with base, zeros and directions alike."""
    if found.as_printed_mm is None or found.aligned_mm is None:
        return []
    off, aligned = (with_unit(number(value, 3), "mm") for value in (found.as_printed_mm, found.aligned_mm))
    return [(off, tr("flange off at worst")), (aligned, tr("base, zeros, directions alike"))]


def _seen(one: Robot, other: Robot, *, same: bool) -> Markup:
    kind: Kind = "right" if same else "wrong"
    arms = [seen_arm(one, own_title(one.title), "A", kind), seen_arm(other, own_title(other.title), "B", "right")]
    return side_view(arms, ratio=UPRIGHT)


def _columns() -> list[str]:
    units = {"a": "mm", "d": "mm", "direction": ""}
    return [
        bracketed(column, tr(unit)) if (unit := units.get(column, "deg")) else tr("direction") for column in COLUMNS
    ]


def _rows(robot: Robot, corrected: Robot) -> list[list[tuple[str, str, bool]]]:
    """By row of the table and column what is printed, what it would have to be, and whether they differ."""
    found = []
    for k in range(robot.rows):
        cells = []
        for column in COLUMNS:
            scale = {"a": 1000.0, "d": 1000.0, "direction": 1.0}.get(column, float(np.degrees(1.0)))
            own, other = (f"{round(scale * float(getattr(each, column)[k]), 4) + 0.0:g}" for each in (robot, corrected))
            cells.append((own, other, own != other))
        found.append(cells)
    return found


def _arms(one: Robot, other: Robot, found: Comparison) -> dict[str, Any]:
    """Both arms as chains for the page's script, and what brings the second onto the first."""
    if (by := found.alignment) is None:
        return {}
    joints = []
    for j in range(one.joints):
        (lower, slides), (upper, _) = (joint_shown(one, j, float(value[j])) for value in (one.lower, one.upper))
        start = min(max(0.0, lower), upper)
        joints.append({"lower": lower, "upper": upper, "start": start, "unit": "mm" if slides else "deg"})
    return {
        "arms": [_chain(one), _chain(other)],
        "base": by.base.tolist(),
        "zeros": (by.zeros * one.direction).tolist(),
        "signs": by.signs.tolist(),
        "joints": joints,
    }


def _chain(robot: Robot) -> dict[str, Any]:
    bare = robot.without_tool()
    coupling = np.eye(robot.rows, robot.joints) if robot.coupling is None else robot.coupling
    return {
        "links": constant_links(bare).tolist(),
        "starts": joint_starts(bare).tolist(),
        "directions": robot.direction.tolist(),
        "sliding": robot.sliding.tolist(),
        "coupling": coupling.tolist(),
    }
