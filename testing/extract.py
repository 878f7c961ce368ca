"""Texts to be translated, for Babel: words and sentences of pages by their English, texts of findings by their keys."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Any

from babel.messages.extract import extract_python

from er3a.pipeline.language import KEYED, TITLE

Message = tuple[int, str, Any, list[str]]


def extract(fileobj: Any, keywords: Any, comment_tags: Any, options: Any) -> Iterator[Message]:
    """Babel's extraction method for this package: ``tr`` and ``N_``, titles, and tables.

    Of tables of ``words`` and ``terms`` the words are entries, of those of ``texts`` the keys.
    The English of a text with a key becomes a comment beside its entry, for translators.
    """
    yield from extract_python(fileobj, {"tr": None, "N_": None}, comment_tags, options)  # type: ignore[misc]
    fileobj.seek(0)
    for call in (each for each in ast.walk(ast.parse(fileobj.read())) if isinstance(each, ast.Call)):
        if ast.unparse(call.func) == "written_title":
            yield call.lineno, "pgettext", (TITLE, ast.literal_eval(call.args[0])), []
        elif ast.unparse(call.func) == "texts" and isinstance(call.args[0], ast.Dict):
            for key, text in zip(call.args[0].keys, call.args[0].values, strict=True):
                entry = KEYED, ast.literal_eval(key or ast.Constant(""))
                yield text.lineno, "pgettext", entry, [ast.literal_eval(text)]
        elif ast.unparse(call.func) in ("words", "terms"):
            yield from ((each.lineno, "N_", each.value, []) for each in _marked(call.args[0], ast.unparse(call.func)))


def _marked(table: ast.expr, by: str) -> Iterator[ast.Constant]:
    """The texts of a table: its values, and the keys of terms."""
    if isinstance(table, ast.Constant) and table.value:
        yield table
    parts = table.values if isinstance(table, ast.Dict) else getattr(table, "elts", [])
    keys = filter(None, table.keys) if by == "terms" and isinstance(table, ast.Dict) else []
    for part in (*keys, *parts):
        yield from _marked(part, by)
