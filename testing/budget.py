"""The budget of code: tokens of each room, against the table ``tool.er3a.budget`` of ``pyproject.toml``.

``make lint`` runs this. A room over its budget fails; budgets only fall. Tokens are counted without comments and
docstrings: explaining a thing is free, writing it twice is not. Scripts and catalogues are counted in lines.

Words that say little (``tool.er3a.words``: "beside", "apart" and the like) are counted, too, in names, comments and
docstrings of the package and in the documents; there may be no more of them than the table says.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FREE = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}
DOCUMENTED = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def docstring_lines(tree: ast.AST) -> set[int]:
    """The lines that docstrings take up, counted from 1."""
    lines: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            lines.update(range(node.body[0].lineno, node.body[0].end_lineno + 1))
    return lines


def tokens(source: str) -> int:
    """The tokens of a module's code."""
    docstrings = docstring_lines(ast.parse(source))
    found = tokenize.generate_tokens(io.StringIO(source).readline)
    return sum(token.type not in FREE and token.start[0] not in docstrings for token in found)


def weight(path: Path) -> int:
    """Tokens of a Python file, lines of any other."""
    text = path.read_text(encoding="utf-8")
    return tokens(text) if path.suffix == ".py" else text.count("\n")


def weights(budgets: dict[str, list[str]], root: Path = ROOT) -> Iterator[tuple[str, int]]:
    """The weight of each room.

    ``budgets`` maps a room's name to patterns below the package. A file belongs to the room whose pattern matches most
    closely, which is the longest one.

    Raises
    ------
    ValueError
        a module that belongs to no room
    """
    package = root / "er3a"
    room_of: dict[Path, tuple[int, str]] = {}
    for room, patterns in budgets.items():
        for pattern in patterns:
            for path in package.glob(pattern):
                room_of[path] = max(room_of.get(path, (0, "")), (len(pattern), room))
    if homeless := sorted({*package.rglob("*.py")} - {*room_of}):
        raise ValueError(f"{homeless[0].relative_to(root)} belongs to no room of tool.er3a.budget in pyproject.toml")
    for room in budgets:
        yield room, sum(weight(path) for path, (_, its) in room_of.items() if its == room)


def uses(words: Iterable[str], root: Path = ROOT) -> dict[str, int]:
    """How often words are used in modules and documents; part of a name counts, too (``_told_apart``)."""
    files = [*(root / "er3a").rglob("*.py"), *(root / "docs").glob("*.md"), root / "README.md"]
    text = "\n".join(path.read_text(encoding="utf-8") for path in files)
    return {word: len(re.findall(rf"(?<![a-z]){word}(?![a-z])", text, re.IGNORECASE)) for word in words}


def main() -> int:
    """Print the rooms, and words that are used too often; 1 if there is anything over its budget."""
    own = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["er3a"]
    table = own["budget"]
    over = 0
    total = 0
    for room, found in weights({room: entry["files"] for room, entry in table.items()}):
        allowed = table[room]["at_most"]
        over += found > allowed
        total += found if table[room]["files"][0].endswith(".py") else 0
        print(f"{'OVER' if found > allowed else '':4} {found:8} of {allowed:8}  {room}")
    print(f"     {total:8} tokens of code in all")
    for word, found in uses(own["words"]).items():
        over += found > own["words"][word]
        print(f"{'OVER' if found > own['words'][word] else '':4} {found:8} of {own['words'][word]:8}  uses of {word}")
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main())
