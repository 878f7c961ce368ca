"""Paints triangles through a buffer of depths; kept out of ``still.py``, whose edits then compile no kernel again."""

from __future__ import annotations

from er3a.numerics.arrays import Reals
from er3a.numerics.jit import kernel


@kernel
def paint(corners: Reals, colours: Reals, image: Reals, near: Reals) -> None:
    """Paint triangles on an image, those in front over those behind.

    Parameters
    ----------
    corners : (n, 3, 3), x, y in px of the image and 1 / depth, of each corner of each triangle; depth 0 or less: none
    colours : (n, 4), red, green, blue, each times alpha, and alpha, 0 to 1; only 1 covers what is painted later; of a
        shadow alpha alone, (n, 1)
    image : (h, w, 4) or (h, w, 1), the same, painted on
    near : (h, w), 1 / depth of what is seen there, 0 where nothing is
    """
    height, width = near.shape
    for n in range(len(corners)):
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = corners[n]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0 or az <= 0.0 or bz <= 0.0 or cz <= 0.0:
            continue
        left, right = max(int(min(ax, bx, cx)), 0), min(int(max(ax, bx, cx)) + 1, width - 1)
        top, bottom = max(int(min(ay, by, cy)), 0), min(int(max(ay, by, cy)) + 1, height - 1)
        for j in range(top, bottom + 1):
            for i in range(left, right + 1):
                x, y = i + 0.5, j + 0.5
                u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
                v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
                z = u * az + v * bz + (1.0 - u - v) * cz
                if u < 0.0 or v < 0.0 or u + v > 1.0 or z <= near[j, i]:
                    continue
                for k in range(image.shape[2]):
                    image[j, i, k] = colours[n, k] + (1.0 - colours[n, -1]) * image[j, i, k]
                if colours[n, -1] == 1.0:
                    near[j, i] = z
