"""Matplotlib figures as SVG images for the pages.

Data for the pointer in a figure: the place and scale of its axes, and the names of its curves.

Points of curves are not repeated: the script reads them from the drawing itself, by the names of its parts.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.colors import to_hex
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager
from matplotlib.lines import Line2D
from matplotlib.rcsetup import cycler
from matplotlib.ticker import FixedLocator

from er3a.pipeline import language
from er3a.pipeline.language import tr, unit_sign
from er3a.pipeline.messages.say import bracketed
from er3a.pipeline.tables import Table
from er3a.pipeline.viewing.palette import GRID, INK, MUTED, SIX_JOINTS

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

MAX_STEPS = 16  # a colour map of few colours stands for whole numbers or classes
NUMBER = re.compile(r"[-−]?[\d.]*(e\d+)?")


def name_parts(figure: Figure) -> None:
    """Name the curves of a figure that is about to be drawn, so that the page's script can find them in the drawing.

    Parameters
    ----------
    figure : whose lines get an id ``curve-AXES-NUMBER``
    """
    for i, ax in enumerate(figure.axes):
        for k, line in enumerate(_curves(ax)):
            line.set_gid(f"curve-{i}-{k}")


def readings(figure: Figure) -> list[dict[str, Any]]:
    """Of a figure that was drawn, all axes from which values can be read.

    Returns
    -------
    list of {"box": left, bottom, right, top in parts of the image; "x", "y": scales; "curves": [part, name];
    "drawn_to_scale"; "bars": [from, to (across), from, to (along), upright, name, colour]}
    """
    bars = {mappable.colorbar.ax for ax in figure.axes for mappable in _shaded(ax) if mappable.colorbar}
    return [
        _axes(i, ax, [other for other in figure.axes if other.axison and other not in bars])
        for i, ax in enumerate(figure.axes)
        if ax.axison and ax.get_visible() and ax not in bars
    ]


def _axes(i: int, ax: Axes, others: list[Axes]) -> dict[str, Any]:
    return {
        "box": _extents(ax),
        "x": _scale(ax.xaxis, others),
        "y": _scale(ax.yaxis, others),
        "drawn_to_scale": ax.get_aspect() == 1,
        "curves": [[f"curve-{i}-{k}", _name(line.get_label())] for k, line in enumerate(_curves(ax))],
        "bars": [_bar(patch, own) for own in ax.containers if isinstance(own, BarContainer) for patch in own],
    }


def _shaded(ax: Axes) -> list[Any]:
    """What shows numbers by colour."""
    return [drawn for drawn in (*ax.collections, *ax.images) if drawn.get_array() is not None]


def _curves(ax: Axes) -> list[Line2D]:
    """The lines that stand for data, not those across the axes."""
    data = ax.transData
    return [line for line in ax.lines if all(line.get_transform().contains_branch_seperately(data))]


def _extents(ax: Axes) -> list[float]:
    return [round(float(value), 5) for value in ax.get_position().extents]


def _name(label: Any) -> str:
    """A label, if a person gave it."""
    return "" if str(label).startswith("_") else str(label)


def _scale(axis: Axis, others: list[Axes]) -> dict[str, Any]:
    """Both ends of an axis, how it is divided, what it is called, and its ticks where they are words."""
    low, high = sorted(float(end) for end in axis.get_view_interval())
    ends = (high, low) if axis.get_inverted() else (low, high)
    found = {"from": float(f"{ends[0]:.9g}"), "to": float(f"{ends[1]:.9g}"), "name": _title(axis, others)}
    if axis.get_scale() == "log":
        found["log"] = True
    texts = (
        [label.get_text() for label in axis.get_ticklabels()]
        if isinstance(axis.get_major_locator(), FixedLocator)
        else []
    )
    if any(NUMBER.fullmatch(text) is None for text in texts):
        found["ticks"] = [[round(float(at), 5), text] for at, text in zip(axis.get_majorticklocs(), texts)]
    return found


def _title(axis: Axis, others: list[Axes]) -> str:
    """An axis's name: its own, that of the axes in its column or row, or the only one of its sort in the figure."""
    if own := axis.get_label_text():
        return own
    level = isinstance(axis, XAxis)
    side = slice(0 if level else 1, None, 2)
    place = axis.axes.get_position().extents[side]
    beside = [ax for ax in others if np.allclose(ax.get_position().extents[side], place)]
    for part in (beside, others):
        names = {(ax.xaxis if level else ax.yaxis).get_label_text() for ax in part} - {""}
        if len(names) == 1:
            return names.pop()
    return ""


def _bar(patch: Any, own: BarContainer) -> list[Any]:
    (x0, y0), (x1, y1) = patch.get_bbox().get_points()
    upright = own.orientation == "vertical"
    span = (x0, x1, y0, y1) if upright else (y0, y1, x0, x1)
    colour = patch.get_facecolor() if patch.get_facecolor()[3] else patch.get_edgecolor()
    return [*(float(f"{value:.6g}") for value in span), upright, _name(own.get_label()), to_hex(colour)]


FONTS = ["DejaVu Sans"]  # what is drawn stays text, at which browsers without it show Verdana, as wide
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
    "axes.axisbelow": True,
    "axes.edgecolor": MUTED,
    "axes.facecolor": "none",
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.prop_cycle": cycler(color=SIX_JOINTS),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "figure.constrained_layout.use": True,
    "figure.facecolor": "none",
    "font.family": "sans-serif",
    "font.sans-serif": FONTS,
    "font.size": 10,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "legend.frameon": False,
    "legend.fontsize": 10,
    "legend.handlelength": 1.2,
    "legend.columnspacing": 1.0,
    "legend.borderaxespad": 0.1,
    "lines.linewidth": 1.6,
    "svg.fonttype": "none",
    "svg.hashsalt": "er3a",
    "xtick.color": INK,
    "ytick.color": INK,
}
SIDE = 4.5  # inches, of figures next to a page's picture, whose letters a phone shows as large as the page's
_COORDINATES = re.compile(r'(?<= )(?:d|x|y)="[^"]*"')
_DECIMALS = re.compile(r"-?\d+\.\d{2,}")
_STYLES = re.compile(r'style="[^"]*"')
_TAG = re.compile(r"<[^>]*>")
_QUOTED = re.compile(r"=\"([^\"']*)\"")
_IN_ADDRESSES = str.maketrans({letter: f"%{ord(letter):02X}" for letter in '%#<>&"\n'})
_BLANKS = re.compile(r"\s*(?<![=\"])([A-Za-z])\s+(?=[-\d])|\s+(?=[z\"])")


@contextmanager
def house_style() -> Iterator[None]:
    """The look of all figures of the pages, in the language of the pages, for what is drawn within it.

    A ``matplotlibrc`` counts for nothing: one in the study's folder could have LaTeX write the texts.

    Yields
    ------
    nothing : at the end the settings of before are back
    """
    chinese = []
    if language.current() == "zh":
        present = {font.name for font in fontManager.ttflist}
        chinese = [name for name in CHINESE_FONTS if name in present][:1]
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE | {"font.sans-serif": [*FONTS, *chinese]})
        yield


def new_figure(rows: int = 1, columns: int = 1, width: float = 9.0, height: float = 4.5, **subplots):
    """A figure and its axes.

    Parameters
    ----------
    rows, columns : of axes
    width, height : in inches
    subplots : further arguments of ``Figure.subplots``

    Returns
    -------
    figure, axes : the latter as ``Figure.subplots`` returns them: one, or an array of them
    """
    figure = Figure(figsize=(width, height))
    return figure, figure.subplots(rows, columns, **subplots)


def equal_scale(axes: Axes, x_label: str, y_label: str, fill: bool = True) -> None:
    """Make a drawing true to scale: equal units on both axes.

    Parameters
    ----------
    axes : is changed
    x_label, y_label : in the page's language
    fill : whether the axes fill their place, or are as large as what they show, and without grid
    """
    axes.set_aspect("equal", adjustable="datalim" if fill else "box")
    if not fill:
        axes.grid(False)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)


def axis_label(table: Table | type[Table], attribute: str, unit: str = "") -> str:
    """The name of an axis along which a column of results is drawn, with its unit.

    Parameters
    ----------
    attribute : of the column; its heading is taken, else its meaning
    unit : in place of the column's, where an arm's joints settle it

    Returns
    -------
    label : in the page's language
    """
    spec = table.columns()[attribute]
    what, unit = tr(spec.heading or spec.meaning), (unit or spec.unit).replace("^2", "²").replace("^3", "³")
    return bracketed(what, unit_sign(unit))


def svg_data_uri(figure: Figure) -> Markup:
    """A figure in the house style as an image in an address, fit for an attribute in double quotes.

    Parameters
    ----------
    figure : dense clouds in it are rasterised at 160 dpi

    Returns
    -------
    address : ``data:image/svg+xml,...``; equal figures give equal text
    """
    buffer = io.BytesIO()
    # Of the parts that are rasterised; the rest has no resolution.
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
    """The same picture in fewer letters: coordinates to a tenth of a point, path data and styles without blanks that
    say nothing, no indentation and no comments."""
    shorter = _COORDINATES.sub(lambda found: _BLANKS.sub(r"\1", _DECIMALS.sub(_shorter, found[0])), svg)
    shorter = _STYLES.sub(lambda found: re.sub(r"(?<=[:;]) ", "", found[0]), shorter)
    return re.sub(r">\s+<", "><", re.sub(r"<!--.*?-->", "", shorter, flags=re.DOTALL)).strip()


def _shorter(number: re.Match[str]) -> str:
    return f"{float(number[0]):.1f}".removesuffix(".0")
