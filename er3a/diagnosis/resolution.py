"""How large a fault must be for references to notice it, and to tell it from others."""

from __future__ import annotations

import numpy as np

from er3a.diagnosis.conclusions import Resolution
from er3a.diagnosis.fault_kinds import entry_of
from er3a.diagnosis.fitting import MEETS, PROBE, least_greatest
from er3a.diagnosis.free_numbers import FreeNumber, moved
from er3a.diagnosis.hypotheses import Case
from er3a.diagnosis.ranking import Ranking
from er3a.kinematics.table_batch import Tables
from er3a.numerics.arrays import Flags, Reals
from er3a.references.quantities import MM

STEP = 1.1
LENGTHS_M = 1e-5 * STEP ** np.arange(124)  # up to 1.2 m
ANGLES_RAD = np.pi / STEP ** np.arange(123, -1, -1)  # from 0.0015 deg to half a turn
MOST_COMPARED = 60
ALIKE = 0.01
"""Two hypotheses that differ by less of a half-width than this, whatever value they take, are alike at any size."""


def resolution_of(case: Case) -> Resolution:
    """What would be noticed of a table that meets all references."""
    entries = [number for number in case.numbers if number.column]
    noticed = {number: least_noticed(case, number) for number in entries}
    lengths = [size * MM for number, size in noticed.items() if size is not None and not number.is_angle]
    angles = [float(np.degrees(size)) for number, size in noticed.items() if size is not None and number.is_angle]
    half_turns = [number for number in entries if number.is_angle and not _missed(case, number, np.array([np.pi]))[0]]
    joints = range(case.given.direction.shape[-1])
    reversible = [f"direction{joint + 1}" for joint in joints if not _noticed_reversed(case, joint)]
    return Resolution(
        length_mm=max(lengths, default=None),
        angle_deg=max(angles, default=None),
        half_turns=tuple(number.name for number in half_turns if noticed[number] is not None),
        unseen=(*(number.name for number, size in noticed.items() if size is None), *reversible),
    )


def least_noticed(case: Case, number: FreeNumber) -> float | None:
    """The least change (m or rad) of an entry, to 10 %, at which some reference is missed, whichever way it is changed;
    None if there is none up to 1.2 m or half a turn."""
    sizes = ANGLES_RAD if number.is_angle else LENGTHS_M
    missed = _missed(case, number, np.concatenate([sizes, -sizes])).reshape(2, -1)
    if not missed.any(axis=1).all():
        return None
    return float(sizes[missed.argmax(axis=1).max()])


def _noticed_reversed(case: Case, joint: int) -> bool:
    turned = case.given.with_column("direction", [joint], -case.given.direction[:, [joint]])
    return bool((np.abs(case.difference(turned)) > case.uncertainty * MEETS).any())


def told_from(case: Case, ranking: Ranking) -> float | None:
    """How many times larger the disagreement would have to be for the references to tell the first set apart.

    Each member but the first is refitted to what the first predicts, to first order; what then stays grows with the
    disagreement. Members that predict the same whatever the size don't count.

    Of a set without end the first members are compared.

    Returns
    -------
    factor : at least 1; None if all members are alike at any size
    """
    group = ranking.groups[0]
    difference = ranking.pool.difference / case.uncertainty
    factors = []
    for row in group[1:MOST_COMPARED]:
        apart = difference[row] - difference[group[0]]
        slopes = _slopes(case, ranking, row)
        if slopes.shape[1]:
            apart = apart + slopes @ least_greatest(slopes[None], apart[None], enough=0.0)[0]
        stays = float(np.abs(apart).max())
        if stays > ALIKE:
            factors.append(max(1 / stays, 1.0))
    return max(factors, default=None)


def _slopes(case: Case, ranking: Ranking, row: int) -> Reals:
    """Derivatives (n, k) of the residuals with respect to the free numbers among a hypothesis' entries."""
    entries = {entry_of(fault) for fault in ranking.pool.faults[row]}
    places = [place for place, number in enumerate(case.numbers) if number.name in entries]
    if not places:
        return np.empty((len(case.references), 0))
    tables: Tables = ranking.pool.tables[[row] * len(places)]
    ahead = moved(tables, case.numbers, np.array(places)[:, None], np.full((len(places), 1), PROBE))
    slopes: Reals = ((case.difference(ahead) - ranking.pool.difference[row]) / PROBE / case.uncertainty).T
    return slopes


def _missed(case: Case, number: FreeNumber, amounts: Reals) -> Flags:
    tables = case.given[np.zeros(len(amounts), dtype=int)]
    changed = moved(tables, [number], np.zeros((len(amounts), 1), dtype=int), amounts[:, None])
    missed: Flags = np.any(np.abs(case.difference(changed)) > case.uncertainty * MEETS, axis=1)
    return missed
