"""Cells of the tables in a text: HTML, LaTeX, and lines with separators, drawn boxes or blanks between the cells."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from html.parser import HTMLParser

from er3a.files.arithmetic import plain, words_of

Words = list[str]
Row = tuple[int, Words]
"""The number of a line in the text, and its cells."""
Grid = list[Row]

LONGEST_LINE = 2000
MARKS = "|", "│", "┃", "║", "\t", ";", ",", "  ", " "
"""What separates cells, tried in this order; two blanks, then one, last."""
_BOX = re.compile(r"[─━═│┃║┌┐└┘├┤┬┴┼╔╗╚╝╠╣╦╩╬╒╕╘╛╞╡╤╧╪╭╮╰╯┏┓┗┛┣┫┳┻╋━+|:=\s_-]*")
_UNIT = r"(?:mm|cm|m|in|inch|deg\w*|grad|rad\w*|°|毫米|米|度)"
_LATEX = (
    (r"(?<!\\)%.*|&(?=\s*=)|(?m:\\\\[ \t]*$)", ""),  # aligned equations give values
    (r"\\(?:hline|toprule|midrule|bottomrule|hhline\{[^}]*\})|\\(?:cline|cmidrule)(?:\([lr]+\))?\{[^}]*\}", ""),
    (
        r"\\multirow\s*\{[^}]*\}\s*(?:\[[^\]]*\])?\{[^}]*\}|\\(?:left|right|displaystyle|limits|boldmath|boldsymbol|bfseries|(?:math)?(?:bf|rm|it))\b",
        "",
    ),
    (r"\\(?:SI|qty)\s*\{([^{}]*)\}\s*\{([^{}]*)\}", r"\1 \2"),
    (r"\\ang\s*\{([^{}]*)\}", r"\1°"),
    (r"\^\s*\{?\s*\\circ\s*\}?", "°"),
    (r"\\_", "_"),
    (r"\\[()\[\],;!: ]|\$|~|\\q?quad", " "),
)
_SYMBOLS = words_of(
    "theta=θ vartheta=θ alpha=α beta=β pi=π approx=≈ cdot=* times=* ast=* circ=° degree=° degrees=° textdegree=° "
    "mm=mm milli=m metre=m meter=m radian=rad radians=rad"
)
_FRACTION = re.compile(r"\\[dt]?frac\s*(?:\{([^{}]*)\}|(\\?\w))\s*(?:\{([^{}]*)\}|(\w))")
_FUNCTION = re.compile(r"\\(sqrt|sin|cos|arctan|arcsin|arccos)\s*(?:\{([^{}]*)\})?")
_WRAPPED = re.compile(r"\\[a-zA-Z]+\*?\s*\{([^{}]*)\}")


def without_latex(text: str) -> str:
    """A cell or a body of LaTeX in plain signs.

    Parameters
    ----------
    text : such as ``$\\theta_{2} - \\frac{\\pi}{2}$``

    Returns
    -------
    text : such as ``θ_2 - (π)/(2)``; other texts as they are
    """
    if "\\" not in text and "$" not in text:
        return text
    for pattern, plainly in _LATEX:
        text = re.sub(pattern, plainly, text)
    text = re.sub(r"\\([a-z]+)", lambda found: _SYMBOLS.get(found[1], found[0]), text)
    for _ in range(4):
        text = _FRACTION.sub(lambda found: f"({found[1] or found[2]})/({found[3] or found[4]})", text)
        text = _FUNCTION.sub(lambda found: f"{found[1]}({found[2]})" if found[2] else found[1], text)
        text = _WRAPPED.sub(r"\1", re.sub(r"([_^])\{([^{}]*)\}", r"\1\2", text))
    return re.sub(r"[{}]", "", text)


class _Html(HTMLParser):
    """Collects the tables of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.grids: list[Grid] = []
        self.inside = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "table":
            self.grids.append([])
        elif tag == "tr" and self.grids:
            self.grids[-1].append((self.getpos()[0], []))
        elif tag in ("td", "th") and self.grids and self.grids[-1]:
            span = dict(attrs).get("colspan") or "1"
            self.grids[-1][-1][1].extend([""] * (min(int(span), 20) if span.isdecimal() else 1))
            self.inside = True
        elif tag == "br":
            self.handle_data(" ")
        elif tag == "sup":
            self.handle_data("^")

    def handle_endtag(self, tag: str) -> None:
        self.inside = self.inside and tag not in ("td", "th", "tr", "table")

    def handle_data(self, data: str) -> None:
        if self.inside and self.grids[-1][-1][1]:
            self.grids[-1][-1][1][-1] += data


def html_grids(text: str) -> list[Grid]:
    """The tables of an HTML page, each with its rows' lines; a cell over several columns is the last of them."""
    if "<t" not in text.lower():
        return []
    page = _Html()
    page.feed(text)
    return [
        [(line, [re.sub(r"\s+", " ", cell).strip().replace("^o", "°") for cell in row]) for line, row in grid]
        for grid in page.grids
    ]


def latex_grids(text: str) -> list[Grid]:
    """The tables and arrays of a LaTeX text."""
    found = []
    for body in re.finditer(
        r"\\begin\s*\{(tabular[xy*]?|array|longtable|tabu|tblr)\}(.{0,20000}?)\\end\s*\{\1\}", text, re.S
    ):
        start = text.count("\n", 0, body.start()) + 1
        grid: Grid = []
        given = 2 if body[1] in ("tabularx", "tabular*") else 1
        inner = re.sub(rf"^\s*(?:\[[^\]]*\]\s*)?(?:\{{(?:[^{{}}]|\{{[^{{}}]*\}})*\}}\s*){{{given}}}", "\n", body[2])
        for row in re.split(r"\\\\\s*(?:\[[^\]]*\])?|\\tabularnewline", inner):
            parts = re.split(r"(?<!\\)&", re.sub(r"(?<!\\)%.*", "", row))
            if any(cells := [without_latex(part).strip() for part in parts]):
                grid.append((start + row.count("\n"), cells))
            start += row.count("\n")
        found.append(grid)
    return found


def line_grids(text: str) -> Iterator[tuple[str, Grid]]:
    """A text's lines cut into cells, by each separator in turn; lines without it have one cell."""
    text = re.sub(r":math:`([^`\n]*)`", r"$\1$", plain(text))
    text = re.sub(r"(?m)^[ \t]*[#%/*]+!?[ \t]*(?=\|)", "", text)  # a table in comments
    broken = re.sub(r"[ \t]*\n\s*(-?π)\s*\n\s*(\d)[ \t]*(?=\n)", r" \1/\2\n\n", text)  # a fraction over three lines
    lines = [
        (number, line)
        for number, line in enumerate(broken.splitlines(), 1)
        if len(line) < LONGEST_LINE and not _BOX.fullmatch(line)
    ]
    for mark in MARKS:
        if mark in ";,\t":
            yield mark, _delimited(text, mark)
        elif mark.isspace():
            yield mark, [(number, _spaced(without_latex(line), mark)) for number, line in lines]
        else:
            yield mark, [(number, _edged(line, mark)) for number, line in lines]


def _edged(line: str, mark: str) -> Words:
    line = line.replace("||", "|") if line.startswith("||") else line
    cells = [without_latex(cell).strip() for cell in re.sub(r"<sub>|</sub>|\*\*|`", "", line).split(mark)]
    framed = not cells[0]  # otherwise an empty cell at the end is one of the table's
    return cells[framed : len(cells) - (framed and not cells[-1])]


def _delimited(text: str, mark: str) -> Grid:
    reader = csv.reader(io.StringIO(text), delimiter=mark)
    try:
        return [(reader.line_num, [cell.strip() for cell in row]) for row in reader if any(map(str.strip, row))]
    except csv.Error:
        return []


def _spaced(line: str, mark: str) -> Words:
    """Cells with blanks between them; a unit, an index and a sum stay together."""
    brackets = r"\[[^\]]*\]|(?<=[\w*°)])\s*\([^()]*\)"
    line = re.sub(brackets, lambda found: re.sub(r"\s", "", found[0]), line.strip())
    line = re.sub(rf"\s*([(\[]\s*{_UNIT}\s*[)\]])", r"\1", line)
    line = re.sub(r"^(joint|link|axis|gelenk|achse)\s+(\d+|[ij#]|no\.?)\b[.:]?", r"\1\2", line, flags=re.I)
    line = re.sub(r"(?<=[\w°*)]) ([-+/*])\s+(?=[\w(.])", r"\1", line)
    return re.split(r"\s{2,}|\t", line) if mark == "  " else line.split()
