"""Differences of two results folders: verdicts, key figures, the table's entries, borders, and files."""

from __future__ import annotations

import math
import shlex
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np

from er3a.errors import ResultError
from er3a.files.kept_files import sha256
from er3a.numerics.arrays import Reals
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.messages import language
from er3a.pipeline.messages.language import N_, tr
from er3a.pipeline.messages.workspace import POINTS
from er3a.pipeline.results import CHECKSUMS, AbsentResults, Input, Provenance, read_stage, result_records
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.viewing import page
from er3a.pipeline.viewing.numbers import number
from er3a.pipeline.viewing.page import Head, ShownFigure, stage_head

VIEWS = {"section": N_("section"), "side": N_("side view")}
SAME_BORDER_MM = 1e-6
DEFAULT_RESULTS = "results"
COLUMNS = (N_("robot"), N_("stage"), N_("what"), N_("old"), N_("new"), N_("difference"), N_("note"))


@dataclass(frozen=True)
class Change:
    """One thing that differs.

    Attributes
    ----------
    robot, stage, what : where it stands; ``what`` is a key figure's name, ``verdict`` or a file's name
    old, new : as shown, with unit; a dash where there is none
    difference : new - old with its unit, or words
    note : what the change means against the figures' uncertainty, or empty
    """

    robot: str
    stage: str
    what: str
    old: str
    new: str
    difference: str
    note: str = ""


def changes(old: Path, new: Path) -> list[Change]:
    """All that differs between two results folders, in the order of robots, stages and figures.

    Raises
    ------
    ResultError
        a folder holds no results, or a summary in it is damaged or of another version
    """
    stages = {folder: _stages(folder) for folder in (old, new)}
    found: list[Change] = []
    for key in sorted(stages[old] | stages[new]):
        robot, stage = key
        if key not in stages[old] or key not in stages[new]:
            there = key in stages[new]
            found.append(
                Change(
                    robot,
                    stage,
                    tr("stage"),
                    *(("–", tr("present")) if there else (tr("present"), "–")),
                    tr("only here"),
                )
            )
            continue
        folders = old / robot / stage, new / robot / stage
        if stage in STAGES:
            found += _in_heads(robot, stage, *(stage_head(folder, STAGES[stage]) for folder in folders))
        if stage == "validation":
            found += _in_entries(robot, *folders)
        if stage == "workspace":
            found += _in_borders(robot, *folders)
        found += _in_tables(robot, stage, *folders)
    return found


def write_diff(old: Path, new: Path, found: list[Change], output: Path) -> None:
    """Render the changes as a page."""
    page.render(
        Path(__file__).with_name("diff.html.j2"),
        output,
        command=shlex.join(
            ["er3a", "diff", str(old), str(new), "--language", language.current(), "--output", str(output)]
        ),
        provenance=Provenance(_records(old) + _records(new), code_digest(__name__)),
        old=old,
        new=new,
        columns=COLUMNS,
        rows=[astuple(change) for change in found],
    )


def _records(folder: Path) -> tuple[Input, ...]:
    return result_records(folder, sorted({robot for robot, _ in _stages(folder)}))


def _stages(folder: Path) -> set[tuple[str, str]]:
    found = {(path.parent.parent.name, path.parent.name) for path in folder.glob("*/*/summary.json")}
    if not found:
        problem = (
            "holds no results (no ROBOT/STAGE/summary.json in it)" if folder.is_dir() else "there is no such folder"
        )
        raise ResultError(folder, problem, _remedy(folder))
    return found


def _remedy(folder: Path) -> str:
    """What to do about a folder without results."""
    inside = folder / DEFAULT_RESULTS
    if any(inside.glob("*/*/summary.json")):
        return f"Give the results folder in it: {shlex.quote(str(inside))}"
    home = folder if folder.is_dir() and folder.name != DEFAULT_RESULTS else folder.parent
    return f"Run the study there first (cd {shlex.quote(str(home))} && er3a run), or give a folder that holds results"


def _in_heads(robot: str, stage: str, old: Head, new: Head) -> list[Change]:
    found = []
    status, turned = page.status_word(old.status), page.status_word(new.status)
    if status != turned:
        found.append(Change(robot, stage, tr("verdict"), status, turned, tr("changed"), new.text))
    elif old.text != new.text:
        found.append(Change(robot, stage, tr("verdict's text"), old.text, new.text, tr("reworded")))
    before, after = ({figure.name: figure for figure in (*head.figures, *head.numerics)} for head in (old, new))
    for name in {**before, **after}:
        a, b = before.get(name), after.get(name)
        shown = b or a
        if shown and a != b:
            found.append(Change(robot, stage, shown.label, _shown(a), _shown(b), *_moved(a, b)))
    return found


def _shown(figure: ShownFigure | None) -> str:
    if figure is None or figure.value is None:
        return "–"
    interval = "" if figure.uncertainty is None else f" ± {number(figure.uncertainty, 2)}"
    return f"{number(figure.value, 6)}{interval} {figure.unit}".strip()


def _moved(a: ShownFigure | None, b: ShownFigure | None) -> tuple[str, str]:
    """The difference in words and what it means."""
    if a is None or b is None:
        return tr("new") if a is None else tr("gone"), ""
    if a.unit != b.unit:
        return tr("another unit"), tr("not to be compared")
    if a.value is None or b.value is None:
        return "–", ""
    difference = b.value - a.value
    shown = f"{number(difference, 3)} {b.unit}".strip()
    if a.uncertainty is None or b.uncertainty is None:
        return shown, ""
    within = abs(difference) <= math.hypot(a.uncertainty, b.uncertainty)
    return shown, tr("within the 95 % interval of the difference") if within else tr("more than the intervals explain")


def _in_entries(robot: str, old: Path, new: Path) -> list[Change]:
    """Entries of the D-H table, zero, limits and speeds that have another value."""
    before, after = (_entries(folder) for folder in (old, new))
    found = []
    for name in {**before, **after}:
        (a, unit), (b, new_unit) = before.get(name, (None, "")), after.get(name, (None, ""))
        if a != b:
            difference = tr("only here") if a is None or b is None else _value(b - a, unit)
            found.append(Change(robot, "validation", name, _value(a, unit), _value(b, new_unit), difference))
    return found


def _entries(folder: Path) -> dict[str, tuple[float | None, str]]:
    """Value and unit by the entry's name, as far as references speak of the table."""
    stored = read_stage(folder, STAGES["validation"]).results
    if isinstance(stored, AbsentResults) or stored.summary.evidence is None:
        return {}
    return {each.entry: (each.value, each.unit) for each in stored.summary.evidence.entries if each.value is not None}


def _value(value: float | None, unit: str) -> str:
    return f"{number(value, 6)} {unit}".strip()


def _in_borders(robot: str, old: Path, new: Path) -> list[Change]:
    """How far each exact border moved: the largest distance of a point of one from the other, either way."""
    borders = [_borders(folder) for folder in (old, new)]
    found = []
    for key in sorted(borders[0] | borders[1]):
        point, view = key
        what = tr("border of the {point}, {view}", point=tr(POINTS[point]), view=tr(VIEWS[view]))
        before, after = (own.get(key) for own in borders)
        if before is None or after is None:
            there = (tr("present"), "–") if after is None else ("–", tr("present"))
            found.append(Change(robot, "workspace", what, *there, tr("only here")))
        elif (farthest := max(_farthest(before, after), _farthest(after, before)))[0] > SAME_BORDER_MM:
            moved, radius, height = (number(value, 3) for value in farthest)
            where = tr("most at {radius} mm from axis 1, {height} mm up", radius=radius, height=height)
            found.append(Change(robot, "workspace", what, "–", "–", tr("{moved} mm at most", moved=moved), where))
    return found


def _borders(folder: Path) -> dict[tuple[str, str], list[Reals]]:
    """By point and view the arcs of the border, (n, 2), in m."""
    stored = read_stage(folder, STAGES["workspace"]).results if (folder / "border.parquet").is_file() else None
    if stored is None or isinstance(stored, AbsentResults):
        return {}
    found: dict[tuple[str, str], list[Reals]] = {}
    for (point, view, _), arc in stored.border.frame().groupby(["point", "view", "arc"], sort=False):
        found.setdefault((point, view), []).append(arc[["rho_m", "z_m"]].to_numpy())
    return found


def _farthest(arcs: list[Reals], others: list[Reals]) -> tuple[float, float, float]:
    """The largest distance of the arcs' points from the other arcs, as lines from point to point, and the radius and
    height where it is, in mm."""
    points = np.concatenate(arcs)[:, None]
    starts, ends = (np.concatenate([arc[part] for arc in others]) for part in (np.s_[:-1], np.s_[1:]))
    along = ends - starts
    squares = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    share = np.clip(((points - starts) * along).sum(axis=2) / squares, 0.0, 1.0)
    gaps = np.linalg.norm(points - starts - share[..., None] * along, axis=2)
    nearest = gaps.min(axis=1)
    radius, height = points[nearest.argmax(), 0]
    return 1000 * float(nearest.max()), 1000 * float(radius), 1000 * float(height)


def _in_tables(robot: str, stage: str, old: Path, new: Path) -> list[Change]:
    found = []
    names = {path.name for folder in (old, new) for path in folder.iterdir() if path.is_file()}
    names -= {"summary.json", CHECKSUMS}
    for name in sorted(names):
        before, after = (sha256(folder / name)[:12] if (folder / name).is_file() else "–" for folder in (old, new))
        if before != after:
            found.append(Change(robot, stage, name, before, after, tr("different content")))
    return found
