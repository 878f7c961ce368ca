"""Colours used the same way in figures and recordings; those of six joints are safe for colour-blind readers.

The joint colours are the qualitative set of M. Okabe and K. Ito, "Color Universal Design", 2008.

One colour for each of the four arm shapes (shoulder, elbow), on the page and in the recording alike.

Safe for colour-blind readers and different from the joints' colours: P. Tol, "Colour schemes", 2021, scheme *bright*.
"""

from __future__ import annotations

_BETWEEN_GROUNDS = 0.19  # luminance: (1.05 / (L + 0.05)) = (L + 0.05) / (0.005 + 0.05), nearly
SIX_JOINTS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b8860b", "#56b4e9")
JOINTS = (*SIX_JOINTS, "#7b4fa3", "#4d4d4d", "#a05a2c", "#80b918")
JOINT_NAMES = tuple(f"J{k}" for k in range(1, len(JOINTS) + 1))

INK = "#1f2933"
MUTED = "#7b8794"
GRID = "#d9e0e7"
MODEL = "#0072b2"
REFERENCE = "#d55e00"
HIGHLIGHT = "#c2185b"
LINK = "#c9d1d9"
SHELL = "#eef2f6"
BODY = "#9aa5b1"
PLATE = "#4a5868"

VOIDS = {"enclosed": HIGHLIGHT, "open": "#e39bb9"}  # one hue, as in the page's section
TOUCHING, DOUBTFUL = "#e0392d", "#dd9a1a"  # of solids, which light darkens

VERDICTS = {
    "pass": "#18794e",
    "caution": "#9a6700",
    "fail": "#b42318",
    "conflict": "#6941c6",
    "no_reference": "#52606d",
    "not_computed": "#52606d",
}


def rgb(colour: str) -> tuple[int, int, int]:
    """Red, green and blue of a colour.

    Parameters
    ----------
    colour : ``#rrggbb``

    Returns
    -------
    parts : 0 to 255 each
    """
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def link_colour(link: int) -> str:
    """The colour of a link that a surface shows: grey, with something of the colour of the joint that moves it.

    Parameters
    ----------
    link : from 1; 0 for the base, which is grey alone

    Returns
    -------
    colour : ``#rrggbb``, 60 % of the grey
    """
    shade = zip(rgb(LINK), rgb(JOINTS[link - 1] if link else BODY))
    return "#" + "".join(f"{round(0.6 * grey + 0.4 * own):02x}" for grey, own in shade)


def legible(colour: str) -> tuple[int, int, int]:
    """A colour of the same hue that can be read on the viewer's dark ground as well as on its light one.

    Parameters
    ----------
    colour : ``#rrggbb``

    Returns
    -------
    parts : red, green and blue, 0 to 255

    Notes
    -----
    Its relative luminance (WCAG 2) is scaled to where the contrast with both grounds is the same.
    """
    # From sRGB to linear light, in which luminance is a weighted sum, and back (IEC 61966-2-1).
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (part / 255 for part in rgb(colour))]
    luminance = sum(weight * c for weight, c in zip((0.2126, 0.7152, 0.0722), linear))
    scaled = [min(1.0, c * _BETWEEN_GROUNDS / luminance) for c in linear]
    red, green, blue = (round(255 * (12.92 * c if c <= 0.0031308 else 1.055 * c ** (1 / 2.4) - 0.055)) for c in scaled)
    return red, green, blue


SHAPE_COLOURS = ("#4477aa", "#ccbb44", "#228833", "#66ccee")


def shape_of(branch: int, label: str) -> int:
    """Number of the arm shape that a solution has, by which it is coloured.

    Parameters
    ----------
    branch : number of the solution's branch
    label : code of the branch; ``found_arm`` for arms without named branches

    Returns
    -------
    shape : two wrist branches of the closed form share one; found arms have one each
    """
    return branch if label == "found_arm" else branch // 2


def colour_of(shape: int) -> str:
    """The colour of an arm shape, in figures and recordings alike.

    Parameters
    ----------
    shape : of :func:`shape_of`; beyond four the colours repeat

    Returns
    -------
    colour : ``#rrggbb``
    """
    return SHAPE_COLOURS[shape % len(SHAPE_COLOURS)]
