"""Random joint vectors that can be drawn again one by one: Philox4x32-10, a counter-based generator [1]_.

The counter is (sample within the block, block, half), the key is the seed. So the joint vector of sample n of block b
depends on nothing else: not on what was drawn before it, nor on how blocks are shared out among processes.

References
----------
.. [1] J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11, 2011.
"""

from __future__ import annotations

import numpy as np

from er3a.kinematics.chain import JOINTS
from er3a.kinematics.jit import kernel
from er3a.robots.robot import Robot

ROUNDS = 10
_LOW = np.uint64(0xFFFFFFFF)
_32 = np.uint64(32)
_M0, _M1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_W0, _W1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_STEP = 2.0**-32


@kernel
def philox4x32(c0, c1, c2, c3, k0, k1):
    """Four random 32-bit words from four counter words and two key words, all held in uint64."""
    for _ in range(ROUNDS):
        p0, p1 = _M0 * c0, _M1 * c2
        c0, c1, c2, c3 = (p1 >> _32) ^ c1 ^ k0, p1 & _LOW, (p0 >> _32) ^ c3 ^ k1, p0 & _LOW
        k0, k1 = (k0 + _W0) & _LOW, (k1 + _W1) & _LOW
    return c0, c1, c2, c3


@kernel
def _unit(word):
    return (np.float64(word) + 0.5) * _STEP


@kernel
def draw_unit(seed, block, sample, out):
    """Set the six entries of ``out`` to independent uniform numbers in (0, 1)."""
    s0, s1 = sample & _LOW, sample >> _32
    k0, k1 = seed & _LOW, seed >> _32
    a, b, c, d = philox4x32(s0, s1, block, np.uint64(0), k0, k1)
    e, f, _, _ = philox4x32(s0, s1, block, np.uint64(1), k0, k1)
    out[0], out[1], out[2], out[3], out[4], out[5] = _unit(a), _unit(b), _unit(c), _unit(d), _unit(e), _unit(f)


@kernel
def _draw(seed, blocks, samples, lower, span, out):
    unit = np.empty(6)
    for n in range(blocks.shape[0]):
        draw_unit(seed, np.uint64(blocks[n]), np.uint64(samples[n]), unit)
        for k in range(6):
            out[n, k] = lower[k] + unit[k] * span[k]


def joint_vectors(robot: Robot, seed: int, blocks: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Draw the joint vectors of some samples again.

    Parameters
    ----------
    seed : of the study, below 2**63
    blocks, samples : (N,), the block of each sample and its number within it

    Returns
    -------
    q : (N, 6), rad, uniform within the joint limits; a joint of zero range stays where it is
    """
    out = np.empty((len(blocks), JOINTS))
    blocks, samples = np.asarray(blocks, dtype=np.int64), np.asarray(samples, dtype=np.int64)
    _draw(np.uint64(seed), blocks, samples, robot.lower, robot.upper - robot.lower, out)
    return out
