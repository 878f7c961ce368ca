"""D-H tables as books, articles and spreadsheets print them, as the columns that :mod:`er3a.files.dh_table` reads.

Headings may be symbols with or without units and subscripts (``α(i-1)``, ``a [mm]``, ``d_i``, ``关节角θ(°)``); cells
may hold degree signs, fractions of pi, and variables: ``q2-90``, ``θ5*``, ``d3*``, ``*``.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

from er3a.errors import InputError
from er3a.files.csv_file import Lines, check_widths
from er3a.files.units import RADIANS_BELOW_DEG
from er3a.robots.robot import Convention

_JOINT = {"joint", "link", "axis", "i", "j", "n", "no", "#", "gelenk", "achse", "关节", "连杆", "轴", "序号"}
_LENGTHS = {
    "a": "a",
    "r": "a",
    "linklength": "a",
    "连杆长度": "a",
    "杆长": "a",
    "d": "d",
    "linkoffset": "d",
    "偏距": "d",
}
_LENGTHS |= {"连杆偏距": "d", "连杆偏移": "d", "offset": "offset"}
_OURS = re.compile(r"(joint)|(a|alpha|d|offset)_(mm|m|in|deg|rad)")
_ANGLES = {
    "α": "alpha",
    "alpha": "alpha",
    "twist": "alpha",
    "扭": "alpha",
    "θ": "theta",
    "theta": "theta",
    "关节角": "theta",
}
"""Each marks a heading that holds it."""
_UNITS = {"mm": "mm", "毫米": "mm", "m": "m", "米": "m", "in": "in", "inch": "in", "cm": "cm"}
_UNITS |= {"°": "deg", "deg": "deg", "degree": "deg", "degrees": "deg", "度": "deg", "grad": "deg", "rad": "rad"}
_BEFORE = re.compile(r"i-1|ᵢ₋₁|j-1")
_PLAIN = str.maketrans({"−": "-", "–": "-", "ϑ": "θ", "⍺": "α", "∗": "*", "＊": "*", "（": "(", "）": ")"})
_PLAIN |= str.maketrans(dict(zip("₀₁₂₃₄₅₆₇₈₉", "0123456789")))
_VARIABLE = re.compile(r"(?<![\w.])([+-]?)(?:(?:q|θ|theta|d)_?\d*\*?|\*|var(?:iable|\.)?|变量)(?:\(t\))?(?=[-+(]|$)")
_PI = re.compile(r"([+-]?)(\d+(?:\.\d*)?)?\*?(?:π|pi)(?:/(\d+(?:\.\d*)?))?")


@dataclass(frozen=True)
class PrintedTable:
    """Lines as a file's lines, under er3a's headings; what the headings say of the
    convention; what was read into them, in words."""

    lines: Lines
    convention: Convention | None
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Heading:
    quantity: str  # joint, a, alpha, d, theta, offset
    unit: str  # "" where the heading has none
    before: bool  # whether it belongs to the link before the joint, as in Craig's tables


def heading_of(text: str) -> _Heading | None:
    """What a heading of those columns that books print stands for; None for any other."""
    if own := _OURS.fullmatch(text):
        return _Heading(own[1] or own[2], own[3] or "", False)
    plain = re.sub(r"[\s{}\\]", "", text.lower().translate(_PLAIN))
    unit = next((_UNITS[each] for each in re.findall(r"[(\[/]([^()\[\]/]+)", plain) if each in _UNITS), "")
    name = re.sub(r"[(\[].*?[)\]]|/.*", "", plain)
    name = re.sub(r"_?[ij]-1$|ᵢ₋₁$|[ᵢⱼ]$|(?<=.)_?[ij]$", "", name)
    if name in _JOINT:
        return _Heading("joint", "", False)
    marked = {quantity for mark, quantity in _ANGLES.items() if mark in name and "_" not in name}
    quantity = marked.pop() if marked else _LENGTHS.get(name) or _LENGTHS.get(re.sub(r"[^a-z]", "", name))
    return _Heading(quantity, unit, bool(_BEFORE.search(plain))) if quantity and "_" not in name else None


def is_printed_table(header: list[str]) -> bool:
    """Whether these are headings of a D-H table, printed or er3a's own."""
    return {"a", "alpha", "d"} <= {found.quantity for name in header if (found := heading_of(name.strip()))}


def as_columns(path: Path, lines: Lines) -> PrintedTable:
    """A table under er3a's headings, its cells as numbers.

    Raises
    ------
    InputError
        for a row that has not as many fields as the header, and for a cell with two variables
    """
    header = [name.strip() for name in lines[0][1]] if lines else []
    found = {k: own for k, name in enumerate(header) if (own := heading_of(name))}
    if "theta_deg" in header and not {"type", "offset_deg"} & set(header):
        found[header.index("theta_deg")] = _Heading("theta", "deg", False)
    if len({own.quantity for own in found.values()}) < len(found) or not found:
        return PrintedTable(lines, None, ())
    check_widths(path, lines)
    return _Table(path, header, lines[1:], found).converted()


class _Table:
    def __init__(self, path: Path, header: list[str], rows: Lines, headings: dict[int, _Heading]):
        self.path, self.header, self.headings = path, header, headings
        self.rows = rows
        self.column = {own.quantity: k for k, own in headings.items()}
        self.units = {k: own.unit or self._said(k) for k, own in headings.items() if own.quantity != "joint"}

    def converted(self) -> PrintedTable:
        sliding = self._sliding()
        columns: dict[str, list[str]] = {}
        offsets: list[str] = []
        for k, name in enumerate(self.header):
            cells = [cells[k] for _, cells in self.rows]
            own = self.headings.get(k)
            if own is None:
                columns[name] = cells
            elif own.quantity == "joint":
                columns["joint"] = [re.sub(r"^\D*(\d+)\D*$", r"\1", cell.translate(_PLAIN)) for cell in cells]
            elif own.quantity == "theta":
                offsets = self._theta(k, sliding, columns)
            else:
                self._plain(k, own, sliding, columns)
        if any(sliding) and "type" not in self.header:
            columns["type"] = ["prismatic" if slides else "revolute" for slides in sliding]
        before = {own.before for own in self.headings.values() if own.quantity in ("a", "alpha")}
        convention: Convention | None = "modified" if before == {True} and "convention" not in self.header else None
        notes = ["a and alpha of the link before the joint (i-1): read as modified D-H (Craig)"] if convention else []
        if offsets:
            notes.append(f"theta was read as the joint's angle with an offset: {', '.join(offsets)}")
        numbers = [number for number, _ in self.rows]
        made = [(number, list(cells)) for number, cells in zip(numbers, zip(*columns.values()))]
        return PrintedTable([(0, list(columns)), *made], convention, tuple(notes))

    def _said(self, k: int) -> str:
        """The unit that a column's cells say; "" if none."""
        cells = [cells[k].lower() for _, cells in self.rows]
        if any("°" in cell for cell in cells):
            return "deg"
        return "rad" if any("π" in cell or "pi" in cell for cell in cells) else ""

    def _unit(self, k: int, quantity: str, cells: list[str]) -> str:
        """A column's unit: that of its heading or cells, of small angles beside radians theirs, else mm or degrees."""
        if self.units[k] or quantity in ("a", "d"):
            return self.units[k] or "mm"
        numbers = [abs(float(cell)) for cell in cells if re.fullmatch(r"[+-]?\d+(\.\d*)?", cell)]
        return "rad" if "rad" in self.units.values() and max(numbers, default=0) < RADIANS_BELOW_DEG else "deg"

    def _sliding(self) -> list[bool]:
        """Whether each row's d is a variable, and its theta none."""
        k = self.column.get("d")
        if "type" in self.header:
            return [cells[self.header.index("type")].strip() == "prismatic" for _, cells in self.rows]
        variable = [k is not None and _variable(cells[k]) is not None for _, cells in self.rows]
        theta = self.column.get("theta")
        return [
            free and (theta is None or _variable(cells[theta]) is None) for free, (_, cells) in zip(variable, self.rows)
        ]

    def _plain(self, k: int, own: _Heading, sliding: list[bool], columns: dict[str, list[str]]) -> None:
        """A column of a, alpha or d; a sliding joint's d keeps what stands beside its variable."""
        texts = []
        for (number, cells), slides in zip(self.rows, sliding):
            text = cells[k]
            if own.quantity == "d" and slides:
                text = self._beside(number, k, text)[1]
            texts.append(text)
        self._add(k, own.quantity, texts, columns)

    def _theta(self, k: int, sliding: list[bool], columns: dict[str, list[str]]) -> list[str]:
        """Directions and offsets of joints that turn, and where theta of those that slide stands."""
        parts = [
            (0, cells[k]) if slides else self._beside(number, k, cells[k])
            for (number, cells), slides in zip(self.rows, sliding)
        ]
        turning = ["" if slides else text for slides, (_, text) in zip(sliding, parts)]
        offsets = [f"joint {row + 1} {text}" for row, text in enumerate(turning) if text.strip("0.°+- ")]
        if "offset" not in self.column:
            self._add(k, "offset", turning, columns)
        elif offsets:
            raise InputError(self.path, f"column {self.header[k]}", "offsets stand in another column too", "Keep one")
        if any(sliding):
            self._add(k, "theta", [text if slides else "" for slides, (_, text) in zip(sliding, parts)], columns)
        if any(sign < 0 for sign, _ in parts):
            if "direction" in self.header:
                problem = "directions stand in another column too"
                raise InputError(self.path, f"column {self.header[k]}", problem, "Keep one")
            columns["direction"] = ["-1" if sign < 0 else "1" for sign, _ in parts]
        return offsets

    def _beside(self, number: int, k: int, cell: str) -> tuple[int, str]:
        """The sign of a cell's variable, 1 if it has none, and what is added to it."""
        found = _variable(cell)
        if found is None:
            return 1, cell.strip() or "0"
        plain = _compact(cell)
        beside = (plain[: found.start()] + plain[found.end() :]).strip("+()").replace(",", ".") or "0"
        if _variable(beside) is not None:
            where = f"row {number}, column {self.header[k]}"
            raise InputError(self.path, where, f"'{cell}' holds two variables", "Write one variable and a number")
        return (-1 if found[1] == "-" else 1), beside

    def _add(self, k: int, name: str, cells: list[str], columns: dict[str, list[str]]) -> None:
        """The column of a quantity, its cells without units and its fractions of pi as numbers."""
        plain = [_compact(cell) for cell in cells]
        unit = self._unit(k, name, plain)
        plain = [re.sub(rf"(?<=\d)({unit}|°)$" if unit != "rad" else r"(?<=[\dπi])rad$", "", cell) for cell in plain]
        in_pi = [_PI.fullmatch(cell) for cell in plain]
        if unit != "rad" and any(in_pi):
            problem = "fractions of pi in a column of degrees"
            raise InputError(self.path, f"column {self.header[k]}", problem, "Write all its angles in one unit")
        columns[f"{name}_{unit}"] = [_of_pi(found) if found else cell for found, cell in zip(in_pi, plain)]


def _compact(cell: str) -> str:
    return re.sub(r"\s", "", cell.lower().translate(_PLAIN))


def _variable(cell: str) -> re.Match[str] | None:
    """The variable in a cell that is no plain number."""
    return _VARIABLE.search(_compact(cell))


def _of_pi(found: re.Match[str]) -> str:
    sign, factor, divisor = found.groups()
    return repr((-1 if sign == "-" else 1) * float(factor or 1) * math.pi / float(divisor or 1))
