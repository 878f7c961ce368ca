"""What each entry of a table is of, as a motion that the page's player shows: a jog, a way to a limit, a place."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from er3a.finding import Finding
from er3a.identifiability.entries import column_of
from er3a.kinematics.forward import forward, frames
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import N_, tr, with_unit
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.references import entry_word, motion_seen
from er3a.pipeline.messages.say import joined, say
from er3a.pipeline.player.motions import Mark, PlayedEvent, PlayedMotion, address_of, at_rest
from er3a.pipeline.stages.validation.model import Conflict
from er3a.pipeline.viewing.answer import Fix, ListRow
from er3a.pipeline.viewing.drawn import drawn_size
from er3a.pipeline.viewing.side_view import entry_places
from er3a.pipeline.viewing.still import AZIMUTH, ELEVATION, axes_of
from er3a.references.quantities import FRAME_OF_POINT, MM, AxisDistance
from er3a.references.seen import SeenMotion
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

BELOW = 0.15  # of the reach, from one line to the next below the arm
JOG = 30.0  # deg, or mm of a joint that slides
LASTS_S, SHARE = 2.0, np.linspace(0.0, 1.0, 13)  # of a motion, and of its way
TIP_M = 0.2  # from the flange to a mark on it, where it turns in its place
LOOKED_FROM = (-np.pi / 2, N_("Side")), (2.8, N_("from behind"))  # azimuth of the eye, rad
FORWARD = 0.45  # of the arm's size: the line along x on the floor
LENGTHS, ANGLES, LIMITS = ("a", "d"), ("alpha", "beta", "offset"), ("lower", "upper")


def jog_rows(robot: Robot, looks: Iterable[Finding]) -> list[ListRow]:
    """Each joint that is to be jogged, with what is seen if its direction is right, as a row of the page's list.

    Parameters
    ----------
    looks : proposals to look at a motion
    """
    rows = []
    for look in looks:
        said = tr("{place}.", place=re.split("[:：]", say(look))[0])
        fix = Fix(said, address_of("validation", look.entry, 0.0, ""), instead=False)
        name = joined([f"+J{look.joint}", tr("{motion}?", motion=motion_seen(look))], ": ")
        other = fixed(-robot.direction[look.joint - 1], 0)
        rows.append(ListRow("caution", name, other, f"#cell-{look.entry}", (look.entry, LASTS_S), fix=fix))
    return rows


def reach_played(robot: Robot, reach: AxisDistance, q: Reals, conflict: Conflict) -> PlayedMotion:
    """The arm as far out as it reaches at joint values (n,), rad or m, over what documents state of that: for each a
    line from axis 1 on, and below them by how much they differ. It has the robot's name."""
    T = frames(robot, q)
    start, axis = T[0, :3, 3], T[0, :3, 2]
    way = T[FRAME_OF_POINT[reach.point], :3, 3] - start
    height, far = way @ axis, way - (way @ axis) * axis
    step, forward = BELOW * np.linalg.norm(far) * axis, far / np.linalg.norm(far) / MM
    top = start + height * axis
    stated = sorted(each.expected for each in conflict.statements)
    low = top - (len(stated) + 0.5) * step
    marks = []
    for row, value in enumerate(stated, 1):
        level, end = top - row * step, value * forward
        marks.append(_mark(level, level + end, with_unit(fixed(value, 1), conflict.unit)))
        marks.append(_mark(top + end, low + end, ""))
    ends = low + stated[0] * forward, low + stated[-1] * forward
    marks.append(_mark(*ends, with_unit(fixed(stated[-1] - stated[0], 1), conflict.unit)))
    return at_rest(robot, robot.name, q=q, marks=marks, turned=-np.pi / 2 - AZIMUTH, elevation=0.0)


def entries_played(robot: Robot, cells: Mapping[str, Any], looks: Iterable[Finding]) -> list[PlayedMotion]:
    """A motion by the name of each entry: of a direction a jog, of a limit the way there, of all else where it is seen
    on the arm; the arm alone where nothing is known of an entry.

    Parameters
    ----------
    cells : of the page's table, by entry
    looks : proposals to look at a motion
    """
    found = [_jogged(robot, look) for look in looks]
    zero = np.zeros(robot.joints)
    places = entry_places(robot, cells, zero)
    for entry, cell in cells.items():
        column = column_of(entry)
        values = joined(filter(None, (cell["value"], cell["gives"])), tr(" or "))
        said = with_unit(joined([entry_word(entry), values], " "), cell["unit"])
        if column in LIMITS:
            end = zero.copy()
            joint = int(entry.removeprefix(column)) - 1
            end[joint] = getattr(robot, column)[joint]
            said_there = [PlayedEvent(0.0, LASTS_S, said, "plain")]
            found.append(PlayedMotion(entry, "", LASTS_S * SHARE, SHARE[:, None] * end, said_there, turned=0.0))
        elif column in LENGTHS or column in ANGLES:
            start, last = places[entry] / MM
            marks = [_mark(start, last, said)]
            if column in ANGLES and cell["gives"]:
                other = getattr(robot, column).copy()
                other[int(entry.removeprefix(column)) - 1] = np.radians(float(cell["gives"].replace("−", "-")))
                T = np.stack([forward(each, zero) for each in (robot, robot.replace(**{column: other}))])
                marks = _choice(T[:, :3, 3], _tips(T), (cell["value"], cell["gives"]))
            found.append(at_rest(robot, entry, q=zero, marks=marks, turned=0.0))
    return found or [at_rest(robot, robot.name, q=zero)]


def _jogged(robot: Robot, look: Finding) -> PlayedMotion:
    """A jog in +, with the arm as it would end if the direction were the other; words where the flange is then, or a
    mark on it that turns with it, seen from where these are farthest from each other."""
    start, joint = meant(robot, look.pose_deg), look.joint - 1
    jog = meant(robot, JOG * np.eye(robot.joints)[joint])
    T = forward(robot, np.stack([start + jog, start - jog]))
    turning = SeenMotion(look.pose_deg, look.joint, look.point, look.seen).manner != "moves"
    ends = _tips(T) if turning else T[:, :3, 3]
    way = ends[0] - ends[1]
    eye, seen = max(LOOKED_FROM, key=lambda each: float(np.linalg.norm(axes_of(each[0], ELEVATION)[:2] @ way)))
    own, foot, ahead = int(robot.direction[joint]), robot.base[:3, 3], FORWARD * drawn_size(robot) * robot.base[:3, 0]
    said = joined([f"+J{look.joint}", tr(seen).lower()], ", ")
    return PlayedMotion(
        look.entry,
        "",
        LASTS_S * SHARE,
        start + SHARE[:, None] * jog,
        [PlayedEvent(0.0, LASTS_S, said, "plain", joints=((look.joint, ""),))],
        [_mark(foot, foot + ahead, "x"), *_choice(T[:, :3, 3], ends, (fixed(own, 0), fixed(-own, 0)), LASTS_S)],
        ghosts=[start - jog],
        turned=eye - AZIMUTH,
    )


def _tips(T: Reals) -> Reals:
    """The ends (2, 3), m, of marks on a flange at two poses (2, 4, 4): along that of its axes which turns most."""
    marks = T[:, :3, 3] + TIP_M * np.moveaxis(T[:, :3, :3], 2, 0)
    found: Reals = max(marks, key=lambda each: float(np.linalg.norm(each[0] - each[1])))
    return found


def _choice(feet: Reals, ends: Reals, values: tuple[str, str], since: float = 0.0) -> list[Mark]:
    """Where an entry's value leads to, and another one instead: words at ``ends`` (2, 3), lines to these from ``feet``
    (2, 3), m."""
    words = tr("keep {value}", value=values[0]), tr("enter {value}", value=values[1])
    dots = [_mark(end, end, word, since) for end, word in zip(ends, words)]
    return dots + [_mark(foot, end, "", since) for foot, end in zip(feet, ends) if (foot != end).any()]


def _mark(start: Reals, end: Reals, text: str, since: float = 0.0) -> Mark:
    (x, y, z), (u, v, w) = start.tolist(), end.tolist()
    return Mark(since, LASTS_S, (x, y, z), (u, v, w), text)
