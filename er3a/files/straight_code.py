"""A program's loops over the rows of a table, written out, with elements of its lists and matrices in their places.

Only what runs straight on is: a loop over all rows, which makes links and has no branch. It is text that is rewritten;
nothing is executed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from er3a.files.code_brackets import groups_of, parts

Arrays = Mapping[str, list[dict[str, str]]]
"""Rows by the name of their matrix: cells by their place, ``"0"``, and by their name if they have one. A list has rows
of one cell."""

MOST_ROWS = 40
_MAKES = re.compile(r"\b\w*(?:link|revolute|prismatic)\w*\s*\(|\bDH\s*\(|[(,]\s*alpha\s*=(?!=)", re.I)
_BRANCHES = re.compile(r"\b(?:if|else|elif|while|switch|case|for|lambda)\b")
_LOOPS = (
    re.compile(
        r"(?m)^([ \t]*)for[ \t]+(?P<names>[\w, \t()]+?)[ \t]+in[ \t]+(?P<over>[^\n]+?):[ \t]*\n"
        r"(?P<body>(?:\1[ \t]+.*\n?|[ \t]*\n)+)"
    ),
    re.compile(
        r"(?ms)^[ \t]*for[\s(]+(?P<names>\w+)\s*(?:=|in)\s*(?P<over>1:[^\n,;)]+)\)?[ \t]*[,;\n]"
        r"(?P<body>.{0,4000}?)\bend\b(?!\s*\+)"
    ),
    re.compile(
        r"\bfor\s*\([^;:()]*?(?P<names>\w+)\s*(?::(?!:)|=)\s*(?P<over>[^;()]+?(?:;[^;]+;[^)]*)?)\)\s*"
        r"\{?(?P<body>(?<=\{)[^{}]*(?=\})|[^;{}]*;)"
    ),
)
_BUILT = re.compile(r"(?P<body>.*?\S)\s+for\s+(?P<names>[\w, \t()]+?)\s+in\s+(?P<over>[^\[\]{}]+)", re.S)
_ELEMENT = re.compile(
    r"\*?(?<![\w'\"])(?:\w+\.)*\b([^\W\d]\w*)([\[(])\s*([\d+\- ]+?)\s*(?:(?:,|\]\s*\[)\s*(\d+|:)\s*)?[\])]"
    r"(?:\.([^\W\d]\w*)\b(?!\()|\[[\"'](\w+)[\"']\])?(?!\s*=(?!=))"
)
_ANGLES = re.compile(r"(?:q|θ|th|t)_?\d*|(?:q_|theta)\w*")
_ASSIGNED = re.compile(r"(?:(?:const|double|float|auto)\s+)*([^\W\d]\w*(?:\s*,\s*[^\W\d]\w*)*)\s*=(?!=)\s*(.+)", re.S)


class StraightCode:
    """A program whose loop over a table's rows is written out.

    Parameters
    ----------
    text : without comments
    arrays : what its lists and matrices hold
    """

    def __init__(self, text: str, arrays: Arrays):
        self.text, self.arrays = text, arrays
        self.first = {"(": 1, "[": int(bool(re.search(r"(?m)^\s*for\s+\w+\s+in\s+1:", text)))}
        self.used: dict[str, set[int]] = {}
        self.numbers: dict[str, set[int]] = {}
        for name, number in re.findall(r"\b([^\W\d]\w*)\[(\d{1,3})\](?!\s*=)", text):
            self.numbers.setdefault(name, set()).add(int(number))

    def written_out(self) -> str:
        """The text with the loop's runs, in as many lines, and with the elements of matrices that are used whole.

        Returns
        -------
        text : as it was if several loops make links, or the loop leaves rows of a matrix to others
        """
        made = [(*each[1:], after) for each in self._loops() if (after := self._runs(*each))]
        if len(made) > 1:
            return self.text
        text, looped = self.text, {*self.used}
        for _, start, end, after in made:
            text = f"{text[:start]}{after}{text.count(chr(10), start, end) * chr(10)}{text[end:]}"
        _ELEMENT.sub(self._element, text)
        wide = {name for name in self.used if len(self.arrays[name][0]) > 1}
        partly = {name for name in wide if len(self.used[name]) < len(self.arrays[name])}
        if looped & partly:
            return self.text
        known = {name for name in self.used.keys() - partly if name in wide or self._counted(name)}
        return _ELEMENT.sub(lambda found: self._element(found) if found[1] in known else found[0], text)

    def _counted(self, name: str) -> bool:
        """Whether it is known where a list's numbers begin; values of joints are a pose and are left out."""
        used = self.numbers.get(name, set())
        return not re.fullmatch(_ANGLES, name) and (not used or bool(used & {0, len(self.arrays[name])}))

    def _loops(self) -> Iterator[tuple[re.Match[str], str, int, int]]:
        """Loops without a branch that make links, what is between their runs, where they begin and end."""
        found = [(each, "; ", 0) for pattern in _LOOPS for each in pattern.finditer(self.text)]
        built = [(_BUILT.fullmatch(group.inside), ", ", group.start + 1) for group in groups_of(self.text)]
        for loop, mark, start in [*found, *built]:
            if loop and _MAKES.search(loop["body"]) and not _BRANCHES.search(loop["body"]):
                yield loop, mark, start + loop.start(), start + loop.end()

    def _runs(self, loop: re.Match[str], mark: str, *_: int) -> str:
        """A loop's runs; "" if it is not known to go through all rows in their order."""
        counts = dict(re.findall(r"\b(\w+)\s*=\s*(\d+)\s*(?:[;\n]|$)", self.text))
        names = re.findall(r"\w+", loop["names"])
        counts.pop(names[0], "")
        over = re.sub(r"[^\W\d]\w*", lambda found: counts.get(found[0], found[0]), loop["over"].strip())
        indexed = rf"\b([^\W\d]\w*)\s*[\[(]\s*{names[0]}\b"
        inside = self.arrays.keys() & {*re.findall(indexed, loop["body"])}
        through = [name for name in re.findall(r"[^\W\d]\w*", over) if name in self.arrays]
        sizes = {len(self.arrays[name]) for name in (*inside, *through)}
        first, numbers = int(over[:1] == "1"), {*map(int, re.findall(r"\d+", re.sub(r"^[01]\s*[:;]|\(0,", "", over)))}
        said = numbers & sizes or through or len(inside) > 2 or any(len(self.arrays[name][0]) > 2 for name in inside)
        other = numbers - sizes or re.search(r"[-+]\s*\d|reversed|sorted", over)
        if len(sizes) != 1 or other or not said:
            return ""
        by_index = not through or re.search(r"range|len|numel|size|[:;]", over)
        runs = [{names[0]: str(k + first)} if by_index else self._row(names, through, over, k) for k in range(*sizes)]
        return mark.join(self._run(loop["body"], k, run, mark) for k, run in enumerate(runs)) if all(runs) else ""

    def _row(self, names: list[str], through: list[str], over: str, k: int) -> dict[str, str]:
        """What the variables of a loop over rows are in one; {} if they are not as many as its cells."""
        run = {names[0]: str(k)} if "enumerate" in over else {}
        names = names[len(run) :]
        values = [f"{name}[{k + self.first['[']}]" for name in through]
        if len(through) == 1 and len(names) > 1:
            self.used.setdefault(through[0], set()).add(k)
            values = _cells(self.arrays[through[0]][k])
        return run | dict(zip(names, values)) if len(names) == len(values) else {}

    def _run(self, body: str, k: int, run: dict[str, str], mark: str) -> str:
        """The statements of a run, with the values of what is assigned in it."""
        made, values = list[str](), dict(run)
        for statement in (each for line in parts(body, "\n") for each in parts(line, ";") if each):
            assigned = _ASSIGNED.fullmatch(statement) if mark == "; " else None
            names = re.findall(r"\w+", assigned[1]) if assigned else []
            value = self._filled(assigned[2] if assigned else re.sub(r"\bend\s*\+\s*1", f"{k + 1}", statement), values)
            cells = parts(re.sub(r"^\[(.*)\]$", r"\1", value)) if len(names) > 1 else [value]
            if not names:
                made.append(value)
            elif len(cells) != len(names) or _MAKES.search(value):
                values |= {name: f"{name}_{k}" for name in names}
                made.append(f"{', '.join(map(values.__getitem__, names))} = {value}")
            else:
                values |= dict(zip(names, map(_whole, cells)))
        return mark.join(made).replace("\n", " ")

    def _filled(self, text: str, values: Mapping[str, str]) -> str:
        """A text with values in place of names, which are no keys, attributes or words."""
        pattern = rf"(?<![\w.'\"])({'|'.join(map(re.escape, values))})\b(?!\s*=(?!=)|['\"])"
        return _ELEMENT.sub(self._element, re.sub(pattern, lambda found: values[found[1]], text))

    def _element(self, found: re.Match[str]) -> str:
        """A row, a cell or a named part of an array, as it is written in a program; unchanged if it has none."""
        rows = self.arrays.get(found[1], [])
        numbers = self.numbers.get(found[1], set()) if found[2] == "[" else set()
        first = self.first[found[2]] or int(0 not in numbers and len(rows) in numbers)  # Julia's begin at 1
        k = sum(int(each.replace(" ", "")) for each in re.findall(r"[-+]?\s*\d+", found[3])) - first
        row = rows[k] if 0 <= k < len(rows) else {}
        key = str(int(found[4]) - first) if found[4] and found[4] != ":" else found[5] or found[6]
        if not row or (key and key not in row):
            return found[0]
        self.used.setdefault(found[1], set()).add(k)
        cells = [_whole(row[key])] if key else _cells(row)
        if found[2] == "[" and found[0][0] != "*" and len(cells) > 1:
            return f"[{', '.join(cells)}]"
        around = found.string[: found.start()].rstrip()[-1:] + found.string[found.end() :].lstrip()[:1]
        return (", " if found[2] == "[" or re.fullmatch(r"[\[,(][\]),]", around) else " ").join(cells)


def _cells(row: Mapping[str, str]) -> list[str]:
    return [_whole(cell) for place, cell in row.items() if place.isdecimal()]


def _whole(cell: str) -> str:
    """A cell, in brackets if it is a sum or a product, or has blanks."""
    return f"({cell})" if re.search(r"\S[-+*/ ]", cell.strip()) and cell[:1] not in "\"'" else cell
