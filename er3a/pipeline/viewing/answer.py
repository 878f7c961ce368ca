"""What a page says first: a headline, key figures, and the list that stands at the picture's side."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal

from er3a.by_value import frozen
from er3a.pipeline.language import tr

Mark = Literal["pass", "caution", "fail", "conflict", "no_reference", "no_verdict", "none"]
PartMark = Literal["pass", "caution", "fail", "none", "rest", "zero", "spread"]
"""Of a stretch of a bar; ``rest`` is what the bar leaves empty, ``zero`` a line at its start."""
NARROWEST = 0.04  # of a bar, at which a moment is still seen
MOST_ROWS = 14  # of a list; in a longer one those that pass are folded


@frozen
class Part:
    """A stretch of a bar, from ``start`` to ``end`` in parts of the row's own length, in the colour of a mark."""

    start: float
    end: float
    mark: PartMark

    @property
    def left(self) -> float:
        """Where it begins, in percent."""
        return 100 * min(self.start, 1 - NARROWEST)

    @property
    def width(self) -> float:
        """How wide it is drawn, in percent."""
        return 100 * max(self.end - self.start, NARROWEST)


@frozen
class ListRow:
    """One path, program, target, object or entry: its mark, its name, and what is to be known of it in few words.

    Attributes
    ----------
    address : where it leads to on the page
    play : the motion that the page's player shows then, and the time (s); None where nothing is played
    length : of the bar, in parts of the longest
    parts : of the bar; without a length there is none
    fix : what to do instead, shown above the list while this row is the chosen one
    meant : whether its file expects that it fails
    """

    mark: Mark
    name: str
    note: str
    address: str = ""
    play: tuple[str, float] | None = None
    length: float = 0.0
    parts: Sequence[Part] = ()
    fix: Fix | None = None
    meant: bool = False


@frozen
class Group:
    """Rows under one title, with how many they are where that is ``counted``; ``folded`` until they are asked for.
    ``ticks``: over the bars of the first row, in parts of them, in mm."""

    title: str
    rows: Sequence[ListRow]
    counted: bool = True
    folded: bool = False
    ticks: Sequence[tuple[float, str]] = ()


@frozen
class Fix:
    """The one thing to do, and where the page shows it; ``instead`` of what was found wrong, or else next."""

    text: str
    address: str = ""
    instead: bool = True


@frozen
class Answer:
    """The first screen of a page.

    Attributes
    ----------
    headline : at most twelve words with ``rest``, in the colour of the verdict
    rest : the second part of the verdict, in plain ink
    below : one sentence below the verdict, or nothing
    keys : two or three figures, each with what it is
    groups : of the list; those without rows are left out
    good : whether the headline holds though the verdict is a caution; the rest then says what is open
    """

    headline: str
    rest: str = ""
    below: str = ""
    keys: Sequence[tuple[str, str]] = ()
    groups: Sequence[Group] = ()
    fix: Fix | None = None
    good: bool = False

    @property
    def shown_groups(self) -> list[Group]:
        """The groups that have rows."""
        return [group for group in self.groups if group.rows]


def may_run(sound: int, due: int, caught: int, what: str) -> tuple[str, str]:
    """How many motions may be run, and how many that are meant to fail do.

    Parameters
    ----------
    sound : that may be run
    due : that are expected to
    caught : that are meant to fail, and do
    what : their name in plural, in the page's language

    Returns
    -------
    headline, rest : of an :class:`Answer`
    """
    return tr("{sound} of {due} {what} pass.", sound=sound, due=due, what=what), all_caught(caught)


def all_caught(count: int) -> str:
    """That all that is meant to fail does; empty where nothing is meant to."""
    return tr("Test faults caught: {count}.", count=count) if count else ""


def lengths(durations_s: Iterable[float]) -> list[float]:
    """Durations in parts of the longest, of at least a tenth."""
    durations = list(durations_s)
    longest = max(durations, default=0.0) or 1.0
    return [max(0.1, each / longest) for each in durations]


def judged(rows: Sequence[ListRow], repairable: Sequence[ListRow] = ()) -> list[Group]:
    """Motions by what came of them, those that fail first, then ``repairable`` ones: there is a way."""
    fail, caution, passed = ([row for row in rows if row.mark == mark] for mark in ("fail", "caution", "pass"))
    return [
        Group(tr("Don't run as they are"), fail),
        Group(tr("Can be repaired"), repairable),
        Group(tr("Doubts"), caution),
        Group(tr("Pass in the model"), passed, folded=len(passed) < len(rows) > MOST_ROWS),
    ]
