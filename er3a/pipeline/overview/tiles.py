"""The index's tiles: which numbers are wrong, which paths and programs fail, where the tray goes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from er3a.by_value import frozen
from er3a.pipeline.language import tr
from er3a.pipeline.messages.dynamics import payload_key
from er3a.pipeline.messages.say import joined
from er3a.pipeline.overview.glances import glance
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.programs.model import ProgramsResults
from er3a.pipeline.stages.programs.page.report import programs_answer
from er3a.pipeline.stages.trajectory.page.report import paths_answer
from er3a.pipeline.stages.validation.model import ValidationResults
from er3a.pipeline.stages.validation.page.evidence_section import evidence_section, known_alone
from er3a.pipeline.stages.workspace.page.from_above import from_above
from er3a.pipeline.stages.workspace.page.tray import placing_of
from er3a.pipeline.stages.workspace.page.workspace_figures import about, if_normal, void_name
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import ListRow, Mark

Results = Mapping[str, Stored[Any]]
FEW, ROOMY = 10, 8  # rows of a tile that are seen whole on the first screen, and with room for the rest
LETTERS = 0.14  # of the reach, in the small view from above


@frozen
class Tile:
    """An answer, which leads to its page, and its picture.

    ``asked``: what it answers, by ``answer``, in the colour of ``mark``. ``entries``, the first ``rows`` of ``all``
    below a ``heading`` with ``sound``, names that are none of them, ``drawing`` with ``keys``: what is shown, one of
    them.
    """

    asked: str
    answer: str
    mark: Mark
    address: str
    entries: Mapping[str, Any] | None = None
    rows: Sequence[ListRow] = ()
    all: int = 0
    heading: str = ""
    sound: str = ""
    drawing: str = ""
    keys: Sequence[tuple[str, str]] = ()


def first_with(stage: str, names: Iterable[str], stored: Mapping[str, Results]) -> str | None:
    """The first of these robots whose stage was computed; None where none was."""
    return next((name for name in names if stage in stored[name] and glance(stored[name][stage].results)[0]), None)


def table_tile(name: str, stored: Results) -> Tile | None:
    """Which entries of a robot's table evidence contradicts or leaves open; None where no document speaks of it.

    Parameters
    ----------
    stored : results of the robot's stages
    """
    results = stored["validation"].results if "validation" in stored else None
    if not isinstance(results, ValidationResults) or results.summary.evidence is None:
        return None
    evidence = results.summary.evidence
    bad = evidence.contradicted
    answer = (
        tr("{count} of {all} contradicted: given → instead.", count=bad, all=known_alone(evidence))
        if bad
        else tr("{count} numbers not settled", count=len(evidence.unconfirmed))
    )
    mark: Mark = "fail" if bad else "caution" if evidence.unconfirmed else "pass"
    entries = evidence_section(evidence)
    return Tile(tr("Which numbers are wrong?"), answer, mark, f"{name}/validation.html", entries)


def motions_tile(study: Study, name: str, found: Stored[Any]) -> Tile:
    """How many paths or programs of a robot pass, and the others, if any, each with its bar over time.

    Parameters
    ----------
    found : of the stage trajectory or programs
    """
    results = found.results
    of_program = isinstance(results, ProgramsResults)
    answer, what = (programs_answer, tr("programs")) if of_program else (paths_answer, tr("paths"))
    said = answer(study.robot(name), results)
    sound: Mark = "pass" if results.summary.verdict.status == "pass" else "caution"
    rows = sorted((row for group in said.groups for row in group.rows), key=lambda row: row.mark != "fail")
    others = [row for row in rows if row.mark != "pass"] or rows
    has_room = others is not rows and len(others) <= ROOMY
    passing = joined([row.name for row in rows if row.mark == "pass"], ", ") if has_room else ""
    page = f"{name}/{found.stage}.html"
    asked = tr("Which {what} pass?", what=what)
    return Tile(asked, said.headline, sound, page, rows=others[:FEW], all=len(others), heading=said.rest, sound=passing)


def tray_tile(study: Study, name: str, stored: Results) -> Tile | None:
    """Where the tray goes, from above; None where it is not asked for or goes nowhere."""
    placing = placing_of(study, stored["workspace"])
    if placing is None:
        return None
    robot, results = study.robot(name), stored["workspace"].results
    drawing = from_above(robot, results, study.scene(name, "capability"), placing.tray, LETTERS)
    known = stored["dynamics"].results.summary if "dynamics" in stored else None
    voids = [(about(void), if_normal(void, void_name(k, void))) for k, void in enumerate(results.summary.voids, 1)]
    keys, page = [payload_key(known, robot), *voids[:2]], f"{name}/workspace.html"
    return Tile(tr("Where the tray goes"), placing.tray.place_text, "pass", page, drawing=drawing, keys=keys)
