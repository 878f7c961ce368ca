"""The index's tiles: which numbers are wrong, which paths may run, where the tray goes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from er3a.pipeline.language import tr
from er3a.pipeline.messages.dynamics import payload_key
from er3a.pipeline.messages.workspace import millimetres
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.trajectory.model import TrajectoryResults
from er3a.pipeline.stages.trajectory.page.report import path_groups
from er3a.pipeline.stages.validation.model import ValidationResults
from er3a.pipeline.stages.validation.page.evidence_section import OTHER_COLUMNS, evidence_section
from er3a.pipeline.stages.workspace.model import WorkspaceResults
from er3a.pipeline.stages.workspace.page.from_above import from_above
from er3a.pipeline.stages.workspace.page.tray import placing_of
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Group

Results = Mapping[str, Stored[Any]]
LETTERS = 0.14  # of the reach, in the small view from above


@dataclass(frozen=True)
class Tile:
    """A question, its picture, and its answer, which leads to the page.

    ``entries``, ``groups``, ``drawing``: what is shown, one of them.
    """

    title: str
    answer: str
    address: str
    robot: str
    entries: Mapping[str, Any] | None = None
    groups: Sequence[Group] = ()
    drawing: str = ""


def first_with(stage: str, names: Iterable[str], stored: Mapping[str, Results]) -> str | None:
    """The first of these robots whose stage was computed; None where none was."""
    return next((name for name in names if stage in stored[name] and _is_there(stored[name][stage])), None)


def _is_there(found: Stored[Any]) -> bool:
    return isinstance(found.results, TrajectoryResults | WorkspaceResults)


def table_tile(study: Study, name: str, stored: Results) -> Tile | None:
    """Which entries of a robot's table evidence contradicts or leaves open; None where no document speaks of it.

    Parameters
    ----------
    stored : results of the robot's stages
    """
    results = stored["validation"].results if "validation" in stored else None
    if not isinstance(results, ValidationResults) or results.summary.evidence is None:
        return None
    evidence = results.summary.evidence
    entries, bad = evidence_section(study.robot(name), evidence, OTHER_COLUMNS), evidence.contradicted
    count = sum(each.value is not None for each in evidence.entries)
    title = tr("Which numbers are wrong?")
    answer = (
        tr("{robot}: {count} of {all} contradicted, limits included.", robot=name, count=bad, all=count)
        if bad
        else tr("{robot}: none; {count} unconfirmed.", robot=name, count=len(evidence.unconfirmed))
    )
    return Tile(title, answer, f"{name}/validation.html", name, entries=entries)


def paths_tile(study: Study, name: str, stored: Results) -> Tile | None:
    """Which paths of a robot may run."""
    results = stored["trajectory"].results
    if not isinstance(results, TrajectoryResults):
        return None
    groups = path_groups(study.robot(name), results)
    bad, mended, sound = (len(group.rows) for group in groups)
    answer = tr("{sound} run, {mended} repaired, {bad} don't.", sound=sound, mended=mended, bad=bad)
    return Tile(tr("Which paths may run?"), answer, f"{name}/trajectory.html", name, groups=groups)


def tray_tile(study: Study, name: str, stored: Results) -> Tile | None:
    """Where the tray goes, from above; None where it is not asked for or goes nowhere."""
    placing = placing_of(study, stored["workspace"])
    if placing is None:
        return None
    robot, results = study.robot(name), stored["workspace"].results
    drawing = from_above(robot, results, study.scene(name, "capability"), [placing.tray], LETTERS)
    known = stored["dynamics"].results.summary if "dynamics" in stored else None
    carried, _ = payload_key(known, robot)
    answer = tr("At {centre} mm; payload {kg}.", centre=millimetres(placing.tray.place.centre_m), kg=carried)
    return Tile(tr("Where does the tray go?"), answer, f"{name}/workspace.html", name, drawing=drawing)
