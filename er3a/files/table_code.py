"""D-H tables in programs and data: calls such as ``RevoluteDH(d=0.29)``, matrices, lists, JSON. Nothing is executed."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NoReturn

from er3a.errors import InputError
from er3a.files.arithmetic import amount_of, words_of
from er3a.files.code_brackets import CodeGroup, groups_of, parts
from er3a.files.table_cells import Grid, Words
from er3a.files.table_headings import heading_of, quantities_of

Cells = dict[str, str]
"""A row by the names of its columns."""
NamedList = tuple[str, Words, int, str]
"""A list's name, its cells, its line, and ``:`` or ``=``."""
_COMMENT = re.compile(
    r"""("(?:[^"\\\n]|\\.)*"|(?<![\w\])}.'])'(?:[^'\\\n]|\\.)*')|(?:(?<![:\w])//|[%\#])+([^\n]*)|\.\.\.(?=\s*(?:%[^\n]*)?\n)"""
)
_BLOCK = re.compile(
    r"(?ms)^[ \t]*%\{[ \t]*$.{0,5000}?^[ \t]*%\}|\"\"\".{0,5000}?\"\"\"|\'\'\'.{0,5000}?\'\'\'|/\*.{0,5000}?\*/"
    r"|\(\*\s.{0,5000}?\s\*\)"
)
_AS_RECORDS = (
    (r"(?<=[\w\"'])[ \t]+(?=\w+=[\"'][^\"'\n]*[\"'][^<>\n]*/>)", ", "),
    (r"<\w+,([^<>\n]*)/>", r"{\1}"),  # attributes in XML
    (r"(?m)^\W*\w+[ \t]+((?:\(\w+[ \t]+[-+\d.]+[ \t]*\)[ \t]*){3,9}).*$", r"{\1}"),  # YARP's (A 0.0) (D 0.0)
    (r"\((\w+)[ \t]+([-+\d.]+)[ \t]*\)", r"\1=\2,"),
    (r"(?m)^[^=,;(\[{|\n]*:[ \t]*((?:\w+[ \t]*=[ \t]*[^,=(\[{\n]+,[ \t]*){2,8}\w+[ \t]*=[^,=(\[{\n]+)$", r"{\1}"),
)
"""Rows of one line each, as records."""
_STREAMED = re.compile(r"<<([^;<>]{0,5000});")  # into a matrix of Eigen
_TOOLBOX = re.compile(r"(?:link|(revolute|prismatic)(?:m?dh)?|dhlink)", re.I)
_FIELD = r"(?:(?:double|float|\w+_t)\s+)?(\w+)\s*(?:;|:\s*(?:float|f32|f64|double)\b)"
_TYPE = re.compile(rf"(?:struct|class)\s+(\w*)[^{{}}\n]*[{{:]?\s*(?:(?:{_FIELD})[^\n]*\s*){{3,8}}(?:\}}\s*(\w*))?")
"""A type whose fields are numbers: in C its name may follow."""
_OF_LINK = [*words_of("theta d a alpha sigma offset")]
_ORDERS = words_of(
    "dhlink=d,alpha,theta,a,sigma revolutedh=d,a,alpha,offset revolutemdh=d,a,alpha,offset "
    "prismaticdh=theta,a,alpha,offset prismaticmdh=theta,a,alpha,offset"
)
"""The order of arguments without names, by the function."""
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
_ADDED = r"(?m)\.extend\(|\)\s*\]\s*\*\s*\d|^\s*(\w+)[\[({]\d+[\])}]\s*=\s*\1[\[({]\d+[\])}]\s*(?:;|$)"
"""Links that no call makes: of another list, ``[...] * 2``, ``L(2) = L(1)``."""
_LISTED = re.compile(r"[\[{(]((?:\s*[\"']\w+[\"']\s*,?){3,9})[\])}]")
_ENUM = re.compile(r"\benum\b[^{;]*\{([^{}=]*)\}")


class Code:
    """A program: its text without comments, these and docstrings by their lines, and the fields of its types by their
    names; its brackets in the order of their beginnings, its lists by their names, and arguments of functions of a
    row's numbers.
    """

    def __init__(self, text: str):
        self.comments = dict[int, str]()
        for block in _BLOCK.finditer(text):
            self.comments |= enumerate(block[0].split("\n"), 1 + text.count("\n", 0, block.start()))
        text = _BLOCK.sub(lambda found: "\n" * found[0].count("\n"), re.sub(r"\b(?:self\.|this->)", "", text))
        text = _STREAMED.sub(lambda found: "= [" + re.sub(r",[ \t]*\n", "\n", found[1]) + "];", text)

        def kept(found: re.Match[str]) -> str:
            if found[2]:
                self.comments[text.count("\n", 0, found.start()) + 1] = found[2].strip()
            return found[1] or ""

        self.text = _COMMENT.sub(kept, text)
        for pattern, plainly in _AS_RECORDS:
            self.text = re.sub(pattern, plainly, self.text)
        self.fields = {each[1] or each[3]: re.findall(_FIELD, each[0]) for each in _TYPE.finditer(self.text)}
        self.groups = sorted(groups_of(self.text), key=lambda each: each.start)
        self.orders = _signatures(self)

    def line(self, place: int) -> int:
        """The number of the line of a place in the text."""
        return self.text.count("\n", 0, place) + 1

    def order_near(self, last: int, first: int, width: int) -> Words:
        """The names of columns that a comment says, in the last lines up to six above the first row."""
        lines = range(last, max(first - 6, 0), -1)
        return next((names for k in lines if (names := _columns_in([self.comments.get(k, "")], width))), [])

    def refuse(self, place: int, text: str, problem: str, remedy: str) -> NoReturn:
        """Refuse a passage, which is quoted."""
        raise InputError(None, f"line {self.line(place)}", f"'{' '.join(text.split())[:60]}' {problem}", remedy)


def row_cells(text: str) -> Words:
    """The elements of a list, with commas or, as MATLAB takes them, blanks between them."""
    cells = parts(text)
    if len(cells) == 1 or not re.search("[\"']", text):
        cells = [each for part in parts(_closed_up(text)) for each in part.split() or [""]]
    return [cell.strip("\"'") for cell in (cells if cells[-1:] != [""] else cells[:-1])]


def _closed_up(text: str) -> str:
    """A list without the blanks within its elements."""
    text = re.sub(r"[ \t]*([*/^])[ \t]*|(?<=[\w)\]])[ \t]+([-+])[ \t]+", r"\1\2", text.strip())
    text = re.sub(r"(^|[,;\n])([ \t]*[-+])[ \t]+", r"\1\2", text)
    return re.sub(r"[(\[{][^()\[\]{}]*[)\]}]", lambda found: found[0].replace(" ", ""), text)


def _rows(code: Code, group: CodeGroup) -> Grid:
    """The rows of a matrix with their lines; [] if the group is none."""
    texts = [each for each in parts(group.inside) if each]
    if re.match(r"[)\s]*(?:'|\.T\b|\.?[*/])(?![*/'])", code.text[group.end + 1 :]):  # transposed, or in other units
        return Grid()
    if len(texts) > 1 and all(each[0] in "[({" and each[-1] in "])}" for each in texts):
        texts = [each[1:-1] for each in texts]
    elif group.bracket == "[" or re.search(r"=\s*\{$", group.before + group.bracket):  # or MATLAB's cells
        lines = [each for part in parts(group.inside, ";") for each in part.split("\n") if each.strip(" ,\n")]
        texts = [each.strip("[], \t") for each in lines]
    else:
        texts = []
    grid, place = Grid(), group.start
    for text in texts:
        place = code.text.index(text, place)
        grid.append((code.line(place), row_cells(text)))
    return grid


def _pairs(texts: Iterable[str]) -> Cells:
    """Values by their keys, of texts such as ``"a": 0`` and ``.a = 0``."""
    pairs = [re.split("[:=]", part, maxsplit=1) for part in texts if re.search("[:=]", part)]
    return {key.strip(" .\"'\n").lower(): value.strip(" \"'\n") for key, value in pairs}


def code_grids(text: str, *, headed: bool = True) -> list[Grid]:
    """The tables in a program or in data.

    Parameters
    ----------
    headed : those whose columns have names; otherwise matrices of numbers without any

    Returns
    -------
    grids : of each its headings and rows, with their lines
    """
    code = Code(text)
    matrices = [grid for grid in (*(_matrix(code, each) for each in code.groups), _listed(code)) if grid]
    if not headed:
        return [[(line, row) for line, row in grid if line] for grid in matrices]
    (links, taken), (loose, elements) = _calls(code)
    links = links or _records(code)
    named = [grid for grid in matrices if grid[0][1]]
    found = links or named or _of_lists(_named_lists(code)) or _of_lists(_numbered(code))
    if not found:
        found, taken = loose, elements
    if found and (taken or not links):
        for group in code.groups:
            _check_kept(code, group, bool(named or taken), taken)
    if found and not (links and "type" in links[0][0][1]) and (moved := re.search(_TURNED, code.text)):
        code.refuse(moved.end(), moved[0], "changes theta", "Write its offset into the table")
    return found


_CONSTANT = {"a", "alpha", "d", "offset"}


def _name_of(group: CodeGroup) -> str:
    """The name that a list gets."""
    found = re.search(r"([^\W\d]\w*)(?:\[\w*\])*\s*=\s*(?:[\w.]+\(\s*)*[\[{(\s]*$", group.before)
    return found[1] if found else ""


def _check_kept(code: Code, group: CodeGroup, is_matrix: bool, taken: set[str]) -> None:
    """Refuse a matrix, or the list of a column, that its program changes."""
    name = _name_of(group)
    table = _matrix(code, group) if is_matrix else []
    of_column = not is_matrix and _CONSTANT.intersection(quantities_of([name, name.rpartition("_")[2]]))
    if (name not in taken if taken else not (table or of_column)) or not group.inside.strip():
        return
    used = {*re.findall(rf"\b{name}[\[(]\d+,\s*:", code.text)}
    if is_matrix and 0 < len(used) < len(_rows(code, group)):
        code.refuse(group.start, name, "has rows that the program does not use", "Leave them out")
    changes = [each for each in re.finditer(_SET.replace("NAME", name), code.text) if _puts_in(each, name, table)]
    for change in [*_MOVED.finditer(group.before), *changes]:
        place = change.end() if change in changes else group.start
        code.refuse(place, change[0].strip(" ;"), f"changes '{name}'", "Write what the program makes of it")


def _puts_in(found: re.Match[str], name: str, table: Grid) -> bool:
    """Whether a statement changes a list: values of joints, which have no numbers, may be added to theta, or put there
    if it is 0, and a list may be converted as a whole, ``DH = np.radians(DH)``."""
    place, sign, given = found.groups()
    value = re.sub(r"[\[(][\w:, +-]*[\])]", "", given or "")  # without indices
    own = re.search(rf"(?<![\w.]){name}\b", value)
    if not place:
        return given is None or bool(own and not _CONVERTED.match(given))
    names = [each for _, header in table[:1] for each in header if each != "joint"]
    last = re.findall(r"\w+", place)[-1]
    column = dict(enumerate(names, "(" in place)).get(int(last), "") if last.isdigit() else last
    cells = " ".join(cell for _, row in table for title, cell in zip(table[0][1], row) if title == column)
    added = sign == "+" or (not sign and (own or not re.search(r"(?i)(?<!\w)[\d.]*[1-9]|pi|π", cells)))
    return _place(column) != "theta" or not added or bool(re.search(r"-|(?<!\w)\d|[\[{]", value))


_SET = (
    r"(?m)(?:^|;)[ \t]*(?:del[ \t]+NAME\b|NAME(?:\.(?:append|insert|extend|pop|reverse)\(|"
    r"[ \t]*((?:\.\w+|[\[({][^\n=\])}]*[\])}])*)[ \t]*([-+*/]?)=(?!=)([^\n;]*)))"
)
"""A statement that puts something into a list, or gives its name to something else."""
_CONVERTED = re.compile(r"\s*(?:\w+\.)*(?:deg2rad|radians|\w*array|matrix|float|sym|double)\(", re.I)
_TURNED = (
    r"(?m)^\s*(?:q|th|theta)\w*[\[(]\d[\])]\s*(?:=\s*[\w.]+[\[(]\d[\])]\s*)?[-+].*(?:pi|\d).*|"
    r"^\s*((?:q|th|theta)\w*)\s*=\s*(?:\1|(?:q|th|theta)[a-z_]*)\s*[-+].*(?:pi\b|90|180).*"
)
_MOVED = re.compile(r"\S*(?:transpose|flip\w*|roll|cumsum)\(\s*$", re.I)


# Calls and records ----------------------------------------------------------------------------------------------------


def _calls(code: Code) -> tuple[tuple[list[Grid], set[str]], ...]:
    """Links made by a function of a toolbox, or by any whose arguments have the names of a D-H row, and records
    ``{"a": 0, "alpha": 90, ...}``, with the lists of which they take elements; then such calls of other functions."""
    rows, own, unread = list[_Link](), list[_Link](), list[CodeGroup]()
    records = [_Link("", each.start, _record(each)) for each in code.groups if each.bracket == "{"]
    lists, loose = Lists(code), Lists(code)
    for each in code.groups:
        named = re.search(r"(?:([\w.()\[\]{}]+)\s*=\s*)?(?:[\w.]*\.)?([A-Za-z_]\w*)\s*$", each.before)
        if each.bracket != "(" or named is None:
            continue
        target, function = named.groups()
        order, toolbox = code.orders.get(function, []), _TOOLBOX.fullmatch(function)
        of_lists = toolbox or function == "DH"
        texts = (lists if of_lists else loose).written_out(each) if of_lists or order else [each.inside]
        if of_lists and not texts:
            code.refuse(each.start, each.inside, *_OF_LOOP)
        made = [_arguments(function, text) or _of_signature(order, text) for text in texts]
        made = [cells for cells in made if cells and (toolbox or _says_numbers(code, cells))]
        if toolbox and "ikpy" in code.text:  # whose theta is added to the joint's angle
            made = [cells | {"offset": cells["theta"], "theta": "0"} for cells in made]
        target = _target(each, target or "", bool(toolbox) and len(texts) == 1)
        for k, cells in enumerate(made):
            name = f"{target}.{k}" if target and len(made) > 1 else target
            (own if order and not of_lists else rows).append(_Link(name, each.start, cells))
        if toolbox and not (made or order or re.fullmatch(r"\s*\w*\s*", each.inside)):  # no list of links
            unread.append(each)
    if "Frame::DH(" in code.text:
        _segments(code, rows)
    if unread and (rows or re.search(r"(?i)\blink\(\[", code.text)):
        code.refuse(unread[0].start, unread[0].inside, "can't be read as a link", "Write its numbers there")
    if not loose.taken:
        rows, own = sorted(rows + own, key=lambda row: row.place), []
    _assigned(code, rows)
    if rows and (re.search(_ADDED, code.text) or len(rows) == 1 or len({*lists.loops}) < len(lists.loops)):
        code.refuse(rows[0].place, ", ".join(_constants(rows[0].cells)), *_OF_LOOP)
    if not lists.taken:
        rows = sorted([*rows, *(row for row in records if _is_row(row.cells))], key=lambda row: row.place)
    grids = [_grid([(code.line(row.place), row.cells) for row in each]) for each in (*_arms(code, rows), own)]
    return (grids[:-1], lists.taken), (grids[-1:] if len(own) > 1 else [], loose.taken)


def _target(call: CodeGroup, name: str, named: bool) -> str:
    """The name of a link, with the list that it is appended to or put in; ``named``: whether it may have its own."""
    added = re.search(r".*\b(\w+)(?:\.|->)(?:addSegment|append|push_back)\([^;\n]*\n?[^;\n]*$", call.before, re.S)
    name = f"{added[1]}[{call.start}" if added else re.sub(r"\s", "", name)
    return "" if name.isidentifier() and not named else name


def _arms(code: Code, rows: list[_Link]) -> list[list[_Link]]:
    """The links of each arm: those that a list names or holds, and the rest by their lists."""
    names = {row.name: row for row in rows}
    chosen = [row_cells(each.inside) for each in code.groups if each.bracket == "["]
    arms = [[names[cell] for cell in cells] for cells in chosen if len(cells) > 1 and {*cells} <= {*names}]
    taken = [row for each in arms for row in each]
    held = [[row for row in rows if each.start < row.place < each.end] for each in code.groups]
    for one in [each for each in held if len(each) > 1] or [rows]:
        arms += [each for each in _begun_again(one) if not taken or (_list_of(each[0]) and each[0] not in taken)]
    return arms


_OF_LOOP = ("is of a loop, or of another program", "Write a row for each joint")


def _record(group: CodeGroup) -> Cells:
    """A record's cells, with the number that its own key has; none of a type."""
    if re.search(r"\b(?:struct|class|interface|type)\s+\w[^;={}]*$", group.before):
        return {}
    label = re.search(r"""["']?([\w ]*\d[\w ]*)["']?\s*:\s*$""", group.before)
    # No colour, no column.
    cells = {key: value for key, value in _pairs(parts(group.inside)).items() if not re.match(r"[(\[].*,", value)}
    return ({"joint": label[1]} if label else {}) | cells


_LOOP = re.compile(
    r"\bfor\b\s*\(?\s*(?:(?:const|let|auto|u?int\w*|size_t|unsigned)\s+)*([\w, ()]+?)\s*(?:\bin\b|=|:)\s*([^\n]*)"
)
MOST_PASSES = 99  # more than any arm has links
_INDEX = re.compile(r"@\d+|[\[({][^\[\](){}]*[\])}]|\.\w+")
_REFERENCE = re.compile(rf"(?<![\w.'\"@])([^\W\d]\w*)((?:{_INDEX.pattern})+)")
_PART = re.compile(
    r"(?m)(?:^|[;{])[ \t]*(?:(?:const|float|double|auto|let|var)[ \t]+)*"
    r"\(?(\w+(?:[ \t]*,[ \t]*\w+)*)\)?[ \t]*=(?!=)[ \t]*([^=;\n]*[^=;\s])"
)
_LENGTH = re.compile(r"(?:len|size|length|numel|height)\(\s*(\w+)\b(?:[^()]|\([^()]*\))*\)|(\w+)\.shape\[0\]")
_RANGE = re.compile(r"range\((?:(\d+), *)?(\w+)\)|(\d+)[ ]*:[ ]*(\w+)|(\d+);[^;<]*<(=?)[ ]*(\w+);.*")
_COUNT = re.compile(r"(?m)^(?:[ \t]*\w+)?[ \t]*\b(\w+)[ \t]*=[ \t]*(\d+)[ \t]*;?[ \t]*$")


class Lists:
    """The lists, matrices and lists of records of a program by their names, and which ones links take."""

    def __init__(self, code: Code):
        self.code, self.taken, self.loops = code, set[str](), Words()
        self.from_one = re.search(r"(?m)^\s*end\b", code.text)  # of MATLAB or Julia
        joints = () if "Frame::DH(" in code.text else ["theta"]  # which KDL has as a constant
        lists = (each for each in _named_lists(code) if each[1] and quantities_of(each[:1]) != joints)
        self.values: dict[str, Any] = {name: cells for name, cells, _, _ in lists}
        for group in code.groups:
            if len(rows := _rows(code, group)) > 1 and (name := _name_of(group)) not in self.values:
                inner = [_record(each) for each in code.groups if group.start < each.start < group.end]
                self.values[name] = [each for each in inner if _is_row(each)] or [row for _, row in rows]

    def written_out(self, call: CodeGroup) -> Words:
        """The arguments of a call as often as it is carried out, with the elements of lists in place of their names."""
        code, passes = self.code.text, [call.inside]
        around = [each for each in self.code.groups if each.start < call.start < call.end < each.end]
        built = [found for each in around if (found := _LOOP.search(code, call.end, each.end))]
        loops = [
            (code[loop.end() : call.start], *loop.groups()) for loop in built or _LOOP.finditer(code, 0, call.start)
        ]
        for body, target, over in loops[-1:] or [("", "i", "n")]:
            names, over = re.findall(r"\w+", target), over.strip(" :{")
            named = Cells()
            for row in _PART.finditer(body):
                value = row[2] if re.fullmatch(r"[\w.\[\]]+", row[2]) else f"({row[2]})"
                own = re.findall(r"\w+", row[1])
                named |= {name: f"{value}@{k}" if own[1:] else value for k, name in enumerate(own)}
            text = _filled(call.inside, named)
            outside = re.search(r"\b(?:def|function)\b", body) or not {*names} & {*re.findall(r"\w+", text)}
            if built or not outside:
                branch = re.search(r"\bif\b", f"{body} {over}")
                made = [] if branch else [_filled(text, each) for each in self._passes(text, names, over)]
                # A loop over poses or time goes through no list.
                passes = made or ([] if loops and {*re.findall(r"\w+", text)} & {*self.values} else passes)
                self.loops += {each[1] for each in _REFERENCE.finditer("".join(passes[:1])) if each[1] in self.values}
        # An element may be a sum of elements.
        return [_REFERENCE.sub(self._element, _REFERENCE.sub(self._element, each)).lstrip("*") for each in passes]

    def _passes(self, text: str, names: Words, over: str) -> Iterator[Cells]:
        """What the names of a loop stand for in each pass; a row may be unpacked into the last ones. If an unknown name
        says how many passes there are, they go through all of the lists that a call takes."""
        counts = {name: len(value) for name, value in self.values.items()}
        known = dict(_COUNT.findall(self.code.text))
        bounds = _LENGTH.sub(lambda found: str(counts.get(found[1] or found[2], "n")), over)
        ranged = _RANGE.fullmatch(re.sub(r"[^\W\d]\w*", lambda found: known.get(found[0], found[0]), bounds))
        lists = [] if ranged else [name for name in re.findall(r"\w+", over) if name in counts]
        every = min([counts[name] for name in lists or re.findall(r"\w+", text) if name in counts], default=0)
        first, last = 0, every if re.match(r"enumerate\(|zip\(|[\w.]+$", over) else 0
        if ranged:
            first, end = int(ranged[1] or ranged[3] or ranged[5] or 0), ranged[2] or ranged[4] or ranged[7]
            last = int(end) + bool(ranged[3] or ranged[6]) if end.isdigit() else first + every
        for k in range(first, min(last, MOST_PASSES)):
            found = [str(k)] * ("enumerate(" in over or not lists) + [f"{name}@{k}" for name in lists]
            rest = [f"{found[-1]}@{part}" for part in range(len(names) - len(found) + 1)]
            yield dict(zip(names, found[:-1] + rest if len(rest) > 1 else found))

    def _element(self, found: re.Match[str]) -> str:
        """An element of a list, or a row of a matrix; what is no list stays as it is."""
        value: Any = self.values.get(found[1])
        key = "-"
        try:
            for index in _INDEX.findall(found[2]):
                for part in parts(index[1:-1]) if index[0] in "[({" else [index]:
                    key = part.strip("'\"@.").lower()
                    if isinstance(value, list) and key != ":":
                        start = index[0] in "({" or (index[0] == "[" and self.from_one)
                        key = str(int(amount_of(key).number) - bool(start))
                    value = value if key == ":" else value[int(key) if isinstance(value, list) else key]
        except (KeyError, IndexError, ValueError, TypeError):
            key = "-"
        if key[0] == "-":
            return found[0]
        self.taken.add(found[1])
        if isinstance(value, str):
            return f"({value})" if re.search(r"[-+*/]", value) else value
        row = ", ".join(value)
        return row if found.string[: found.start()].rstrip()[-1:] in ("[", "*") else f"[{row}]"


def _filled(text: str, given: Cells) -> str:
    """A text with what names stand for in place of them."""
    pattern = rf"(?<![\w.'\"@])(?:{'|'.join(given) or '(?!)'})\b(?![('\"]|\s*=(?!=))"
    return re.sub(pattern, lambda found: given[found[0]], text)


def _segments(code: Code, rows: list[_Link]) -> None:
    """Say what moves in KDL's ``Segment(Joint(Joint::RotZ), Frame::DH(a, alpha, d, theta))``: its joint comes first."""
    joints = dict(re.findall(r"\bJoint\s+(\w+)\s*[({=]([^;\n]*)", code.text))
    for each in code.groups:
        if re.search(r"\bSegment\s*$", each.before):
            said = " ".join(joints.get(part, part) for part in parts(each.inside))
            own = [row for row in rows if each.start < row.place < each.end]
            kinds = [kind for kind in _KDL if re.search(rf"\b{kind}\b", said)]
            if not own or len(kinds) != 1:
                code.refuse(
                    each.start,
                    each.inside,
                    "is no row of a table",
                    "Write its joint, RotZ, TransZ or None, and Frame::DH into its call, or leave it out",
                )
            for row in own:
                row.cells.update(type=_KDL[kinds[0]], convention="standard")


_KDL = {"RotZ": "revolute", "TransZ": "prismatic", "None": "fixed"}


_OF_ROWS = re.compile(r"\w*(?:dh|denavit|link|trans|frame)\w*|[AT]", re.I)
"""Names of functions of a row, whose order a comment may say."""


def _signatures(code: Code) -> dict[str, Words]:
    """The order of the four numbers of a function ``dh(theta, d, a, alpha)``, where it is defined or called so, or of a
    type."""
    # KDL's joint comes before the frame, whose theta is a constant, whatever its name.
    orders = {"DH": ["a", "alpha", "d", "offset"]} if "Frame::DH(" in code.text else {}
    for each in code.groups:
        named, names = re.search(r"(\w+)(?:[\"'],)?\s*$", each.before), _parameters(each.inside)
        line = code.line(each.start)
        if sorted(map(_place, quantities_of(names))) != ["a", "alpha", "d", "theta"]:
            called = named and _OF_ROWS.fullmatch(named[1]) and len(names) == 4
            names = code.order_near(line, line, 4) if called else []
        if names and named and each.bracket != "{":
            made = re.findall(r"class\s+(\w+)", code.text[: each.start]) if named[1] == "__init__" else [named[1]]
            orders.setdefault(made[-1] if made else "", names)
    return {name: names for name, names in code.fields.items() if _names_columns(names)} | orders


def _parameters(text: str) -> Words:
    """Names of parameters without their types and defaults."""
    names = [re.sub(r"\s*[:=].*", "", part).rpartition(" ")[2].strip("&*\"'") for part in parts(text)]
    return names[names[0] == "self" :]


def _of_signature(order: Words, text: str) -> Cells:
    """A row of a function's arguments; none of its definition."""
    cells = {name: part.strip("\"'") for name, part in zip(order, parts(text))}
    return {} if len(cells) < len(order) or _parameters(text) == order else cells


def _says_numbers(code: Code, cells: Cells) -> bool:
    """Whether a row holds numbers or names of numbers, and no elements of lists."""
    texts = _constants(cells)
    return not any(re.search(r"\[|\w\(\w+\s*,\s*\d+\)|\bc\(", cell) for cell in texts) and any(
        not re.fullmatch(r"[^\W\d][\w.]*", cell) or re.search(rf"(?m)^\s*{re.escape(cell)}\s*=[^\[{{\n]+$", code.text)
        for cell in texts
    )


def _constants(cells: Cells) -> Words:
    """The numbers of a row without theta, which can be an element ``q[0]``."""
    return [cell for name, cell in cells.items() if quantities_of([name]) not in ([], ["theta"], ["type"])]


@dataclass(frozen=True)
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
    low, toolbox = function.lower(), _TOOLBOX.fullmatch(function)
    given, words, cells = Words(), Words(), Cells()
    pending = ""
    for part in parts(text):
        key, is_named, value = part.partition("=")
        quoted = re.fullmatch(r"""["'](\w*)["']""", part)
        if is_named and re.fullmatch(r"\w+\s*", key):
            cells[_argument(key)] = value.strip(" \"'")
        elif pending:
            cells[pending], pending = part, ""
        elif quoted and _FLAGS.fullmatch(quoted[1]):
            words.append(quoted[1].lower())
        elif quoted:
            pending = _argument(quoted[1])
        elif part:
            given.append(part)
    if toolbox is None:
        return cells if _is_row(cells) and not given else None
    if len(given) == 1 and given[0].startswith("["):
        order = words_of("alpha a theta d sigma") if function == "link" else _OF_LINK
        given = row_cells(given[0][1:-1])
        if len(given) < 4:
            return None
        cells |= dict(zip(order, given))
    elif low in _ORDERS and len(given) <= len(order := _ORDERS[low].split(",")):
        cells |= dict(zip(order, given))
    elif given or (low == "link" and not cells):
        return None
    return _of_toolbox(low, words, cells)


def _argument(key: str) -> str:
    """The name of an argument, ``α`` and ``link_length`` as that of their quantity; letters mean what they are."""
    own = heading_of(key)
    named = own and own.quantity in _OF_LINK and (len(key.strip()) > 1 or not key.isascii())
    return own.quantity if own and named else key.strip().lower()


_FLAGS = re.compile("modified|mod|mdh|standard|std|stddh|moddh|revolute|prismatic|flip|sym", re.I)


def _of_toolbox(function: str, words: Words, cells: Cells) -> Cells:
    """A row of a toolbox: what is left out is 0; theta of a joint that turns, and d of one that slides, is its own."""
    words += [flag for flag in ("mdh", "flip") if cells.pop(flag, "0").lower() in ("1", "true")]
    said = " ".join([function, *words])
    slides = "prismatic" in said or cells.get("sigma", "0") in ("1", "1.0")
    slides |= function == "link" and "theta" in cells and "d" not in cells
    offset = cells.pop("offset", "0")
    row = {name: cells.get(name, "0") for name in ("theta", "d", "a", "alpha")}
    row |= {
        "offset": offset,
        "type": "revolute",
        "convention": "modified" if "mod" in said or "mdh" in said else "standard",
    }
    if slides:  # its own d is no part of the transform
        row |= {"d": offset, "offset": "", "type": "prismatic"}
    return row | {"direction": "-1"} if "flip" in words else row


def _assigned(code: Code, rows: list[_Link]) -> None:
    """Carry out what is set after a link was made: ``L(2).offset = -pi/2``."""
    pattern = r"([\w.]+(?:[(\[{]\d+[)\]}])?)\.(offset|alpha|theta|a|d|flip|sigma|mdh)\s*=(?!=)\s*([^;\n]+)"
    for found in re.finditer(pattern, code.text) if rows else ():
        name = f"{found[1]}.{found[2]}"
        given = [(row, key) for row in rows for key, cell in row.cells.items() if name in (cell, f"{row.name}.{key}")]
        for row, key in given:
            row.cells[key] = found[3].strip()
        if not given:
            code.refuse(found.start(), name, "is set for a link that is not found", "Write it into the link's call")


def _is_row(cells: Iterable[str]) -> bool:
    """Whether keys are those of a D-H row."""
    quantities = {*quantities_of(cells)}
    return "alpha" in quantities and bool(quantities & {"a", "d"})


def _records(code: Code) -> list[Grid]:
    """Rows as lines ``a: 0``, ``alpha: 90``, ... of YAML, each begun by a dash, a name or a key that is repeated; if
    such keys hold lists, these are columns (:func:`_of_lists`)."""
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
    full = [[row for row in rows if _is_row(row[1])] for rows in tables]
    return [_grid(rows) for rows in full if len(rows) > 1]


def _grid(rows: list[tuple[int, Cells]]) -> Grid:
    header = list(dict.fromkeys(key for _, cells in rows for key in cells))
    blank = ["1" if key == "direction" else "" for key in header]
    return [(0, header), *((line, [*map(cells.get, header, blank)]) for line, cells in rows)]


# Matrices and lists ---------------------------------------------------------------------------------------------------


def _matrix(code: Code, group: CodeGroup) -> Grid:
    """A matrix with the names of its columns; [] if it is none, or a pose."""
    rows = _rows(code, group)
    if len(rows) < 2 or any(re.match(r"[\[{]|\([^()]*,|.*:|-?\s*(?:\w+\.)*(?:cos|sin)\(", cell) for cell in rows[0][1]):
        return []
    if len(rows) == 4 and re.fullmatch(r"(0[.0]* ){3}1[.0]*", " ".join(rows[-1][1])):  # a pose
        return []
    several = len({line for line, _ in rows}) == len(rows)
    labels = [code.comments.get(line, "") if several else "" for line, _ in rows]
    widths = {len(cells) for _, cells in rows}
    return _titled(code, rows, labels, group.before) if len(widths) == 1 and 3 <= min(widths) <= 8 else []


def _listed(code: Code) -> Grid:
    """A matrix with a line for each row: ``joint1: [0, 270, 0, 0]`` of YAML, ``dh(1,:) = [0 270 0 0];``."""
    rows, labels, arms = Grid(), Words(), set[str]()
    stacked = {name for each in code.groups for name in re.findall(r"\w+", each.inside)}
    for group in code.groups:
        label = re.search(
            r"(?:^|\n)\s*(?:-|[\"']?(\w+)[\"']?\s*:|"
            r"(?:(?:(?:static|const|constexpr|double|float)\s+)*(\w+\d)(?:\[[4-8]\])?|\w+[\[(]\d+(?:,\s*:)?[\])])\s*=)"
            r"\s*$|setFixedTransform\([^\n]*,\s*$",
            group.before,
        )
        if label and label[2] and label[2] not in stacked and "dh" not in label[2].lower():
            continue
        if label and not re.search(r"[\[{:]", group.inside):
            cells = row_cells(group.inside)
            alike = len(cells) == len(rows[0][1]) if rows else 4 <= len(cells) <= 8
            if alike and all(re.search(r"\d|pi|π", cell) for cell in cells):
                rows.append((code.line(group.start), cells))
                labels.append(label[1] or label[2] or "")
                arms.add((label[2] or "").rstrip("0123456789"))
    return _titled(code, rows, labels) if len(rows) > 1 and len(arms) == 1 else []


def _titled(code: Code, rows: Grid, labels: Words, before: str = "") -> Grid:
    """A matrix below the names of its columns, [] if it has none; with the names of its rows, if each has one."""
    symbols = [re.sub(r"\d+$", "", cell) for cell in rows[0][1]]  # theta1 d1 a1 alpha1
    header = _order(code, rows, before) or (symbols if _names_columns(symbols) else [])
    firsts = [cells[0] for _, cells in rows]
    if not header and len(rows[0][1]) > 3 and all(re.fullmatch(r"[A-Za-z][\w -]*", first) for first in firsts):
        rows, labels = [(line, cells[1:]) for line, cells in rows], firsts  # names of the joints
        header = _order(code, rows, before)
    labelled = all(re.search(r"[^\W\d_]|^\d+$", each) for each in labels) and not all(map(heading_of, labels))
    if header and "joint" not in header and labelled:
        return [(0, ["joint", *header]), *((line, [label, *cells]) for label, (line, cells) in zip(labels, rows))]
    return [(0, header), *rows]


def _order(code: Code, rows: Grid, before: str) -> Words:
    """The names of a matrix's columns: of a comment, of what its rows are unpacked into, of the type of its rows, or
    of a library."""
    width = len(rows[0][1])
    near = code.order_near(rows[-1][0] + 1, rows[0][0], width)
    used = _columns_in(
        [
            *(
                ",".join(code.orders[name])
                for name in code.fields
                if re.search(rf"\b{name}\b.", before) and name in code.orders
            ),
            *_UNPACKED.findall(code.text),
            *_ENUM.findall(code.text),
            *_LISTED.findall(code.text),
            *_indexed(code),
        ],
        width,
    )
    if near and used and [*map(_place, near)] != [*map(_place, used)]:
        raise InputError(
            None,
            f"line {rows[0][0]}",
            f"a comment says {', '.join(near)}, and the program {', '.join(used)}",
            "Say the columns' order by --column",
        )
    if said := near or used or _columns_in(code.comments.values(), width):
        return said
    taken = (order for library, (order, _) in LIBRARIES.items() if re.search(library, code.text) and width >= 4)
    return next((order.split(",")[:width] for order in taken), [])


def _place(name: str) -> str:
    """What a column is, whether theta or its offset."""
    return next(iter(quantities_of([name])), name).replace("offset", "theta")


def _columns_in(texts: Iterable[str], width: int) -> Words:
    """The names of columns that texts hold one after the other; [] if they hold several orders."""
    found: dict[str, Words] = {}
    for text in texts:
        text = re.sub(r"(?<=,)(\s*)_(?=,|$)", r"\1theta", re.sub(r"\b(?:joint_?)?type\b", "sigma", text))
        text = re.sub(r"(?<=\w)\s*[({_]*\s*i\s*-\s*1\s*[)}]*", "_i-1", text)
        text = re.sub(r"(?<=\w)(?:\s*\(\s*i\s*\)|\s+i(?=\s*,|$))", "_i", text)
        words = re.split(r"(?:[\s,;|\[\]()→]|->|\band\b|(?<!\w)-(?!\w))+", text)
        windows = (words[k : k + size] for size in range(9, width - 1, -1) for k in range(len(words) - size + 1))
        # All that it names, of which the row's number is no column; theta and its offset are two mentions of one.
        names = next((each for each in windows if _names_columns(each, once=len(each) > width)), [])
        names = names if len(names) == width else [name for name in names if _place(name) != "joint"]
        if len(names) == width:
            found.setdefault(" ".join(map(_place, names)), names)
    return next(iter(found.values())) if len(found) == 1 else []


def _indexed(code: Code) -> Iterator[str]:
    """Names of a row's parts in the order of their numbers: ``a = row[0]``, ``T = dh(row[0], row[1], ...)``."""
    found: dict[str, dict[int, str]] = {}
    pattern = r"(\w+)\s*=\s*(?:[\w\[\]().]+\s*\+\s*)?([\w.]+)[\[(](?:[\w:]+\s*(?:,|\]\s*\[)\s*)?(\d+)[\])](?!\s*-)"
    for name, row, number in re.findall(pattern, code.text):
        if heading_of(name):
            found.setdefault(row, {})[int(number)] = name
    for names in found.values():
        yield ",".join(names[k] for k in sorted(names))


def _names_columns(names: Words, *, once: bool = False) -> bool:
    """Whether names are those of a D-H table's columns, each once; with ``once`` theta and its offset count as one."""
    quantities = {name.replace("offset", "theta") if once else name for name in quantities_of(names)}
    return len(quantities) == len(names) and {"a", "alpha", "d"} <= quantities


def _named_lists(code: Code) -> Iterator[NamedList]:
    """The name and the cells of each list, multiplied by what is written after it, its line, and ``:`` or ``=``."""
    for group in code.groups:
        name = re.search(
            r"([A-Za-zα-ωΑ-Ω]\w*)[\"']?(?:\[\d*\]|\(1:\w+\))?\s*(?::(?: *\[\w+; *\d+\] *|[^=:\n\"'\d]*)(?==))?"
            r"([=:])\s*(?:[\w.]+\(\s*|np\.r_\s*|c|\[\d*\]\w+)?[\"']?$",
            group.before,
        )
        inside = re.sub(r"(?<!\w)\[([^,;\n]+?)\](?=\s*(?:[,\n]|$))", r"\1", group.inside)  # a column [[0], [1]]
        rows = re.search(
            r"[\[{:%]|(?<!\w)\([^()]*,|[^\s;,][, ]+[^\s;,][^;]*;|\bfor\b|(?<!a)(?:cos|sin)\(",
            re.sub(r"\w\[[^\[\]]*\]|\w+::", "q", _closed_up(inside)),
        )
        if name is None or rows or (group.bracket == "(" and not re.search(r"=\s*c?$", group.before)):
            continue
        after = re.match(r"[)\s]*'?\s*([*/][^;,\n]+|=(?!=))?", code.text[group.end + 1 :])
        if after and after[1] == "=":  # the type of what follows
            continue
        cells = row_cells(inside.replace(";", ",").replace("\n", " "))
        cells = [f"({cell}){after[1]}" if after and after[1] else cell for cell in cells]
        yield name[1], cells, code.line(group.start), name[2]


def _of_lists(lists: Iterable[NamedList]) -> list[Grid]:
    """A table of columns by the names of their lists: ``a = [0, 0.27, ...]``, ``"a": [0, ...]``; theta is no pose."""
    columns: dict[str, NamedList] = {}  # heading, cells, line, the list's name
    for name, cells, line, mark in sorted(lists, key=lambda each: each[0] in "Ll"):
        bare = re.sub(r"^t\d?$", "theta", re.sub(r"(?<=.)(?:_?(?:[Ll]ist|[Vv]ec(?:tor)?|[Vv]al(?:ue)?s)|s)$", "", name))
        names = (name, bare, bare.rpartition("_")[2])
        heading = next(filter(None, map(heading_of, names)), None)
        quantity = heading.quantity if heading else name
        if quantity == "theta" and re.match(r"[qQ]_?[a-zA-Z]", name):
            continue  # values of joints, or their limits
        text = re.sub(r"(?<![a-z])(?:\w+[._])?pi\b|π|2rad|radians", "π", " ".join(cells), flags=re.I)
        if quantity == "theta" and mark == "=" and not re.search(r"[^\W\dπ]", text):
            quantity = "pose" if name != "q" and re.search("[1-9π]", text) else ""
        quantity = "alpha" if quantity == "a" and "π" in text else quantity
        of_others = name in "Ll" and columns.get("a", "r")[-1] not in "rR"
        if quantity not in _OF_VECTORS or not cells or of_others:
            continue
        title = f"{quantity}(i-1)" if heading and heading.before else "r" if name == "r" else quantity
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
    if len({*map(len, lengths)}) > 1:
        entries = ", ".join(f"{name} {len(cells)}" for name, (_, cells, _, _) in columns.items())
        raise InputError(
            None, f"line {max(places)}", f"different numbers of entries: {entries}", "Give one for each joint"
        )
    return [[(0, [*titles]), *((1, list(row)) for row in zip(*lengths))]]


_USED = re.compile(
    r"[\[(,;]\s*-?(?:al(?:p|ph|f)a?)[_({\[]*\d[)}\]]*+\s*[,;\])]|\b(?:q|th(?:eta)?)_?[\[({]?\d[\])}]?\s*[-+]\s*(?:\d|\w*\.?pi\b)",
    re.I,
)
"""Symbols that are entries of a matrix, or a sum with a joint's variable."""
_OF_VECTORS = words_of("a alpha d theta offset type direction pose")


def _numbered(code: Code) -> Iterator[NamedList]:
    """Lists of entries by name and number: ``alpha0: 0, a0: 0, d1: 0.75, q1: q1``, as in SymPy's substitutions,
    or ``DH_0_ALPHA = 90``, whose theta is the table's."""
    name = r"(?<![\w.\"'])([\"'])?(?:DH_)?(al(?:p|ph|f)a?|theta|th|a|r|d|q|(?:(?:theta|q)_)?offset)"
    name += r"([_({\[]*)(\d{1,2})[)}\]]*(?(1)\1)"
    pattern = rf"{name}\s*([:=])(?!=)\s*(?!(?:\w+\.)?symbols?\()([^,}}\n;:=!\s\[{{](?:::|[^,}}\n;:=!])*)"
    spellings: dict[str, dict[str, dict[int, tuple[str, str, int]]]] = {}  # value, mark and place of each number
    text = re.sub(r"(?i)\bDH[_(\[]*(\d+)(?:_|[)\]]\.)([A-Za-z]+)\s*=", r"\2\1:", code.text)
    for each in re.finditer(pattern, text, re.I):
        _, name, bracket, number, mark, value = each.groups()
        for spelling in (f"{bracket}{name.isupper()}", "~"):  # D1 = 0.3; d(1) = D1
            entries = spellings.setdefault(spelling, {}).setdefault(name.lower(), {})
            entries.setdefault(int(number), (value.strip(), mark, each.start()))
    whole = [one for _, one in sorted(spellings.items()) if {*quantities_of(one)} >= {"alpha", "a", "d"}]
    if not whole:
        return
    found = whole[-1] | whole[0]
    quantities = dict(zip(quantities_of(found), found.values()))
    if len(found) == 3 and "DH_A" not in code.text and (used := _USED.search(code.text)):
        code.refuse(used.start(), used[0], "is no column of a table", "Write a list of theta or offset")
    for name, entries in found.items():
        cells = {k: value for k, (value, _, _) in entries.items()}
        _, mark, place = entries[max(entries)]
        of_link = quantities["alpha" if _place(name) in ("alpha", "a") else "d"]
        first = min(entries) if len(entries) == len(of_link) else min(of_link)
        gaps = {*range(first, max(entries) + 1)} - {*entries}
        if gaps and (mark != ":" or _place(name) != "theta"):
            code.refuse(place, f"{name}{min(gaps)}", "is missing", "Give one for each joint")
        cells |= {k: f"{name}{k}" for k in gaps}  # what is not replaced stays a variable
        before = "(i-1)" if min(of_link) < max(map(min, found.values())) else ""
        yield name + before, [cells[k] for k in sorted(cells)], code.line(place), mark
