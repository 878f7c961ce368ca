"""Rows of a D-H table that a program makes by calls and records: ``RevoluteDH(d=0.29)``, ``{"a": 0, ...}``."""

from __future__ import annotations

import re

from er3a.by_value import frozen
from er3a.files.arithmetic import words_of
from er3a.files.code_brackets import CodeGroup, parts
from er3a.files.code_lists import Lists
from er3a.files.column_order import KDL, parameters_of, signatures
from er3a.files.program_text import Cells, Code, is_row, record_of, row_cells
from er3a.files.table_cells import Grid, Words
from er3a.files.table_headings import heading_of, quantities_of

_TOOLBOX = re.compile(r"(?:link|(revolute|prismatic)(?:m?dh)?|dhlink)", re.I)


_OF_LINK = [*words_of("theta d a alpha sigma offset")]


_ORDERS = words_of(
    "dhlink=d,alpha,theta,a,sigma revolutedh=d,a,alpha,offset revolutemdh=d,a,alpha,offset "
    "prismaticdh=theta,a,alpha,offset prismaticmdh=theta,a,alpha,offset"
)
"""The order of arguments without names, by the function."""


_ADDED = r"(?m)\.extend\(|\)\s*\]\s*\*\s*\d|^\s*(\w+)[\[({]\d+[\])}]\s*=\s*\1[\[({]\d+[\])}]\s*(?:;|$)"
"""Links that no call makes: of another list, ``[...] * 2``, ``L(2) = L(1)``."""


_ADDED_THETA = r"(?s)\A(?!.*\b(?:offset|sigma)\b)(.*)\btheta(?=\s*=)"


_OF_LOOP = ("is of a loop, or of another program", "Write a row for each joint")


def links_of(code: Code) -> tuple[list[Grid], list[Grid], Lists]:
    """Links made by a function of a toolbox, or by any whose arguments have the names of a D-H row, and records
    ``{"a": 0, "alpha": 90, ...}``, such calls of other functions; and the lists, of which they take elements."""
    rows, own, unread = list[_Link](), list[_Link](), list[CodeGroup]()
    records = _records(code)
    lists = Lists(code)
    for each in code.groups:
        named = re.search(r"(?:([\w.()\[\]{}]+)\s*=\s*)?(?:[\w.]*\.)?([A-Za-z_]\w*)\s*$", each.before)
        if each.bracket != "(" or named is None:
            continue
        target, function = named.groups()
        order, toolbox = signatures(code).get(function, []), _TOOLBOX.fullmatch(function)
        of_lists = toolbox or function in KDL
        texts = lists.written_out(each) if of_lists or order else [each.inside]
        if function == "DHLink" and "OriginLink(" in code.text:  # ikpy's turns by its theta and the joint's angle
            texts = [re.sub(_ADDED_THETA, r"\1offset", text) for text in texts]
        if of_lists and not texts:
            code.refuse(each.start, each.inside, *_OF_LOOP)
        made = [_arguments(function, text) or _of_signature(order, text) for text in texts]
        made = [cells for cells in made if cells and (toolbox or _says_numbers(lists, cells, target))]
        target = _target(each, target or "", bool(toolbox) and len(texts) == 1)
        for k, cells in enumerate(made):
            name = f"{target}.{k}" if target and len(made) > 1 else target
            (own if order and not of_lists else rows).append(_Link(name, each.start, cells))
        if toolbox and not (made or order or re.fullmatch(r"[\w\s+-]*", each.inside)):  # no list of links
            unread.append(each)
    if "Frame::DH" in code.text:
        _segments(code, rows)
    if unread and (rows or re.search(r"(?i)\blink\(\[", code.text)):
        code.refuse(unread[0].start, unread[0].inside, "can't be read as a link", "Write its numbers there")
    if not lists.taken:
        rows, own = sorted(rows + own, key=lambda row: row.place), []
    _assigned(code, rows, lists)
    if rows and (re.search(_ADDED, code.text) or len(rows) == 1 or len({*lists.loops}) < len(lists.loops)):
        code.refuse(rows[0].place, ", ".join(_constants(rows[0].cells)), *_OF_LOOP)
    if not lists.taken:
        rows = sorted(rows + records, key=lambda row: row.place)
    grids = [_grid([(code.line(row.place), row.cells) for row in each]) for each in (*_arms(code, rows), own)]
    return grids[:-1], grids[-1:] if len(own) > 1 else [], lists


def _records(code: Code) -> list[_Link]:
    """Records ``{"a": 0, "alpha": 90, ...}``; those next to them in a list may leave out what is 0."""
    found = [(each, record_of(each)) for each in code.groups if each.bracket == "{"]
    around = [[other.start for other in code.groups if other.start < each.start < other.end] for each, _ in found]
    lists = {tuple(places) for places, (_, cells) in zip(around, found) if is_row(cells)} - {()}
    records = list[_Link]()
    for places, (each, cells) in zip(around, found):
        names = quantities_of(cells)
        if is_row(cells) or (names and len(names) == len(cells) and tuple(places) in lists):
            blank = {name: "0" for name in ("a", "alpha", "d") if name not in names}
            records.append(_Link("", each.start, blank | cells))
    return records


def _target(call: CodeGroup, name: str, named: bool) -> str:
    """The name of a link, with the list that it is appended to or put in; ``named``: whether it may have its own."""
    added = re.search(r".*\b(\w+)(?:\.|->)(?:addSegment|append|push_back)\(\s*[^;\n]*\n?[^;\n]*$", call.before, re.S)
    name = f"{added[1]}[{call.start}" if added else re.sub(r"\s", "", name)
    return "" if name.isidentifier() and not named else name


def _arms(code: Code, rows: list[_Link]) -> list[list[_Link]]:
    """The links of each arm: those that a list names or holds, and the rest by their lists."""
    names = {row.name: row for row in rows}
    chosen = [row_cells(each.inside) for each in code.groups if each.bracket == "["]
    arms = [[names[cell] for cell in cells] for cells in chosen if len(cells) > 1 and {*cells} <= {*names}]
    taken = [row for each in arms for row in each]
    held = [[row for row in rows if each.start < row.place < each.end] for each in code.groups]
    several = [] if "Frame::DH" in code.text else [each for each in held if len(each) > 1]
    for one in several or [rows]:
        arms += [each for each in _begun_again(one) if not taken or (_list_of(each[0]) and each[0] not in taken)]
    return arms


def _segments(code: Code, rows: list[_Link]) -> None:
    """Say what moves in KDL's ``Segment(Joint(Joint::RotZ), Frame::DH(a, alpha, d, theta))``: its joint comes first.

    Of Craig's frames the joint's row is that of the segment before, and the last one is the flange's.
    """
    joints = dict(re.findall(r"\bJoint\s+(\w+)\s*[({=]([^;\n]*)", code.text))
    craig = "DH_Craig" in code.text
    chains = dict[str, tuple[Words, list[_Link]]]()
    for each in code.groups:
        if re.search(r"\bSegment\s*$", each.before) and each.inside.strip():  # an empty one moves and turns nothing
            said = " ".join(joints.get(part, part) for part in parts(each.inside))
            own = [row for row in rows if each.start < row.place < each.end]
            found = [kind for kind in _KINDS if re.search(rf"\b{kind}\b", said)]
            chain = _target(each, "", False).partition("[")[0]
            kinds, frames = chains.setdefault(chain, ([], []))
            if len(found) != 1 or len(frames) < len(kinds) or not (own or craig):
                code.refuse(
                    each.start,
                    each.inside,
                    "is no row of a table",
                    "Write its joint, RotZ, TransZ or None, and Frame::DH into its call, or leave it out",
                )
            passes = [row for row in own if row.place == own[0].place]  # another frame is of the inertia
            kinds += [_KINDS[found[0]]] * max(len(passes), 1)
            frames += [_Link(f"{chain}[{len(kinds)}.{k}", row.place, row.cells) for k, row in enumerate(passes)]
    rows.clear()
    for chain, (kinds, frames) in chains.items():
        if not frames:
            continue
        zero = _Link(f"{chain}[", frames[0].place, dict.fromkeys(frames[0].cells, "0"))
        if len(frames) < len(kinds):
            frames[-1].cells["last frame"] = ""
        frames = [zero, *frames] if craig else frames
        rows += frames
        for row, kind in zip(frames, [*kinds, "fixed"]):
            row.cells.update(type=kind, convention="modified" if craig else "standard")


_KINDS = {"RotZ": "revolute", "TransZ": "prismatic", "None": "fixed"}


def _of_signature(order: Words, text: str) -> Cells:
    """A row of a function's arguments; none of its definition."""
    cells = {name: part.strip("\"'") for name, part in zip(order, parts(text))}
    return {} if len(cells) < len(order) or parameters_of(text) == order else cells


def _says_numbers(lists: Lists, cells: Cells, target: str | None) -> bool:
    """Whether a row holds numbers or names of numbers, and no elements of lists; no model of elements ``L(1)``, ..."""
    texts, code = [cell for cell in _constants(cells) if cell not in lists.values], lists.code
    if target and f"{target}(1)" in code.text:
        return False
    return not any(re.search(r"\[(?!\d+\])|\w(?<!2)\(\w+\s*,\s*\w+\)|\bc\(", cell) for cell in texts) and any(
        not re.fullmatch(r"[^\W\d][\w.]*", cell) or re.search(rf"(?m)^\s*{re.escape(cell)}\s*=[^\[{{\n]+$", code.text)
        for cell in texts
    )


def _constants(cells: Cells) -> Words:
    """The numbers of a row without theta, which can be an element ``q[0]``."""
    return [cell for name, cell in cells.items() if quantities_of([name]) not in ([], ["theta"], ["type"])]


@frozen
class _Link:
    name: str
    place: int
    cells: Cells


def _begun_again(rows: list[_Link]) -> list[list[_Link]]:
    """Links by the arms that they belong to: a name that is used again begins another arm, another list does too."""
    arms: dict[tuple[str, int], list[_Link]] = {}
    lists = {_list_of(row) for row in rows if row.name}
    for k, row in enumerate(rows):
        uses = [other.name for other in rows[:k] if row.name].count(row.name)
        one = _list_of(row) if row.name or len(lists) > 1 else "".join(lists)
        arms.setdefault((one, uses), []).append(row)
    return [*arms.values()]


def _list_of(row: _Link) -> str:
    """The name of the list that holds a link ``L(2)``; "" if it is in none."""
    return "".join(re.findall(r"(.*)[(\[{]", row.name))


def _arguments(function: str, text: str) -> Cells | None:
    """A row's cells by their headings; None if the call makes no link."""
    low = function.lower()
    given, words, cells = Words(), Words(), Cells()
    for part in parts(_NAMED_BEFORE.sub(r"\1=\2", text)):
        key, is_named, value = part.partition("=")
        if is_named and re.fullmatch(r"\w+\s*", key):
            cells[_argument(key)] = value.strip(" \"'")
        elif _FLAGS.fullmatch(word := part.strip("\"'")):
            words.append(word.lower())
        elif part:
            given.append(part)
    if {"theta", "dz", "dx", "alpha"} <= {*cells}:  # Kajita's lengths along z and x, as textbooks have them
        cells["d"], cells["a"] = cells.pop("dz"), cells.pop("dx")
    if not _TOOLBOX.fullmatch(function):
        return cells if is_row(cells) and not given else None
    order = [*filter(None, _ORDERS.get(low, "").split(","))]
    if len(given) == 1 and given[0].startswith("["):
        order = [*words_of("alpha a theta d sigma")] if function == "link" else _OF_LINK
        given = row_cells(given[0][1:-1])
        if len(given) < 4:
            return None
    elif len(given) > len(order) or (low == "link" and not cells):
        return None
    return _of_toolbox(low, words, cells | dict(zip(order, given)))


def _argument(key: str) -> str:
    """The name of an argument, ``α`` and ``link_length`` as that of their quantity; letters mean what they are."""
    own = heading_of(key)
    named = own and own.quantity in _OF_LINK and (len(key.strip()) > 1 or not key.isascii())
    return own.quantity if own and named else key.strip().lower()


_FLAGS = re.compile("modified|mod|mdh|standard|std|stddh|moddh|revolute|prismatic|flip|sym", re.I)
_NAMED_BEFORE = re.compile(rf"""["'](?!(?:{_FLAGS.pattern})["'])(\w*)["']\s*,\s*(["'][^"']*["']|(?=\S))""", re.I)
"""A name of MATLAB's before its value."""


def _of_toolbox(function: str, words: Words, cells: Cells) -> Cells:
    """A row of a toolbox: what is left out is 0; theta of a joint that turns, and d of one that slides, is its own."""
    words += [flag for flag in ("mdh", "flip") if cells.pop(flag, "0").lower() in ("1", "true")]
    said = " ".join([function, *words])
    slides = "prismatic" in said or cells.get("sigma", "0") in ("1", "1.0")
    slides |= function == "link" and "theta" in cells and "d" not in cells
    row = {name: cells.get(name, "0") for name in ("theta", "d", "a", "alpha", "offset")}
    row |= {"type": "revolute", "convention": "modified" if "mod" in said or "mdh" in said else "standard"}
    if slides:  # its own d is no part of the transform
        row |= {"d": "0", "type": "prismatic"}
    return row | {"direction": "-1"} if "flip" in words else row


_SET = re.compile(
    r"([\w.]+(?:[(\[{]\d+[)\]}])?)\.(offset|alpha|theta|a|d|flip|sigma|mdh)\b"
    r"([^=;\n,)]*\)?)\s*=(?!=)\s*([^;\n]+)"  # what is between: an index of a joint
)


def _assigned(code: Code, rows: list[_Link], lists: Lists) -> None:
    """Carry out what is set after a link was made: ``L(2).offset``, ``robot.offset(2)``, ``robot.links(2).offset``."""
    text = re.sub(r"\.links(\(\d+\))\.(\w+)", r".\2\1      ", code.text)  # as long as it was
    for found in _SET.finditer(text) if rows else ():
        name, one = f"{found[1]}.{found[2]}", f"{found[2]}{found[3]}".rstrip()
        given = [
            (row, key)
            for k, row in enumerate(rows, 1)
            for key, cell in row.cells.items()
            if one == f"{key}({k})" or (one == found[2] and name in (cell, f"{row.name}.{key}"))
        ]
        for row, key in given:
            row.cells[key] = found[4].strip()
        whole = lists.values.get(found[2], ()) if found[1].isidentifier() else ()
        if not given and isinstance(whole, list) and len(whole) == len(rows):  # robot.offset = DH(:, 4)'
            for row, cell in zip(rows, whole):
                row.cells[found[2]] = cell
        elif not given:
            code.refuse(found.start(), name, "is set for a link that is not found", "Write it into the link's call")


def listed_rows(code: Code) -> list[Grid]:
    """Rows as lines ``a: 0``, ``alpha: 90``, ... of YAML, each begun by a dash, a name or a key that is repeated; if
    such keys hold lists, these are columns (:func:`columns_of`)."""
    tables = [[(0, Cells())]]
    level = 0
    for number, line in enumerate(code.text.split("\n"), 1):
        found = re.fullmatch(r"(\s*)(-\s+)?[\"']?([\w ]+?)[\"']?\s*(?::|=(?=\s*[-+.\d]))\s*([^\[{;]*)", line)
        if found is None:
            continue
        indent, dash, key, value = found.groups()
        key, rows = key.lower(), tables[-1]
        numbered = re.search(r"\d", key)
        if len(indent) < level and not value and not numbered:  # the name of another list
            tables.append([(number, {})])
        elif dash or key in rows[-1][1] or not value:
            rows.append((number, {"joint": key} if not value and numbered else {}))
            level = len(indent)
        if value:
            rows[-1][1][key] = value.strip(" \"'")
    full = [[row for row in rows if is_row(row[1])] for rows in tables]
    return [_grid(rows) for rows in full if len(rows) > 1]


def _grid(rows: list[tuple[int, Cells]]) -> Grid:
    header = list(dict.fromkeys(key for _, cells in rows for key in cells))
    blank = ["1" if key == "direction" else "" for key in header]
    return [(0, header), *((line, [*map(cells.get, header, blank)]) for line, cells in rows)]
