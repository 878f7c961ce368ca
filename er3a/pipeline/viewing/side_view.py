"""Arms from the side, at one scale, with what they reach: one drawing that follows the page's colours."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal

import numpy as np
from markupsafe import Markup

from er3a.by_value import by_identity
from er3a.kinematics.chain import ALONG_Z, TO_NEXT_AXIS, link_parts
from er3a.kinematics.forward import frames, skeleton
from er3a.numerics.arrays import Integers, Reals
from er3a.pipeline.language import tr, with_unit
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import joined
from er3a.robots.robot import Robot

Kind = Literal["right", "wrong"]
LabelKind = Literal["wrong", "open", "hole", "right", "sound"]
MARGIN = 0.06  # of the larger side
UPRIGHT = 0.83  # width of a drawing, of its height
LABEL, SCALE = 0.28, 0.05  # of the height: room for labels at the right, for the scale below
LETTERS = 0.021  # of the height: of a line's word
SIDES = np.array(
    [(0, 1.4), (1.9, 0), (0, -1.4)]
)  # of these, from a line to its word: not to the left, where the drawing ends
BETWEEN = 20  # points of a link that words keep off
GAP = 0.045  # of the height, between two labels
TICK = 0.02  # of a dimension, half of what ends it
COLUMN = 0.1  # of the size of what is drawn, from there to a column of labels
SEEN_MM = 2.0  # by which two arms differ in a drawing
ON_AXIS_MM = 1e-6
# From where to where an entry of a row is seen, in shares of its way along its axis and of that to the next one.
AT_JOINT = ((0.66, 0.0), (0.66, 0.0))
SEEN_AT = {"d": ((0.0, 0.0), (1.0, 0.0)), "a": ((1.0, 0.0), (1.0, 1.0))}
SEEN_AT |= dict.fromkeys(("alpha", "beta", "offset"), ((1.0, 0.0), (1.0, 0.0)))
BONE, THINNER = 0.045, 0.6  # an arm's thickness, of the height of what is drawn, and a wrong arm's of that over another
THICKEST = 0.13  # of the arm's own extent
SCALES_MM = (100, 200, 500, 1000, 2000)


SMOOTHED = 16  # times that a corner of an outline goes to the middle between it and the next


@by_identity
class SeenArm:
    """An arm from the side.

    Attributes
    ----------
    title, note : in a corner of the drawing, in the arm's colour
    kind : of its colour
    points_mm : (k, 2), the joints' places from the base to the flange: forward, up
    reach_mm : outlines (m, 2) of what the tool point reaches
    """

    title: str
    note: str
    kind: Kind
    points_mm: Reals
    reach_mm: Sequence[Reals] = ()


@by_identity
class Label:
    """A word at a place (2,), mm, in the colour of its kind.

    Attributes
    ----------
    name : by which an address on the page leads to it, or the entry of the table that it is of
    start : (2,), mm, from where a dashed line leads to the place; None for none
    """

    text: str
    at: Reals
    kind: LabelKind
    name: str = ""
    start: Reals | None = None


@by_identity
class DrawnLine:
    """A line over the arms: points (k, 2), mm, the class of its look, the entry of the table that it is of, and a word
    near it, where there is room."""

    points: Reals
    look: str
    entry: str = ""
    word: str = ""


def seen_arm(
    robot: Robot, title: str, note: str, kind: Kind = "right", reach_mm: Sequence[Reals] = (), q: Reals | None = None
) -> SeenArm:
    """An arm at joint values (n,), rad or m, or else with all joints at 0, seen along y of the frame that its base is
    placed in."""
    q = np.zeros(robot.joints) if q is None else q
    return SeenArm(title, note, kind, skeleton(robot, q)[:, ::2] * 1000, reach_mm)


def entry_lines(robot: Robot, entries: Iterable[str], q: Reals) -> dict[str, Reals]:
    """As :func:`entry_places`, from the side (2, 2), mm."""
    return {entry: place[:, ::2] for entry, place in entry_places(robot, entries, q).items()}


def entry_places(robot: Robot, entries: Iterable[str], q: Reals) -> dict[str, Reals]:
    """From where to where entries such as ``d4`` are seen (2, 3), mm, at joint values (n,), rad or m: a length along
    its link, an angle at the end of its row, all else at the middle of its axis."""
    parts, T, found = link_parts(robot), frames(robot, q), {}
    for entry in entries:
        column = entry.rstrip("0123456789")
        row = int(entry.removeprefix(column))
        local = SEEN_AT.get(column, AT_JOINT) @ parts[row, [ALONG_Z, TO_NEXT_AXIS], :3, 3]
        found[entry] = 1000 * (local @ T[row - 1, :3, :3].T + T[row - 1, :3, 3])
    return found


def flanges_off(arms: Sequence[SeenArm]) -> list[Label]:
    """How far the flange of the last arm is off that of the first; nothing of arms whose flanges are the same."""
    right, wrong = arms[0].points_mm[-1], arms[-1].points_mm[-1]
    far = float(np.linalg.norm(right - wrong))
    off = tr("flange {off} off", off=with_unit(fixed(far, 0), "mm"))
    return [Label(off, right, "wrong", start=wrong)] if far > SEEN_MM else []


def through_floor(arms: Sequence[SeenArm], floor_mm: float | None) -> list[Label]:
    """A word at the lowest point of each arm that is lower than the floor; None: there is no floor."""
    lowest = [arm.points_mm[arm.points_mm[:, 1].argmin()] for arm in arms]
    aside, said = [BONE * float(np.ptp(_corners(arms)[:, 1])), 0.0], tr("through the floor")
    return [Label(said, at + aside, "wrong", start=at) for at in lowest if floor_mm is not None and at[1] < floor_mm]


def dimension(far: float, low: float, high: float, kind: LabelKind) -> list[DrawnLine]:
    """A dimension at the height ``low``, from axis 1 to ``far`` in front of it, with a tick at both ends, and a dashed
    line from its end up to ``high``; all in mm. As ``over`` of :func:`side_view` takes it."""
    tick = TICK * far
    ends = np.array([(0.0, low + tick), (0.0, low - tick), (0.0, low), (far, low), (far, low - tick)])
    upwards = np.array([(far, low), (far, high)])
    return [DrawnLine(ends, f"dimension {kind}"), DrawnLine(upwards, f"dimension far {kind}")]


def beyond(arms: Sequence[SeenArm]) -> float:
    """How far forward (mm) there is room for words: beyond the arms and what they reach, so that no outline of
    these crosses a word."""
    corners = _corners(arms)
    return float(corners[:, 0].max() + COLUMN * np.ptp(corners, axis=0).max())


def _corners(arms: Sequence[SeenArm]) -> Reals:
    """All arms' points and what they reach (k, 2), mm."""
    return np.concatenate([each for arm in arms for each in (arm.points_mm, *arm.reach_mm)])


def side_view(
    arms: Sequence[SeenArm],
    floor_mm: float | None = None,
    *,
    ratio: float,
    labels: Sequence[Label] = (),
    column_mm: float | None = None,
    over: Sequence[DrawnLine] = (),
) -> Markup:
    """The drawing as HTML: an SVG, and over it words that are as large as the page's.

    Parameters
    ----------
    arms : drawn in this order, later ones over earlier ones
    floor_mm : height of the floor; None where there is none
    ratio : width of the drawing, of its height
    labels : moved up or down where they would be on each other
    column_mm : how far forward all labels begin, each with a line to its place; None for labels at their places
    over : lines over the arms

    Returns
    -------
    drawing : colours come from the page's style sheet
    """
    # What another arm reaches may go beyond the drawing's edge: the arms are what is to be seen.
    corners = np.concatenate(
        [_corners(arms[:1]), *(arm.points_mm for arm in arms[1:]), *(line.points for line in over)]
    )
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = MARGIN * float(max(high - low))
    low, high = low - margin, high + margin
    tall = float(high[1] - low[1])
    low[1] -= SCALE * tall
    for label in labels:
        across = _across(label, column_mm)
        high[0] = max(high[0], across + LABEL * max(tall, (across - low[0]) / (ratio - LABEL)))
    wide, tall = high - low
    spare = np.maximum(0.0, [ratio * tall - wide, wide / ratio - tall]) / 2
    low, high = low - spare, high + spare
    wide, tall = high - low
    parts = [_reach(arm) for arm in arms]
    if floor_mm is not None:
        floor = '<rect class="floor" x="{:.0f}" y="{:.0f}" width="{:.0f}" height="{:.0f}"/>'
        parts.append(Markup(floor).format(low[0] - wide, -floor_mm, 3 * wide, 3 * tall))
        below = np.array([low[0], floor_mm - GAP * tall])
        parts.append(_text("floor", below, 1.25 * LETTERS * tall, tr("floor")))
    placed = _placed(labels, low, high, column_mm)
    thick = min(BONE * tall, THICKEST * float(np.ptp(arms[0].points_mm, axis=0).max()))
    parts += [_arm(arm, thick * (THINNER if k else 1.0)) for k, arm in enumerate(arms)]
    parts += [_lead(k, *each, LETTERS * tall) for k, each in enumerate(placed, 1)]
    parts += _over(arms, over, LETTERS * tall)
    said = joined(joined((arm.title, arm.note), ", ") for arm in arms)
    drawn = Markup('<svg viewBox="{:.0f} {:.0f} {:.0f} {:.0f}" role="img" aria-label="{}">{}</svg>').format(
        low[0], -high[1], wide, tall, said, Markup("").join(parts)
    )
    length = max((each for each in SCALES_MM if each < wide / 3), default=SCALES_MM[0])
    scale = Markup('<span class="scale" style="width: {:.2f}%">{}</span>').format(
        100 * length / wide, tr("{length} mm", length=length)
    )
    words = [_word(label, (place - low) / [wide, tall]) for label, place in placed]
    return Markup('<div class="arms" style="--ratio: {:.3f}">{}<div class="drawn">{}{}{}</div></div>').format(
        wide / tall, Markup("").join(map(_name, arms)), drawn, Markup("").join(words), scale
    )


def _over(arms: Sequence[SeenArm], lines: Sequence[DrawnLine], letters: float) -> list[Markup]:
    """Lines, and the word of each on that side of it which is farthest from arms and the words of those before it."""
    taken = [np.linspace(arm.points_mm[:-1], arm.points_mm[1:], BETWEEN).reshape(-1, 2) for arm in arms]
    found = []
    for line in lines:
        drawn = Markup('<polyline points="{}"/>').format(_line(line.points))
        if line.word:
            low, high = line.points.min(axis=0), line.points.max(axis=0)
            places = (low + high) / 2 + letters * SIDES + np.sign(SIDES) * (high - low) / 2
            others = np.concatenate(taken)
            at = max(places, key=lambda place: np.linalg.norm(others - place, axis=1).min())
            taken.append(at[None])
            drawn += _text("", at, letters, line.word)
        found.append(Markup('<g class="{}" data-entry="{}">{}</g>').format(line.look, line.entry, drawn))
    return found


def _name(arm: SeenArm) -> Markup:
    return Markup('<p class="{}"><b>{}</b> {}</p>').format(arm.kind, arm.title, arm.note)


def _placed(labels: Sequence[Label], low: Reals, high: Reals, column_mm: float | None) -> list[tuple[Label, Reals]]:
    """Labels from above, each with where it is written (2,), mm: none on another, none below the drawing."""
    # Of those at one height the farthest from the column is written first: their lines don't cross.
    order = sorted(labels, key=lambda each: (-round(each.at[1]), each.at[0]))
    gap, below, above = GAP * (high[1] - low[1]), low[1], high[1]
    heights = [below := max(below + gap, float(label.at[1])) for label in reversed(order)][::-1]
    for k in range(len(order)):
        above = heights[k] = min(above - gap, heights[k])
    return list(zip(order, np.column_stack([[_across(label, column_mm) for label in order], heights])))


def _across(label: Label, column_mm: float | None) -> float:
    """How far forward (mm) a label begins."""
    return float(label.at[0]) if column_mm is None else column_mm


def _lead(number: int, label: Label, place: Reals, letters: float) -> Markup:
    """The line of a label: from its start, or to where it is written if that is not its place. Its number there is seen
    where labels are a list."""
    if label.start is None and place[0] == label.at[0]:
        return Markup("")
    start, dashed = (label.at, "") if label.start is None else (label.start, "dashed")
    line = Markup('<polyline class="lead {} {}" points="{}"/>')
    return line.format(label.kind, dashed, _line([start, label.at, place])) + _text(
        label.kind, start, 2 * letters, str(number)
    )


def _text(kind: str, at: Reals, letters: float, text: str) -> Markup:
    """A word in the drawing, in the middle of a place."""
    word = '<text class="{}" x="{:.0f}" y="{:.0f}" font-size="{:.0f}">{}</text>'
    return Markup(word).format(kind, at[0], letters / 3 - at[1], letters, text)


def _word(label: Label, share: Reals) -> Markup:
    """A label, at its place in parts of the drawing."""
    word = '<span class="label {}" data-entry="{}" style="left: {:.1f}%; bottom: {:.1f}%">{}</span>'
    return Markup(word).format(label.kind, label.name, *(100 * share), label.text)


def _line(points: Iterable[Reals]) -> str:
    return " ".join(f"{x:.0f},{-z:.0f}" for x, z in points)


def _reach(arm: SeenArm) -> Markup:
    """What is reached, in one path, so that rings within rings let the colour of holes through."""
    rings = [_line(ring) for ring in arm.reach_mm]
    inner = sorted(arm.reach_mm, key=lambda ring: ring[:, 0].max())[:-1]
    hole = Markup('<polygon class="hole {}" points="{}"/>')
    holes = Markup("").join(hole.format(arm.kind, _line(ring)) for ring in inner)
    outline = " ".join(f"M{ring}Z" for ring in rings)
    return holes + Markup('<path class="reach {}" fill-rule="evenodd" d="{}"/>').format(arm.kind, outline)


def border_lines(arc: Integers, rho_m: Reals, z_m: Reals) -> list[Reals]:
    """The outline of a section about axis 1 on both sides of the axis.

    Parameters
    ----------
    arc : (k,) number of the line that each point is of, which is closed or goes from axis 1 to axis 1
    rho_m, z_m : (k,) its distance from the axis, and its height, m

    Returns
    -------
    rings : (m, 2) each, mm, without the steps of the cells
    """
    rings: list[Reals] = []
    for each in np.unique(arc):
        ring = 1000 * np.stack([rho_m[arc == each], z_m[arc == each]], axis=1)
        mirrored = ring * [-1, 1]
        if ring[[0, -1], 0].max() < ON_AXIS_MM:
            rings.append(np.concatenate([ring, mirrored[::-1]]))
        else:
            rings += [ring, mirrored]
    for _ in range(SMOOTHED):
        rings = [(ring + np.roll(ring, -1, axis=0)) / 2 for ring in rings]
    return rings


def _arm(arm: SeenArm, thick: float) -> Markup:
    line = _line(arm.points_mm)
    joints = Markup("").join(
        Markup('<circle cx="{:.0f}" cy="{:.0f}" r="{:.0f}"/>').format(x, -z, 0.22 * thick) for x, z in arm.points_mm
    )
    drawn = Markup(
        '<polyline class="edge" points="{0}" stroke-width="{1:.0f}"/><polyline points="{0}" stroke-width="{2:.0f}"/>'
    )
    drawn = drawn.format(line, thick, 0.78 * thick)
    return Markup('<g class="bones {}">{}{}</g>').format(arm.kind, drawn, joints)
