"""Loops of a program that make links, written out, with the elements of lists and matrices in place of their indices.

Only what runs straight on is: a loop over a known range, or over the rows of a matrix, whose body has no branch. It is
text that is rewritten; nothing is executed.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

Arrays = Mapping[str, list[dict[str, str]]]
"""Rows by the name of their matrix: cells by their place, ``"0"``, and by their name if they have one. A list has rows
of one cell."""

MOST_RUNS = 40
LONGEST = 200_000
_MAKES = re.compile(r"\b\w*(?:link|revolute|prismatic)\w*\s*\(|\bDH\s*\(|\balpha\s*=(?!=)", re.I)
_BRANCHES = re.compile(r"\b(?:if|else|elif|while|switch|case|for|lambda)\b")
_NAMES = r"([\w, \t()]+?)"
_PYTHON = re.compile(rf"(?m)^([ \t]*)for[ \t]+{_NAMES}[ \t]+in[ \t]+([^\n]+?):[ \t]*\n((?:\1[ \t]+.*\n?|[ \t]*\n)+)")
_MATLAB = re.compile(
    r"(?ms)^[ \t]*for\s*\(?\s*(\w+)\s*(=|in)\s*(\d+:[^\n,;]+?)\)?[ \t]*[,;\n](.{0,4000}?)\bend\b(?!\s*\+)"
)
_C = re.compile(
    r"\bfor\s*\((?:[^;()]*?(\w+)\s*=\s*(\d+)\s*;\s*\1\s*(<=?)\s*([^;]+?)\s*;[^)]*"
    r"|\s*(?:const\s+)?auto\s*&?\s*(\w+)\s*:\s*(\w+)\s*)\)\s*"
)
_BUILT = re.compile(rf"(.*?\S)\s+for\s+{_NAMES}\s+in\s+([^\[\]{{}}]+)", re.S)
_RANGE = re.compile(r"range\((?:([^,()]+),)?\s*([^,]+)\)|(\d+)\s*:\s*(.+)")
_LENGTH = re.compile(
    r"(?:len|length|numel|size)\(\s*(?:\w+\.)*(\w+)\s*(?:,\s*1\s*)?\)|(?:\w+\.)*?(\w+)\.(?:shape\[0\]|size\(\))"
)
_ELEMENT = re.compile(
    r"\*?(?<![\w'\"])(?:\w+\.)*\b([^\W\d]\w*)([\[(])\s*([\d+\- ]+?)\s*(?:(?:,|\]\s*\[)\s*(\d+|:)\s*)?[\])]"
    r"(?:\.([^\W\d]\w*)\b(?!\()|\[[\"'](\w+)[\"']\])?(?!\s*=(?!=))"
)
_ASSIGNED = re.compile(r"(?:(?:const|double|float|auto)\s+)*([^\W\d]\w*(?:\s*,\s*[^\W\d]\w*)*)\s*=(?!=)\s*(.+)", re.S)


@dataclass(frozen=True)
class _Loop:
    start: int
    end: int
    body: str
    names: str
    over: str
    mark: str = "\n"


class Straight:
    """A program's text with its loops written out.

    Parameters
    ----------
    text : without comments
    arrays : what its lists and matrices hold
    parts : cuts a text at marks that are in no brackets
    inside : the beginnings, ends and texts of its pairs of brackets

    Attributes
    ----------
    text : with the loops written out; as it was if a matrix would be used in part only
    lines : the number of each of its lines in the program
    """

    def __init__(
        self,
        text: str,
        arrays: Arrays,
        parts: Callable[[str, str], list[str]],
        inside: list[tuple[int, int, str]],
    ):
        self.arrays, self.parts, self.program = arrays, parts, text
        self.first = {"(": 1, "[": 1 if re.search(r"(?m)^\s*for\s+\w+\s+in\s+1:", text) else 0}
        self.used: dict[str, set[int]] = {}
        self.text, self.lines, done, line, several = "", [1], 0, 1, 0
        for loop in sorted(self._loops(text, inside), key=lambda each: each.start):
            straight = loop.start >= done and _MAKES.search(loop.body) and not _BRANCHES.search(loop.body)
            kept = {name: {*rows} for name, rows in self.used.items()}
            copies = [self._run(loop, k, run) for k, run in enumerate(self._runs(loop)[:MOST_RUNS])] if straight else []
            if self.used == kept:  # nothing of an array is used, or what has been used
                continue
            for piece, grows in ((text[done : loop.start], 1), (loop.mark.join([*copies, ""]), 0)):
                self.text += piece
                self.lines += [line + grows * k for k in range(1, piece.count("\n") + 1)]
                line += grows * piece.count("\n")
            line += text.count("\n", loop.start, loop.end)
            done, several = loop.end, several + 1
        self.lines += [line + k for k in range(1, text.count("\n", done) + 1)]
        self.text += text[done:]
        looped, self.used = self.used, {name: {*rows} for name, rows in self.used.items()}
        filled = _ELEMENT.sub(self._element, self.text)
        whole = {
            name for name, rows in self.used.items() if len(rows) == len(arrays[name]) and len(arrays[name][0]) > 1
        }
        if (
            several > 1
            or any(len(arrays[name][0]) > 1 and name not in whole for name in looped)
            or len(filled) > LONGEST
        ):
            self.text, self.lines = text, list(range(1, text.count("\n") + 2))
        elif whole:
            self.text = _ELEMENT.sub(lambda found: self._element(found) if found[1] in whole else found[0], self.text)

    def _loops(self, text: str, inside: list[tuple[int, int, str]]) -> Iterator[_Loop]:
        for each in _PYTHON.finditer(text):
            yield _Loop(each.start(), each.end(), each[4], each[2], each[3])
        for each in _MATLAB.finditer(text):
            yield _Loop(each.start(), each.end(), each[4], each[1], each[3])
        blocks = {start: (end, body) for start, end, body in inside}
        for each in _C.finditer(text):
            end, body = blocks.get(each.end(), (0, ""))
            over = each[6] or (f"{each[2]}:{each[4]}" if each[3] == "<=" else f"range({each[2]},{each[4]})")
            if end or (statement := re.match(r"[^;{}]*;", text[each.end() :])):
                end, body = (end, body) if end else (each.end() + len(statement[0]) - 1, statement[0])
                yield _Loop(each.start(), end + 1, body, each[1] or each[5], over)
        for start, end, body in inside:
            if built := _BUILT.fullmatch(body):
                yield _Loop(start + 1, end, built[1], built[2], built[3], ", ")

    def _runs(self, loop: _Loop) -> list[dict[str, str]]:
        """What the loop's variables are in each of its runs; [] if that is not known."""
        names, over = re.findall(r"\w+", loop.names), re.sub(r"\bself\.", "", loop.over.strip())
        counter = ""
        if found := re.fullmatch(r"enumerate\((.+?)(?:,.*)?\)", over):
            counter, over = names.pop(0), found[1].strip()
        if found := re.fullmatch(r"zip\((.+)\)", over):
            several = [each.strip() for each in found[1].split(",")]
            sizes = {len(self.arrays.get(each, ())) for each in several}
            if len(several) != len(names) or len(sizes) > 1:
                return []
            return [{name: f"{each}[{k}]" for name, each in zip(names, several)} for k in range(*sizes)]
        if over in self.arrays:
            runs = [self._row(names, over, k) for k in range(len(self.arrays[over]))]
        elif found := _RANGE.fullmatch(over):
            first = self._number(found[1] or found[3] or "0")
            last = self._number(found[2] or found[4])
            size = self._common(names, loop.body) if last is None else last - (first or 0) + bool(found[4])
            runs = [{names[0]: str((first or 0) + k)} for k in range(size)] if first is not None else []
        else:
            runs = [{names[0]: str(k)} for k in range(self._common(names, loop.body))]
        return [run | ({counter: str(k)} if counter else {}) for k, run in enumerate(runs)] if all(runs) else []

    def _row(self, names: list[str], over: str, k: int) -> dict[str, str]:
        """What the variables of a loop over a matrix are in its row; {} if they are not as many as its cells."""
        row = self.arrays[over][k]
        if len(names) == 1:
            return {names[0]: f"{over}[{k + self.first['[']}]"}
        cells = [cell for place, cell in row.items() if place.isdecimal()]
        self.used.setdefault(over, set()).add(k)
        return dict(zip(names, map(_whole, cells))) if len(cells) == len(names) else {}

    def _common(self, names: list[str], body: str) -> int:
        """The length of all lists that a variable goes through, if they say enough of a row; 0 if it is not one."""
        through = rf"\b{{}}\s*[\[(]\s*{names[0]}\b"
        held = [rows for name, rows in self.arrays.items() if re.search(through.format(name), body)]
        sizes = {len(rows) for rows in held}
        return sizes.pop() if len(sizes) == 1 and (len(held) > 2 or len(held[0][0]) > 2) else 0

    def _number(self, text: str) -> int | None:
        """A count: a number, the length of a list, or a name that has one value."""
        text = text.strip()
        if found := _LENGTH.fullmatch(text):
            return len(self.arrays.get(found[1] or found[2], ())) or None
        given = {text} if text.isdecimal() else {*re.findall(rf"\b{re.escape(text)}\s*=\s*(\d+)\b(?!\.)", self.program)}
        return int(given.pop()) if len(given) == 1 else None

    def _run(self, loop: _Loop, k: int, run: dict[str, str]) -> str:
        """The statements of a loop's run, with the values of what is assigned in it."""
        made, values = [], dict(run)
        statements = [each for line in self.parts(loop.body, "\n") for each in self.parts(line, ";") if each]
        for statement in statements:
            assigned = _ASSIGNED.fullmatch(statement)
            names = re.findall(r"\w+", assigned[1]) if assigned else []
            value = self._filled(assigned[2] if assigned else re.sub(r"\bend\s*\+\s*1", f"{k + 1}", statement), values)
            cells = self.parts(value.strip("[]()") if len(names) > 1 else value, ",")
            if names and (loop.mark == ", " or _MAKES.search(value) or len(cells) != len(names)):
                values |= {name: f"{name}_{k}" for name in names} if loop.mark == "\n" else {}
                made.append(f"{', '.join(values.get(name, name) for name in names)} = {value}")
            elif names:
                values |= dict(zip(names, map(_whole, cells)))
            else:
                made.append(value)
        return "\n".join(made)

    def _filled(self, text: str, values: Mapping[str, str]) -> str:
        """A text with values in place of names, which are no keys, attributes or words."""
        names = "|".join(map(re.escape, values))
        pattern = rf"(?<![\w.'\"])({names})\b(?!\s*=(?!=)|['\"])"
        text = re.sub(pattern, lambda found: values[found[1]], text) if values else text
        return _ELEMENT.sub(self._element, text)

    def _element(self, found: re.Match[str]) -> str:
        """A row, a cell or a named part of an array, as it is written in a program; unchanged if it has none."""
        rows, first = self.arrays.get(found[1], []), self.first[found[2]]
        k = sum(int(each.replace(" ", "")) for each in re.findall(r"[-+]?\s*\d+", found[3])) - first
        if not 0 <= k < len(rows):
            return found[0]
        row, key = rows[k], found[5] or found[6]
        cells = [_whole(cell) for place, cell in row.items() if place.isdecimal()]
        if found[4] and found[4] != ":":
            key = str(int(found[4]) - first)
        if key and key not in row:
            return found[0]
        self.used.setdefault(found[1], set()).add(k)
        if key:
            return _whole(row[key])
        around = found.string[: found.start()].rstrip()[-1:] + found.string[found.end() :].lstrip()[:1]
        if found[2] == "[" and found[0][0] != "*":
            return f"[{', '.join(cells)}]" if len(cells) > 1 else cells[0]
        return (", " if found[2] == "[" or re.fullmatch(r"[\[,(][\]),]", around) else " ").join(cells)


def _whole(cell: str) -> str:
    """A cell, in brackets if it is a sum or a product, or has blanks."""
    return f"({cell})" if re.search(r"\S[-+*/ ]", cell.strip()) and cell[:1] not in "\"'" else cell
