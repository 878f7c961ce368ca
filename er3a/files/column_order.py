"""What a program says of its columns' order: in comments, in functions of a row, by what it unpacks rows into."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import lru_cache
from itertools import permutations

from er3a.errors import InputError
from er3a.files.arithmetic import plain
from er3a.files.code_brackets import groups_of, parts
from er3a.files.program_text import PART, Cells, Code, filled, rows_of
from er3a.files.table_cells import Grid, Words
from er3a.files.table_headings import heading_of, place_of, quantities_of

LIBRARIES = {
    "SerialLink": ("theta,d,a,alpha,type,offset", ""),
    r"setFixedTransform\([^\n]*[\"']dh[\"']": ("a,alpha,d,theta", "standard"),
    r"setFixedTransform\([^\n]*[\"']mdh[\"']": ("a,alpha,d,theta", "modified"),
    r"\bpybotics": ("alpha,a,theta,d", "modified"),
    "visual_kinematics": ("d,a,alpha,theta", "standard"),
    "sympybotics": ("alpha,a,d,theta", ""),
}
"""Columns of a matrix, and the convention, by what a program has that calls the library that takes it."""


_UNPACKED = re.compile(
    r"((?<![\w.])\w+(?:\s*,\s*\w+){2,7})\s*\)?\s*"
    r"(?:\bin\s+(?:enumerate\(\s*)?[\w.]+\b(?!\()|=\s*[\w.]+(?:\[[^\]\n]*\])*[ \t]*(?=[\n;]|$))"
)
"""Names that the parts of a row get, of a name or of each of a list; what a call makes is no row."""


_LISTED = re.compile(r"[\[{(]((?:\s*[\"']\w+[\"']\s*,?){3,9})[\])}]")


_ENUM = re.compile(r"\benum\b[^{;]*\{([^{}=]*)\}")


def order_of(code: Code, rows: Grid, before: str) -> Words:
    """The names of a matrix's columns: of a comment, of what its rows are unpacked into, of the type of its rows, or
    of a library."""
    width = len(rows[0][1])
    near = order_near(code, rows[-1][0] + 1, rows[0][0], width)
    used = _columns_in(
        [
            *(
                ",".join(order)
                for name, order in signatures(code).items()
                if name in code.fields and re.search(rf"\b{name}\b.", before)
            ),
            *_UNPACKED.findall(code.text),
            *_ENUM.findall(code.text),
            *_LISTED.findall(code.text),
            ",".join(re.findall(r"<th\b[^>]*>([^<]+)</th>", code.text)),  # above rows that a script writes
            *_indexed(code),
        ],
        width,
    )
    if near and used and [*map(place_of, near)] != [*map(place_of, used)]:
        raise InputError(
            None,
            f"line {rows[0][0]}",
            f"a comment says {', '.join(near)}, and the program {', '.join(used)}",
            "Say the columns' order by --column",
        )
    if said := near or used or _columns_in(code.comments.values(), width):
        return said
    of_links = {tuple(name for name in order if place_of(name) != "theta") for order in signatures(code).values()}
    if width == 3 and len(of_links) == 1:  # theta is the function's other argument
        return [*of_links.pop()]
    of_arm = re.findall(r"SerialLink\(\s*(\w+)\s*[,)]", code.text)
    name = re.search(r"(\w+)\s*=\s*[\[{]?$", before)
    if of_arm and name and name[1] not in of_arm:
        return []
    taken = (order for library, (order, _) in LIBRARIES.items() if re.search(library, code.text) and width >= 4)
    return next((order.split(",")[:width] for order in taken), [])


def order_near(code: Code, last: int, first: int, width: int) -> Words:
    """The names of columns that a comment says, in the last lines up to six above the first row."""
    lines = range(last, max(first - 6, 0), -1)
    return next((names for k in lines if (names := _columns_in([code.comments.get(k, "")], width))), [])


def _columns_in(texts: Iterable[str], width: int) -> Words:
    """The names of columns that texts hold one after the other; [] if they hold several orders."""
    found: dict[str, Words] = {}
    for text in texts:
        text = plain(text)
        text = re.sub(r"(?<=,)(\s*)_(?=,|$)", r"\1theta", re.sub(r"\b(?:joint_?)?type\b", "sigma", text))
        text = re.sub(
            r"(?<=\w)\s*[(\[]\s*(?:(mm|cm|m|in)|deg|rad|°)\s*[)\]](?!.*\|)",  # a table in a comment has its own rows
            lambda each: f"_{each[1]}" * bool(each[1]),
            text,
        )
        text = re.sub(r"(?<=\w)\s*[(\[{_]*\s*i\s*-\s*1\s*[)\]}]*", "_i-1", text)
        text = re.sub(r"(?<=\w)(?:\s*[(\[]\s*i\s*[)\]]|\s+i(?=\s*,|$))", "_i", text)
        words = re.split(r"(?:[\s,;|\[\]()→]|->|\band\b|(?<!\w)-(?!\w))+", text)
        windows = (words[k : k + size] for size in range(9, width - 1, -1) for k in range(len(words) - size + 1))
        # All that it names, of which the row's number is no column, nor theta of three; theta and its offset are two
        # mentions of one.
        names = next((each for each in windows if names_columns(each, once=len(each) > width)), [])
        others = "joint", "theta" if width == len(_WITHOUT_THETA) else ""
        names = names if len(names) == width else [name for name in names if place_of(name) not in others]
        if len(names) == width:
            found.setdefault(" ".join(map(place_of, names)), names)
    return next(iter(found.values())) if len(found) == 1 else []


def _indexed(code: Code) -> Iterator[str]:
    """Names of a row's parts in the order of their numbers: ``a = row[0]``, ``T = dh(row[0], row[1], ...)``."""
    found: dict[str, dict[int, str]] = {}
    pattern = (
        r"(\w+)\s*=\s*(?:[\w\[\]().]+\s*\+\s*|(?:\w+\.)?(?:deg2rad|radians)\()?"
        r"([\w.]+)[\[(](?:[\w:]+\s*(?:,|\]\s*\[)\s*)?(\d+)[\])](?!\s*-)"
    )
    for name, row, number in re.findall(pattern, code.text):
        if heading_of(name):
            found.setdefault(row, {})[int(number)] = name
    for names in found.values():
        yield ",".join(names[k] for k in sorted(names))


def names_columns(names: Words, *, once: bool = False) -> bool:
    """Whether names are those of a D-H table's columns, each once; with ``once`` theta and its offset count as one."""
    quantities = {name.replace("offset", "theta") if once else name for name in quantities_of(names)}
    return len(quantities) == len(names) and quantities >= _WITHOUT_THETA


_WITHOUT_THETA = {"a", "alpha", "d"}


_OF_JOINT = re.compile(r"(?<![a-z])(?:q|th(?:eta)?|θ)[_\[({]*\d", re.I)
_RIGHT_ANGLE = re.compile(
    r"[-+()\s]*(?:[\d.]+\*)?(?:\w+\.)?(?:\w*pi\b|π)[\s()/\d._]*|[-+]?(?:90|180|270|1\.57\d*|3\.14\d*)(?:\.0*)?f?",
    re.I,
)
_NOTHING = re.compile(r"[-+]?0*\.?0*f?")
_PARALLEL = re.compile(r"[-+]?(?:0*\.?0*f?|(?:\w+\.)?(?:\w*pi|π)|180(?:\.0*)?|3\.14\d*)", re.I)


def only_order(rows: Grid) -> Words:
    """The order of four columns without names, if there is one alone in which no two joints turn about one line.

    Two joints do if both length and twist between them are 0: of standard tables in all rows but the last, of modified
    ones in all but the first.

    Returns
    -------
    names : [] if no order, or several, are possible
    """
    columns = [*zip(*(cells for _, cells in rows))]
    if len(columns) != len(_ROLES):
        return []
    named = [[bool(_OF_JOINT.search(cell)) for cell in column] for column in columns]
    none = [[bool(_NOTHING.fullmatch(cell)) for cell in column] for column in columns]
    right = [[bool(_RIGHT_ANGLE.fullmatch(cell)) for cell in column] for column in columns]
    in_pi = [bool(re.search(r"pi\b|π", " ".join(column), re.I)) for column in columns]
    turned = [all(x or y or z for x, y, z in zip(*each)) for each in zip(named, none, right)]
    found = []
    for a, alpha, d, theta in permutations(range(len(_ROLES))):
        lengths = not (all(none[a]) or all(none[d]) or any(named[a]) or in_pi[a] or in_pi[d])
        angles = turned[alpha] and turned[theta] and any(right[alpha]) and not any(named[alpha])
        links = zip(none[a], columns[alpha], named[d])
        one_line = [bool(blank and _PARALLEL.fullmatch(twist) and not slides) for blank, twist, slides in links]
        separate = not any(one_line[:-1]) or not any(one_line[1:])
        if lengths and angles and sum(named[d]) <= sum(named[theta]) and separate:
            found.append((a, alpha, d, theta))
    order = dict(zip(found[0], _ROLES)) if len(found) == 1 else {}
    return [order[k] for k in sorted(order)]


_ROLES = "a", "alpha", "d", "theta"


KDL = "DH", "DH_Craig1989"


_OF_ROWS = re.compile(r"\w*(?:dh|denavit|link|trans|frame)\w*|[AT]", re.I)
"""Names of functions of a row, whose order a comment may say."""


@lru_cache(maxsize=2)
def signatures(code: Code) -> dict[str, Words]:
    """The order of the four numbers of a function ``dh(theta, d, a, alpha)``, where it is defined or called so, or of a
    type."""
    # KDL's joint comes before the frame, whose theta is a constant, whatever its name.
    orders = {name: ["a", "alpha", "d", "offset"] for name in KDL if "Frame::DH" in code.text}
    for each in code.groups:
        named, names = re.search(r"(\w+)(?:[\"'],)?\s*$", each.before), parameters_of(each.inside)
        line = code.line(each.start)
        if sorted(map(place_of, quantities_of(names))) != ["a", "alpha", "d", "theta"]:
            called = named and _OF_ROWS.fullmatch(named[1]) and len(names) == 4
            names = order_near(code, line, line, 4) if called else []
        if names and named and each.bracket != "{":
            made = re.findall(r"class\s+(\w+)", code.text[: each.start]) if named[1] == "__init__" else [named[1]]
            orders.setdefault(made[-1] if made else "", names)
    return {name: names for name, names in code.fields.items() if names_columns(names)} | orders


def parameters_of(text: str) -> Words:
    """Names of parameters without their types and defaults."""
    names = [re.sub(r"\s*[:=].*", "", part).rpartition(" ")[2].strip("&*\"'") for part in parts(text)]
    return names[names[0] == "self" :]


_PLAINLY = (
    (r"(?:\w+(?:\.|::))+(?=(?:cos|sin|radians|deg2rad)\b)|\s|\*\w*\.?pi/180", ""),
    (r"\b(cos|sin)([θα]\w*)", r"\1(\2)"),
    (r"\b(cos|sin)d\(", r"\1("),
    (r"(?:radians|deg2rad)\(([^()]*)\)", r"\1"),
)
_TRANSFORMS = {
    "standard": r"cos\((?P<theta>.+)\);[^;]+;[^;]+;(?:cos\((?P=theta)\)\*)?(?P<a>[^;*]+?)(?:\*cos\((?P=theta)\))?;"
    r"(?:[^;]+;){4}[0.]+;sin\((?P<alpha>.+)\);cos\((?P=alpha)\);(?P<d>[^;]+)",
    "modified": r"cos\((?P<theta>.+)\);-sin\((?P=theta)\);[0.]+;(?P<a>[^;]+);[^;]+;[^;]+;-sin\((?P<alpha>.+)\);"
    r"-(?:sin\((?P=alpha)\)\*)?(?P<d>[^;*]+?)(?:\*sin\((?P=alpha)\))?;[^;]+;[^;]+;cos\((?P=alpha)\);.*",
}
"""The entries of a row's transform in either convention, one after the other."""
_NAME = re.compile(r"[^\W\d]\w*(?:\.\w+|\[[^\[\]]*\]|\([^()]*\))*")


@lru_cache(maxsize=2)
def program(text: str) -> Code:
    """A program in which names of a row's transform are those of their quantities, whatever they were; with the order
    of columns, as a comment, and the conventions that such transforms say."""
    code, given = Code(text), Cells()
    for names, values in PART.findall(code.text):
        pairs = zip(names.split(","), parts(values))
        given |= {name.strip(): own for name, own in pairs if re.search(r"(?:cos|sin)\(", own)}
    renamed = list[tuple[int, int, Cells]]()
    for group in code.groups:
        entries = ";".join(filled(cell, given) for _, cells in rows_of(code, group)[:3] for cell in cells)
        for pattern, plainly in _PLAINLY:
            entries = re.sub(pattern, plainly, entries)
        for convention, pattern in _TRANSFORMS.items():
            if found := re.fullmatch(pattern, entries):
                code.conventions.add(convention)
                named = {name: role for role, own in found.groupdict().items() for name in _NAME.findall(own)}
                places = {name[-2]: role for name, role in named.items() if name[-2:-1].isdigit()}  # row[2]
                code.comments[0] = ",".join(role for _, role in sorted(places.items()))
                begun = max(
                    0, *(code.text.rfind(each, 0, group.start) for each in ("def ", "function", "lambda", "}\n"))
                )
                renamed.append((begun, group.end, {name: role for name, role in named.items() if name.isidentifier()}))
    for begun, end, named in renamed[::-1]:
        code.text = code.text[:begun] + filled(code.text[begun:end], named) + code.text[end:]
    code.groups = sorted(groups_of(code.text), key=lambda each: each.start)
    return code
