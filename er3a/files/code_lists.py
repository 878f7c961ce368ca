"""Lists of a program by their names: as columns of a D-H table, and what calls take of them, written out."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Any

from er3a.errors import InputError
from er3a.files.arithmetic import amount_of, words_of
from er3a.files.code_brackets import CodeGroup, parts
from er3a.files.program_text import (
    PART,
    Cells,
    Code,
    closed_up,
    filled,
    is_row,
    list_name,
    pairs_of,
    record_of,
    row_cells,
    rows_of,
)
from er3a.files.table_cells import Grid, Words
from er3a.files.table_headings import heading_of, place_of, quantities_of

NamedList = tuple[str, Words, int, str]
"""A list's name, its cells, its line, and ``:`` or ``=``."""


_NAMED = re.compile(
    r"""
    (?P<name>[A-Za-zα-ωΑ-Ω]\w*)["']?\]?                      # a, "a" or row["a"]
    (?:\[(?:\d*|[A-Z]\w*)\]|\(1:\w+\))?\s*                 # C's a[6] or a[N], MATLAB's a(1:6)
    (?::(?:[ ]*\[\w+;[ ]*\d+\][ ]*|[^=:\n"'\d]*)(?==))?   # its type: Rust's a: [f64; 6] =, Python's a: list =
    (?P<mark>[=:])\s*
    (?:[\w.]+\(\s*|new\s+\w+\[\d*\]\s*|np\.r_\s*|c|\[[\d.]*\]\w+)?["']?\s*$   # np.array(, np.r_, R's c(, Go's []float64
    """,
    re.VERBOSE,
)
"""What is written before the bracket of a list that has a name."""


def named_lists(code: Code) -> Iterator[NamedList]:
    """The name and the cells of each list, multiplied by what is written after it, its line, and ``:`` or ``=``."""
    for group in code.groups:
        named = _NAMED.search(group.before)
        inside = re.sub(r"(?<!\w)\[([^,;\n]+?)\](?=\s*(?:[,\n]|$))", r"\1", group.inside)  # a column [[0], [1]]
        rows = re.search(
            r"^\.+$|[\[{:%]|(?<!\w)\([^()]*,|[^\s;,][, ]+[^\s;,][^;]*;|\bfor\b|(?<!a)(?:cos|sin)\(",
            re.sub(r"\w\[[^\[\]]*\]|\w+::", "q", closed_up(inside)),
        )
        no_list = group.bracket == "(" and not ("," in inside and re.search(r"=\s*c?$", group.before))
        if named is None or rows or no_list:
            continue
        factor = re.findall(r"\A[)\s]*'?\s*([*/][^;,\n]+|=(?!=))?", code.text[group.end + 1 :])[0]
        if factor == "=":  # the type of what follows
            continue
        cells = row_cells(inside.replace(";", ",").replace("\n", " "))
        if len(cells) == 1 and (often := re.fullmatch(r"\*\s*(\d\d?)\s*", factor)):  # Python's [0.0] * 6
            cells, factor = cells * int(often[1]), ""
        cells = [f"({cell}){factor}" if factor else cell for cell in cells]
        yield named["name"], cells, code.line(group.start), named["mark"]


def columns_of(lists: Iterable[NamedList], program: str) -> list[Grid]:
    """A table of columns by the names of their lists: ``a = [0, 0.27, ...]``, ``"a": [0, ...]``; theta is no pose."""
    columns: dict[str, NamedList] = {}  # heading, cells, line, the list's name
    for name, cells, line, mark in sorted(lists, key=lambda each: each[0] in "Ll"):
        bare = re.sub(r"(?<=.)(?:_?(?:[Ll]ist|[Vv]ec(?:tor)?|[Vv]al(?:ue)?s?)|_dh|s)$", "", name.strip("_"))
        names = (name, re.sub(r"^t$", "theta", bare), bare.rpartition("_")[2])
        heading = next(filter(None, map(heading_of, names)), None)
        quantity = heading.quantity if heading else name
        if quantity == "theta" and re.match(r"[qQ]_?[a-zA-Z]", name):
            continue  # values of joints, or their limits
        text = re.sub(r"(?<![a-z])(?:\w+[._])?pi\b|π|2rad|radians", "π", " ".join(cells), flags=re.I)
        if quantity == "theta" and mark == "=" and not re.search(r"[^\W\dπ]", text):
            quantity = "pose" if name != "q" and re.search("[1-9π]", text) else ""
            summed = re.search(f"{_SUMMED.replace('NAME', name)}|DQ_SerialManipulator", program) or "dh" in name.lower()
            quantity = "offset" if summed else quantity
        quantity = "alpha" if quantity == "a" and "π" in text else quantity
        if quantity == "a" and name[0] in "rR" and columns.get("a", "r")[-1][0] not in "rR":
            quantity = "d"  # Khalil's r, with a
        of_others = name in "Ll" and columns.get("a", "r")[-1] not in "rR"
        if not heading and "theta" not in columns and len(re.findall(_ANGLES, ",".join(cells))) > 1:
            others = columns.get("a", ("", []))[1]  # a list of theta by another name, as long as the rest
            quantity = "theta" if len(others) == len(cells) else quantity
        if quantity not in _OF_VECTORS or not cells or of_others:
            continue
        kept = (name, quantity) == ("r", "a") or (quantities_of([name]) == [quantity] == ["offset"] and name[-1] == "0")
        as_printed = name if kept else quantity
        title = f"{quantity}(i-1)" if heading and heading.before else as_printed
        _, first, place, other = columns.setdefault(quantity, (title, cells, line, name))
        if first != cells and quantity not in ("theta", "pose"):
            raise InputError(
                None,
                f"line {line}",
                f"'{name}' is another list of {quantity} than '{other}' of line {place}",
                "Give the lists of one arm, each with its own name",
            )
    if not {"a", "alpha", "d"} <= {*columns}:
        return []
    *_, place, name = columns.pop("pose", ("", 0, ""))
    if name and "theta" not in columns:
        raise InputError(
            None,
            f"line {place}",
            f"'{name}' may be offsets of the joints' angles, or a pose",
            "Name it offset if theta = q + offset, or remove it",
        )
    titles, lengths, places, _ = zip(*columns.values())
    short = min(map(len, lengths))
    ends = [
        title.endswith("(i-1)") and " ".join(cells[short:]) in ("0", "0.0") for title, cells in zip(titles, lengths)
    ]
    lengths = tuple(cells[:short] if end else cells for end, cells in zip(ends, lengths))  # a6 = 0 of the flange
    entries = dict(zip(columns, map(len, lengths)))
    used = {*re.findall(r"(?<![\w.])(?:q|thetas?|joints|joint_angles)[\[(](\d+)[\])]", program)}
    # q[0] to q[6] with eight rows: one of these is fixed
    if "theta" not in entries and len(used) == len(lengths[0]) - 1 > 1:
        entries["values of joints"] = len(used)
    if len({*entries.values()}) > 1:
        problem = "different numbers of entries: " + ", ".join(f"{name} {number}" for name, number in entries.items())
        raise InputError(None, f"line {max(places)}", problem, "Give one for each joint")
    return [[(0, [*titles]), *((1, list(row)) for row in zip(*lengths))]]


_USED = re.compile(
    r"[\[(,;]\s*-?(?:al(?:p|ph|f)a?)[_({\[]*\d[)}\]]*+\s*[,;\])]|\b(?:q|th(?:eta)?)_?[\[({]?\d[\])}]?\s*[-+]\s*(?:\d|\w*\.?pi\b)",
    re.I,
)
"""Symbols that are entries of a matrix, or a sum with a joint's variable."""


_VARIABLE = re.compile(r"\b(?:q|th(?:eta)?)_?[\[({]?\d", re.I)
"""A joint's variable: an entry of a line that has one is a row's, and its theta that variable."""


_SUMMED = (
    r"\bNAME[\[(]\w+[\])]\s*\+\s*\w*(?:q|th|joint)|(?:q|th\w*|joint\w*)[\[(]\w+[\])]\s*\+\s*NAME\b|"
    r"\bNAME\s*\+\s*VALUES(?!\s*[*/.\w\[(])|(?<![\w.])VALUES\s*\+\s*NAME\b"
).replace("VALUES", "(?:q|theta|thetas|joints|joint_angles)")
"""A list that is added to values of joints, as a whole or one by one."""


_ANGLES = r"(?:^|,)[-+\w.*/ ]*?\b(?:q|th|t[eh]{1,2}ta|θ)_?\d+[-+\w.*/ ]*(?=,|$)"


_OF_VECTORS = words_of("a alpha beta d theta offset type direction pose")


_NUMBERED = re.compile(
    r"""
    (?<![\w."'])(?P<quote>["'])?(?:DH_)?
    (?P<name>al(?:p|ph|f)a?|tw|theta|th|a|r|d|q|(?:(?:theta|q)_)?offset)
    (?P<bracket>[_({\[]*)(?P<number>\d{1,2})(?:,1)?[)}\]]*(?(quote)(?P=quote))   # a1, "a1", a_{1}, a(1)
    \s*(?P<mark>[:=])(?!=)\s*
    (?!(?:\w+\.)?symbols?\()                                             # a symbol of SymPy is no value
    (?P<value>[^,}\n;:=!\s\[{](?:::|[^,}\n;:=!])*)                       # C++'s std::numbers::pi is one
    """,
    re.IGNORECASE | re.VERBOSE,
)
"""An entry of a table that has a name with a number, and its value."""


def _each_of_range(found: re.Match[str]) -> str:
    """A statement for each entry that ``a(1:6) = 0;`` gives a value, and no other one."""
    of_range = range(int(found[2]), int(found[3]) + 1)
    rest = [k for k in of_range if not re.search(rf"\b{found[1]}\({k}\)\s*=", found.string)]
    return ";".join(f"{found[1]}({k}) = {found[4]}" for k in rest)


def numbered_lists(code: Code) -> Iterator[NamedList]:
    """Lists of entries by name and number: ``alpha0: 0, a0: 0, d1: 0.75, q1: q1``, as in SymPy's substitutions,
    or ``DH_0_ALPHA = 90``, whose theta is the table's."""
    spellings: dict[str, dict[str, dict[int, tuple[str, str, int]]]] = {}  # value, mark and place of each number
    text = re.sub(r"(?i)\b(?:DH_|\w+[(\[])(\d+)(?:_|[)\]]\.)([A-Za-z]+)\s*=(?!=)", r"\2\1:", code.text)  # dh(1).alpha =
    text = re.sub(r"(\w+)\((\d\d?):(\d\d?)\)\s*=\s*([-\d.]+)(?=\s*[;\n])", _each_of_range, text)
    fields = re.findall(r"(?m)^\s*(\w+\.)(?:a|d|alpha|theta|offset)\(\d+\)\s*=", text)
    text = text.replace(fields[0], "") if len({*fields}) == 1 else text  # of one record: dh.alpha(1) = pi
    for each in _NUMBERED.finditer(text):
        _, name, bracket, number, mark, value = each.groups()
        if int(number) > MOST_ROWS:  # r11, r12, ... are a rotation's
            continue
        for spelling in (f"{bracket}{name.isupper()}", "~"):  # D1 = 0.3; d(1) = D1
            entries = spellings.setdefault(spelling, {}).setdefault(name.lower(), {})
            entries.setdefault(int(number), (value.strip(), mark, each.start()))
    whole = [one for _, one in sorted(spellings.items()) if {*quantities_of(one)} >= {"alpha", "a", "d"}]
    if not whole:
        return
    if end := re.search(r"(?i)\b(?:DH_)?d_?g\s*[=:]\s*[\d.]+", text):  # d of a gripper
        code.refuse(end.start(), end[0], "belongs to no joint", "Number it as a row after the joints, or leave it out")
    found = whole[-1] | whole[0]
    if any(mark == ":" for _, mark, _ in found.get("q", {}).values()):
        found.pop("theta", None)  # what the program computes for a pose
    quantities = dict(zip(quantities_of(found), found.values()))
    lines = code.text.split("\n") if len(found) == 3 else []
    for used in _USED.finditer("\n".join(lines)):
        if used[0][0] not in "[(,;" or not _VARIABLE.search(lines[code.line(used.start()) - 1]):
            code.refuse(used.start(), used[0], "is no column of a table", "Write a list of theta or offset")
    for name, entries in found.items():
        own = {*quantities["alpha"]} if place_of(name) == "a" else {*entries}  # a6 of a flange is no row's
        cells = {k: value for k, (value, _, _) in entries.items() if k in own}
        _, mark, place = entries[max(entries)]
        of_link = quantities["alpha" if place_of(name) in ("alpha", "a") else "d"]
        first = min(entries) if len(entries) == len(of_link) else min(of_link)
        last = max([*entries, *(of_link if place_of(name) == "theta" else ())])
        gaps = {*range(first, last + 1)} - {*entries}
        cells |= {k: f"{name}{k}" for k in gaps}  # what is not replaced stays a variable
        before = "(i-1)" if min(of_link) < max(map(min, found.values())) else ""
        yield name + before, [cells[k] for k in sorted(cells)], code.line(place), mark


_LOOP = re.compile(r"\bfor\b([^\n]*)")


MOST_ROWS = 10  # joints that er3a models
MOST_PASSES = 99  # more than any arm has links


_COLUMN = re.compile(r"(\w+)\s*=\s*(\w+)([\[(])\s*:\s*,\s*(\d+)\s*[\])]")  # a = DH(:, 3)


_INDEX = re.compile(r"@\d+|[\[({][^\[\](){}]*[\])}]|\.\w+")


_REFERENCE = re.compile(rf"(?<![\w.'\"@])([^\W\d]\w*)((?:{_INDEX.pattern})+)")


_LANGUAGE = r"(?m)^\s*end\b|\b(?:import|def|range|zip|np|float|double|const|let|var|auto|self)\b"


def _set_in(body: str) -> Cells:
    """What the statements of a loop make of names; a name among several is a part, ``value@2``."""
    named = Cells()
    for names, value in PART.findall(body):
        value = value if re.fullmatch(r"[\w.\[\]]+", value) else f"({value})"
        own = re.findall(r"\w+", names)
        named |= {name: f"{value}@{k}" if own[1:] else value for k, name in enumerate(own)}
    return named


def _header(line: str) -> tuple[Words, str]:
    """The names that get a value in each pass of a loop, and what it goes through; of ``i, row in enumerate(rows):``,
    ``(int i = 0; i < 6; i++) {``, ``(const auto& row : rows) {``, ``(const row of rows) {`` or ``i = 1:n``."""
    names, over = [*re.split(" in | of |=|:", line, maxsplit=1), ""][:2]
    return re.findall(r"\w+(?=[^\w,]*(?:,|$))", names), over.strip(" :{")  # its type is before a name


def _numbers(over: str) -> tuple[int, str, bool] | None:
    """The first number of a loop, its end as it is written, and whether that is one, too; None of other loops."""
    if over.startswith("range("):
        first, _, end = over[6:-1].rpartition(",")
    elif ";" in over and "+=" not in over:
        first, condition, *_ = over.split(";")
        end = condition.partition("<")[2]
    else:
        first, _, end = over.partition(":")
    first, end = first.strip() or "0", end.strip().removeprefix("1:") if ":" in over else end.strip()
    closed = ":" in over or end.startswith("=")
    return (int(first), end.lstrip("= "), closed) if first.isdigit() and end else None


class Lists:
    """The lists, matrices and lists of records of a program by their names, and which ones links take."""

    def __init__(self, code: Code):
        self.code, self.taken, self.loops = code, set[str](), Words()
        self.said = re.search(_LANGUAGE, code.text)  # what counts from 0 or, as Julia, from 1
        self.first = int(bool(self.said and "end" in self.said[0]))
        joints = () if "Frame::DH" in code.text else ["theta"]  # which KDL has as a constant
        lists = (each for each in named_lists(code) if each[1] and quantities_of(each[:1]) != joints)
        self.values: dict[str, Any] = {name: cells for name, cells, _, _ in lists}
        for group in code.groups:
            name, texts = list_name(group), parts(group.inside)
            own = group.bracket == "{" and group.before.rstrip().endswith("=")
            if own and all(re.fullmatch(r"[\"']?\w+[\"']?\s*:[^\[{(:]+|", each) for each in texts):
                changed = re.search(rf"\b{name}(?:\[[^\]\n]*\]\s*[-+*/]?=(?!=)|\.update\()", code.text)
                self.values[name] = {} if changed or name in self.values else pairs_of(texts)
            elif len(rows := rows_of(code, group)) > 1 and name not in self.values:
                inner = [record_of(each) for each in code.groups if group.start < each.start < group.end]
                self.values[name] = [each for each in inner if is_row(each)] or [row for _, row in rows]

        for name, matrix, bracket, column in _COLUMN.findall(code.text):
            cells, k = self.values.get(matrix), int(column) - (self.first if bracket == "[" else 1)
            if isinstance(cells, list) and all(isinstance(row, list) and 0 <= k < len(row) for row in cells):
                self.values[name] = [row[k] for row in cells]

    def written_out(self, call: CodeGroup) -> Words:
        """The arguments of a call as often as it is carried out, with the elements of lists in place of their names."""
        code, passes = self.code.text, [call.inside]
        around = [each for each in self.code.groups if each.start < call.start < call.end < each.end]
        built = [found for each in around if (found := _LOOP.search(code, call.end, each.end))]
        loops = built or [*_LOOP.finditer(code, 0, call.start)]
        names, over = _header(loops[-1][1]) if loops else (["i"], "n")
        body = code[loops[-1].end() : call.start] if loops else ""
        text = filled(call.inside, _set_in(body))
        own = {*re.findall(r"\w+", text)}
        if built or (own.intersection(names) and not re.search(r"\b(?:def|function)\b", body)):
            branch = re.search(r"\bif\b", f"{body} {over}")
            made = [] if branch else [filled(text, each) for each in self._passes(text, names, over)]
            # A loop over poses or time goes through no list.
            passes = made or ([] if loops and own & {*self.values} else passes)
            self.loops += {each[1] for each in _REFERENCE.finditer("".join(passes[:1])) if each[1] in self.values}
        return [self.resolved(each).lstrip("*") for each in passes]

    def resolved(self, text: str) -> str:
        """A text with elements of lists in place of their names; an element may be a sum of elements."""
        return _REFERENCE.sub(self._element, _REFERENCE.sub(self._element, text))

    def _passes(self, text: str, names: Words, over: str) -> Iterator[Cells]:
        """What the names of a loop stand for in each pass; a row may be unpacked into the last ones. If an unknown name
        says how many passes there are, they go through all of the lists that a call takes."""
        counts = {name: len(value) for name, value in self.values.items() if isinstance(value, list)}
        numbers = _numbers(over)
        lists = [] if numbers else [name for name in re.findall(r"\w+", over) if name in counts]
        every = min([counts[name] for name in lists or re.findall(r"\w+", text) if name in counts], default=0)
        first, last = 0, every if re.match(r"enumerate\(|zip\(|[\w.]+\)?$", over) else 0
        if numbers:
            first, end, closed = numbers
            known = counts | {name: int(value) for name, value in PART.findall(self.code.text) if value.isdigit()}
            ends = [known[name] for name in re.findall(r"\w+", end) if name in known]  # n, or len(rows)
            last = int(end) if end.isdigit() else ends[0] if ends else first + every - closed
            last = first if re.search(r"[-+*/:]", end) else last + closed
        for k in range(first, min(last, MOST_PASSES)):
            found = [str(k)] * ("enumerate(" in over or not lists) + [f"{name}@{k}" for name in lists]
            rest = [f"{found[-1]}@{part}" for part in range(len(names) - len(found) + 1)]
            yield dict(zip(names, found[:-1] + rest if len(rest) > 1 else found))

    def _element(self, found: re.Match[str]) -> str:
        """An element of a list, or a row of a matrix; what is no list stays as it is."""
        value: Any = self.values.get(found[1])
        try:
            for index in _INDEX.findall(found[2]):
                for part in parts(index[1:-1]) if index[0] in "[({" else [index]:
                    key: Any = part.strip("'\"@.").lower()
                    if isinstance(value, list) and key != ":":
                        key = int(amount_of(key).number) - {"[": self.first, "@": 0}.get(index[0], 1)
                        if key < 0:
                            raise IndexError(key)
                    value = value if key == ":" else value[key]
            row = ", ".join(value)
        except (KeyError, IndexError, ValueError, TypeError):
            return found[0]
        self.taken.add(found[1])
        if isinstance(value, str):
            return f"({value})" if re.search(r"[-+*/]", value) else value
        return row if found.string[: found.start()].rstrip()[-1:] in ("[", "*") else f"[{row}]"
