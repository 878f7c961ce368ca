"""The page of ``er3a compare``: both tables side by side, both arms in one picture, the corrected table."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from markupsafe import Markup

from er3a.comparison.compare import Comparison, in_units
from er3a.files.kept_files import sha256
from er3a.files.robot_writer import robot_file, robot_text
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.language import N_, own_title, tr, with_unit
from er3a.pipeline.messages.comparison import HEADLINES, STATES, doubt_rows, layer_rows
from er3a.pipeline.messages.numbers import fixed, number
from er3a.pipeline.messages.say import joined, say, word
from er3a.pipeline.results import Input, Provenance
from er3a.pipeline.viewing import page
from er3a.pipeline.viewing.answer import Group, ListRow, Mark
from er3a.pipeline.viewing.side_view import UPRIGHT, Label, beyond, entry_lines, flanges_off, seen_arm, side_view
from er3a.robots.robot import Robot

COLUMNS = {"a": "a (mm)", "alpha": "α (°)", "d": "d (mm)", "offset": N_("offset (°)"), "direction": N_("direction")}
Row = list[tuple[str, str, bool]]


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
    rows = [] if corrected is None else _rows(one[1], corrected)
    text = "" if corrected is None else robot_text(robot_file(corrected))
    layers = [*doubt_rows(doubts), *layer_rows(found)]
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
        seen=_seen(in_units(one[1], slips, "a"), in_units(other[1], slips, "b"), found, rows),
        layers=layers,
        groups=[Group(tr("What agrees and what differs"), [_layer(*row) for row in layers], counted=False)],
        columns=[tr(label) for label in COLUMNS.values()],
        rows=rows,
        corrected=text,
        corrected_address=page.text_address(text),
    )


def _layer(name: str, state: str, how: str) -> ListRow:
    """A layer in the list at the picture's side."""
    marks: dict[str, Mark] = {tr(STATES[True]): "pass", tr(STATES[False]): "fail"}
    return ListRow(marks.get(state, "none"), name, how or state, "#layers-in-full")


def _keys(found: Comparison) -> list[tuple[str, str]]:
    """How far the flanges are off each other, and how far with base, zeros and directions alike."""
    if found.as_printed_mm is None or found.aligned_mm is None:
        return []
    off, aligned = (with_unit(number(value, 3), "mm") for value in (found.as_printed_mm, found.aligned_mm))
    return [(off, tr("flange off at worst")), (aligned, tr("base, zeros, directions alike"))]


def _seen(one: Robot, other: Robot, found: Comparison, rows: Sequence[Row]) -> Markup:
    """Both arms from the side; the lengths that differ named, and how far the flanges are from each other."""
    same, lengths = found.verdict == "equal", [f"{column}{k + 1}" for k in range(one.rows) for column in "ad"]
    places = entry_lines(one, lengths, np.zeros(one.joints))
    arms = [
        seen_arm(other, own_title(other.title), "B"),
        seen_arm(one, own_title(one.title), "A", "right" if same else "wrong"),
    ]
    labels = [
        Label(f"{column}{k} = {own} → {new}", places[f"{column}{k}"].mean(0), "wrong")
        for k, row in enumerate(rows, 1)
        for column, (own, new, differs) in zip(COLUMNS, row)
        if differs and column in ("a", "d")
    ]
    return side_view(arms, ratio=UPRIGHT, labels=[*labels, *flanges_off(arms)], column_mm=beyond(arms))


def _rows(robot: Robot, corrected: Robot) -> list[Row]:
    """By row of the table and column what is printed, what it would have to be, and whether they differ."""
    found = []
    for k in range(robot.rows):
        cells = []
        for column in COLUMNS:
            scale = {"a": 1000.0, "d": 1000.0, "direction": 1.0}.get(column, float(np.degrees(1.0)))
            own, other = (fixed(scale * float(getattr(each, column)[k]), 4) for each in (robot, corrected))
            own, other = (each.rstrip("0").rstrip(".") for each in (own, other))
            cells.append((own, other, own != other))
        found.append(cells)
    return found
