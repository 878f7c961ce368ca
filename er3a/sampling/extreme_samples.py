"""The furthest samples in many fixed directions, found without storing the samples.

A sample at distance r from an inner point can only be a new extreme if r exceeds a threshold that depends on the way
it points. The ways are sorted into the patches of a cube map; with s_d the best support so far in direction d, seen
from the inner point, and theta the least angle between d and the patch, no sample of the patch below
``min_d s_d / cos(theta)`` improves anything. Each cell of the grid gets such a threshold, and each patch a list of the
directions that come into question first. Both are refreshed as the support grows. They only skip what could not matter,
so the result is that of comparing each sample with each direction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.geometry.vectors import Vector
from er3a.numerics.arrays import Integers, Reals, Singles
from er3a.numerics.jit import inner_kernel, kernel

NearLists = tuple[Reals, Integers, Integers, Reals]
Cells = tuple[Reals, float, tuple[int, int, int]]
Furthest = tuple[Reals, Reals, Integers, Integers]  # directions (D, 3) and what Extremes holds

_PATCHES = 16
_SAFETY = 1 - 1e-5
_LISTED, _LONGEST = 0.06, 128
NONE = -1


@dataclass(frozen=True, eq=False)
class Extremes:
    """Per direction the furthest sample.

    Attributes
    ----------
    support : (D,), m, the sample's coordinate along the direction, -inf where there is none
    block, sample : (D,), int64, which sample it is, -1 where there is none
    """

    support: Reals
    block: Integers
    sample: Integers

    @classmethod
    def empty(cls, count: int) -> Extremes:
        """No sample yet."""
        return cls(np.full(count, -np.inf), np.full(count, NONE), np.full(count, NONE))

    def merge(self, other: Extremes) -> Extremes:
        """The further of the two in each direction, the earlier sample at a tie."""
        earlier = (other.block < self.block) | ((other.block == self.block) & (other.sample < self.sample))
        take = (other.support > self.support) | ((other.support == self.support) & earlier & (other.block != NONE))
        names = "support", "block", "sample"
        return Extremes(*(np.where(take, getattr(other, name), getattr(self, name)) for name in names))


def cube_map() -> Reals:
    """Centres (unit vectors) and angular radii (rad) of the patches that :func:`_patch` numbers, as rows (4, P)."""
    edge = np.linspace(-1, 1, _PATCHES + 1)
    middle = (edge[1:] + edge[:-1]) / 2
    centres, radii = [], []
    for face in range(6):
        major, sign = face // 2, 1 - 2 * (face % 2)

        def unit(u: Reals, v: Reals, major: int = major, sign: int = sign) -> Reals:
            out = np.empty((*np.broadcast(u, v).shape, 3))
            out[..., major], out[..., (major + 1) % 3], out[..., (major + 2) % 3] = sign, u, v
            direction: Reals = out / np.linalg.norm(out, axis=-1, keepdims=True)
            return direction

        centre = unit(middle[:, None], middle[None, :])
        corners = unit(edge[:, None], edge[None, :])
        near = [corners[i : i + _PATCHES, j : j + _PATCHES] for i in (0, 1) for j in (0, 1)]
        cosine = np.min([np.sum(centre * corner, axis=-1) for corner in near], axis=0)
        centres.append(centre.reshape(-1, 3))
        radii.append(np.arccos(np.minimum(cosine, 1)).ravel())
    return np.concatenate([np.concatenate(centres).T, np.concatenate(radii)[None] + 1e-6])


@kernel
def _patch(x: float, y: float, z: float) -> int:
    ax, ay, az = abs(x), abs(y), abs(z)
    if ax >= ay and ax >= az:
        face, m, u, v = (0 if x >= 0 else 1), ax, y, z
    elif ay >= az:
        face, m, u, v = (2 if y >= 0 else 3), ay, z, x
    else:
        face, m, u, v = (4 if z >= 0 else 5), az, x, y
    if m == 0.0:
        return 0
    i = min(_PATCHES - 1, int((u / m + 1.0) * (0.5 * _PATCHES)))
    j = min(_PATCHES - 1, int((v / m + 1.0) * (0.5 * _PATCHES)))
    return (face * _PATCHES + i) * _PATCHES + j


@inner_kernel
def _set_thresholds(directions: Reals, seen: Reals, patches: Reals, widen: float, threshold: Reals) -> None:
    """Squared distance per patch, grown by the angle ``widen`` (rad), below which nothing improves any direction."""
    cos_widen, sin_widen = np.cos(widen), np.sin(widen)
    count = patches.shape[1]
    threshold[:] = np.inf
    for d in range(directions.shape[0]):
        dx, dy, dz, s = directions[d, 0], directions[d, 1], directions[d, 2], seen[d]
        for p in range(count):
            c = patches[0, p] * dx + patches[1, p] * dy + patches[2, p] * dz
            cos_radius = patches[3, p] * cos_widen - patches[4, p] * sin_widen
            sin_radius = patches[4, p] * cos_widen + patches[3, p] * sin_widen
            nearest = c * cos_radius + np.sqrt(max(0.0, 1.0 - c * c)) * sin_radius
            nearest = 1.0 if c >= cos_radius else nearest
            limit = s / nearest if nearest > 0.0 else np.inf
            threshold[p] = limit if limit < threshold[p] else threshold[p]
    for p in range(count):
        threshold[p] = (threshold[p] * _SAFETY) ** 2


@inner_kernel
def _set_lists(directions: Reals, seen: Reals, patches: Reals, least: Reals, lists: NearLists) -> None:
    """List for each patch the directions that may be improved there, by the distance from which on they are.

    Parameters
    ----------
    least : (P,), lower bounds (squared, m^2) of the distances from which on anything is improved
    """
    complete, count, near, limits = lists
    lowest = seen.min()
    for p in range(patches.shape[1]):
        limit = np.sqrt(least[p]) * (1.0 + _LISTED)
        complete[p], count[p] = limit * limit, 0
        widest = np.arccos(min(1.0, lowest / limit)) + np.arccos(patches[3, p]) if limit > 0.0 else np.pi
        enough = np.cos(min(np.pi, widest)) - 1e-9
        for d in range(directions.shape[0]):
            c = patches[0, p] * directions[d, 0] + patches[1, p] * directions[d, 1] + patches[2, p] * directions[d, 2]
            if c < enough:
                continue
            nearest = 1.0
            if c < patches[3, p]:
                nearest = c * patches[3, p] + np.sqrt(max(0.0, 1.0 - c * c)) * patches[4, p]
            if seen[d] >= limit * nearest:
                continue
            if count[p] == near.shape[1]:
                complete[p] = 0.0
                break
            n, own = count[p], (seen[d] / nearest * _SAFETY) ** 2
            while n > 0 and limits[p, n - 1] > own:
                limits[p, n], near[p, n] = limits[p, n - 1], near[p, n - 1]
                n -= 1
            limits[p, n], near[p, n] = own, d
            count[p] += 1


@inner_kernel
def refresh(
    directions: Reals, support: Reals, inner: Reals, patches: Reals, lists: NearLists, grid: Cells, idle: Singles
) -> None:
    """Set the lists of the patches, and where samples of each cell are idle, from the support so far.

    Parameters
    ----------
    inner : (3,), m, the inner point; patches : (5, P), centres, cosines and sines of the radii of the cube map
    lists : see :func:`near_lists`, set
    grid : origin (3,), cell (m), shape
    idle : (cells,), set to the squared distance (m^2) from the inner point below which a sample improves nothing
    """
    origin, cell, (nx, ny, nz) = grid
    seen = np.empty(directions.shape[0])
    for d in range(directions.shape[0]):
        along = inner[0] * directions[d, 0] + inner[1] * directions[d, 1] + inner[2] * directions[d, 2]
        seen[d] = max(0.0, support[d] - along)
    least, half = seen.min() * _SAFETY, 0.5 * np.sqrt(3.0) * cell
    small = least > 3.0 * half
    # A cell that holds a place beyond ``least`` is seen from the inner point under at most this angle.
    widen, wider = np.arcsin(half / (least - 2.0 * half)) if small else 0.0, np.empty(patches.shape[1])
    _set_thresholds(directions, seen, patches, widen, wider)
    _set_lists(directions, seen, patches, wider, lists)
    if not small:
        return
    for i in range(nx):
        x = origin[0] + (i + 0.5) * cell - inner[0]
        for j in range(ny):
            y = origin[1] + (j + 0.5) * cell - inner[1]
            for k in range(nz):
                z = origin[2] + (k + 0.5) * cell - inner[2]
                inside = np.sqrt(x * x + y * y + z * z) + half < least
                idle[(i * ny + j) * nz + k] = np.inf if inside else wider[_patch(x, y, z)]


def near_lists(patches: int) -> NearLists:
    """Per patch: squared distance (m^2) up to which its list is complete, length of the list, directions, and the
    squared distances from which on each may be improved. Before the first refresh no list is complete.
    """
    shape = (patches, _LONGEST)
    return np.zeros(patches), np.zeros(patches, np.int64), np.zeros(shape, np.int64), np.zeros(shape)


@inner_kernel
def take_point(point: Vector, block: int, sample: int, inner: Reals, lists: NearLists, furthest: Furthest) -> None:
    """Take one point (x, y, z) into the extremes; samples of a block come in their order."""
    (complete, count, near, limits), (directions, support, blocks, samples) = lists, furthest
    x, y, z = point[0] - inner[0], point[1] - inner[1], point[2] - inner[2]
    squared, patch = x * x + y * y + z * z, _patch(x, y, z)
    listed = squared < complete[patch]
    for n in range(count[patch] if listed else directions.shape[0]):
        if listed and limits[patch, n] > squared:
            break
        d = near[patch, n] if listed else n
        along = point[0] * directions[d, 0] + point[1] * directions[d, 1] + point[2] * directions[d, 2]
        if along > support[d]:
            support[d], blocks[d], samples[d] = along, block, sample
