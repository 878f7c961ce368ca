"""Joint vectors that can be drawn again one by one: Philox4x32-10, a counter-based generator [1]_.

The counter is (sample within the block, block, draw), the key is the seed, and the four words of one draw
give six numbers of 21 bits (steps below 0.0002 deg for a full turn); arms with more than six joints take a second draw.
So the joint vector of sample n of block b depends on nothing else: not on what was drawn before it, nor on which
process draws which block.

References
----------
.. [1] J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11, 2011.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from er3a.by_value import frozen
from er3a.numerics.arrays import Integers, Reals, Singles
from er3a.numerics.jit import inner_kernel, kernel
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot

Counter = tuple[np.uint64, np.uint64, np.uint64, np.uint64]

CHUNK = 512
"""Samples that are worked on at a time, in rows of an array that stays in the processor's cache."""
OF_A_DRAW = 6  # numbers of 21 bits in 128 bits
UNIT_ROWS = 2 * OF_A_DRAW
"""Rows of random numbers that a chunk has place for."""
ROUNDS = 10
_LOW = np.uint64(0xFFFFFFFF)
_32 = np.uint64(32)
_M0, _M1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_W0, _W1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
_10, _11 = np.uint64(10), np.uint64(11)
_MASK_10, _MASK_11 = np.uint64(0x3FF), np.uint64(0x7FF)
_HALF, _STEP = np.float32(0.5), np.float32(2.0**-21)


@frozen
class Draw:
    """How the samples of a run are drawn.

    Attributes
    ----------
    seed : of the study, below 2**63
    samples, blocks : how many in all, and in how many blocks
    """

    seed: int
    samples: int
    blocks: int

    @property
    def sizes(self) -> Integers:
        """Samples (blocks,) of each block: as even as possible, the first ones one larger."""
        return self.samples // self.blocks + (np.arange(self.blocks) < self.samples % self.blocks)

    def opening_joints(self, robot: Robot, count: int) -> Reals:
        """Draw the first samples of each block again, about as many of each.

        Parameters
        ----------
        robot : gives limits
        count : how many at most

        Returns
        -------
        q : (N, n), rad or m; those outside limits of sums of joints, which are not counted, are left out
        """
        wanted = Draw(self.seed, min(count, self.samples), self.blocks).sizes
        blocks = np.repeat(np.arange(self.blocks), wanted)
        q = self.joints(robot, blocks, np.concatenate([np.arange(size) for size in wanted]))
        return q[within(robot, q)] if robot.combined else q

    def joints(self, robot: Robot, blocks: ArrayLike, samples: ArrayLike) -> Reals:
        """Draw the joint vectors of some samples again.

        Parameters
        ----------
        blocks, samples : (N,), the block of each sample and its number within it

        Returns
        -------
        q : (N, n), rad or m, within each joint's limits; a joint of zero range stays where it is
        """
        blocks, samples = np.asarray(blocks, dtype=np.int64), np.asarray(samples, dtype=np.int64)
        out = np.empty((len(blocks), robot.joints))
        _again(np.uint64(self.seed), blocks, samples, out)
        return robot.lower + out * (robot.upper - robot.lower)


@inner_kernel
def _round(
    c0: np.uint64, c1: np.uint64, c2: np.uint64, c3: np.uint64, k0: np.uint64, k1: np.uint64, r: np.uint64
) -> Counter:
    """One round of Philox4x32."""
    k0, k1 = (k0 + r * _W0) & _LOW, (k1 + r * _W1) & _LOW
    p0, p1 = _M0 * c0, _M1 * c2
    return (p1 >> _32) ^ c1 ^ k0, p1 & _LOW, (p0 >> _32) ^ c3 ^ k1, p0 & _LOW


@kernel
def philox4x32(c0: np.uint64, c1: np.uint64, c2: np.uint64, c3: np.uint64, k0: np.uint64, k1: np.uint64) -> Counter:
    """Four random words from a counter and a key: Philox4x32-10 [1]_. Kernel.

    Parameters
    ----------
    c0, c1, c2, c3 : the counter, 32 bits each, held in uint64
    k0, k1 : the key, 32 bits each, held in uint64

    Returns
    -------
    words : four numbers of 32 bits, held in uint64
    """
    for r in range(ROUNDS):
        c0, c1, c2, c3 = _round(c0, c1, c2, c3, k0, k1, np.uint64(r))
    return c0, c1, c2, c3


@inner_kernel
def _unit(bits: np.uint64) -> np.float32:
    """A number in (0, 1) from 21 bits, exact in single precision."""
    return (np.float32(np.int32(bits)) + _HALF) * _STEP


@inner_kernel
def _fifth(a: np.uint64, b: np.uint64) -> np.uint64:
    """The bits that two words have left over."""
    return ((a & _MASK_11) << _10) | (b & _MASK_10)


@inner_kernel
def fill_uniform(seed: np.uint64, block: np.uint64, first: np.uint64, draw: int, rows: Singles) -> None:
    """Fill in the random numbers of a chunk of samples. Kernel.

    Parameters
    ----------
    seed : of the study, the key
    block : number of the block
    first : number within the block of the chunk's first sample
    draw : 0 for the first six joints, 1 for further ones
    rows : six stretches of ``CHUNK`` numbers, filled with numbers in (0, 1), multiples of 2^-21 plus half a step
    """
    k0, k1 = seed & _LOW, seed >> _32
    for i in range(CHUNK):
        sample = first + np.uint64(i)
        a, b, c, d = sample & _LOW, sample >> _32, block, np.uint64(draw)
        for r in range(ROUNDS):  # unrolled by the compiler, so that the loop around it becomes vector instructions
            a, b, c, d = _round(a, b, c, d, k0, k1, np.uint64(r))
        rows[i] = _unit(a >> _11)
        rows[CHUNK + i] = _unit(b >> _11)
        rows[2 * CHUNK + i] = _unit(c >> _11)
        rows[3 * CHUNK + i] = _unit(d >> _11)
        rows[4 * CHUNK + i] = _unit(_fifth(a, b))
        rows[5 * CHUNK + i] = _unit(_fifth(c, d))


@kernel
def _again(seed: np.uint64, blocks: Integers, samples: Integers, out: Reals) -> None:
    """Fill ``out`` (N, n) with the random numbers of single samples, in (0, 1)."""
    joints = out.shape[1]
    for n in range(blocks.shape[0]):
        sample = np.uint64(samples[n])
        key = seed & _LOW, seed >> _32
        for draw in range(2):
            block, number = np.uint64(blocks[n]), np.uint64(draw)
            a, b, c, d = philox4x32(sample & _LOW, sample >> _32, block, number, key[0], key[1])
            words = (_unit(a >> _11), _unit(b >> _11), _unit(c >> _11), _unit(d >> _11))
            six = (words[0], words[1], words[2], words[3], _unit(_fifth(a, b)), _unit(_fifth(c, d)))
            for k in range(min(OF_A_DRAW, joints - draw * OF_A_DRAW)):
                out[n, draw * OF_A_DRAW + k] = six[k]
