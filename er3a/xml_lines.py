"""XML whose elements know their lines, for findings at their place; safe for files of strangers."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from er3a.errors import InputError

DEEPEST_ELEMENT = 100
DECLARATION = re.compile(r"\s*<\?xml[^>]*\?>")
LINE = "line of the file"
"""Attribute of every element in memory; no attribute of XML has such a name."""


def read_xml(text: str, path: Path | None) -> Element:
    """The top element of a text.

    Parameters
    ----------
    path : of the file, for errors

    Returns
    -------
    top : all elements have their line as the attribute ``LINE``

    Raises
    ------
    InputError
        for text that is not XML, holds a document type or entities, or is nested too deeply
    """
    tree, depth = TreeBuilder(), 0
    parser = expat.ParserCreate("utf-8")
    parser.buffer_text = True

    def refuse(*_: object, problem: str = "holds a document type or entities") -> int:
        remedy = "Such a file needs none, and few elements within each other"
        raise InputError(path, f"line {parser.CurrentLineNumber}", problem, remedy)

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > DEEPEST_ELEMENT:
            refuse(problem=f"more than {DEEPEST_ELEMENT} elements within each other")
        tree.start(tag, {**attributes, LINE: str(parser.CurrentLineNumber)})

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        tree.end(tag)

    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    parser.ExternalEntityRefHandler = refuse
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = tree.data
    # The encoding that is declared is the file's; here the text is read already. Its lines stay.
    text = DECLARATION.sub(lambda match: "\n" * match.group().count("\n"), text, count=1)
    try:
        parser.Parse(text.encode("utf-8", "surrogatepass"), True)
    except expat.ExpatError as error:
        problem = f"not valid XML ({expat.ErrorString(error.code)})"
        raise InputError(path, f"line {error.lineno}", problem, "Correct the file, or export it again") from None
    return tree.close()
