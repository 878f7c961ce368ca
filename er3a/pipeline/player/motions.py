"""Motions for the player and the recording: joint values over time, and events."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal
from urllib.parse import urlencode

from er3a.numerics.arrays import Reals
from er3a.pipeline.language import tr
from er3a.pipeline.messages.say import joined

Weight = Literal["plain", "caution", "fail"]


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class Mark:
    """A line between two points (m), a dot where they are one, with a word, shown from ``t0`` to ``t1`` (s)."""

    t0: float
    t1: float
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    text: str


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class Fault:
    """Why a path or a program may not be run as it is, and what to do instead.

    ``moments``: of a path what fails first, then what fails later and weighs more, then what only follows from it; of
    a program what weighs most, then what fails before that. ``cause``: what all of it comes from, such as a singular
    pose, empty where nothing is known.
    ``status`` and ``verdict``: of all of it; ``meant``: whether its file expects that, said in words by ``expected``
    (empty where it expects nothing). ``facts``: what else is to be known of what to do, each after what it is about.
    ``address``: of the place on the robot's pages, which the player shows there; ``instead``: a motion that may be run,
    and where the player shows it.
    """

    name: str
    title: str
    status: Weight
    verdict: str
    meant: bool
    expected: str
    moments: tuple[FaultMoment, ...]
    to_do: str
    address: str
    instead: tuple[str, str] | None = None
    cause: str = ""
    facts: tuple[tuple[str, str], ...] = ()

    @property
    def when(self) -> str:
        """When it fails first."""
        return self.moments[0].when

    @property
    def what(self) -> str:
        """All that fails, each after the first with its moment."""
        first, *later = self.moments
        placed = [tr("{where}: {text}", where=m.when, text=m.what) if m.when else m.what for m in later]
        return joined([first.what, *placed])


def address_of(page: str, motion: str, t: float, place: str, until: float | None = None) -> str:
    """The address of a place on a page, whose player then shows time ``t`` (s) of a motion, and plays it ``until``."""
    end = {} if until is None else {"until": round(until, 9)}
    return f"{page}.html?{urlencode({'play': motion, 't': round(t, 9), **end})}#{place}"


@dataclass(frozen=True, eq=False)
class PlayedMotion:
    """A motion of the arm.

    Attributes
    ----------
    name, text : what it is called, and what is said of it where no event is near; label : for people, if not the name
    t : (N,), s, rising; q : (N, n), joint coordinates, finite
    beside : (N, n) each, joint coordinates of the arms that stand beside the first
    """

    name: str
    text: str
    t: Reals
    q: Reals
    events: Sequence[PlayedEvent] = ()
    marks: Sequence[Mark] = ()
    beside: Sequence[Reals] = ()
    label: str = ""
