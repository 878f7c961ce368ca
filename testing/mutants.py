"""Seeded damage to input files: what people, editors, transfers and vandals do to YAML and CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from random import Random

import yaml

VALUES = (
    "nan", ".nan", "NaN", ".inf", "-.INF", "inf", "1e400", "-1e400", "1e308", "1e-300", "1e-400", "4.9e-324",
    "0e400", "1e1000000000", "0", "-0.0", "+5", "5.", ".5", "1e3", "1E+2", "-1", "1.5", "0.1e1",
    "12345678901234567890", "9" * 5000, "0650", "0x1F", "0b11", "0o17", "1_000", "1:30", "190:20:30.15", "1,5",
    "5 mm", "１２", "٣", "½", "5\xa0", "--5", "!!int 0650", "!!float 1:30", "!!float '5'", "!!str 5", "!!bool 1",
    "!!binary aGk=", "!!python/name:os.system", "'5'", '"5"', "yes", "off", "true", "null", "~", "", "''", "[]",
    "{}", "[1]", "{a: 1}", "2020-01-01", "=", "<<", "&a 5", "*a", "|", ">-", "'", '"', "#", "%", "@", "`", "-", "?",
    "...", "---", "\t", "é", "空洞", "😀", "\ufeff", "\u2028", "\x00", "\x1b[2J", "\x85", '"a\\nb"', '"\\x1b[31m"',
    "../../etc/passwd", "'..'", "/", "a/b", "C:\\x", "<script>alert(1)</script>", "{{ 7*7 }}", "$(reboot)",
    "x" * 3000, "a b", "A", "[" * 3000, "{a: " * 400, "- " * 400,
)  # fmt: skip
HEADER_NAMES = ("x_cm", "x_m", "q1_rad", "", "name", "source", '"a\nb"', "\x1b[2J", "x" * 3000, "空洞")
BOMB = "bomb: &a [x, x, x, x, x, x, x, x, x]\nb: &b [*a, *a, *a, *a, *a, *a, *a, *a]\nc: [*b, *b, *b, *b, *b, *b]\n"


def mutant(content: bytes, suffix: str, random: Random) -> tuple[bytes, str]:
    """A damaged copy of a file's content, and in words what was done to it: one to three changes."""
    structural = _CSV if suffix == ".csv" else _YAML
    said = []
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        change = random.choice(structural if random.random() < 0.8 else _BYTES)
        try:
            content = change(content, random)
        except (yaml.YAMLError, ValueError, LookupError, AttributeError, RecursionError, csv.Error):
            continue  # it is damaged beyond a change that needs to read it
        said.append(change.__name__.strip("_"))
    return content, ", ".join(said)


def _nodes(text: str) -> list[tuple[yaml.Node | None, yaml.Node | None, yaml.Node]]:
    """(parent, key, node) of every node of a YAML text, the root first."""
    found: list = []
    todo = [(None, None, yaml.compose(text, Loader=yaml.SafeLoader))]
    while todo:
        parent, key, node = todo.pop()
        found.append((parent, key, node))
        if isinstance(node, yaml.MappingNode):
            todo += [(node, name, value) for name, value in node.value]
        elif isinstance(node, yaml.SequenceNode):
            todo += [(node, None, value) for value in node.value]
    return found


def _on_text(change: Callable[[str, Random], str]) -> Callable[[bytes, Random], bytes]:
    def wrapped(content: bytes, random: Random) -> bytes:
        return change(content.decode(), random).encode("utf-8", "surrogatepass")

    wrapped.__name__ = change.__name__
    return wrapped


def _replaced(text: str, node: yaml.Node, new: str) -> str:
    return text[: node.start_mark.index] + new + text[node.end_mark.index :]


def _scalars(text: str) -> list[yaml.Node]:
    return [node for parent, _, node in _nodes(text) if parent and isinstance(node, yaml.ScalarNode)]


@_on_text
def replace_value(text: str, random: Random) -> str:
    return _replaced(text, random.choice(_scalars(text)), random.choice(VALUES))


@_on_text
def nudge_number(text: str, random: Random) -> str:
    numbers = [node for node in _scalars(text) if node.tag.endswith((":int", ":float"))]
    node = random.choice(numbers)
    value = float(node.value)
    words = (f"{value * 1000:g}", f"{value / 1000:g}", f"{-value:g}", f"{value / 57.29577951308232:.4f}", f"{value!r}1")
    return _replaced(text, node, random.choice((*words, node.value + "0", "0" + node.value, node.value + "e-3")))


@_on_text
def quote_value(text: str, random: Random) -> str:
    node = random.choice(_scalars(text))
    return _replaced(text, node, f"{random.choice(('', '!!str ', '! '))}'{node.value}'")


@_on_text
def swap_values(text: str, random: Random) -> str:
    first, second = sorted(random.sample(_scalars(text), 2), key=lambda node: node.start_mark.index)
    return _replaced(_replaced(text, second, first.value), first, second.value)


@_on_text
def rename_key(text: str, random: Random) -> str:
    key = random.choice([key for _, key, _ in _nodes(text) if key is not None])
    name = key.value
    at = random.randrange(len(name))
    typos = (name[:at] + name[at + 1 :], name.upper(), name.replace("_", "-"), name.replace("_mm", "_m"), f"'{name} '")
    return _replaced(text, key, random.choice((*typos, name.replace("_deg", "_rad"), random.choice(VALUES))))


@_on_text
def delete_entry(text: str, random: Random) -> str:
    _, key, node = random.choice([entry for entry in _nodes(text) if entry[0]])
    start = (key or node).start_mark.index
    return text[:start] + text[node.end_mark.index :]


@_on_text
def repeat_entry(text: str, random: Random) -> str:
    parent, key, node = random.choice([entry for entry in _nodes(text) if entry[0]])
    start = key or node
    piece = text[start.start_mark.index : node.end_mark.index]
    between = ", " if parent.flow_style else "\n" + " " * start.start_mark.column
    between += "- " if not parent.flow_style and key is None else ""
    return text[: node.end_mark.index] + between + piece + text[node.end_mark.index :]


@_on_text
def replace_group(text: str, random: Random) -> str:
    groups = [node for _, _, node in _nodes(text) if not isinstance(node, yaml.ScalarNode)]
    return _replaced(text, random.choice(groups), random.choice(VALUES))


@_on_text
def add_odd_block(text: str, random: Random) -> str:
    odd = (BOMB, "<<: {kind: robot}\n", "1: 2\n", "? [a]\n: 1\n", "---\nkind: robot\n", "...\n", "kind: robot\n")
    block = random.choice((*odd, "x: " + "[" * random.choice((50, 3000)), "#" + "x" * 1_100_000, "y: *z\n"))
    return random.choice((block + text, text.rstrip("\n") + "\n" + block))


def _cells(text: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO(text)))


def _csv_text(rows: list[list[str]]) -> str:
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue()


@_on_text
def replace_cell(text: str, random: Random) -> str:
    rows = _cells(text)
    row = random.choice(rows[1:])
    row[random.randrange(len(row))] = random.choice(VALUES)
    return _csv_text(rows)


@_on_text
def nudge_cell(text: str, random: Random) -> str:
    rows = _cells(text)
    row = random.choice(rows[1:])
    numbers = [i for i, cell in enumerate(row) if cell.strip("-").replace(".", "").isdigit()]
    at = random.choice(numbers)
    words = (row[at] + "0", "-" + row[at], f"{float(row[at]) / 1000:g}", f" {row[at]} ", f"+{row[at]}", row[at] + "e2")
    row[at] = random.choice(words)
    return _csv_text(rows)


@_on_text
def change_header(text: str, random: Random) -> str:
    rows = _cells(text)
    at = random.randrange(len(rows[0]))
    rows[0][at] = random.choice((*HEADER_NAMES, rows[0][at - 1], rows[0][at].upper()))
    return _csv_text(rows)


@_on_text
def change_columns(text: str, random: Random) -> str:
    rows = _cells(text)
    at = random.randrange(len(rows[0]))
    kind = random.randrange(3)
    for row in rows:
        if kind == 0:
            del row[at]
        elif kind == 1:
            row.insert(at, row[at])
        else:
            row.append(row.pop(at))
    return _csv_text(rows)


@_on_text
def change_rows(text: str, random: Random) -> str:
    rows = _cells(text)
    at = random.randrange(len(rows))
    kind = random.randrange(5)
    if kind == 0:
        del rows[at]
    elif kind == 1:
        rows.insert(at, list(rows[at]))
    elif kind == 2:
        rows[at] = rows[at][:-1]
    elif kind == 3:
        rows[at] = [*rows[at], "1"]
    else:
        rows.insert(at, [])
    return _csv_text(rows)


@_on_text
def change_separators(text: str, random: Random) -> str:
    other = random.choice((";", "\t", "|", ", ", ",,"))
    lines = text.split("\n")
    if random.random() < 0.5:
        return "\n".join(line.replace(",", other) for line in lines)
    at = random.randrange(len(lines))
    lines[at] = lines[at].replace(",", other, random.choice((1, 100)))
    return "\n".join(lines)


@_on_text
def decimal_commas(text: str, random: Random) -> str:
    return _csv_text([[cell.replace(".", ",") for cell in row] for row in _cells(text)])


@_on_text
def loose_quote(text: str, random: Random) -> str:
    at = random.randrange(len(text) + 1)
    return text[:at] + random.choice(('"', "'", '""', '"\n')) + text[at:]


def truncate(content: bytes, random: Random) -> bytes:
    return content[: random.randrange(len(content))]


def flip_bit(content: bytes, random: Random) -> bytes:
    at = random.randrange(len(content))
    return content[:at] + bytes([content[at] ^ (1 << random.randrange(8))]) + content[at + 1 :]


def insert_bytes(content: bytes, random: Random) -> bytes:
    at = random.randrange(len(content) + 1)
    return content[:at] + random.choice((b"\0", b"\xff\xfe", b"\xef\xbb\xbf", b"\t", b"\xa0", b"\r")) + content[at:]


def encode_otherwise(content: bytes, random: Random) -> bytes:
    text = content.decode()
    ways = ("utf-16", "utf-32", "utf-8-sig", "utf-7", "latin-1", "cp1252")
    return text.replace("mm", "mm\u00b0", 1).encode(random.choice(ways), "replace")


def other_line_ends(content: bytes, random: Random) -> bytes:
    return content.replace(b"\n", random.choice((b"\r\n", b"\r", b"\n\n", b"\xc2\x85", b"\xe2\x80\xa8", b"")))


def other_line(content: bytes, random: Random) -> bytes:
    lines = content.split(b"\n")
    at = random.randrange(len(lines))
    kind = random.randrange(5)
    if kind == 0:
        del lines[at]
    elif kind == 1:
        lines.insert(at, lines[at])
    elif kind == 2:
        random.shuffle(lines)
    elif kind == 3:
        lines[at] = b"  " + lines[at]
    else:
        lines[at] = lines[at].replace(b" ", b"\t", 1)
    return b"\n".join(lines)


def twice(content: bytes, random: Random) -> bytes:
    return content + content


def nothing_left(content: bytes, random: Random) -> bytes:
    return random.choice((b"", b"\n", b"\0" * 100, b"kind", b"\xff\xd8\xff\xe0"))


_YAML = (
    *(replace_value, replace_value, replace_value, nudge_number, nudge_number, quote_value, swap_values, rename_key),
    *(delete_entry, repeat_entry, replace_group, add_odd_block),
)
_CSV = (
    *(replace_cell, replace_cell, replace_cell, nudge_cell, nudge_cell, change_header, change_columns, change_rows),
    *(change_separators, decimal_commas, loose_quote),
)
_BYTES = (
    truncate,
    flip_bit,
    flip_bit,
    insert_bytes,
    encode_otherwise,
    other_line_ends,
    other_line,
    twice,
    nothing_left,
)
