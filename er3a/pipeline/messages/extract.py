"""Texts to be translated, for Babel: words and sentences of pages by their English, texts of findings by their keys."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Any

from babel.messages.extract import extract_python

from er3a.pipeline.language import KEYED, TITLE

Message = tuple[int, str, Any, list[str]]


def extract(fileobj: Any, keywords: Any, comment_tags: Any, options: Any) -> Iterator[Message]:
    """Babel's extraction method for this package: ``tr`` and ``N_``, titles, and tables of ``texts`` by key.

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
