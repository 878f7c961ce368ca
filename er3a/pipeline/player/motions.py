"""Motions for the player and the recording: joint values over time, and events."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any, Literal
from urllib.parse import urlencode

import numpy as np

from er3a.by_value import by_identity, frozen
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import first_sentence
from er3a.pipeline.viewing.answer import Fix, ListRow, Part
from er3a.pipeline.viewing.still import ELEVATION
from er3a.robots.robot import Robot

Weight = Literal["plain", "caution", "fail"]


@frozen
class PlayedEvent:
    """Something to be seen from ``t`` to ``until`` (s); ``status`` (``plain``, ``caution``, ``fail``) colours it.

    ``bodies`` (``base``, ``link_3``, names of solids) are red then; ``joints`` (from 1) fail, each with what it would
    need, in few words, or nothing; ``axes`` (rows of the table from 1) of a singular pose are drawn then.
    """

    t: float
    until: float
    text: str
    status: Weight
    bodies: tuple[str, ...] = ()
    joints: tuple[tuple[int, str], ...] = ()
    axes: tuple[int, ...] = ()


@frozen
class Mark:
    """A line or an arrow between two points (m), a dot where they are one, with a word, from ``t0`` to ``t1`` (s)."""

    t0: float
    t1: float
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    text: str
    arrow: bool = False


@frozen
class FaultMoment:
    """One thing that is wrong: ``when``, or in which line, and ``place``, how far along and where the tool point is
    then; both empty where not known. ``seen_s``: when the player shows it best, at ``address`` on the robot's pages;
    ``row``: the id of the line that it is in, on the page."""

    what: str
    when: str = ""
    place: str = ""
    seen_s: float | None = None
    row: str = ""
    address: str = ""


@frozen
class Fault:
    """Why a path or a program may not be run as it is, and what to do instead.

    ``moments``: of a path what fails first, then what fails later and weighs more, then what only follows from it; of
    a program what weighs most, then what fails before that. ``cause``: what all of it comes from, such as a singular
    pose, empty where nothing is known.
    ``status`` and ``verdict``, in few words: of all of it; ``meant``: whether its file expects that.
    ``address``: of the place on the robot's pages, which the player shows there; ``instead``: a motion that may be run,
    and where the player shows it.
    """

    name: str
    status: Weight
    verdict: str
    meant: bool
    moments: tuple[FaultMoment, ...]
    to_do: str
    address: str
    instead: tuple[str, str] | None = None
    cause: str = ""


def address_of(page: str, motion: str, t: float, place: str, until: float | None = None) -> str:
    """The address of a place on a page, whose player then shows time ``t`` (s) of a motion, and plays it ``until``."""
    end = {} if until is None else {"until": round(until, 9)}
    return f"{page}.html?{urlencode({'play': motion, 't': round(t, 9), **end})}#{place}"


@by_identity
class PlayedMotion:
    """A motion of the arm.

    Attributes
    ----------
    name, text : what it is called, and what is said of it where no event is near
    t : (N,), s, rising; q : (N, n), joint coordinates, finite
    beside : (N, n) each, joint coordinates of the arms that stand beside the first
    ghosts : (n,) each, joint coordinates of poses in which the first arm is drawn pale all the while
    loads : (N, n), what each joint bears, N m, or N where it slides: a bar at each; None where nothing is known
    elevation : rad, of the eye: 0 for a side elevation
    turned : rad, of the eye about the vertical; None for where the motion is seen best
    """

    name: str
    text: str
    t: Reals
    q: Reals
    events: Sequence[PlayedEvent] = ()
    marks: Sequence[Mark] = ()
    beside: Sequence[Reals] = ()
    ghosts: Sequence[Reals] = ()
    loads: Reals | None = None
    whole_s: float = 0.0
    elevation: float = ELEVATION
    turned: float | None = None


def at_rest(
    robot: Robot,
    name: str,
    text: str = "",
    weight: Weight = "plain",
    q: Reals | None = None,
    bodies: tuple[str, ...] = (),
    **more: Any,
) -> PlayedMotion:
    """The arm for a second in one pose, of which ``text`` is said.

    Parameters
    ----------
    q : (n,), rad or m; None for the arm's home, or zeros where it has none
    bodies : that are red
    more : of a :class:`PlayedMotion`
    """
    pose = next(each for each in (q, robot.home, np.zeros(robot.joints)) if each is not None)
    events = [PlayedEvent(0.0, 1.0, text, weight, bodies)] if text else []
    return PlayedMotion(name, "", np.array([0.0, 1.0]), np.tile(pose, (2, 1)), events, **more)


def bar_of(motion: PlayedMotion, duration_s: float) -> list[Part]:
    """What happens during a motion, as parts of a bar.

    Parameters
    ----------
    motion : with its events
    duration_s : that the whole bar stands for, s; the part that the motion does not get to is marked ``none``
    """
    last = float(motion.t[-1])
    whole = max(duration_s, last) or 1.0
    order = sorted((each for each in motion.events if each.status != "plain"), key=lambda each: each.status == "fail")
    parts = [Part(each.t / whole, each.until / whole, "fail" if each.status == "fail" else "caution") for each in order]
    end = last / whole
    return [*([Part(end, 1.0, "none")] if end < 0.995 else []), *parts]


def row_of(fault: Fault, motion: PlayedMotion | None, duration_s: float = 0.0) -> ListRow:
    """A path or program that may not be run as it is, as a row of the list at the picture's side.

    Parameters
    ----------
    motion : that the player shows; None where it shows none, as of one with no two moments
    duration_s : of the whole motion, s, where the arm does not get to its end

    Returns
    -------
    row : without a bar where no moment of the motion is known to fail
    """
    motion = motion if motion and len(motion.t) > 1 else None
    parts = bar_of(motion, duration_s) if motion else []
    fails = fault.status == "fail"
    events = motion.events if motion else ()
    gravest = min(((each.t, each.until) for each in events if each.status == fault.status), default=None)
    return ListRow(
        "fail" if fails else "caution",
        fault.name,
        fault.verdict,
        f"#{fault.name}",
        (fault.name, gravest[0] if gravest and fails else fault.moments[0].seen_s or 0.0) if motion else None,
        float(bool(parts)),
        parts,
        fix_of([fault]),
        fault.meant,
    )


def opened(faults: Iterable[Fault]) -> tuple[str, float] | None:
    """The motion and time (s) that a player opens at: the first fault that it can show; None where there is none."""
    shown = ((fault.name, fault.moments[0].seen_s) for fault in faults)
    return next(((name, t) for name, t in shown if t is not None), None)


def fix_of(faults: Iterable[Fault]) -> Fix | None:
    """What to do about the first fault that can be mended; None where none can."""
    for fault in faults:
        if fault.to_do:
            place = fault.instead[1] if fault.instead else ""
            text = re.sub(r"(?<=\d) (?=(mm|s|%))", "\u00a0", first_sentence(fault.to_do)[0])  # units stay with values
            return Fix(text, place, fault.status != "caution")
    return None
