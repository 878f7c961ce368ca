"""What a picture of an arm shows."""

from __future__ import annotations

import colorsys
import io

import numpy as np
from PIL import Image

from er3a.pipeline.viewing.palette import JOINTS, rgb


def joints_seen(picture: bytes) -> int:
    """How many of the six joints' colours (by hue, shaded as they are) fill a spot of the picture."""
    pixels = Image.open(io.BytesIO(picture)).convert("HSV")
    hue, saturation, value = (np.asarray(band, dtype=float) for band in pixels.split())
    strong = (saturation > 100) & (value > 60)
    seen = 0
    for colour in JOINTS:
        wanted = colorsys.rgb_to_hsv(*(part / 255 for part in rgb(colour)))[0] * 255
        apart = np.abs((hue - wanted + 127.5) % 255 - 127.5)
        seen += int((strong & (apart < 4)).sum() > 40)
    return seen
