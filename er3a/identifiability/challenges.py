"""Tables that speak against what would count as settled: looked for from very many places at once.

Starts are spread near and far about an open table, some with joints reversed and angles turned round; then each entry
is held some way off, both ways, from the open table and from what was found. From each start damped Gauss-Newton steps
go toward what is asked for, all of them in one batch, so that hundreds cost what a few would one by one. Extremes over
the joint limits are left aside meanwhile: what meets the rest is put to them afterwards.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from er3a.identifiability.elsewhere import FAR, WIDEST_M, WIDEST_RAD, Elsewhere, nearest_rows
from er3a.identifiability.entries import shifted
from er3a.identifiability.feasible import MET, MOST_DAMPING, PROFILE, STAYING, OpenTable, Region
from er3a.identifiability.restarts import amounts_between
from er3a.kinematics.table_batch import Tables
from er3a.numerics.arrays import Flags, Reals

SPREAD, WIDTHS = 192, (0.02, 0.1, 0.3, 1.0)
REVERSED, TURNED = 0.2, 0.15  # shares of joints reversed and angles turned round, in every second spread start
PUSHES = 1.1, 1.7, 3.0, 8.0  # of the least step that matters
ROUNDS, PUSHED_FROM, MOST_KEPT = 3, 3, 40
PASSES, STEP, DAMPING, STALLED, FLOOR, NOTHING = 40, 1e-3, 1e-2, 1e-3, 1e-8, 1e-12
CHUNK, SEED = 48, 20261121


def challenges_to(region: Region, start: OpenTable, matters: Mapping[int, float]) -> list[Elsewhere]:
    """Open tables that lie farther than others along some entry, either way.

    Parameters
    ----------
    region : its entries are those that may change; start : an open table of it
    matters : places of entries that are held some way off, with the least step (in their scales) that matters
    """
    search = _ManyStarts(region, start, matters)
    search.try_from(*_spread(region, start))
    for _ in range(ROUNDS):
        places = search.farthest()[:PUSHED_FROM]
        before = search.reach.copy()
        search.try_from(*_pushed(region, start, places, matters))
        if (search.reach - before).max() < FAR:
            break
    return search.found()


def _spread(region: Region, start: OpenTable) -> tuple[Reals, Reals, Flags]:
    """Directions (R, n), amounts (R, k) and what is held (R, k), spread about an open table."""
    random = np.random.Generator(np.random.Philox(SEED))
    k, own = len(region.entries), region.table.direction
    wide = np.array([WIDEST_M if entry.unit == "mm" else WIDEST_RAD for entry in region.entries]) / region.scale
    shares = random.uniform(-1, 1, (SPREAD, k)) * np.resize(WIDTHS, SPREAD)[:, None]
    second = (np.arange(SPREAD) // len(WIDTHS) % 2 == 1)[:, None]
    is_angle = np.array([entry.unit != "mm" for entry in region.entries])
    turned = second & is_angle & (random.uniform(size=(SPREAD, k)) < TURNED)
    reversed_ = second & (random.uniform(size=(SPREAD, own.shape[1])) < REVERSED)
    amounts = start.amounts + shares * wide + np.where(turned, np.pi / region.scale, 0.0)
    return np.where(reversed_, -own, own), amounts, np.zeros((SPREAD, k), dtype=bool)


def _pushed(
    region: Region, start: OpenTable, places: Sequence[tuple[Reals, Reals]], matters: Mapping[int, float]
) -> tuple[Reals, Reals, Flags]:
    """Likewise, each entry held some way off the open table, the others as they are there and at places found."""
    direction, amounts, held = [], [], []
    for own, begun in [(region.table.direction[0], start.amounts), *places]:
        for k, step in matters.items():
            for push in step * np.array([*PUSHES, *(-push for push in PUSHES)]):
                row = begun.copy()
                row[k] = start.amounts[k] + push
                direction.append(own)
                amounts.append(row)
                held.append(np.arange(len(row)) == k)
    return np.array(direction), np.array(amounts), np.array(held)


class _ManyStarts:
    """What was found so far.

    Attributes
    ----------
    reach : (2, k), how far entries were found above and below the start, in their scales
    best : for each of these the directions (n,) and amounts (k,) of the table that lies there
    """

    def __init__(self, region: Region, start: OpenTable, watched: Collection[int]):
        self.region, self.start, self.watched = region, start, watched
        self.reach = np.zeros((2, len(region.entries)))
        self.best: dict[tuple[int, int], tuple[Reals, Reals]] = {}

    def try_from(self, direction: Reals, amounts: Reals, held: Flags) -> None:
        """Go from starts toward what is asked for, and keep what comes farthest."""
        for begun in range(0, len(amounts), CHUNK):
            own = slice(begun, begun + CHUNK)
            for row, place in zip(direction[own], self._lowered(direction[own], amounts[own], held[own])):
                if place is not None:
                    self._keep(row, place)

    def _keep(self, direction: Reals, amounts: Reals) -> None:
        region = self.region
        table = region.at(amounts).with_column("direction", slice(None), direction[None])
        nearest = nearest_rows(table, region, self.watched)
        place = nearest.direction[0], amounts_between(region.table, nearest, region.entries)
        basis = region.basis
        apart = basis @ (basis.T @ (place[1] - self.start.amounts))
        for way, sign in enumerate((1.0, -1.0)):
            for k in np.flatnonzero(sign * apart > self.reach[way] + FAR / 2).tolist():
                self.reach[way, k], self.best[way, k] = sign * apart[k], place

    def farthest(self) -> list[tuple[Reals, Reals]]:
        """Different tables found, those first that lie farthest along most entries."""
        counted: dict[bytes, list[tuple[Reals, Reals]]] = {}
        for place in self.best.values():
            counted.setdefault(place[1].tobytes(), []).append(place)
        return [same[0] for same in sorted(counted.values(), key=lambda same: -len(same))]

    def found(self) -> list[Elsewhere]:
        """Tables found, as points of the regions with their directions; those that extremes allow as well."""
        region, found = self.region, list[Elsewhere]()
        for direction, amounts in self.farthest()[:MOST_KEPT]:
            table = region.table.with_column("direction", slice(None), direction[None])
            other = Region(region.asked, table, region.entries, region.gauge)
            point = other.restarted(amounts, self.start.chi2)
            found += [Elsewhere(other, point)] if point else []
        return found

    def _lowered(self, direction: Reals, amounts: Reals, held: Flags) -> list[Reals | None]:
        """Amounts (k,) at which what is asked for is met, reached from each of R starts; None where it is not."""
        region, likely = self.region, self.region.asked.likely
        amounts = np.clip(amounts, -region.widest, region.widest)
        off = self._off(direction, amounts)
        rest = self._rest(off)
        damping = np.full(len(amounts), DAMPING)
        going: Flags = (rest != 0).any(axis=1)
        for _ in range(PASSES):
            rows = np.flatnonzero(going)
            if not len(rows):
                break
            step = self._steps(direction[rows], amounts[rows], off[rows], rest[rows], damping[rows], held[rows])
            trial = np.clip(amounts[rows] + step, -region.widest, region.widest)
            new_off = self._off(direction[rows], trial)
            new = self._rest(new_off)
            before, after = (rest[rows] ** 2).sum(axis=1), (new**2).sum(axis=1)
            better = after < before
            kept = rows[better]
            amounts[kept], off[kept], rest[kept] = trial[better], new_off[better], new[better]
            damping[rows] = np.where(better, np.maximum(damping[rows] / 10, 1e-9), damping[rows] * 10)
            stalled = better & (after > (1 - STALLED) * before)
            going[rows[stalled | (after == 0)]] = False
            going &= damping < MOST_DAMPING
        chi2 = (off[:, likely] ** 2).sum(axis=1)
        met = self.region.asked.excess(off) <= MET
        met &= chi2 <= self.start.chi2 + PROFILE**2
        return [amount if good else None for amount, good in zip(amounts, met)]

    def _tables(self, direction: Reals, amounts: Reals) -> Tables:
        region = self.region
        return shifted(region.table, region.entries, amounts * region.scale).with_column(
            "direction", slice(None), direction
        )

    def _off(self, direction: Reals, amounts: Reals) -> Reals:
        return self.region.asked.plain_off(self._tables(direction, amounts))

    def _steps(self, direction: Reals, amounts: Reals, off: Reals, rest: Reals, damping: Reals, held: Flags) -> Reals:
        """Damped Gauss-Newton steps (R, k) that leave alone what is held and what moves no tool."""
        count, k = amounts.shape
        near = (amounts[:, None] + STEP * np.eye(k)).reshape(-1, k)
        beside = self._off(np.repeat(direction, k, axis=0), near).reshape(count, k, -1)
        J = np.where((rest[:, None] != 0) & ~held[..., None], (beside - off[:, None]) / STEP, 0.0)  # (R, k, m)
        normal = J @ J.swapaxes(1, 2)
        own = np.einsum("rkk->rk", normal)
        size = np.maximum(own.max(axis=1, keepdims=True), NOTHING)
        system = normal + np.eye(k) * (damping[:, None] * own + FLOOR * size)[:, None]
        step = np.linalg.solve(system, np.einsum("rkm,rm->rk", J, rest)[..., None])[..., 0]
        found: Reals = -step @ self.region.basis @ self.region.basis.T
        return found

    def _rest(self, off: Reals) -> Reals:
        """Components (R, m) of what lies outside the half-widths, a little within; of a likelihood all."""
        rest = self.region.asked.outside(off, STAYING)
        likely = self.region.asked.likely
        rest[:, likely] = off[:, likely]
        return rest
