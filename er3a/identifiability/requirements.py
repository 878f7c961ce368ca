"""The requirements of references on a table's geometry, as smooth functions for a search.

A reference with a half-width requires ``|off| <= half-width``; one with a standard deviation is a term of a likelihood.
Of references that contradict each other, either may be right, so they require only the hull of the values they allow.

- :class:`SoughtExtreme`: an extreme over the joint limits, and the pose at which it was attained last: near to a table
  its measure there stands for it (envelope theorem);
- :class:`Asked`: the requirements on a table, and by how much tables miss them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from er3a.by_value import frozen
from er3a.kinematics.table_batch import Tables, frames_of, tables_of
from er3a.numerics.arrays import Reals
from er3a.numerics.peaks import box_points, peak
from er3a.references import quantities
from er3a.references.predict import TablesState
from er3a.references.reference import Reference, conflicts
from er3a.robots.robot import Robot

AFRESH, FOLLOWED = (4096, 12), (48, 1)  # points of a box and climbs: a table far away has many tops
LIKELY = 4.0  # standard deviations, beyond which a discrete alternative is excluded
SLIGHT = 1e-3  # of a half-width
TINY = 1e-300


class SoughtExtreme:
    """An extreme over the joint limits.

    Attributes
    ----------
    q : (n,), rad, where it was attained last; None before it was sought
    """

    def __init__(self, quantity: quantities.Extreme, robot: Robot):
        self.quantity, self.robot = quantity, robot
        moving = quantities.FRAME_OF_POINT[quantity.point] % (robot.joints + 1)
        self.joints = list(range(1, min(moving, robot.joints)))  # none of the measures changes with joint 1
        self.sign = 1.0 if quantity.extreme == "greatest" else -1.0
        self.q: Reals | None = None

    def at(self, table: Tables) -> float:
        """The extreme of a table, sought over the joint ranges; where it is attained is kept in ``q``.

        Parameters
        ----------
        table : a batch of one

        Returns
        -------
        extreme : mm
        """
        ends = np.sort([table.lower[0], table.upper[0]], axis=0)
        lower, upper = ends[:, self.joints]
        count, climbs = AFRESH if self.q is None else FOLLOWED
        points = box_points(lower, upper, count)
        if self.q is not None:
            points = np.concatenate([np.clip(self.q[self.joints], lower, upper)[None], points])
        q, values = peak(
            lambda q: self.sign * self.quantity.measure(frames_of(table, self.robot, self._whole(q)))[0],
            lower,
            upper,
            points,
            climbs,
        )
        self.q = self._whole(q[0])
        return self.sign * float(values[0]) * quantities.MM

    def _whole(self, q: Reals) -> Reals:
        whole = np.zeros((*q.shape[:-1], self.robot.joints))
        whole[..., self.joints] = q
        return whole


def along(tables: Tables, extremes: Sequence[SoughtExtreme]) -> list[Reals]:
    """The measures of many tables where extremes of one arm were attained last, in one batch of poses.

    Parameters
    ----------
    tables : H of them
    extremes : those that were not sought yet are sought for the first table

    Returns
    -------
    measures : of each extreme (H,), mm
    """
    for sought in extremes:
        if sought.q is None:
            sought.at(tables[[0]])
    if not extremes:
        return []
    T = frames_of(tables, extremes[0].robot, np.array([sought.q for sought in extremes]))
    return [sought.quantity.measure(T[:, k]) * quantities.MM for k, sought in enumerate(extremes)]


@frozen
class Requirement:
    """One required number.

    Attributes
    ----------
    half_width : or the standard deviation, if ``gaussian``
    references : places of the references that ask for it
    """

    quantity: quantities.Quantity
    expected: float
    half_width: float
    gaussian: bool
    references: tuple[int, ...]


def requirements_of(references: Sequence[Reference], places: Sequence[int] | None = None) -> list[Requirement]:
    """What references ask of a table; those about limits and speeds ask nothing of it.

    Of references that contradict each other only the hull of the values that they allow is required.

    Parameters
    ----------
    places : by which requirements name the references; by default their order

    Returns
    -------
    requirements : one for each reference, or for each set that contradicts itself
    """
    places = range(len(references)) if places is None else places
    asked = [i for i, each in enumerate(references) if each.expected is not None and each.quantity.depends_on_table]
    rivals: dict[int, set[int]] = {}
    for i, j in conflicts(references):
        if i in asked and j in asked:
            together = {i, j} | rivals.get(i, set()) | rivals.get(j, set())
            rivals.update(dict.fromkeys(together, together))
    found = []
    for i in asked:
        if i not in rivals:
            own = references[i]
            width = own.deviation or own.uncertainty
            found.append(Requirement(own.quantity, _stated(own), width, own.deviation is not None, (places[i],)))
        elif i == min(rivals[i]):
            found.append(_hull([references[k] for k in sorted(rivals[i])], [places[k] for k in sorted(rivals[i])]))
    return found


def _hull(stated: Sequence[Reference], places: list[int]) -> Requirement:
    """What references that contradict each other leave open together."""
    first, values = stated[0], [_stated(each) for each in stated]
    if all(type(each.quantity).apart is quantities.Quantity.apart for each in stated):
        low = min(value - each.uncertainty for value, each in zip(values, stated))
        high = max(value + each.uncertainty for value, each in zip(values, stated))
        return Requirement(first.quantity, (low + high) / 2, (high - low) / 2, False, tuple(places))
    width = max(
        first.quantity.apart(values[0], each.quantity, value) + each.uncertainty for value, each in zip(values, stated)
    )
    return Requirement(first.quantity, values[0], width, False, tuple(places))


def _stated(reference: Reference) -> float:
    return float(reference.expected or 0.0)  # there always is one


class Asked:
    """Requirements beside a robot's table: how far tables are off, in half-widths.

    Attributes
    ----------
    order : the requirements, those that are no extremes first; gaussian : (r,) bool, those with a standard deviation
    sizes : how many components each has; likely : components of those with a standard deviation
    """

    def __init__(self, robot: Robot, requirements: Sequence[Requirement]):
        self.robot = robot
        self.plain = [each for each in requirements if not isinstance(each.quantity, quantities.Extreme)]
        self._state = TablesState(robot, [each.quantity for each in self.plain])
        self.extreme = [
            (each, SoughtExtreme(each.quantity, robot))
            for each in requirements
            if isinstance(each.quantity, quantities.Extreme)
        ]
        self.order = (*self.plain, *(each for each, _ in self.extreme))
        self.gaussian = np.array([each.gaussian for each in self.order], dtype=bool)
        own = self._state.of(tables_of(robot))
        sizes = [each.quantity.off(own, each.expected).shape[-1] for each in self.plain]
        self.sizes = np.array([*sizes, *[1] * len(self.extreme)], dtype=np.int64)
        self._starts = np.cumsum(self.sizes) - self.sizes
        self._most = np.where(self.gaussian, LIKELY, 1.0)
        self.likely = np.flatnonzero(np.repeat(self.gaussian, self.sizes))

    def __len__(self) -> int:
        return len(self.order)

    def plain_off(self, tables: Tables) -> Reals:
        """How far tables are off the requirements that are no extremes.

        Parameters
        ----------
        tables : H of them

        Returns
        -------
        off : (H, m), components in half-widths or standard deviations
        """
        if not self.plain:
            return np.empty((len(tables), 0))
        state = self._state.of(tables)
        parts = [each.quantity.off(state, each.expected) / each.half_width for each in self.plain]
        return np.concatenate(parts, axis=-1)

    def near_off(self, tables: Tables) -> Reals:
        """How far tables are off all requirements, extremes where they were attained last.

        Parameters
        ----------
        tables : H of them

        Returns
        -------
        off : (H, m), components in half-widths or standard deviations
        """
        measured = along(tables, [sought for _, sought in self.extreme])
        extremes = [(value - each.expected) / each.half_width for value, (each, _) in zip(measured, self.extreme)]
        return np.column_stack([self.plain_off(tables), *extremes])

    def off(self, table: Tables, afresh: bool = True) -> Reals:
        """How far a table is off all requirements.

        Parameters
        ----------
        table : a batch of one
        afresh : True to seek extremes all over the joint ranges; False from where they were attained last, and few more

        Returns
        -------
        off : (m,), components in half-widths or standard deviations
        """
        for _, sought in self.extreme:
            sought.q = None if afresh else sought.q
        extremes = [(sought.at(table) - each.expected) / each.half_width for each, sought in self.extreme]
        return np.append(self.plain_off(table)[0], extremes)

    def missed_by(self, table: Tables) -> float:
        """The largest violation of a table.

        Parameters
        ----------
        table : a batch of one

        Returns
        -------
        violation : as of :meth:`violation`, not above 0 if all is met; 0 if nothing is asked
        """
        return float(self.violation(self.off(table)).max(initial=-1.0)) if len(self) else 0.0

    def excluding(self, table: Tables, nominal: Tables) -> tuple[int, ...]:
        """References that a table misses though another one meets them.

        Parameters
        ----------
        table, nominal : batches of one

        Returns
        -------
        places : of the references
        """
        violations = [self.violation(self.off(each)) for each in (table, nominal)]
        missed = (violations[0] > SLIGHT) & (violations[1] <= SLIGHT)
        return tuple(i for each, own in zip(self.order, missed) if own for i in each.references)

    def violation(self, off: Reals) -> Reals:
        """How far each requirement is exceeded.

        Parameters
        ----------
        off : (..., m), components

        Returns
        -------
        violation : (..., r), in half-widths (or ``LIKELY`` standard deviations) less one; not above 0 where it is met
        """
        lengths = self._lengths(off)
        return lengths / self._most[: lengths.shape[-1]] - 1.0

    def excess(self, off: Reals) -> Reals:
        """How far the requirement with a half-width that is exceeded most is exceeded.

        Parameters
        ----------
        off : (..., m), components

        Returns
        -------
        excess : (...,), in half-widths less one; those with a standard deviation don't count
        """
        lengths = self._lengths(off)
        bounded = lengths[..., ~self.gaussian[: lengths.shape[-1]]]
        most: Reals = bounded.max(axis=-1, initial=0.0) - 1.0
        return most

    def rest(self, off: Reals, inner: float) -> Reals:
        """Components of what lies outside a share of the half-widths, for least squares steps to just within them.

        Parameters
        ----------
        off : (..., m), components
        inner : half-widths within which nothing is left

        Returns
        -------
        rest : (..., m); components with a standard deviation are left as they are
        """
        lengths = self._lengths(off)
        share = np.where(lengths > inner, 1.0 - inner / np.maximum(lengths, TINY), 0.0)
        share = np.where(self.gaussian[: lengths.shape[-1]], 1.0, share)
        rest: Reals = off * np.repeat(share, self.sizes[: lengths.shape[-1]], axis=-1)
        return rest

    def _lengths(self, off: Reals) -> Reals:
        """Lengths (..., r) of components (..., m) of all requirements, or of those that are no extremes."""
        starts = self._starts[self._starts < off.shape[-1]]
        return np.sqrt(np.add.reduceat(off * off, starts, axis=-1)) if len(starts) else np.empty((*off.shape[:-1], 0))
