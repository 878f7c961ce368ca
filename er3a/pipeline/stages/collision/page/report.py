"""The page of the collision stage."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from er3a.collision.pairs import TRIED
from er3a.kinematics.forward import skeleton
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import tr
from er3a.pipeline.messages.collision import state_word, why
from er3a.pipeline.messages.kinematics import branch_word
from er3a.pipeline.messages.left_out import body_word, pair_words
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import joined, say
from er3a.pipeline.player.player import drawing_head, moment, player
from er3a.pipeline.results import Stored
from er3a.pipeline.stages.collision import model
from er3a.pipeline.stages.collision.page.played import motions
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.figures import clearance_panels, equal_scale, new_figure
from er3a.pipeline.viewing.page import Picture, render_stage
from er3a.pipeline.viewing.palette import HIGHLIGHT, INK, LINK, MODEL, MUTED, REFERENCE, VERDICTS
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

MAX_PAIRS = 12
LOST, CLEAR, JOINED = 0, 1, 2


def by_pair(pairs: model.PairShares) -> Picture | None:
    """How much of joint space each pair takes; None where none takes any."""
    shown = pairs.take(np.flatnonzero(pairs.ratio > 0)[:MAX_PAIRS])
    if not len(shown):
        return None
    figure, ax = new_figure(width=9.0, height=0.8 + 0.28 * len(shown))
    y = np.arange(len(shown))[::-1]
    spread = 100 * np.abs(np.stack([shown.ratio - shown.low, shown.high - shown.ratio]))
    colours = [MODEL if own else REFERENCE for own in shown.of_itself]
    ax.barh(y, 100 * shown.ratio, color=colours, xerr=spread, ecolor=INK, height=0.7)
    ax.set_yticks(y, [say(pair) for pair in shown.between])
    ax.set_xlabel(tr("share of the joint space in which the pair overlaps (%)"))
    worst = say(shown.between[0])
    caption = tr(
        "{pair} collide most often: in {percent} % of the joint space. Blue: self-collision; orange: with the "
        "scene. Lines: 95 % intervals.",
        pair=worst[:1].upper() + worst[1:],
        percent=fixed(100 * shown.ratio[0], 1),
    )
    return Picture(figure, tr("Bars: share of joint space per pair. {conclusion}", conclusion=caption), caption)


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
    if results.summary.verdict.shapes:
        caption = tr(
            "Each square is a column of {cell:.0f} mm cells: the redder, the more of its reached cells are lost. Of "
            "{reached} cells reached, {clear} have a configuration that is clear of the assumed shapes, {joined} of "
            "these connected to home by a motion that is. In the others none was found in {tries} tries in all, so "
            "their volume of {lost} L overestimates the loss. Ringed: columns with collision-free cells that are not "
            "connected to home.",
            **numbers,
        )
    else:
        caption = tr(
            "Each square is a column of {cell:.0f} mm cells: the redder, the more of its reached cells are lost. Of"
            " {reached} cells reached, {clear} have a collision-free configuration (proven), {joined} of these "
            "connected to home by a proven motion. In the others none was found in {tries} tries in all, so their "
            "volume of {lost} L overestimates the loss. Ringed: columns with collision-free cells that are not "
            "connected to home.",
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
    colours = ListedColormap([_mixed(k / 20) for k in range(21)])
    mesh = ax.pcolormesh(
        *edges, 100 * share.T, cmap=colours, vmin=0, vmax=100, edgecolors="white", linewidth=0.3, rasterized=True
    )
    ringed = np.argwhere(apart > 0)
    ax.plot(*(low + cell * ringed).T, "o", markerfacecolor="none", markeredgecolor=HIGHLIGHT, markersize=5)
    return mesh


def _mixed(share: float) -> tuple[float, ...]:
    """From the colour of a pass to that of a fail."""
    ends = [np.array([int(VERDICTS[key][k : k + 2], 16) for k in (1, 3, 5)]) / 255 for key in ("pass", "fail")]
    return tuple(1 - (0.35 + 0.65 * share) * (1 - (1 - share) * ends[0] - share * ends[1]))


def clearance_over_time(results: model.CollisionResults) -> Picture | None:
    """Smallest distance over time, path by path."""
    rows = results.paths
    names = [str(name) for name in dict.fromkeys(rows.path) if np.isfinite(rows.clearance_mm[rows.path == name]).any()]
    if not names:
        return None
    figure, panels = clearance_panels(rows, names)
    met = [found.name for found in results.summary.closest if found.kind == "path" and found.clearance_mm < 0]
    caption = (
        tr("Below zero bodies overlap: {paths}.", paths=joined(met, ", "))
        if met
        else tr("No path reaches zero: the arm collides neither with its surroundings nor with itself.")
    )
    alt = tr("Clearance over time, one panel per path. {conclusion}", conclusion=caption)
    return Picture(figure, alt, caption, panels)


def closest_pair(robot: Robot, found: model.Closest) -> Picture:
    """The arm where it is nearest to anything, from the side and from above, with the two points."""
    points = skeleton(robot, meant(robot, np.array(found.q_deg))) * 1000
    pair = np.array([found.from_mm, found.to_mm])
    figure, views = _two_views(4.6)
    for ax, plane in views:
        ax.plot(*points[:, plane].T, color=LINK, linewidth=7, solid_capstyle="round", zorder=1)
        ax.plot(*points[:, plane].T, color=MUTED, linewidth=1, zorder=2)
        ax.plot(*pair[:, plane].T, "o-", color=HIGHLIGHT, markersize=5, zorder=3)
    caption = tr(
        "{name}: {pair}, {clearance} mm apart; the line joins the two nearest points of their surfaces.",
        name=found.name,
        pair=say(found.between),
        clearance=fixed(found.clearance_mm, 1),
    )
    if found.clearance_mm < 0:
        caption = tr(
            "{name}: {pair} overlap by {depth} mm; the line joins the points of deepest penetration.",
            name=found.name,
            pair=say(found.between),
            depth=fixed(-found.clearance_mm, 1),
        )
    return Picture(figure, caption, caption)


NO_BREAK_SPACE = "\u00a0"
MAX_ROWS = 100  # of a table of targets and paths
ALIKE_MM = 0.05  # clearances that differ by no more are shown as the same


def report(study: Study, stored: Stored[model.CollisionResults], output: Path) -> None:
    """Write the page from the stage's results."""
    name, results, summary = stored.robot, stored.results, stored.results.summary
    robot = study.robot(name)
    scene = study.scene(name, stored.stage)
    closest = sorted(summary.closest, key=lambda found: found.clearance_mm)
    nearest = closest[0] if closest else None
    render_stage(
        study,
        stored,
        output,
        matrix=_matrix(robot, results.matrix, results.summary.verdict.shapes is not None),
        tried=TRIED,
        by_pair=by_pair(results.pairs),
        pairs=_pairs(results.pairs),
        workspace=workspace(results),
        targets=target_rows(results.targets, {each.name: each.q_deg for each in closest if each.kind == "target"}),
        clearance=clearance_over_time(results),
        player=player(robot, motions(robot, results), scene),
        drawing_head=drawing_head(),
        closest=[_closest(found) for found in closest[:MAX_ROWS]],
        rows_left_out=max(len(closest), len(set(results.targets.target))) - MAX_ROWS,
        nearest=closest_pair(robot, nearest) if nearest else None,
        mounting=[_mounted(contact.solid, contact.depth_mm, contact.inside) for contact in summary.mounting],
    )


def _matrix(robot: Robot, rows: model.MatrixRows, assumed: bool) -> list[list[str]]:
    order = sorted(range(len(rows)), key=lambda k: model.STATES.index(rows.state[k]))
    return [
        [
            *(body_word(name).replace(" ", NO_BREAK_SPACE) for name in (rows.first[k], rows.second[k])),
            state_word(rows.state[k]),
            tr("yes") if rows.watched[k] else tr("no"),
            why(
                rows.state[k],
                rows.least_mm[k],
                rows.left_out_mm[k],
                int(rows.boxes[k]),
                _angles(robot, rows.witness_deg[k]),
                rows.reason[k],
                assumed=assumed,
            ),
        ]
        for k in order
    ]


def _angles(robot: Robot, values: Reals) -> str:
    """Joint values in words, each with its unit; empty where there are none."""
    if not np.isfinite(values).all():
        return ""
    return ", ".join(fixed(value, 0) + (" mm" if slides else "°") for value, slides in zip(values, robot.slides))


def _pairs(rows: model.PairShares) -> list[list[str]]:
    return [
        [say(pair), fixed(100 * ratio, 2), tr("{low} to {high}", low=fixed(100 * low, 2), high=fixed(100 * high, 2))]
        for pair, ratio, low, high in zip(rows.between, rows.ratio, rows.low, rows.high)
    ]


def target_rows(rows: model.TargetClearances, chosen: Mapping[str, tuple[float, ...]]) -> list[list[str]]:
    """One row for each target: branches within limits, clear ones, the best clearance and its branch.

    Of many targets those whose best clearance is smallest. Of branches that are alike the ``chosen`` one is named, by
    joint values.
    """
    names, first, group = np.unique(rows.target.astype(str), return_index=True, return_inverse=True)
    most = np.full(len(names), -np.inf)
    np.maximum.at(most, group, rows.clearance_mm)
    kept = np.argsort(most, kind="stable")[:MAX_ROWS]
    found = []
    for name in names[kept[np.argsort(first[kept])]]:
        own = rows.take(rows.target == name)
        alike = np.flatnonzero(own.clearance_mm >= own.clearance_mm.max() - ALIKE_MM)
        away = np.abs(own.q_deg[alike] - chosen[name]).max(axis=1) if name in chosen else np.zeros(len(alike))
        best = int(alike[away.argmin()])
        branches, equal = len(set(own.branch.tolist())), len(set(own.branch[alike].tolist()))
        branch = branch_word(own.label[best], int(own.branch[best]))
        found.append(
            [
                str(name),
                str(branches),
                str(len(set(own.branch[own.clearance_mm >= 0].tolist()))),
                fixed(own.clearance_mm[best], 1),
                branch if equal == 1 else tr("{branch} ({count} branches are alike)", branch=branch, count=equal),
                _between(own.between[best]),
            ]
        )
    return found


def _between(label: str) -> str:
    return pair_words(label) if label else tr("nothing")


def _closest(found: model.Closest) -> list[str]:
    kind = tr("chosen solution of a target") if found.kind == "target" else tr("path")
    at = "" if found.t_s is None else moment(found.name, found.t_s, tr("t = {t} s", t=fixed(found.t_s, 2)))
    return [found.name, kind, fixed(found.clearance_mm, 1), at, say(found.between)]


def _mounted(solid: str, depth_mm: float, inside: bool) -> str:
    if inside:
        return tr("The base's middle lies in {own_name}.", own_name=solid)
    return tr(
        "The base overlaps {own_name} by {depth} mm or more in every pose; this is taken to be its mounting.",
        own_name=solid,
        depth=fixed(depth_mm, 1),
    )
