"""The furthest samples in many fixed directions, found without storing the samples.

A sample at distance r from an inner point can only be a new extreme if r exceeds a threshold that depends on the way
it points. The ways are sorted into the patches of a cube map; with s_d the best support so far in direction d, seen
from the inner point, and theta the least angle between d and the patch, no sample of the patch below
``min_d s_d / cos(theta)`` improves anything. The thresholds are refreshed as the support grows. They only skip
samples that could not matter, so the result is that of comparing each sample with each direction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.kinematics.jit import kernel

_PATCHES = 24
_SAFETY = 1 - 1e-9
NONE = -1


@dataclass(frozen=True, eq=False)
class Extremes:
    """Per direction the furthest sample.

    Attributes
    ----------
    support : (D,), m, the sample's coordinate along the direction, -inf where there is none
    block, sample : (D,), int64, which sample it is, -1 where there is none
    """

    support: np.ndarray
    block: np.ndarray
    sample: np.ndarray

    @classmethod
    def empty(cls, count: int) -> Extremes:
        """No sample yet."""
        return cls(np.full(count, -np.inf), np.full(count, NONE), np.full(count, NONE))

    def merge(self, other: Extremes) -> Extremes:
        """The further of the two in each direction, the earlier sample at a tie."""
        earlier = (other.block < self.block) | ((other.block == self.block) & (other.sample < self.sample))
        take = (other.support > self.support) | ((other.support == self.support) & earlier & (other.block != NONE))
        return Extremes(
            *(np.where(take, b, a) for a, b in zip(self._arrays(), other._arrays())),
        )

    def _arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.support, self.block, self.sample


def fibonacci_sphere(count: int) -> np.ndarray:
    """Nearly even unit vectors (count, 3) [1]_.

    References
    ----------
    .. [1] A. Gonzalez, "Measurement of areas on a sphere using Fibonacci and latitude-longitude lattices",
       Mathematical Geosciences 42, 2010.
    """
    n = np.arange(count)
    z = 1 - (2 * n + 1) / count
    azimuth = 2 * np.pi * n * (2 / (1 + np.sqrt(5)))
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z], axis=1)


def cube_map() -> tuple[np.ndarray, np.ndarray]:
    """Centres (P, 3) and angular radii (P,) in rad of the patches that :func:`_patch` numbers."""
    edge = np.linspace(-1, 1, _PATCHES + 1)
    middle = (edge[1:] + edge[:-1]) / 2
    centres, radii = [], []
    for face in range(6):
        major, sign = face // 2, 1 - 2 * (face % 2)

        def unit(u, v, major=major, sign=sign):
            out = np.empty((*np.broadcast(u, v).shape, 3))
            out[..., major], out[..., (major + 1) % 3], out[..., (major + 2) % 3] = sign, u, v
            return out / np.linalg.norm(out, axis=-1, keepdims=True)

        centre = unit(middle[:, None], middle[None, :])
        corners = unit(edge[:, None], edge[None, :])
        cosine = np.min(
            [np.sum(centre * corners[i : i + _PATCHES, j : j + _PATCHES], axis=-1) for i in (0, 1) for j in (0, 1)],
            axis=0,
        )
        centres.append(centre.reshape(-1, 3))
        radii.append(np.arccos(np.minimum(cosine, 1)).ravel())
    return np.concatenate(centres), np.concatenate(radii) + 1e-6


@kernel
def _patch(x, y, z):
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


@kernel
def refresh_thresholds(directions, support, inner, centres, cos_radius, sin_radius, threshold):
    """Set the squared distance per patch below which no sample improves any direction."""
    for p in range(centres.shape[0]):
        least = np.inf
        for d in range(directions.shape[0]):
            dx, dy, dz = directions[d, 0], directions[d, 1], directions[d, 2]
            s = max(0.0, support[d] - (inner[0] * dx + inner[1] * dy + inner[2] * dz))
            c = centres[p, 0] * dx + centres[p, 1] * dy + centres[p, 2] * dz
            least_angle_cosine = 1.0
            if c < cos_radius[p]:
                least_angle_cosine = c * cos_radius[p] + np.sqrt(max(0.0, 1.0 - c * c)) * sin_radius[p]
            if least_angle_cosine > 0.0:
                least = min(least, s / least_angle_cosine)
        threshold[p] = (least * _SAFETY) ** 2


@kernel
def update_extremes(points, block, first_sample, directions, inner, threshold, support, blocks, samples):
    """Take the points (N, 3) of a block, in the order of their samples, into the extremes."""
    for n in range(points.shape[0]):
        px, py, pz = points[n, 0], points[n, 1], points[n, 2]
        x, y, z = px - inner[0], py - inner[1], pz - inner[2]
        if x * x + y * y + z * z < threshold[_patch(x, y, z)]:
            continue
        for d in range(directions.shape[0]):
            along = px * directions[d, 0] + py * directions[d, 1] + pz * directions[d, 2]
            if along > support[d]:
                support[d], blocks[d], samples[d] = along, block, first_sample + n
