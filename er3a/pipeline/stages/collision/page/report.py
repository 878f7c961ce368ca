"""The page of the collision stage."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from er3a.collision.pairs import TRIED
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import tr, with_unit
from er3a.pipeline.messages.collision import HOMES, state_word, why
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import joined, say, word
from er3a.pipeline.messages.scope import body_word
from er3a.pipeline.player.player import drawing_head, player
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.collision import model
from er3a.pipeline.stages.collision.page.played import motions, poses
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.answer import Answer, Group, ListRow, Mark
from er3a.pipeline.viewing.figures import equal_scale, new_figure
from er3a.pipeline.viewing.page import Picture, render_stage
from er3a.pipeline.viewing.palette import HIGHLIGHT, VERDICTS
from er3a.robots.robot import Robot

LOST, CLEAR, JOINED = 0, 1, 2


def most_often(pairs: model.PairShares) -> str:
    """The pair that takes the largest part of joint space; empty where none takes any."""
    if not len(pairs) or not pairs.ratio[0]:
        return ""
    worst, percent = say(pairs.between[0]), fixed(100 * pairs.ratio[0], 1)
    return tr("{pair} overlap most often, in {percent} % of it.", pair=worst[:1].upper() + worst[1:], percent=percent)


def _two_views(height: float) -> tuple[Figure, list[tuple[Axes, list[int]]]]:
    """A figure with a drawing from the side and one from above, each with the numbers of its coordinates."""
    figure, axes = new_figure(1, 2, width=11.0, height=height)
    for ax, up, title in zip(axes, (tr("z (mm)"), tr("y (mm)")), (tr("From the side"), tr("From above"))):
        equal_scale(ax, tr("x (mm)"), up)
        ax.set_title(title)
    return figure, list(zip(axes, ([0, 2], [0, 1])))


def workspace(results: model.CollisionResults) -> Picture:
    """From the side and from above: what of the reached places is clear, joined to home, or lost."""
    rows = results.places
    state = np.where(rows.joined, JOINED, np.where(rows.clear, CLEAR, LOST))
    figure, views = _two_views(5.2)
    cell = results.summary.places.cell_m * 1000
    for ax, plane in views:
        mesh = _columns(ax, rows.middle_mm[:, plane], state, cell)
    figure.colorbar(mesh, ax=figure.axes[:2], label=tr("reached cells lost to collisions (%)"), shrink=0.8)
    found = results.summary.places
    numbers = {
        "cell": cell,
        "reached": found.reached,
        "clear": found.clear,
        "joined": found.joined,
        "tries": found.tries_in_lost,
        "lost": fixed(found.lost_m3 * 1000, 0),
    }
    caption = tr(
        "Each square is a column of {cell:.0f} mm cells: the redder, the more of its reached cells are lost. Of "
        "{reached} cells reached, {clear} have a collision-free configuration, {joined} of these connected to home by "
        "a motion that is. In the others none was found in {tries} tries in all, so their volume of {lost} L "
        "overestimates the loss. Ringed: columns with collision-free cells that are not connected to home.",
        **numbers,
    )
    return Picture(figure, tr("Two views of the cells reached. {conclusion}", conclusion=caption), caption)


def _columns(ax, at: np.ndarray, state: np.ndarray, cell: float) -> QuadMesh:
    """One square for each column of cells: the share that is lost as its shade, a ring where some is not joined."""
    low = at.min(axis=0)
    index = np.round((at - low) / cell).astype(int)
    size = index.max(axis=0) + 1
    count, lost, apart = np.zeros((3, *size))
    np.add.at(count, tuple(index.T), 1)
    np.add.at(lost, tuple(index[state == LOST].T), 1)
    np.add.at(apart, tuple(index[state == CLEAR].T), 1)
    share = np.where(count > 0, lost / np.maximum(count, 1), np.nan)
    edges = [low[k] + cell * (np.arange(size[k] + 1) - 0.5) for k in (0, 1)]
    colours = LinearSegmentedColormap.from_list("lost", [VERDICTS["pass"], VERDICTS["fail"]], 21)
    mesh = ax.pcolormesh(
        *edges, 100 * share.T, cmap=colours, vmin=0, vmax=100, edgecolors="white", linewidth=0.3, rasterized=True
    )
    ringed = np.argwhere(apart > 0)
    ax.plot(*(low + cell * ringed).T, "o", markerfacecolor="none", markeredgecolor=HIGHLIGHT, markersize=5)
    return mesh


NO_BREAK_SPACE = "\u00a0"
MAX_ROWS = 100  # of the list of targets and paths


def report(study: Study, stored: Stored[model.CollisionResults], output: Path) -> None:
    """Write the page from the stage's results."""
    name, results, summary = stored.robot, stored.results, stored.results.summary
    robot = study.robot(name)
    scene = study.scene(name, stored.stage)
    closest = sorted(summary.closest, key=lambda found: found.clearance_mm)
    worst = next(((found.name, found.t_s) for found in closest if found.t_s is not None), None)
    render_stage(
        study,
        stored,
        output,
        _answer(summary, closest, _unreached(results.paths)),
        matrix=_matrix(robot, results.matrix),
        never=int((results.matrix.state == "never").sum()),
        tried=TRIED,
        most_often=most_often(results.pairs),
        workspace=workspace(results),
        player=player(robot, [*motions(robot, results), *poses(robot, results)], scene, opened=worst),
        drawing_head=drawing_head(),
        home=_angles(robot, np.array(summary.home_deg)) if summary.home_deg else "",
        home_from=word("collision.home", HOMES, summary.home_from),
        mounting=[_mounted(contact.solid, contact.depth_mm, contact.inside) for contact in summary.mounting],
    )


def _unreached(paths: model.PathClearances) -> set[str]:
    """Names of paths of which a part can't be reached, and is therefore clear of nothing."""
    return set(paths.path[np.isnan(paths.q_deg).any(axis=1)].tolist())


def _answer(summary: model.CollisionSummary, closest: Sequence[model.Closest], unreached: set[str]) -> Answer:
    """How much of the joint space is free, and how near each path and chosen solution comes to anything.

    ``unreached``: of some paths only a part was measured.
    """
    found = {figure.name: figure.value for figure in summary.figures}
    free, places = found.get("free_of_collisions"), summary.places
    share = with_unit(fixed(float(free), 0), "%") if free is not None else ""
    headline = tr("{share} of joint space is free.", share=share) if share else tr("Collisions checked.")
    touch = sum(each.clearance_mm < 0 for each in closest)
    rest = tr("{count} of {all} motions collide.", count=touch, all=len(closest)) if closest else ""
    keys = [(with_unit(fixed(1000 * places.lost_m3, 0), "L"), tr("reach lost to collisions, at most"))]
    groups = (
        Group(tr("Paths"), [_row(each, unreached) for each in closest[:MAX_ROWS] if each.kind == "path"]),
        Group(tr("Targets"), [_row(each, set()) for each in closest[:MAX_ROWS] if each.kind == "target"]),
    )
    return Answer(headline, rest, "", keys, groups)


def _row(found: model.Closest, unreached: set[str]) -> ListRow:
    """A path or chosen solution: how near it comes, and to what."""
    note = tr("{far} mm: {pair}", far=fixed(found.clearance_mm, 1), pair=say(found.between))
    mark: Mark = "fail" if found.clearance_mm < 0 else "pass"
    if mark == "pass" and found.name in unreached:
        mark, note = "none", joined([note, tr("not all of it is reached")], ", ")
    return ListRow(mark, found.name, note, play=(found.name, found.t_s or 0.0))


def _matrix(robot: Robot, rows: model.MatrixRows) -> list[list[str]]:
    told = [k for k in range(len(rows)) if rows.state[k] != "never"]
    order = sorted(told, key=lambda k: model.STATES.index(rows.state[k]))
    return [
        [
            *(body_word(name).replace(" ", NO_BREAK_SPACE) for name in (rows.first[k], rows.second[k])),
            state_word(rows.state[k]),
            tr("yes") if rows.watched[k] else tr("no"),
            why(
                rows.state[k],
                radius=float(rows.left_out_mm[k]),
                boxes=int(rows.boxes[k]),
                witness=_angles(robot, rows.witness_deg[k]),
                reason=rows.reason[k],
            ),
        ]
        for k in order
    ]


def _angles(robot: Robot, values: Reals) -> str:
    """Joint values in words, each with its unit; empty where there are none."""
    if not np.isfinite(values).all():
        return ""
    return ", ".join(fixed(value, 0) + (" mm" if slides else "°") for value, slides in zip(values, robot.slides))


def _mounted(solid: str, depth_mm: float, inside: bool) -> str:
    if inside:
        return tr("The base's middle lies in {own_name}.", own_name=solid)
    return tr(
        "The base overlaps {own_name} by {depth} mm or more in every pose; this is taken to be its mounting.",
        own_name=solid,
        depth=fixed(depth_mm, 1),
    )
