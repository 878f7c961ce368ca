"""Writes the page on the article, with its steps in order and three tables compared, in each language."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from babel import Locale
from markupsafe import Markup, escape

from er3a.files.kept_files import write_atomically
from er3a.geometry.transforms import translation
from er3a.kinematics.forward import forward, jacobian, skeleton
from er3a.kinematics.singularity import characteristic_length, conditioning
from er3a.pipeline import language
from er3a.pipeline.article.article_numbers import (
    CLOUD,
    COMPARED,
    DURATION_S,
    LINE,
    MOVE,
    MOVE_END,
    WINDOW_Z_M,
    ArticleNumbers,
    TableNumbers,
    agreements,
    article_numbers,
    path_rows,
    random_joints,
    summary_of,
)
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.language import N_, tr
from er3a.pipeline.messages.article import AGREEMENT, ITEMS, SECTIONS, Item
from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.numbers import at_least, at_most, fixed, number
from er3a.pipeline.messages.say import joined, say
from er3a.pipeline.messages.trajectory import event_word, strategy_word
from er3a.pipeline.messages.workspace import change_text
from er3a.pipeline.overview.index import border_mm
from er3a.pipeline.player.motions import PlayedEvent, PlayedMotion
from er3a.pipeline.player.player import drawing_head, player
from er3a.pipeline.results import Provenance, checksum_file, input_records, read_stage, result_records
from er3a.pipeline.stages.dynamics.model import NoLimits
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.vision.model import GraspCounts
from er3a.pipeline.study import ArticleTables, Study
from er3a.pipeline.viewing import page
from er3a.pipeline.viewing.figures import house_style, new_figure
from er3a.pipeline.viewing.page import Picture, stage_head
from er3a.pipeline.viewing.palette import HIGHLIGHT, INK, JOINT_NAMES, MODEL, MUTED, REFERENCE
from er3a.planning.moves import JointMove
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot
from er3a.workspace.causes import SingleChange

COLOURS = (REFERENCE, MODEL, MUTED)  # printed, corrected, real
DOTS = 3000


def draw(study: Study, results: Path, numbers: ArticleNumbers) -> dict[str, Picture]:
    """The figures by name, in the order in which they stand on the page."""
    tables = study.article
    assert tables is not None
    robots = [study.robot(name) for name in tables.names]
    names = [tr("as printed"), tr("offset 2 = −90°"), tr("the real ER3A-C60")]
    return {
        "zero": _zero_pose(robots, names, numbers),
        "reach": _reach(results, tables.names, robots, names, numbers, study.seed),
        "wrist": _wrist(robots[0], numbers),
        "move": _move(numbers),
        "line": _line(results, tables.names[:2], names, numbers),
        "measures": _measures(robots[0], study.seed, numbers),
    }


def _zero_pose(robots: list[Robot], names: list[str], numbers: ArticleNumbers) -> Picture:
    figure, axes = new_figure(width=7.0, height=5.2)
    low, high = (1000 * z for z in WINDOW_Z_M)
    axes.axhspan(low, high, color=MUTED, alpha=0.12, linewidth=0, label=tr("window of the article's plot"))
    for robot, name, colour in zip(robots, names, COLOURS):
        corners = 1000 * skeleton(robot, np.zeros(robot.joints))
        axes.plot(corners[:, 0], corners[:, 2], "o-", color=colour, linewidth=2.5, markersize=4, label=name)
    axes.set(xlabel="x (mm)", ylabel="z (mm)", aspect="equal")
    axes.legend(loc="center left", bbox_to_anchor=(1.02, 0.5))
    return Picture(
        figure,
        tr("Side view of three arms with all joints at 0, and the band of heights that the article's plot shows"),
        tr(
            "All joints at 0, from the side. As printed the tool is at z = {printed} mm, with offset 2 = −90° at "
            "{corrected} mm; the window from 0 to 1 500 mm shows {shown} % of the printed arm.",
            printed=fixed(numbers.printed.tool_mm[2], 2),
            corrected=fixed(numbers.corrected.tool_mm[2], 2),
            shown=fixed(100 - numbers.hidden_percent, 0),
        ),
    )


def _reach(
    results: Path,
    tables: tuple[str, ...],
    robots: list[Robot],
    names: list[str],
    numbers: ArticleNumbers,
    seed: int,
) -> Picture:
    figure, panels = new_figure(1, 3, width=12.0, height=5.2, sharex=True, sharey=True)
    found = (numbers.printed, numbers.corrected, numbers.real)
    for axes, table, robot, name, colour, own in zip(panels, tables, robots, names, COLOURS, found):
        points = 1000 * forward(robot, random_joints(robot, seed, CLOUD))[:DOTS, :3, 3]
        axes.plot(np.hypot(points[:, 0], points[:, 1]), points[:, 2], ",", color=MUTED)
        for arc in border_mm(read_stage(results / table / "workspace", STAGES["workspace"]).results):
            axes.plot(*np.array(arc).T, color=colour, linewidth=1)
        if own.void_mm and own.void_litres:
            axes.plot(np.hypot(*own.void_mm[:2]), own.void_mm[2], "*", color=HIGHLIGHT, markersize=11)
            text = tr(
                "void of {low} to {high} L",
                low=at_least(own.void_litres[0], "L"),
                high=at_most(own.void_litres[1], "L"),
            )
            axes.annotate(text, (np.hypot(*own.void_mm[:2]), own.void_mm[2]), (8, 8), textcoords="offset points")
        axes.set(title=name, xlabel=tr("distance from axis 1 (mm)"), aspect="equal")
    panels[0].set_ylabel("z (mm)")
    return Picture(
        figure,
        tr("Sections through what the tool reaches of three tables, with random samples, border and void"),
        tr(
            "What the tool reaches, folded about axis 1: samples as the article draws them, the border, and the "
            "middle of the largest enclosed void (star). The printed table's void is at z = {z} mm, above the base.",
            z=fixed(numbers.printed.void_mm[2], 0) if numbers.printed.void_mm else "–",
        ),
    )


def _wrist(robot: Robot, numbers: ArticleNumbers) -> Picture:
    angles = np.geomspace(0.05, 90.0, 200)
    q = np.zeros((len(angles), robot.joints))
    q[:, 4] = np.radians(angles)
    gain = np.linalg.norm(np.linalg.inv(jacobian(robot, q)[:, 3:, 3:]), axis=2).max(axis=1)
    figure, axes = new_figure(width=7.0, height=3.6)
    axes.loglog(angles, gain, color=REFERENCE, label=tr("fastest wrist joint, per unit of the tool's angular velocity"))
    turned = np.full(len(angles), numbers.wrist_turn_deg)
    axes.loglog(angles, turned, color=MODEL, label=tr("turn of the tool (°) by one degree of joint 4"))
    axes.set(xlabel=tr("joint 5 (°)"))
    axes.legend(loc="upper right")
    return Picture(
        figure,
        tr("Joint speed needed, and turn of the tool by joint 4, against the angle of joint 5"),
        tr(
            "Towards joint 5 = 0 it is not the tool that turns faster: the joints have to, without bound. One degree "
            "of joint 4 turns the tool by {turn}° everywhere.",
            turn=fixed(numbers.wrist_turn_deg, 3),
        ),
    )


def _move(numbers: ArticleNumbers) -> Picture:
    t = np.linspace(0, DURATION_S, 250)
    curves = JointMove(np.zeros(6), MOVE_END, DURATION_S).joints(t)
    figure, panels = new_figure(1, 3, width=11.0, height=3.4)
    for axes, values, label in zip(
        panels, curves, (tr("angle (°)"), tr("velocity (°/s)"), tr("acceleration (°/s²)")), strict=True
    ):
        for joint, (name, curve) in enumerate(zip(JOINT_NAMES, np.degrees(values).T)):
            axes.plot(t, curve, color=f"C{joint}", label=name)
        axes.set(xlabel=tr("time (s)"), ylabel=label)
    panels[0].legend(ncols=2)
    return Picture(
        figure,
        tr("Angles, velocities and accelerations of the article's joint move over time"),
        tr(
            "The article's joint move: at most {speed}°/s and {acceleration}°/s².",
            speed=fixed(numbers.move_speed_deg_s, 1),
            acceleration=fixed(numbers.move_acceleration_deg_s2, 1),
        ),
        over_time=[(axes, "article_joint") for axes in panels],
    )


def _line(results: Path, tables: tuple[str, ...], names: list[str], numbers: ArticleNumbers) -> Picture:
    figure, axes = new_figure(width=8.0, height=3.8)
    for table, name, colour in zip(tables, names, COLOURS):
        rows = path_rows(results, table, LINE)
        axes.semilogy(rows.t_s, np.abs(rows.q_deg_s).max(axis=1) + 1e-3, color=colour, label=name)
    for found, colour in zip((numbers.printed, numbers.corrected), COLOURS):
        for t in found.line_crossings_s:
            axes.axvline(t, color=colour, linestyle=":", linewidth=1.2)
    axes.set(xlabel=tr("time (s)"), ylabel=tr("fastest joint (°/s)"))
    axes.legend(loc="lower center")
    return Picture(
        figure,
        tr("The fastest joint along the article's straight line over time, of two tables, and where it is singular"),
        tr(
            "The article's straight line. Dotted: singular poses. The fastest joint reaches {printed}°/s as printed "
            "and {corrected}°/s with offset 2 = −90°.",
            printed=number(numbers.printed.line_speed_deg_s, 4),
            corrected=number(numbers.corrected.line_speed_deg_s, 4),
        ),
        over_time=[(axes, LINE)],
    )


def _measures(robot: Robot, seed: int, numbers: ArticleNumbers) -> Picture:
    measures = conditioning(robot, random_joints(robot, seed, COMPARED), characteristic_length(robot))
    figure, axes = new_figure(width=6.5, height=4.2)
    axes.loglog(measures.manipulability, measures.condition_number, ".", color=INK, markersize=3, alpha=0.6)
    axes.set(xlabel=tr("manipulability"), ylabel=tr("condition number"))
    return Picture(
        figure,
        tr("Condition number against manipulability at random poses"),
        tr(
            "{count} random poses of the printed table. Of two of them both measures name another one as nearer to a "
            "singularity in {apart} % of the cases.",
            count=COMPARED,
            apart=fixed(numbers.ranked_apart_percent, 0),
        ),
    )


APART_M = 1.8  # between two arms that stand side by side
STATUS_OF_STAGES = ("collision", "programs", "vision", "dynamics")
PAGES = {
    **dict.fromkeys(("teach", "wrist", "same_as_teach"), "teach"),
    **dict.fromkeys(("zero_pose", "offset", "key_poses", "boundary", "round_trip", "units"), "validation"),
    **dict.fromkeys(("target", "ikine", "ikcon", "unreachable", "eight", "choice", "poor_solver"), "inverse"),
    **dict.fromkeys(("cloud", "void", "hole"), "workspace"),
    **dict.fromkeys(
        ("jtraj", "animation", "ctraj", "line_singular", "condition", "avoidance", "programs"), "trajectory"
    ),
}
"""The page of the printed table that shows more of an item, by the item's code."""
ROUNDING = 1e-6  # mm or deg
REAL_PAGES = {"payload": "dynamics", **{stage: stage for stage in ("collision", "vision", "dynamics")}}
PLACES = {"same_as_teach": "#q=0,45,-30,0,60,0", "programs": f"#{MOVE}"}
ERRORS = (
    "circle_error_mm",
    "missed_after_mm",
    "residual_mm",
    "round_trip_deg",
    "shifted_apart_mm",
    "same_pose_apart_deg",
)
BADGES = {"agrees": "pass", "differs": "fail", "in_part": "caution", "not_examined": "no_reference", "done": "done"}
ROLES = {
    "printed": N_("the article's table"),
    "corrected": N_("the same with offset 2 = −90°"),
    "real": N_("the real ER3A-C60"),
}


def write_article(study: Study, results: Path, folder: Path) -> None:
    """Compute the numbers, keep them as ``article.json`` below ``results``, and write the page in each language."""
    numbers = article_numbers(study, results)
    text = json.dumps(asdict(numbers) | {"agreements": agreements(numbers)}, indent=1) + "\n"
    write_atomically(results / "article.json", lambda file: file.write_text(text, encoding="utf-8"))
    pages = study.article_pages()
    for code in language.LANGUAGES:  # the study may have had another language
        if (former := f"article_{code}.html") not in pages.values():
            for file in (folder / former, checksum_file(folder / former)):
                file.unlink(missing_ok=True)
    for code, name in pages.items():
        own = study.model_copy(update={"report": study.report.model_copy(update={"language": code})})
        language.use(code, own.own_titles())
        with house_style():
            others = {each: pages[each] for each in pages if each != code}
            mark = (
                ""
                if code == study.report.language
                else tr("in {language}", language=Locale(study.report.language).get_display_name(code))
            )
            _write(study, results, numbers, folder / name, others, mark)


def _write(
    study: Study, results: Path, numbers: ArticleNumbers, output: Path, others: dict[str, str], mark: str
) -> None:
    """One page; ``others``: its siblings by language, ``mark``: what links to pages of another language say."""
    tables = study.article
    assert tables is not None
    drawn = draw(study, results, numbers)
    order = ["zero", "player", *(name for name in drawn if name != "zero")]
    places = {name: k for k, name in enumerate(order, start=1)}
    rows = list(_rows(study, results, numbers, places))
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
        counts=[(status, BADGES[status], sum(row["status"] == status for row in rows)) for status in AGREEMENT],
        agreement_words=AGREEMENT,
        sections=[
            (code, title, [row for row, item in zip(rows, ITEMS) if item.section == code])
            for code, title in SECTIONS.items()
        ],
        compared=_compared(numbers),
        pages_in=mark,
        roles=[tr(word) for word in ROLES.values()],
        robots=[(name, study.robot(name), study.pages(name)) for name in tables.names],
        table_columns=["i>", "a (mm)>", "α (°)>", "d (mm)>", tr("direction>"), tr("offset (°)>"), tr("limits (°)>")],
        table_rows=[_dh_rows(study.robot(name)) for name in tables.names],
        drawn=drawn,
        of_section={"3.2": ["wrist"], "5.2": ["move", "line", "measures"]},
        player=_player(study, results, tables),
        drawing_head=drawing_head(),
    )


def _rows(study: Study, results: Path, numbers: ArticleNumbers, places: dict[str, int]) -> Iterator[dict[str, Any]]:
    found, parts = agreements(numbers), _parts(study, results, numbers, places)
    for place, item in enumerate(ITEMS, start=1):
        status = found.get(item.code) or _status_of_stage(study, results, item)
        instead = parts.get(f"instead_{item.code}")
        yield dict(
            number=place,
            code=item.code,
            title=tr(item.title),
            says=tr(item.says),
            finds=_with_code(instead or tr(item.finds, **parts)),
            how=item.how,
            why=tr(item.why, **parts) if item.why and status != "agrees" and instead is None else "",
            status=status,
            badge=BADGES[status],
            page=_page_on(study.article, item.code) if study.article else "",
        )


def _page_on(tables: ArticleTables, code: str) -> str:
    """The address of the page that shows more of an item; empty where there is none."""
    if code in REAL_PAGES:
        return f"{tables.real}/{REAL_PAGES[code]}.html"
    return f"{tables.printed}/{PAGES[code]}.html{PLACES.get(code, '')}" if code in PAGES else ""


def _with_code(text: str) -> Markup:
    """A text whose words in backticks are code."""
    plain, *rest = text.split("`")
    parts = [Markup("<code>{}</code>").format(part) if k % 2 == 0 else escape(part) for k, part in enumerate(rest)]
    return escape(plain) + Markup("").join(parts)


def _status_of_stage(study: Study, results: Path, item: Item) -> str:
    if item.code not in STATUS_OF_STAGES:
        return "done"
    return "not_examined" if _head(study, results, item.code) is None else "done"


def _head(study: Study, results: Path, stage: str) -> page.Head | None:
    """What a stage found of the real arm; None where it was not computed."""
    assert study.article is not None
    name = study.article.real
    if stage not in study.stages(name):
        return None
    head = stage_head(results / name / stage, STAGES[stage])
    return None if head.status == "not_computed" else head


def _parts(study: Study, results: Path, numbers: ArticleNumbers, places: dict[str, int]) -> dict[str, Any]:
    """The fields of the items' texts."""
    parts: dict[str, Any] = {key: value for key, value in asdict(numbers).items() if not isinstance(value, dict)}
    parts |= {key: _error(float(parts[key])) for key in ERRORS}
    for letter, table in (("p", numbers.printed), ("c", numbers.corrected), ("r", numbers.real)):
        parts |= {f"{letter}_{key}": value for key, value in _flat(table).items()}
    gone, meeting = numbers.changes_gone, numbers.changes_meeting
    parts |= {"changes_gone": len(gone), "changes_named": _named(gone), "changes_meeting": _named(meeting)}
    reach = numbers.reach
    if reach is None:
        parts["instead_boundary"] = tr("No drawing of this arm was found, and this study knows no reach of it.")
    else:
        parts |= {"reach_known_mm": reach.known_mm, "reach_printed_mm": reach.printed_mm}
    parts |= {key: np.nan for key, value in parts.items() if value is None and key.endswith(("_mm", "_nm"))}
    listed = {"gain": numbers.wrist_gain, "wrist_shift": numbers.wrist_shift_mm}
    listed |= {"zyz": numbers.printed.example_zyz_deg, "quaternion": numbers.printed.example_quaternion}
    parts |= {f"{name}_{k}": value for name, values in listed.items() for k, value in enumerate(values)}
    parts["quintic_crossings"] = _times(numbers.quintic_crossings_s)
    parts["way_chosen"] = strategy_word(numbers.strategy) if numbers.strategy else "–"
    parts["round_trips"] = number(numbers.round_trips)
    parts["ways_usable"] = joined(map(strategy_word, numbers.strategies_usable)) or "–"
    parts["ways_unusable"] = joined(map(strategy_word, numbers.strategies_unusable)) or "–"
    parts |= {f"figure_{name}": place for name, place in places.items()}
    for stage in STATUS_OF_STAGES:
        head = _head(study, results, stage)
        parts[f"stage_{stage}"] = tr("This study does not examine it.") if head is None else head.text
    for stage, fields in (("vision", _grasps), ("dynamics", _torque)):
        found = fields(study, results) if _head(study, results, stage) else None
        parts |= found or {f"instead_{stage}": parts[f"stage_{stage}"]}
    return parts


def _grasps(study: Study, results: Path) -> dict[str, Any] | None:
    """What came of the real arm's simulated camera; None where its verdict is of another kind."""
    assert study.article is not None
    verdict = summary_of(results, study.article.real, "vision").verdict
    found = verdict.finding
    if not isinstance(found, GraspCounts) or found.point_mm is None or not found.simulated:
        return None
    return {
        "grasped": found.grasped,
        "objects": found.objects,
        "grasp_error_mm": found.point_mm,
        "misplaced": len(found.demonstrations),
        "poses_left_out": len(found.left_out),
        "grasp_rests_on": joined(map(say, verdict.findings[1:]), " "),
    }


def _torque(study: Study, results: Path) -> dict[str, Any] | None:
    """The real arm's greatest torque on a path; None where its verdict is of another kind."""
    assert study.article is not None
    found = summary_of(results, study.article.real, "dynamics").verdict.finding
    if not isinstance(found, NoLimits) or found.path is None or found.grade is None:
        return None
    return {
        "torque_nm": found.torque,
        "torque_tolerance_nm": found.tolerance,
        "torque_joint": found.joint,
        "massless": ", ".join(map(str, found.missing_links)) or "–",
    }


def _error(value: float) -> str:
    """A difference in mm or deg; what is rounding alone has one size."""
    return number(value, 2) if abs(value) >= ROUNDING else tr("less than {bound}", bound="10⁻⁶")


def _named(changes: tuple[SingleChange, ...]) -> str:
    return joined(map(change_text, changes), ", ") or "–"


def _flat(table: TableNumbers) -> dict[str, Any]:
    found = asdict(table)
    for key, axes in (("tool", "xyz"), ("example", "xyz"), ("void", "xyz")):
        found |= {f"{key}_{axis}": value for axis, value in zip(axes, found[f"{key}_mm"] or (np.nan,) * 3)}
    found |= dict(zip(("example_roll", "example_pitch", "example_yaw"), found["example_rpy_deg"]))
    low, high = table.volume_m3
    found |= {"volume_low": at_least(low, "m³"), "volume_high": at_most(high, "m³")}
    low, high = table.void_litres or (0.0, 0.0)
    found |= {"void_low": at_least(low, "L"), "void_high": at_most(high, "L")}
    found["crossings"] = _times(table.line_crossings_s)
    found["other_voids"] = joined(
        (
            tr("{low} to {high} L at z = {z} mm", low=at_least(low, "L"), high=at_most(high, "L"), z=fixed(z, 0))
            for low, high, z in table.other_voids
        ),
        ", ",
    )
    found["other_voids"] = found["other_voids"] or tr("none")
    found |= {key: np.nan for key in ("move_clearance_mm", "line_clearance_mm") if found[key] is None}
    found["rests_on"] = say(table.rests_on) if table.rests_on else ""
    found["line"] = outcome_word(table.line) if table.line else "–"  # type: ignore[arg-type]
    return found


def _times(times: tuple[float, ...]) -> str:
    return joined((fixed(t, 4) for t in times), ", ") or "–"


def _compared(numbers: ArticleNumbers) -> list[list[str]]:
    """The rows of the comparison: what is compared, then a cell for each table."""
    unexamined = tr("not examined")
    rows: list[tuple[str, Callable[[TableNumbers], str]]] = [
        (
            tr("Statements of the article that hold"),
            lambda t: unexamined if t.statements is None else f"{t.statements_met} / {t.statements}",
        ),
        (
            tr("Independent checks against CAD models and a URDF that pass"),
            lambda t: f"{t.checks_met} / {t.checks}",
        ),
        (tr("Upper arm from the vertical, all joints at 0"), lambda t: f"{fixed(t.upper_arm_deg, 1)}°"),
        (tr("Forearm from the vertical, all joints at 0"), lambda t: f"{fixed(t.forearm_deg, 1)}°"),
        (tr("Tool at joint angles 0: x, y, z (mm)"), lambda t: ", ".join(fixed(v, 2) for v in t.tool_mm)),
        (tr("Branches of the article's target within the limits"), lambda t: f"{t.within_limits} / {t.solutions}"),
        (tr("Greatest reach of the tool from axis 1 (mm)"), lambda t: fixed(t.reach_mm, 1)),
        (tr("Reached volume, proven (m³)"), lambda t: _between(t.volume_m3, "m³")),
        (tr("Largest enclosed void, proven (L)"), lambda t: _between(t.void_litres, "L") if t.void_litres else "–"),
        (tr("Its centre: z (mm)"), lambda t: fixed(t.void_mm[2], 0) if t.void_mm else "–"),
        (tr("The article's straight line"), lambda t: outcome_word(t.line) if t.line else unexamined),  # type: ignore[arg-type]
        (tr("It is singular at t (s)"), lambda t: _times(t.line_crossings_s) if t.line else unexamined),
    ]
    return [[label, *map(cell, (numbers.printed, numbers.corrected, numbers.real))] for label, cell in rows]


def _between(bounds: tuple[float, float], unit: str) -> str:
    return f"{at_least(bounds[0], unit)} … {at_most(bounds[1], unit)}"


def _dh_rows(robot: Robot) -> list[list[str]]:
    def deg(value: float) -> str:
        return f"{round(float(np.degrees(value)), 6) + 0.0:g}".replace("-", "−")

    return [
        [
            str(k + 1),
            f"{round(1000 * float(robot.a[k]), 4) + 0.0:g}",
            deg(robot.alpha[k]),
            f"{round(1000 * float(robot.d[k]), 4) + 0.0:g}".replace("-", "−"),
            f"{robot.direction[k]:+.0f}".replace("-", "−"),
            deg(robot.offset[k]),
            f"{deg(robot.lower[k])} … {deg(robot.upper[k])}",
        ]
        for k in range(robot.rows)
    ]


def _player(study: Study, results: Path, tables: ArticleTables) -> Any:
    """Both tables side by side: the article's joint move, its line, and joint 1 alone."""
    printed, corrected = study.robot(tables.printed), study.robot(tables.corrected)
    beside = corrected.replace(base=translation(0.0, -APART_M / 2, 0.0) @ corrected.base)
    first = printed.replace(base=translation(0.0, APART_M / 2, 0.0) @ printed.base)
    texts = {
        MOVE: tr("The article's joint move (section 5.2), on both tables"),
        LINE: tr("The article's straight line (section 5.2), from where each table has the tool at joint angles 0"),
    }
    labels = {MOVE: tr("Joint move"), LINE: tr("Straight line")}
    motions = []
    for name, text in texts.items():
        own, other = (path_rows(results, robot, name) for robot in (tables.printed, tables.corrected))
        q = np.stack([np.interp(own.t_s, other.t_s, column) for column in other.q_deg.T], axis=1)
        motions.append(
            PlayedMotion(
                name,
                text,
                own.t_s,
                meant(first, own.q_deg),
                _events(results, tables, name),
                beside=(meant(beside, q),),
                label=labels[name],
            )
        )
    t = np.linspace(0, 4, 81)
    q = np.zeros((len(t), first.joints))
    q[:, 0] = np.linspace(first.lower[0], first.upper[0], len(t))
    text = tr("Joint 1 alone, over its range (section 2.2)")
    motions.append(PlayedMotion("joint_1", text, t, q, beside=(q,), label=tr("Hand check: joint 1 alone")))
    signs = [tr("as printed"), tr("offset 2 = −90°")]
    return player(first, motions, beside=(beside,), signs=signs)


def _events(results: Path, tables: ArticleTables, name: str) -> list[PlayedEvent]:
    """Where one of both tables is singular on a path."""
    found = []
    for robot, sign in ((tables.printed, tr("as printed")), (tables.corrected, tr("offset 2 = −90°"))):
        for path in summary_of(results, robot, "trajectory").paths:
            for event in path.singularities if path.name == name else ():
                if event.crossing:
                    text = tr("{table}: singular ({type})", table=sign, type=event_word(event))
                    found.append(PlayedEvent(event.t_s, event.until_s, text, "caution"))
    return found
