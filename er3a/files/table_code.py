"""D-H tables in programs and data: calls such as ``RevoluteDH(d=0.29)``, matrices, lists, JSON. Nothing is executed."""

from __future__ import annotations

import re

from er3a.files.code_brackets import CodeGroup
from er3a.files.code_links import links_of, listed_rows
from er3a.files.code_lists import Lists, columns_of, named_lists, numbered_lists
from er3a.files.column_order import names_columns, order_of, program
from er3a.files.program_text import Code, list_name, row_cells, rows_of
from er3a.files.table_cells import Grid, Words
from er3a.files.table_headings import heading_of, place_of, quantities_of


def code_grids(text: str, *, headed: bool = True) -> list[Grid]:
    """The tables in a program or in data.

    Parameters
    ----------
    headed : those whose columns have names; otherwise matrices of numbers without any

    Returns
    -------
    grids : of each its headings and rows, with their lines
    """
    code = program(text)
    matrices = [grid for grid in (*(_matrix(code, each) for each in code.groups), _listed(code)) if grid]
    if not headed:
        lists, unnamed = Lists(code), [""] * MOST_COLUMNS
        return [[(line, _shown(lists, unnamed, row)) for line, row in grid if line] for grid in matrices]
    links, others, lists = links_of(code)
    links = links or listed_rows(code)
    named = [grid for grid in matrices if grid[0][1]]
    columns = (columns_of(each, code.text) for each in (named_lists(code), numbered_lists(code)))
    found = links or named or next(filter(None, columns), others)
    if found and (lists.taken or not links):
        for group in code.groups:
            _check_kept(code, group, bool(named or lists.taken), lists.taken)
    of_types = links and "type" in links[0][0][1]
    if found and not of_types and (moved := re.search(_TURNED, code.text)):
        code.refuse(moved.end(), moved[0], "changes theta", "Write its offset into the table")
    return [[(line, _shown(lists, table[0][1], row)) for line, row in table] for table in found]


MOST_COLUMNS = 8
"""Of a matrix that is a table of links."""


def _shown(lists: Lists, header: Words, row: Words) -> Words:
    """A row with elements of lists in place of their names; in a language that nothing says, numbers of elements may be
    from 0 or 1."""
    kept = [
        place_of(name) == "theta" or bool(re.search(r"\[\d", cell) and not lists.said)
        for name, cell in zip(header, row)
    ]
    return [cell if keep else lists.resolved(cell) for keep, cell in zip(kept, row)]


_CONSTANT = {"a", "alpha", "d", "offset"}


def _check_kept(code: Code, group: CodeGroup, is_matrix: bool, taken: set[str]) -> None:
    """Refuse a matrix, or the list of a column, that its program changes."""
    name = list_name(group)
    table = _matrix(code, group) if is_matrix else []
    of_column = not is_matrix and _CONSTANT.intersection(quantities_of([name, name.rpartition("_")[2]]))
    if (name not in taken if taken else not (table or of_column)) or not group.inside.strip():
        return
    titles, *rows = [row for _, row in table] or [[]]
    thetas = [cell for row in rows for title, cell in zip(titles, row) if quantities_of([title]) == ["theta"]]
    # Joints' values are added to constants of theta, or put there if these are 0.
    joints = (
        r"\+=?\s*(?:q|th|θ|joint)" if re.search(r"(?i)(?<!\w)[\d.]*[1-9]|pi|π", " ".join(thetas)) else "q|th|θ|joint"
    )
    used = {*re.findall(rf"\b{name}[\[(](\w+),\s*:", code.text)}
    if is_matrix and all(map(str.isdigit, used)) and 0 < len(used) < len(rows_of(code, group)):
        code.refuse(group.start, name, "has rows that the program does not use", "Leave them out")
    of_name = _SET.replace("NAME", name).replace("JOINTS", joints)
    for change in [*_MOVED.finditer(group.before), *re.finditer(of_name, code.text)]:
        place = group.start if change.re is _MOVED else change.end()
        code.refuse(place, change[0].strip(" ;"), f"changes '{name}'", "Write what the program makes of it")


_SET = r"""(?mx)
    (?<![(,]\n)(?<![(,]\r\n)^[ \t]*(?:del[ \t]+NAME\b                              # no argument on its own line
    |NAME(?:\.(?:append|insert|extend|pop|reverse)\(
    |(?:\.\w+|[\[({][^\n=\])}]*[\])}])*[ \t]*-=                                    # NAME[1][0] -= q[1]
    |(?:\.\w+|[\[({][^\n=\])}]*[\])}])+(?!.*(?:JOINTS))[ \t]*[+*/]?=(?!=)[^\n;]*
    |[ \t]*[+*/]?=(?!=)[ \t]*+(?!\w+\.NAME[ \t]*(?:[;,]|$))                    # a record's field of that name
    (?!(?:\w+\.)*(?:deg2rad|radians|\w*array|matrix|float|sym|double)\()[^\n;]*\bNAME\b.*))
"""
"""A statement that puts something else than joints' values into a list, changes its length, or makes it anew of itself,
in the same units."""


_TURNED = (
    r"(?m)^\s*(?:q|th|theta)\w*[\[(]\d[\])]\s*(?:=\s*[\w.]+[\[(]\d[\])]\s*[-+]|[-+]=).*(?:pi|\d).*|"
    r"^\s*((?:q|th|theta)\w*)\s*=\s*(?:\1|(?:q|th|theta)[a-z_]*)\s*[-+].*(?:pi\b|90|180).*"
)


_MOVED = re.compile(r"\S*(?:transpose|flip\w*|roll|cumsum)\(\s*$", re.I)


def _matrix(code: Code, group: CodeGroup) -> Grid:
    """A matrix with the names of its columns; [] if it is none, or a pose."""
    rows = rows_of(code, group)
    turning = any(re.match(r"-?\s*(?:\w+\.)*(?:cos|sin)\(", cell) for _, cells in rows for cell in cells)
    if len(rows) < 2 or turning or any(re.match(r"[\[{]|\([^()]*,|.*:", cell) for cell in rows[0][1]):
        return []
    ends = " ".join(rows[-1][1])
    units = [sorted(cell.strip("-+.0") for cell in cells) for _, cells in rows]
    if (len(rows) == 4 and re.fullmatch(r"(0[.0]* ){3}1[.0]*", ends)) or units == [["", "", "1"]] * 3:  # a pose, a turn
        return []
    several = len({line for line, _ in rows}) == len(rows)
    labels = [code.comments.get(line, "") if several else "" for line, _ in rows]
    widths = {len(cells) for _, cells in rows}
    return _titled(code, rows, labels, group.before) if len(widths) == 1 and 3 <= min(widths) <= MOST_COLUMNS else []


def _listed(code: Code) -> Grid:
    """A matrix with a line for each row: ``joint1: [0, 270, 0, 0]`` of YAML, ``dh(1,:) = [0 270 0 0];``."""
    rows, labels, arms = Grid(), Words(), set[str]()
    stacked = {name for each in code.groups for name in re.findall(r"\w+", each.inside)}
    for group in code.groups:
        label = re.search(
            r"(?:^|[\n{,])\s*(?:-|[\"']?(\w+)[\"']?\s*:|"
            r"(?:(?:(?:static|const|constexpr|double|float)\s+)*(\w+\d)(?:\[[4-8]\])?|\w+[\[(]\d+(?:,\s*:)?[\])])\s*=)"
            r"\s*$|setFixedTransform\([^\n]*,\s*$",
            group.before,
        )
        if label and label[2] and label[2] not in stacked and "dh" not in label[2].lower():
            continue
        if label and not re.search(r"(?<!\w)\[|[{:]", group.inside):
            cells = row_cells(group.inside)
            begun = 4 <= len(cells) <= MOST_COLUMNS and re.search(r"\d|pi|π", group.inside)
            if len(cells) == len(rows[0][1]) if rows else begun:
                rows.append((code.line(group.start), cells))
                labels.append(label[1] or label[2] or "")
                arms.add((label[2] or "").rstrip("0123456789"))
    return _titled(code, rows, labels) if len(rows) > 1 and len(arms) == 1 else []


def _titled(code: Code, rows: Grid, labels: Words, before: str = "") -> Grid:
    """A matrix below the names of its columns, [] if it has none; with the labels of its rows, if each has one."""
    if {*quantities_of(labels)} >= {"a", "alpha", "d"}:  # a row for each quantity
        names = ["theta" if quantities_of([each]) == ["joint"] else each for each in labels]
        return [(0, names), *((rows[0][0], [*cells]) for cells in zip(*(cells for _, cells in rows)))]
    header = order_of(code, rows, before) or _symbols(rows)
    labelled = all(re.search(r"[^\W\d_]|^\d+$", each) for each in labels) and not all(map(heading_of, labels))
    if header and "joint" not in header and labelled:
        return [(0, ["joint", *header]), *((line, [label, *cells]) for label, (line, cells) in zip(labels, rows))]
    return [(0, header), *rows]


def _symbols(rows: Grid) -> Words:
    """The names of columns that all symbols in them have, ``theta1 d1 0 pi/2`` and ``theta2 0 a2 0``; [] if one has
    none, or several."""
    of_pi = r"^(?!.*[^\W\d_]_?\d)[^a-zA-Zθα]*(?:\w+\.)?(?:pi|π).*"
    columns = (re.sub(of_pi, "alpha1", " ".join(cells)) for cells in zip(*(cells for _, cells in rows)))
    found = ({*re.findall(r"(?<![^\W\d_])(?![lL]_?\d)[^\W\d_]+(?=_?\d+\b)", text)} for text in columns)
    names = [each.pop() if len(each) == 1 else "" for each in found]
    if names.count("") == 1 and len(names) == 4:  # a length L2 among d1 and theta1 is a
        k = names.index("")
        names[k] = "a" if re.search(r"[lL]_?\d", " ".join(cells[k] for _, cells in rows)) else ""
    return names if names_columns(names) else []
