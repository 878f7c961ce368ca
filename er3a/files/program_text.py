"""A program's text without comments, its brackets, and the matrices and records in these."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NoReturn

from er3a.errors import InputError
from er3a.files.code_brackets import CodeGroup, groups_of, parts
from er3a.files.table_cells import Grid, Words
from er3a.files.table_headings import quantities_of

Cells = dict[str, str]
"""A row by the names of its columns."""


_COMMENT = re.compile(
    r"""("(?:[^"\\\n]|\\.)*"|(?<![\w\])}.'])'(?:[^'\\\n]|\\.)*')|(?:(?<![:\w])//|[%\#])+([^\n]*)|\.\.\.(?=\s*(?:%[^\n]*)?\n)"""
)


BLOCK = re.compile(
    r"(?ms)^[ \t]*%\{[ \t]*$.{0,5000}?^[ \t]*%\}|\"\"\".{0,5000}?\"\"\"|\'\'\'.{0,5000}?\'\'\'|/\*.{0,5000}?\*/"
    r"|\(\*\s.{0,5000}?\s\*\)"
)


_AS_RECORDS = (
    (
        r"([\"']\w+[\"']:)\s*\{\s*[\"']values?[\"']:\s*(\[[^\[\]]*\](?:[ \t]*\*[ \t]*\d+)?),",
        r"\1 \2, {",
    ),  # with more of it
    (r"(?m)^([ \t]*\w+)[ \t]*:[ \t]*[A-Za-z][\w.]*(?:\[[\w., ]*\])?[ \t]*=(?!=)", r"\1 ="),  # Python's types
    (r"(?<=[\w\"'])[ \t]+(?=\w+=[\"'][^\"'\n]*[\"'][^<>\n]*/>)", ", "),
    (r"<\w+,([^<>\n]*)/>", r"{\1}"),  # attributes in XML
    (r"(?m)^\W*\w+[ \t]+((?:\(\w+[ \t]+[-+\d.]+[ \t]*\)[ \t]*){3,9}).*$", r"{\1}"),  # YARP's (A 0.0) (D 0.0)
    (r"\((\w+)[ \t]+([-+\d.]+)[ \t]*\)", r"\1=\2,"),
    (r"(?m)^([ \t]*\w+)[ \t]*,[ \t]*(\w+)[ \t]*=[ \t]*(\[[^\[\]]*\])[ \t]*,[ \t]*(?=\[)", r"\1 = \3; \2 = "),
    (r"(?m)^[^=,;(\[{|\n\"]*:[ \t]*((?:\w+[ \t]*=[ \t]*[^,=(\[{\n]+,[ \t]*){2,8}\w+[ \t]*=[^,=(\[{\n]+)$", r"{\1}"),
)
"""Rows of one line each, as records; and two lists that are named at once."""


_STREAMED = re.compile(r"<<([^;<>]{0,5000});")  # into a matrix of Eigen


_FIELD = r"(?:(?:double|float|\w+_t)\s+)?(\w+)\s*(?:=[^;\n]*)?(?:;|:\s*(?:float|f32|f64|double)\b)"


_TYPE = re.compile(rf"(?:struct|class)\s+(\w*)[^{{}}\n]*\s*[{{:]?\s*(?:(?:{_FIELD})[^\n]*\s*){{3,8}}(?:\}}\s*(\w*))?")
"""A type whose fields are numbers: in C its name may follow."""


class Code:
    """A program: its text without comments, these and docstrings by their lines, and the fields of its types by their
    names; its brackets in the order of their beginnings; and the conventions that it says.
    """

    def __init__(self, text: str):
        self.comments, self.conventions = dict[int, str](), set[str]()
        for block in BLOCK.finditer(text):
            self.comments |= enumerate(block[0].split("\n"), 1 + text.count("\n", 0, block.start()))
        text = BLOCK.sub(lambda found: "\n" * found[0].count("\n"), re.sub(r"\b(?:self\.|this->)", "", text))
        text = re.sub(r"(?m)^[ \t]*\[\w+\([^\n]*\)\][ \t]*$|\\(?=[ \t]*$)", "", text)  # C#'s attributes; long lines
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

    def line(self, place: int) -> int:
        """The number of the line of a place in the text."""
        return self.text.count("\n", 0, place) + 1

    def refuse(self, place: int, text: str, problem: str, remedy: str) -> NoReturn:
        """Refuse a passage, which is quoted."""
        raise InputError(None, f"line {self.line(place)}", f"'{' '.join(text.split())[:60]}' {problem}", remedy)


def row_cells(text: str) -> Words:
    """The elements of a list, with commas or, as MATLAB takes them, blanks between them."""
    cells = parts(text)
    if len(cells) == 1 or not re.search("[\"']", text):
        cells = [each for part in parts(closed_up(text)) for each in part.split() or [""]]
    return [cell.strip("\"'") for cell in (cells if cells[-1:] != [""] else cells[:-1])]


def closed_up(text: str) -> str:
    """A list without the blanks within its elements."""
    text = re.sub(r"[ \t]*([*/^])[ \t]*|(?<=[\w)\]])[ \t]+([-+])[ \t]+", r"\1\2", text.strip())
    text = re.sub(r"(^|[,;\n])([ \t]*[-+])[ \t]+", r"\1\2", text)
    return re.sub(r"[(\[{][^()\[\]{}]*[)\]}]", lambda found: found[0].replace(" ", ""), text)


def rows_of(code: Code, group: CodeGroup) -> Grid:
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


def pairs_of(texts: Iterable[str]) -> Cells:
    """Values by their keys, of texts such as ``"a": 0`` and ``.a = 0``."""
    pairs = [re.split("[:=]", part, maxsplit=1) for part in texts if re.search("[:=]", part)]
    return {key.strip(" .\"'\n").lower(): value.strip(" \"'\n") for key, value in pairs}


def list_name(group: CodeGroup) -> str:
    """The name that a list gets."""
    found = re.search(r"([^\W\d]\w*)(?:\[\w*\])*\s*=\s*(?:[\w.]+\(\s*)*[\[{(\s]*$", group.before)
    return found[1] if found else ""


def record_of(group: CodeGroup) -> Cells:
    """A record's cells, with the number that its own key has; none of a type."""
    if re.search(r"\b(?:struct|class|interface|type)\s+\w[^;={}]*$", group.before):
        return {}
    label = re.search(r"""["']?([\w ]*\d[\w ]*)["']?\s*:\s*$""", group.before)
    # No colour, no column.
    cells = {key: value for key, value in pairs_of(parts(group.inside)).items() if not re.match(r"[(\[{].*,", value)}
    return ({"joint": label[1]} if label else {}) | cells


def is_row(cells: Iterable[str]) -> bool:
    """Whether keys are those of a D-H row."""
    quantities = {*quantities_of(cells)}
    return "alpha" in quantities and bool(quantities & {"a", "d"})


PART = re.compile(
    r"(?m)(?:^|[;{])[ \t]*(?:(?:const|int|float|double|auto|let|var)[ \t]+)*"
    r"\(?(\w+(?:[ \t]*,[ \t]*\w+)*)\)?[ \t]*=(?!=)[ \t]*([^=;\n]*[^=;\s])"
)


def filled(text: str, given: Cells) -> str:
    """A text with what names stand for in place of them."""
    pattern = rf"(?<![\w.'\"@])(?:{'|'.join(given) or '(?!)'})\b(?![('\"]|\s*=(?!=))"
    return re.sub(pattern, lambda found: given[found[0]], text)
