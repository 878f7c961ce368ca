"""XML as a light tree with line numbers, without document types, entities or deep nesting."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from er3a.errors import InputError
from er3a.programs.program_text import ProgramText

DEEPEST_ELEMENT = 100
DECLARATION = re.compile(r"\s*<\?xml[^>]*\?>")


@dataclass(slots=True)
class XmlNode:
    """An element."""

    tag: str
    line: int
    attributes: dict[str, str]
    children: list[XmlNode] = field(default_factory=list)
    parts: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """Its own text."""
        return "".join(self.parts).strip()

    def child(self, tag: str) -> XmlNode | None:
        """The first child of a tag."""
        return next((each for each in self.children if each.tag == tag), None)

    def text_of(self, tag: str) -> str:
        """The text of the first child of a tag; empty if there is none."""
        found = self.child(tag)
        return "" if found is None else found.text

    def all(self, tag: str) -> list[XmlNode]:
        """The children of a tag."""
        return [each for each in self.children if each.tag == tag]


def read_xml(source: ProgramText) -> XmlNode:
    """The top element.

    Raises
    ------
    InputError
        for what is no XML, holds a document type or entities, or is nested too deeply
    """
    top = XmlNode("", 0, {})
    stack = [top]
    parser = expat.ParserCreate("utf-8")
    parser.buffer_text = True

    def refuse(*_: object) -> int:
        problem, remedy = "holds a document type or entities", "Remove them; a program needs none"
        raise InputError(source.path, f"line {parser.CurrentLineNumber}", problem, remedy)

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(stack) > DEEPEST_ELEMENT:
            problem = f"more than {DEEPEST_ELEMENT} elements within each other"
            raise InputError(source.path, f"line {parser.CurrentLineNumber}", problem, "Nest fewer")
        node = XmlNode(tag, parser.CurrentLineNumber, attributes)
        stack[-1].children.append(node)
        stack.append(node)

    def end(_: str) -> None:
        stack.pop()

    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    parser.ExternalEntityRefHandler = refuse
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = lambda text: stack[-1].parts.append(text)
    text = DECLARATION.sub(lambda match: "\n" * match.group().count("\n"), source.text, count=1)
    try:
        parser.Parse(text.encode("utf-8", "surrogatepass"), True)
    except expat.ExpatError as error:
        raise _no_xml(source.path, error) from None
    return top.children[0]


def _no_xml(path: Path, error: expat.ExpatError) -> InputError:
    problem = f"not valid XML ({expat.ErrorString(error.code)})"
    return InputError(path, f"line {error.lineno}", problem, "Correct the file, or save it on the pendant again")
