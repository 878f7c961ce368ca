"""The slips of a pen that explain best why two tables differ: the fewest win.

What two tables differ by after their best match is counted (:attr:`er3a.comparison.mechanism.Match.cost`): entries of
geometry, zeros, directions, base and flange. A slip that is undone has a price and lowers this count. A wrong sign, for
one, shows as a base turned over and joints that turn the other way where other zeros differ, too. All slips of a
declared list are tried, alone and up to ``TOGETHER``, first by a lower bound of what they leave; the best of these are
matched in full.

A slip is named if it leaves nothing, or if it lowers count and price together by at least ``CLEARLY``. One that changes
no geometry has to leave the base upright and all joints turning the same way, or to lower what differs by ``FAR``: else
the arms are merely defined otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from er3a.by_value import by_identity, frozen
from er3a.comparison import mechanism
from er3a.comparison.changes import Change, Slip, SlipCode, changed, slips_of, times
from er3a.geometry.vectors import wrap_to_pi
from er3a.robots.robot import Robot

CauseCode = SlipCode | Literal["unit", "angle_unit", "scale"]
SIDES: tuple[Literal["a", "b"], ...] = ("a", "b")
SAME_RATIO = math.log(1.005)
WHOLE = 2.0  # of a slip that changes more than one number
TOGETHER, KEPT, MATCHED = 3, 6, 6
CLEARLY = 2.0
FAR = 4.0
UPRIGHT = 1 - 1e-6


@frozen
class Cause:
    """A slip that made entries differ.

    Attributes
    ----------
    code : what kind it is; entries : those that it changes, or columns that are in another unit
    side : whose table has it; None: either's
    amount, unit : by how many rows or times, of which columns
    alike : entries of which any one, in place of the first, explains as much
    """

    code: CauseCode
    side: Literal["a", "b"] | None = "a"
    entries: tuple[str, ...] = ()
    amount: float | None = None
    unit: str = ""
    alike: tuple[str, ...] = ()


@by_identity
class _Edit:
    slip: Cause
    price: float
    undone: Change


@by_identity
class Explained:
    """Both arms with the ``slips`` undone, and how they match then."""

    slips: tuple[Cause, ...]
    one: Robot
    other: Robot
    found: mechanism.Match


def explain(one: Robot, other: Robot, found: mechanism.Match, tolerances: mechanism.Tolerances) -> Explained:
    """The fewest slips that explain what differs.

    Parameters
    ----------
    one, other : with the same number of rows, of the same kinds, in the right units
    found : their match
    tolerances : in m and rad

    Returns
    -------
    explained : without slips, as they are, if none explains clearly more than the match does
    """
    as_they_are = Explained((), one, other, found)
    if found.rank[0] == 0 and abs(_upright(one, found)) < UPRIGHT:
        return as_they_are  # signs turn a base over, they don't tilt it
    best, price, tied = as_they_are, found.cost, list[tuple[_Edit, ...]]()
    edits = sorted(_edits(one, other, tolerances), key=lambda edit: edit.price < WHOLE)  # single numbers after the rest
    kept: list[tuple[_Edit, ...]] = [()]
    for count in range(1, TOGETHER + 1):
        if count > 1 and price <= count:
            break
        tried = [(*own, edit) for own in kept for edit in edits if _follows(own, edit, edits)]
        tried = [own for own in tried if _price(own) < price]
        guesses = [_price(own) + mechanism.least_cost(*_mechanisms(one, other, own), tolerances) for own in tried]
        order = np.argsort(guesses, kind="stable")
        kept = [tried[k] for k in order[:KEPT]]
        likely = [k for k in order if guesses[k] <= price]
        for k in likely[:MATCHED]:
            own = tried[k]
            match = mechanism.match(*_mechanisms(one, other, own), tolerances)
            cost = _price(own) + match.cost
            if match.cost and not _is_plain(one, match, found, own):
                continue
            if cost < price:
                best, price, tied = Explained(tuple(e.slip for e in own), *_undone(one, other, own), match), cost, [own]
            elif cost == price and tied and len(own) == len(tied[0]):
                tied.append(own)
    return replace(best, slips=_with_alternatives(best.slips, tied))


def _is_plain(robot: Robot, match: mechanism.Match, before: mechanism.Match, edits: Sequence[_Edit]) -> bool:
    """Whether much less geometry differs than before, or the arms are not merely defined otherwise: the base does not
    lean, and all joints turn the same way or far less differs. A number that differs still is no slip undone."""
    still = {f"{each.column}{row_of(robot, each.column, each.link) + 1}" for each in match.differences}
    if not still.isdisjoint(name for edit in edits if edit.price < WHOLE for name in edit.slip.entries):
        return False
    saved = before.cost - match.cost - _price(edits)
    if any(edit.price >= WHOLE for edit in edits) and saved < CLEARLY:
        return False
    turns_alike = _upright(robot, match) > UPRIGHT and (not match.reverses.any() or saved >= FAR)
    return match.rank[0] < before.rank[0] or turns_alike


def row_of(robot: Robot, column: str, link: int) -> int:
    """The row of an entry; a modified table has a, alpha and beta one row later.

    Parameters
    ----------
    link : the axis (from 0) that the entry follows

    Returns
    -------
    row : from 0
    """
    return link + (robot.convention == "modified" and column in ("a", "alpha", "beta"))


def _upright(robot: Robot, match: mechanism.Match) -> float:
    """1 if the first joint's axis is the same in both bases, -1 if it is turned over."""
    axis = robot.base[:3, 2]
    return float(axis @ match.base[:3, :3] @ axis)


def _price(edits: Sequence[_Edit]) -> float:
    return sum(edit.price for edit in edits)


def _follows(own: tuple[_Edit, ...], edit: _Edit, edits: list[_Edit]) -> bool:
    """Whether an edit comes after those chosen, so that no set is tried twice, and changes no entry of theirs."""
    names = {name for each in own for name in each.slip.entries}
    return edits.index(edit) > max(map(edits.index, own), default=-1) and names.isdisjoint(edit.slip.entries)


def _undone(one: Robot, other: Robot, edits: Sequence[_Edit]) -> tuple[Robot, Robot]:
    for edit in edits:
        if edit.slip.side == "a":
            one = changed(one, edit.undone)
        else:
            other = changed(other, edit.undone)
    return one, other


def _mechanisms(one: Robot, other: Robot, edits: Sequence[_Edit]) -> tuple[mechanism.Mechanism, mechanism.Mechanism]:
    first, second = map(mechanism.mechanism_of, _undone(one, other, edits))
    return first, second


def _with_alternatives(slips: tuple[Cause, ...], tied: Sequence[tuple[_Edit, ...]]) -> tuple[Cause, ...]:
    """Slips with the entries that would do in their place, where sets that explain as much differ in one slip only."""
    found = list(slips)
    for own in tied[1:]:
        others = [edit.slip for edit in own if edit.slip not in slips]
        places = [k for k, slip in enumerate(slips) if slip not in [edit.slip for edit in own]]
        if len(others) == len(places) == 1 and len(others[0].entries) == 1 == len(slips[places[0]].entries):
            k = places[0]
            found[k] = replace(found[k], alike=(*found[k].alike, *others[0].entries))
    return tuple(found)


# The list of slips ----------------------------------------------------------------------------------------------------


def _edits(one: Robot, other: Robot, tolerances: mechanism.Tolerances) -> Iterator[_Edit]:
    """All slips that could be undone; directions and limits are said as such."""
    for slip in slips_of(one.rows):
        if slip.code in ("direction_reversed", "limits_exchanged") or not _matters(slip, one, tolerances):
            continue
        price = 1.0 if slip.code.startswith("one_") or slip.columns == ("offset",) else WHOLE
        entries = slip.entries if 0 < len(slip.rows) < one.rows else ()
        columns = ", ".join(slip.columns) if slip.amount else ""
        for dearer, side in enumerate(SIDES[: 1 + (not slip.rows)], 1):  # B is what A is held against
            yield _Edit(
                Cause(slip.code, side, entries, float(slip.amount) or None, columns), price * dearer, slip.undone
            )
    yield from _scales(one, other)


def _matters(slip: Slip, robot: Robot, tolerances: mechanism.Tolerances) -> bool:
    """Whether undoing a slip changes more than zeros at the ends and values of joints that slide."""
    meant = changed(robot, slip.undone)
    if slip.columns == ("offset",):
        inner = ~robot.sliding & (np.arange(robot.rows) > 0) & (np.arange(robot.rows) < robot.rows - 1)
        return bool(np.abs(wrap_to_pi(meant.offset))[inner].max(initial=0.0) > tolerances.angle)
    if robot.sliding[list(slip.rows)].any() and (slip.code == "rows_exchanged" or slip.columns == ("d",)):
        return slip.amount != 0
    # -180 deg is 180 deg; no arm has a length of 2 pi m, which this would miss.
    gaps = [np.abs(wrap_to_pi(getattr(meant, name) - getattr(robot, name))).max() for name in slip.columns]
    return not slip.columns or max(gaps) > tolerances.length


def _scales(one: Robot, other: Robot) -> Iterator[_Edit]:
    """The factor between the longest lengths of two tables, if it is not about 1."""
    arms = (mechanism.mechanism_of(each, ends=False) for each in (one, other))
    longest = [max(np.abs(each.a).max(initial=0.0), np.abs(each.d).max(initial=0.0)) for each in arms]
    ratio = float(longest[1] / longest[0]) if min(longest) > 0 else 1.0
    if abs(math.log(ratio)) > SAME_RATIO:
        yield _Edit(Cause("scale", "a", (), ratio), WHOLE, times(ratio, ("a", "d")))
