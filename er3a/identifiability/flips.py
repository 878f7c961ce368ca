"""Discrete changes of a table: directions reversed, half turns, signs, the other convention.

None of them is near the table, so none can be found by linearisation: they and their combinations are tried.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from er3a.identifiability.entries import Column, TableNumber
from er3a.kinematics.table_batch import Tables, join
from er3a.numerics.arrays import Flags, Reals
from er3a.references.quantities import Quantity
from er3a.robots.robot import Robot

MOST_TOGETHER = 4
PATTERNS_UP_TO = 6
SOME_DEG = 1e-6


@dataclass(frozen=True)
class Flip:
    """One discrete change.

    Attributes
    ----------
    entries : those that it changes; None for the convention
    about_deg : of a direction that is reversed about another angle than 0, that angle
    """

    kind: str
    entry: TableNumber | None
    about_deg: float = 0.0

    @property
    def entries(self) -> tuple[str, ...]:
        """Names of the entries that it changes."""
        if self.entry is None:
            return ("convention",)
        if self.about_deg:
            return self.entry.name, f"offset{self.entry.joint}"
        return (self.entry.name,)

    def apply(self, table: Tables) -> Tables:
        """Tables with it."""
        if self.entry is None:
            return replace(table, modified=~table.modified)
        j = self.entry.joint - 1
        own: Reals = getattr(table, self.entry.column)[:, [j]]
        if self.kind == "half_turn":
            return table.with_column(self.entry.column, [j], half_turn(own))
        changed = table.with_column(self.entry.column, [j], -own)
        if self.about_deg:
            shift = 2 * own * np.radians(self.about_deg)
            changed = changed.with_column("offset", [j], table.offset[:, [j]] + shift)
        return changed


def half_turn(angle: Reals) -> Reals:
    """Half a turn further, kept within (-pi, pi] as people write angles."""
    turned = angle + np.pi
    return np.where(turned > np.pi + 1e-9, turned - 2 * np.pi, turned)


def flips_of(robot: Robot, quantities: Sequence[Quantity]) -> list[Flip]:
    """The changes of a robot's table, the likeliest to be mistaken first."""
    joints = range(1, len(robot.a) + 1)
    found = [Flip("reversed", TableNumber("direction", j)) for j in joints]
    for j in joints:
        angles = {round(quantity.seen_at[j - 1], 9) for quantity in quantities} - {0.0}
        found += [Flip("reversed", TableNumber("direction", j), angle) for angle in sorted(angles)]
    last_first = joints[::-1]  # what only turns the flange comes before what the flange and others compose
    found += [Flip("half_turn", TableNumber("offset", j)) for j in last_first]
    found += [Flip("half_turn", TableNumber("alpha", j)) for j in last_first]
    oblique = np.abs(np.sin(2 * robot.alpha)) > np.sin(np.radians(SOME_DEG))
    found += [Flip("sign", TableNumber("alpha", j)) for j in joints if oblique[j - 1]]
    columns: tuple[Column, ...] = ("a", "d")
    found += [
        Flip("sign", TableNumber(column, j)) for column in columns for j in joints if getattr(robot, column)[j - 1]
    ]
    return [*found, Flip("convention", None)]


def sets_of(flips: Sequence[Flip]) -> Iterator[list[tuple[int, ...]]]:
    """Combinations to try, by how many flips are in them: all up to four; of directions and half turns of offsets, for
    arms of up to six joints, all that there are."""
    basic = [i for i, flip in enumerate(flips) if not flip.about_deg and flip.entry is not None]
    turning = [i for i in basic if flips[i].entry.column in ("direction", "offset")]  # type: ignore[union-attr]
    most = len(turning) if len(turning) <= 2 * PATTERNS_UP_TO else MOST_TOGETHER
    for count in range(1, max(most, MOST_TOGETHER) + 1):
        if count <= 2:
            chosen = list(combinations(range(len(flips)), count))
        elif count <= MOST_TOGETHER:
            chosen = list(combinations(basic, count))
        else:
            chosen = list(combinations(turning, count))
        yield [each for each in chosen if _apart(flips, each)]


def _apart(flips: Sequence[Flip], chosen: tuple[int, ...]) -> bool:
    """Whether no entry is changed twice."""
    names = [name for i in chosen for name in flips[i].entries]
    return len(set(names)) == len(names)


def changed(table: Tables, flips: Sequence[Flip], chosen: Sequence[tuple[int, ...]]) -> Tables:
    """Tables with each combination of flips."""
    batch = table[np.zeros(len(chosen), dtype=np.int64)]
    for i, flip in enumerate(flips):
        rows = np.array([i in each for each in chosen])
        if rows.any():
            own = flip.apply(batch[rows])
            batch = _placed(batch, rows, own)
    return batch


def _placed(batch: Tables, rows: Flags, own: Tables) -> Tables:
    """A batch with some of its rows replaced."""
    order = np.empty(len(batch), dtype=np.int64)
    order[~rows] = np.arange(int((~rows).sum()))
    order[rows] = np.arange(int(rows.sum())) + int((~rows).sum())
    return join([batch[~rows], own])[order]
