"""Sine, cosine and arctangent as straight-line arithmetic, which compilers turn into vector instructions.

Coefficients and error bounds (under 1 unit in the last place) are those of fdlibm [1]_. Selections replace branches, no
table is looked up and no product is fused with a sum, so a value does not depend on the vector's width or on its place
in a block.

References
----------
.. [1] Sun Microsystems, *fdlibm* 5.3, 1993: ``k_sin.c``, ``k_cos.c``, ``e_rem_pio2.c``, ``s_atan.c``.
"""

from __future__ import annotations

import numpy as np

from er3a.numerics.jit import inner_kernel

LARGEST_ANGLE = 1e5  # rad; the two-part reduction below keeps full accuracy up to here

_HALF_PI_HIGH, _HALF_PI_LOW = 1.57079632673412561417e00, 6.07710050650619224932e-11
_PER_HALF_PI = 2 / np.pi
_LAST_BITS = 1.5 * 2.0**52  # a whole number plus this ends in the number's own bits
_TAN_PI_8 = 0.41421356237309503


@inner_kernel
def cos_sin(angle: float) -> tuple[float, float]:
    """Cosine and sine of an angle, without a branch. Kernel.

    Parameters
    ----------
    angle : rad, at most ``LARGEST_ANGLE`` in size

    Returns
    -------
    cosine, sine : to less than 1 unit in the last place

    Notes
    -----
    Multiples of pi/2, in two parts, are taken off, to within [-pi/4, pi/4]. Then come fdlibm's polynomials [1]_; the
    number of the quarter turn says which is which, and the signs.
    """
    # Number of the quarter turn nearest to the angle, and what is left of the angle.
    k = np.floor(angle * _PER_HALF_PI + 0.5)
    x = (angle - k * _HALF_PI_HIGH) - k * _HALF_PI_LOW
    z = x * x
    s = 2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)
    s = 8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * s)
    s = x + x * z * (-1.66666666666666324348e-01 + z * s)
    c = -2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)
    c = -1.38888888888741095749e-03 + z * (2.48015872894767294178e-05 + z * c)
    c = z * (4.16666666666666019037e-02 + z * c)
    half = 0.5 * z
    near_one = 1.0 - half
    c = near_one + ((1.0 - near_one) - half + z * c)
    turns = np.float64(k + _LAST_BITS).view(np.int64)
    odd = (turns & 1) != 0
    cosine, sine = s if odd else c, c if odd else s
    # Bit 1 moved up to the sign: the cosine is negative in quarters 1 and 2, the sine in 2 and 3.
    cosine = np.int64(np.float64(cosine).view(np.int64) ^ ((turns + 1 & 2) << 62)).view(np.float64)
    sine = np.int64(np.float64(sine).view(np.int64) ^ ((turns & 2) << 62)).view(np.float64)
    return cosine, sine


@inner_kernel
def arctan2(y: float, x: float) -> float:
    """Angle of the point (x, y), without a branch. Kernel.

    Parameters
    ----------
    y, x : coordinates of one unit; their lengths don't matter

    Returns
    -------
    angle : rad, in (-pi, pi]; NaN at the origin

    Notes
    -----
    The point is mirrored into the octant below the diagonal. Above 22.5 deg it is turned by 45 deg: ``arctan r = pi/4 +
    arctan((r - 1) / (r + 1))``. Then comes fdlibm's polynomial [1]_.
    """
    ax, ay = abs(x), abs(y)
    steep = ay > ax
    low, high = ax if steep else ay, ay if steep else ax
    reduced = low > _TAN_PI_8 * high
    r = (low - high if reduced else low) / (low + high if reduced else high)
    z = r * r
    w = z * z
    even = 6.66107313738753120669e-02 + w * (4.97687799461593236017e-02 + w * 1.62858201153657823623e-02)
    even = 3.33333333333329318027e-01 + w * (1.42857142725034663711e-01 + w * (9.09088713343650656196e-02 + w * even))
    odd = -7.69187620504482999495e-02 + w * (-5.83357013379057348645e-02 + w * -3.65315727442169155270e-02)
    odd = -1.99999999998764832476e-01 + w * (-1.11111104054623557880e-01 + w * odd)
    angle = r - r * (z * even + w * odd)
    angle = np.pi / 4 + angle if reduced else angle
    angle = np.pi / 2 - angle if steep else angle
    angle = np.pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle
