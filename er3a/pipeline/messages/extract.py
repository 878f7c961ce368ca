"""Texts to be translated, for Babel: those of findings with the finding's code as context, and all others."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

from babel.messages.extract import extract_python

KEYWORDS = {"tr": None, "N_": None, "pgettext": ((1, "c"), 2), "npgettext": ((1, "c"), 2, 3)}
Message = tuple[int, str, Any, list[str]]


def extract(fileobj: Any, keywords: Any, comment_tags: Any, options: Any) -> Iterator[Message]:
    """Babel's extraction method for this package: ``tr`` and ``N_``, and ``sentence`` and ``counted`` with contexts."""
    yield from extract_python(fileobj, {"tr": None, "N_": None}, comment_tags, options)  # type: ignore[misc]
    fileobj.seek(0)
    yield from _of_findings(ast.parse(fileobj.read()), Path(fileobj.name))


def _of_findings(tree: ast.Module, path: Path) -> Iterator[Message]:
    for function in ast.walk(tree):
        if not isinstance(function, ast.FunctionDef):
            continue
        for call in ast.walk(function):
            if isinstance(call, ast.Call) and isinstance(call.func, ast.Name):
                yield from _of_call(call, function, path)


def _of_call(call: ast.Call, function: ast.FunctionDef, path: Path) -> Iterator[Message]:
    texts = {"sentence": call.args[1:2], "counted": call.args[1:3]}.get(call.func.id, [])  # type: ignore[attr-defined]
    said = tuple(text.value for text in texts if isinstance(text, ast.Constant) and isinstance(text.value, str))
    if not said or len(said) != len(texts):
        return
    name = "pgettext" if len(said) == 1 else "npgettext"
    for code in _codes(call.args[0], function, path):
        yield call.lineno, name, (code, *said), []


def _codes(context: ast.expr, function: ast.FunctionDef, path: Path) -> list[str]:
    """The contexts that a text can have: a code as it stands, or those of the findings that an argument can be."""
    if isinstance(context, ast.Constant):
        return [str(context.value)]
    if isinstance(context, ast.Attribute) and isinstance(context.value, ast.Name):
        for argument in function.args.args:
            if argument.arg == context.value.id and argument.annotation is not None:
                return [kind.code for kind in _kinds(ast.unparse(argument.annotation), path)]
    raise ValueError(f"{path}:{context.lineno}: the context of a text is neither a code nor that of a finding")


def _kinds(annotation: str, path: Path) -> tuple[Any, ...]:
    parts = path.with_suffix("").parts
    module = import_module(".".join(parts[len(parts) - 1 - parts[::-1].index("er3a") :]))
    kind = eval(annotation, vars(module))
    return get_args(kind) or (kind,)
