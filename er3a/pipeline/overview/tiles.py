"""The index's tiles: which numbers are wrong, which paths may run, where the tray goes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from er3a.collision.scene import Scene
from er3a.pipeline.language import own_title, tr
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.workspace import millimetres
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.trajectory.model import TrajectoryResults
from er3a.pipeline.stages.trajectory.page.report import path_groups
from er3a.pipeline.stages.validation.model import ValidationResults
from er3a.pipeline.stages.validation.page.evidence_section import OTHER_COLUMNS, evidence_section
from er3a.pipeline.stages.workspace.model import WorkspaceResults
from er3a.pipeline.stages.workspace.page.tray import Placing, placing_of
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Group
from er3a.pipeline.viewing.drawn import outlines
from er3a.robots.robot import Robot

Results = Mapping[str, Stored[Any]]
AROUND = 1.15  # of the reach, that the view from above shows


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
    drawing = _from_above(robot, results, study.scene(name, "capability"), placing)
    answer = tr("Centre {centre} mm.", centre=millimetres(placing.tray.place.centre_m))
    return Tile(tr("Where does the tray go?"), answer, f"{name}/workspace.html#placement", name, drawing=drawing)


def _from_above(robot: Robot, results: WorkspaceResults, scene: Scene | None, placing: Placing) -> Markup:
    """The reach of axis 1, what stands around the arm, and the tray, y to the left of x."""
    reach = 1000 * results.summary.reach_m.furthest_from_axis
    low, high = float(robot.lower[0]), float(robot.upper[0])
    letters, size = 0.075 * reach, AROUND * reach
    parts = [Markup('<path class="reached" d="{}"/>').format(_sector(reach, low, high))]
    for solid in scene.solids if scene else ():
        if not (seen := [1000 * corners for corners in outlines(solid, [0, 1])]):
            continue
        parts += [Markup('<polygon class="solid" points="{}"/>').format(_seen(corners)) for corners in seen]
        parts.append(_word(np.concatenate(seen).mean(axis=0), letters, own_title(solid.name), ""))
    bottom, top = (1000 * corner for corner in placing.tray.corners)
    corners = np.array([[bottom[0], bottom[1]], [top[0], bottom[1]], [top[0], top[1]], [bottom[0], top[1]]])
    parts.append(Markup('<polygon class="tray" points="{}"/>').format(_seen(corners)))
    parts.append(_word(np.array([top[0] + letters, (bottom + top)[1] / 2]), letters, tr("tray"), "tray"))
    parts.append(Markup('<circle class="base" cx="0" cy="0" r="{:.0f}"/>').format(0.06 * reach))
    box = f"{-size:.0f} {-size:.0f} {2 * size:.0f} {2 * size:.0f}"
    said = tr("From above: what axis 1 sweeps, what stands there, and the tray, {far} mm at most", far=fixed(reach, 0))
    return Markup('<svg class="plan-view" viewBox="{}" role="img" aria-label="{}">{}</svg>').format(
        box, said, Markup("").join(parts)
    )


def _sector(radius: float, low: float, high: float) -> str:
    """What an arm that turns from ``low`` to ``high`` (rad) sweeps."""
    turn = np.linspace(low, min(high, low + 2 * np.pi), 73)
    arc = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    centre = "" if high - low >= 2 * np.pi - 1e-6 else "M0,0 L"
    return f"{centre or 'M'}{_seen(arc)}Z"


def _seen(points: Any) -> str:
    return " ".join(f"{x:.0f},{-y:.0f}" for x, y in points)


def _word(at: Any, letters: float, text: str, kind: str) -> Markup:
    return Markup('<text class="{}" x="{:.0f}" y="{:.0f}" font-size="{:.0f}">{}</text>').format(
        kind, at[0], -at[1], letters, text
    )
