"""Writes the page on the article, with its statements in order and three tables compared, in each language."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from babel import Locale

from er3a.files.kept_files import write_text
from er3a.geometry.transforms import translation
from er3a.pipeline import language
from er3a.pipeline.article.article_numbers import (
    LINE,
    MOVE,
    ArticleNumbers,
    TableNumbers,
    agreements,
    article_numbers,
    path_rows,
    summary_of,
)
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.language import tr, words
from er3a.pipeline.messages.article import AGREEMENT, ITEMS, SECTION_OF
from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.numbers import NOTHING, at_least, at_most, fixed, number, numbers
from er3a.pipeline.messages.trajectory import event_word
from er3a.pipeline.player.motions import PlayedEvent, PlayedMotion
from er3a.pipeline.player.player import drawing_head, player
from er3a.pipeline.results import Provenance, checksum_file, input_records, result_records
from er3a.pipeline.study import ArticleTables, Study
from er3a.pipeline.viewing import page
from er3a.pipeline.viewing.answer import Answer, Fix, Group, ListRow, Mark
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

ROLES = words(("the article's table", "the same with offset 2 = −90°", "the real ER3A-C60"))
APART_M = 1.8  # between two arms that stand side by side
PAGES = {"3.2": "teach", "4.2": "inverse", "5.1": "workspace", "5.2": "trajectory", "6.2": "workspace"}
"""The page of the printed table that shows more, by section of the article; for all others its validation page."""
GLANCES = {
    "zero_pose": "{p_upper_arm_deg:.0f}° → {c_upper_arm_deg:.0f}°",
    "offset": "{p_statements_met}/{p_statements} → {c_statements_met}/{c_statements}",
    "plot": "z {p_tool_z:.0f} → {c_tool_z:.0f} mm",
    "unreachable": "{p_within_limits}/{p_solutions} → {c_within_limits}/{c_solutions}",
    "void": "z {p_void_z} → {c_void_z} mm",
    "line_singular": "t = {p_crossings} s",
    "key_poses": "{p_checks_met}/{p_checks} → {c_checks_met}/{c_checks}",
    "round_trip": "{round_trip_deg}°",
    "hole": "{p_void} → {c_void} L",
}
"""What each item comes to, in numbers: as printed, and with offset 2."""
BADGES: dict[str, Mark] = {"differs": "fail", "in_part": "caution", "agrees": "pass", "not_examined": "no_reference"}


def write_article(study: Study, tables: ArticleTables, results: Path, folder: Path) -> None:
    """Compute the numbers, keep them as ``article.json`` below ``results``, and write the page in each language.

    Raises
    ------
    ResultError
        if results of a table are missing or damaged
    """
    found = article_numbers(study, tables, results)
    text = json.dumps(asdict(found) | {"agreements": agreements(found)}, indent=1) + "\n"
    write_text(results / "article.json", text)
    pages = study.article_pages()
    for code in language.LANGUAGES:  # a page of another run would be of other results, and of no language now
        for old in {"article.html", f"article_{code}.html"} - {*pages.values()}:
            (folder / old).unlink(missing_ok=True)
            checksum_file(folder / old).unlink(missing_ok=True)
    for code, name in pages.items():
        own = study.model_copy(update={"report": study.report.model_copy(update={"language": code})})
        language.use(code, own.own_titles())
        _write(study, tables, results, found, folder / name)


def _write(study: Study, tables: ArticleTables, results: Path, found: ArticleNumbers, output: Path) -> None:
    others = {code: name for code, name in study.article_pages().items() if name != output.name}
    rows = list(_rows(tables, found))
    robots = [study.robot(name) for name in tables.names]
    page.render(
        Path(__file__).with_name("article.html.j2"),
        output,
        command=page.run_command(study, output.name),
        provenance=Provenance(
            input_records(study.robot_file(name) for name in tables.names) + result_records(results, tables.names),
            code_digest(),
            seed=study.seed,
        ),
        others=[(code, Locale(code).display_name, name) for code, name in others.items()],
        answer=_answer(tables, found, rows),
        rows=rows,
        compared=_compared(found),
        roles=[tr(word) for word in ROLES],
        player=_player(robots, results, tables),
        drawing_head=drawing_head(),
    )


def _answer(tables: ArticleTables, found: ArticleNumbers, rows: list[dict[str, Any]]) -> Answer:
    """What the page says first: whose table it is, which entry explains most, and where the article is right."""
    groups = [
        Group(tr(AGREEMENT[status]), [row["shown"] for row in rows if row["status"] == status]) for status in BADGES
    ]
    counts = (f"{table.statements_met} / {table.statements}" for table in (found.printed, found.corrected))
    return Answer(
        tr("Another arm's table."),
        tr("Offset 2 = {fault_deg:.0f}° mends most.", fault_deg=found.fault_deg),
        keys=list(zip(counts, (tr("statements hold as printed"), tr("with offset 2 = −90°")))),
        groups=groups,
        fix=Fix(tr("Use the real arm's table."), f"{tables.real}/validation.html", instead=False),
    )


def _rows(tables: ArticleTables, found: ArticleNumbers) -> Iterator[dict[str, Any]]:
    agree, parts = agreements(found), _parts(found)
    for code, (title, says, finds, why) in ITEMS.items():
        status, section = agree[code], SECTION_OF[code]
        yield {
            "code": code,
            "title": f"{section} {tr(title)}",
            "says": tr(says),
            "finds": tr(finds, **parts),
            "shown": ListRow(BADGES[status], tr(title), GLANCES[code].format(**parts), f"#item-{code}"),
            "why": tr(why, **parts) if status != "agrees" else "",
            "status": status,
            "word": tr(AGREEMENT[status]),
            "badge": BADGES[status],
            "page": f"{tables.printed}/{PAGES.get(section, 'validation')}.html",
        }


def _parts(found: ArticleNumbers) -> dict[str, Any]:
    """The fields of the items' texts: those of :class:`ArticleNumbers`, and of its tables with a letter before them."""
    parts = dict(vars(found))
    for letter, table in (("p", found.printed), ("c", found.corrected), ("r", found.real)):
        parts |= {f"{letter}_{key}": value for key, value in (vars(table) | _worded(table)).items()}
    for key in ("missed_after_mm", "round_trip_deg"):
        rounding = abs(parts[key]) < NOTHING
        parts[key] = tr("less than {bound}", bound="10⁻⁶") if rounding else number(parts[key], 2)
    return parts


def _worded(table: TableNumbers) -> dict[str, Any]:
    """Numbers of a table as texts show them."""
    return {
        "tool_z": table.tool_mm[2],
        "volume": _between(table.volume_m3, "m³"),
        "void": _between(table.void_litres, "L") if table.void_litres else "–",
        "void_z": fixed(table.void_mm[2], 0) if table.void_mm else "–",
        "line": outcome_word(table.line) if table.line else "–",  # type: ignore[arg-type]
        "crossings": numbers(table.crossings_s, 4) or "–",
        "line_speed": number(table.line_speed_deg_s, 4),
    }


def _between(bounds: tuple[float, float], unit: str) -> str:
    return f"{at_least(bounds[0], unit)} … {at_most(bounds[1], unit)}"


def _compared(found: ArticleNumbers) -> list[list[str]]:
    """The rows of the comparison: what is compared, then a cell for each table."""
    cells = {
        tr("Statements of the article that hold"): "{statements_met} / {statements}",
        tr("Independent checks against CAD models and a URDF that pass"): "{checks_met} / {checks}",
        tr("Upper arm from the vertical, all joints at 0"): "{upper_arm_deg:.1f}°",
        tr("Forearm from the vertical, all joints at 0"): "{forearm_deg:.1f}°",
        tr("Tool at joint angles 0: x, y, z (mm)"): "{tool_mm}",
        tr("Tool at the article's example: x, y, z (mm)"): "{example_mm}",
        tr("Branches of the article's target within the limits"): "{within_limits} / {solutions}",
        tr("Greatest reach of the tool from axis 1 (mm)"): "{reach_mm:.1f}",
        tr("Reached volume, proven (m³)"): "{volume}",
        tr("Largest enclosed void, proven (L)"): "{void}",
        tr("The article's straight line"): "{line}",
    }
    parts = []
    for table in (found.printed, found.corrected, found.real):
        points = {"tool_mm": numbers(table.tool_mm, 2), "example_mm": numbers(table.example_mm, 2)}
        known = vars(table) | _worded(table) | points
        parts.append({key: "–" if value is None else value for key, value in known.items()})
    return [[label, *(language.filled(text, text, part) for part in parts)] for label, text in cells.items()]


def _player(robots: list[Robot], results: Path, tables: ArticleTables) -> Any:
    """Both tables side by side: the article's joint move and its line."""
    first, second = (
        robot.replace(base=translation(0.0, y, 0.0) @ robot.base)
        for robot, y in zip(robots, (APART_M / 2, -APART_M / 2))
    )
    texts = {
        MOVE: tr("The article's joint move (section 5.2), on both tables"),
        LINE: tr("The article's straight line (section 5.2), from where each table has the tool at joint angles 0"),
    }
    motions = []
    for name, text in texts.items():
        own, other = (path_rows(results, table, name) for table in (tables.printed, tables.corrected))
        q = np.stack([np.interp(own.t_s, other.t_s, column) for column in other.q_deg.T], axis=1)
        beside = (meant(second, q),)
        motions.append(
            PlayedMotion(name, text, own.t_s, meant(first, own.q_deg), _events(results, tables, name), beside=beside)
        )
    return player(first, motions, beside=(second,), signs=[tr(role) for role in ROLES[:2]])


def _events(results: Path, tables: ArticleTables, name: str) -> list[PlayedEvent]:
    """Where one of both tables is singular on a path."""
    found = []
    for table, role in zip((tables.printed, tables.corrected), ROLES):
        for path in summary_of(results, table, "trajectory").paths:
            for event in path.singularities if path.name == name else ():
                if event.crossing:
                    text = tr("{table}: singular ({type})", table=tr(role), type=event_word(event))
                    found.append(PlayedEvent(event.t_s, event.until_s, text, "caution"))
    return found
