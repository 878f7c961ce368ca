"""Matplotlib figures as SVG images for the pages."""

from __future__ import annotations

import io
import re
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

import matplotlib
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager
from matplotlib.rcsetup import cycler

from er3a.pipeline.messages import language
from er3a.pipeline.viewing.figure_readings import name_parts
from er3a.pipeline.viewing.palette import GRID, INK, MUTED, SIX_JOINTS

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

FONTS = ["DejaVu Sans"]
CHINESE_FONTS = (
    "Noto Sans CJK SC",
    "Noto Sans CJK JP",  # as matplotlib names the collection of all of Noto's
    "Source Han Sans SC",
    "WenQuanYi Zen Hei",
    "WenQuanYi Micro Hei",
    "Microsoft YaHei",
    "PingFang SC",
    "SimHei",
)
STYLE: dict[RcKeyType, Any] = {
    "axes.edgecolor": MUTED,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.prop_cycle": cycler(color=SIX_JOINTS),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "figure.constrained_layout.use": True,
    "figure.facecolor": "white",
    "font.family": FONTS,
    "font.size": 10,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "lines.linewidth": 1.6,
    "svg.hashsalt": "er3a",
    "xtick.color": INK,
    "ytick.color": INK,
}
_COORDINATES = re.compile(r'(?<= )(?:d|x|y)="[^"]*"')
_DECIMALS = re.compile(r"-?\d+\.\d{3,}")
_TAG = re.compile(r"<[^>]*>")
_QUOTED = re.compile(r"=\"([^\"']*)\"")
_IN_ADDRESSES = str.maketrans({letter: f"%{ord(letter):02X}" for letter in '%#<>&"\n'})
_BLANKS = re.compile(r"\s*(?<![=\"])([A-Za-z])\s+(?=[-\d])|\s+(?=[z\"])")


def house_style() -> AbstractContextManager[None]:
    """The look of all figures of the pages, in the language of the pages, for what is drawn within it."""
    if language.current() != "zh":
        return matplotlib.rc_context(STYLE)
    present = {font.name for font in fontManager.ttflist}
    chinese = [name for name in CHINESE_FONTS if name in present][:1]
    # Without a font for it here, Chinese stays text, for which the reader's browser finds one.
    glyphs = "path" if chinese else "none"
    return matplotlib.rc_context(STYLE | {"font.family": [*FONTS, *chinese], "svg.fonttype": glyphs})


def new_figure(rows: int = 1, columns: int = 1, width: float = 9.0, height: float = 4.5, **subplots):
    """A figure and its axes (as ``Figure.subplots`` returns them); sizes in inches."""
    figure = Figure(figsize=(width, height))
    return figure, figure.subplots(rows, columns, **subplots)


def row_of_panels(
    columns: int, width: float, height: float, room: tuple[float, float, float, float, float], **subplots
):
    """A figure and its axes (columns,) where they are put: finding places for them takes longer than drawing.

    Parameters
    ----------
    width, height, room : inches; ``room`` is left free at the left, below, at the right, above and between panels
    """
    figure = Figure(figsize=(width, height), layout="none")  # type: ignore[arg-type]  # the stubs lack it
    left, below, right, above, between = room
    panel = (width - left - right - (columns - 1) * between) / columns
    sides = {"left": left / width, "right": 1 - right / width, "wspace": between / panel}
    figure.subplots_adjust(bottom=below / height, top=1 - above / height, **sides)
    return figure, figure.subplots(1, columns, **subplots)


def equal_scale(axes: Axes, x_label: str, y_label: str) -> None:
    """A drawing to scale: equal units on both axes."""
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)


def svg_data_uri(figure: Figure) -> Markup:
    """A figure in the house style as a ``data:`` address of an SVG image (dense clouds rasterised at 160 dpi), fit for
    an attribute in double quotes."""
    buffer = io.BytesIO()
    figure.dpi = 160
    name_parts(figure)
    # Not savefig: it would draw a figure with a layout twice.
    FigureCanvasSVG(figure).print_svg(buffer, metadata={"Date": None})
    svg = _compact(buffer.getvalue().decode())
    # As text, which is a third shorter than base64. The letters that an address or an attribute reads otherwise are
    # written by their numbers; values stand in single quotes, which need none.
    quoted = _TAG.sub(lambda tag: _QUOTED.sub(r"='\1'", tag[0]), svg)
    return Markup("data:image/svg+xml," + quoted.translate(_IN_ADDRESSES))


def _compact(svg: str) -> str:
    """The same picture in fewer letters: coordinates to a hundredth of a point, path data without blanks that say
    nothing, no indentation and no comments."""
    shorter = _COORDINATES.sub(lambda found: _BLANKS.sub(r"\1", _DECIMALS.sub(_shorter, found[0])), svg)
    return re.sub(r">\s+<", "><", re.sub(r"<!--.*?-->", "", shorter, flags=re.DOTALL)).strip()


def _shorter(number: re.Match[str]) -> str:
    return f"{float(number[0]):.2f}".rstrip("0").rstrip(".")
