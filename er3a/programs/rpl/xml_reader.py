"""Reads EFORT's controller files (.XPL): RPL as XML.

Elements that are not understood are kept; a loop's body is another ``Pou`` that is named by its number.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from xml.parsers import expat

from er3a.errors import InputError
from er3a.programs import syntax
from er3a.programs.code_builder import CodeBuilder, fault, linked
from er3a.programs.instructions import Disabled, Place
from er3a.programs.lexing import ProgramText
from er3a.programs.rpl.reader import expression, initial, statement

DEEPEST_ELEMENT = 100
DECLARATION = re.compile(r"\s*<\?xml[^>]*\?>")


@dataclass(slots=True, eq=False)
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
        """The first child with a tag.

        Parameters
        ----------
        tag : without namespace

        Returns
        -------
        node : None if there is none
        """
        return next((each for each in self.children if each.tag == tag), None)

    def text_of(self, tag: str) -> str:
        """The text of the first child with a tag.

        Parameters
        ----------
        tag : of a direct child

        Returns
        -------
        text : empty if there is none
        """
        found = self.child(tag)
        return "" if found is None else found.text

    def all(self, *path: str) -> list[XmlNode]:
        """The descendants along a path of tags.

        Parameters
        ----------
        path : tags from the children on; none for the element itself

        Returns
        -------
        nodes : in the order of the file
        """
        found = [self]
        for tag in path:
            found = [each for node in found for each in node.children if each.tag == tag]
        return found

    def below(self) -> Iterator[XmlNode]:
        """All elements within it."""
        for each in self.children:
            yield each
            yield from each.below()


def read_xml(source: ProgramText) -> XmlNode:
    """The top element.

    Raises
    ------
    InputError
        for text that is not XML, holds a document type or entities, or is nested too deeply
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
        problem = f"not valid XML ({expat.ErrorString(error.code)})"
        remedy = "Correct the file, or save it on the pendant again"
        raise InputError(source.path, f"line {error.lineno}", problem, remedy) from None
    return top.children[0]


TOP = "Xpl-source"
MAX_LOOPS = 50
MOTION_PARTS = ("target", "speed", "zone", "tool", "refsys")
PARTS: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(("mjoint", "mlin"), MOTION_PARTS),
    "set": ("dest", "expr"),
    "wait": ("condition", "timeout", "var"),
    "dwell": ("expr",),
    "end_pro": (),
    "rem": ("text",),
    "call": ("subroutine", "name", "args", "arg"),
    "while": ("cond", "pouref"),
    "for": ("var", "from", "to", "by", "pouref"),
}
"""The elements that are understood, with those that they hold. An element with others, or with attributes, is not."""


def read_xpl(source: ProgramText) -> syntax.Program:
    """The program of an .XPL file.

    Raises
    ------
    InputError
        for text that is not XML, entities, loops whose body is missing or is the loop itself
    """
    if not source.text.lstrip().startswith("<"):
        problem = "is text, not XML: the controller refuses it (alarm 4902)"
        raise InputError(source.path, None, problem, "Save it as .pgm, or export it from the pendant")
    top = read_xml(source)
    environment = top.child("XplEnvironment")
    if top.tag != TOP or environment is None:
        problem = f"the top element is <{top.tag}>" if top.tag != TOP else "holds no <XplEnvironment>"
        raise InputError(source.path, f"line {top.line}", problem, f"An .XPL file has <{TOP}> with <XplEnvironment>")
    pous = environment.all("Pous", "Pou")
    if not pous:
        raise InputError(source.path, f"line {environment.line}", "holds no <Pou>", "Give a program with its Main")
    by_name = linked([_Pou(source, pou).routine() for pou in pous])
    entry = next((pou for pou in pous if pou.text_of("Type").upper() == "PROGRAM"), pous[0])
    groups = [each for group in environment.all("VarDeclarations") for each in group.children]
    data = tuple(_declared(source, var, local=False) for group in groups for var in group.all("Var"))
    name = entry.text_of("Name")
    return syntax.Program("xpl", source.path.stem, source.path, by_name, name, data, lines=source.lines)


def _declared(source: ProgramText, var: XmlNode, local: bool) -> syntax.Assign:
    kind, name, first = var.text_of("Type"), var.text_of("Name"), var.text_of("InitValue")
    place = Place(source.path, var.line, f"Var {name}")
    value = initial(first, kind) if first else None
    return syntax.Assign(place, syntax.Variable(name), value, f"{kind} {name} := {first}", kind, local)


class _Pou:
    """One routine, with the bodies of its loops."""

    def __init__(self, source: ProgramText, pou: XmlNode):
        self.source, self.pou = source, pou
        self.name = pou.text_of("Name")
        self.place = Place(source.path, pou.line, self.name)

    def routine(self) -> syntax.Routine:
        """The routine: its parameters, its own variables, and its body with all loops.

        Returns
        -------
        routine : flat code

        Raises
        ------
        InputError
            for a loop without a body, or blocks nested too deeply
        """
        parameters = tuple(
            syntax.RoutineParameter(var.text_of("Name"), var.text_of("Attrib").upper() not in ("IN", ""))
            for var in self.pou.all("VarDeclarations", "VarInterface", "Var")
        )
        builder = CodeBuilder(self.name, parameters, self.place)
        for var in self.pou.all("VarDeclarations", "VarLocal", "Var"):
            builder.add(_declared(self.source, var, local=True))
        self._body(builder, self.pou, self.name, ())
        return builder.routine(self.place)

    def _body(self, builder: CodeBuilder, pou: XmlNode, path: str, within: tuple[XmlNode, ...]) -> None:
        counts: dict[str, int] = {}
        for element in (each for body in pou.all("Body") for each in body.children):
            counts[element.tag] = counts.get(element.tag, 0) + 1
            place = Place(self.source.path, element.line, f"{path}/{element.tag}[{counts[element.tag]}]")
            switch = element.attributes.pop("disable", "false").lower()
            if switch == "true" and not element.attributes:
                builder.add(syntax.Fixed(place, Disabled(text_of(element))))
            elif switch != "false" or _is_strange(element):
                builder.unread(place, f"{text_of(element)} {_all_text(element)}")
            elif element.tag == "rem":
                builder.remark(place, element.text_of("text"))
            elif element.tag == "end_pro":
                builder.add(syntax.Return(place, ends=True))
            else:
                statement(builder, place, text_of(element))
            if element.child("pouref") is not None and element.tag in ("while", "for"):
                self._inside(builder, element, place, (*within, pou))
            elif element.tag == "wait" and (flag := element.text_of("var")):  # whether it came in time
                builder.unclear(place, expression(flag), flag)

    def _inside(self, builder: CodeBuilder, element: XmlNode, place: Place, within: tuple[XmlNode, ...]) -> None:
        """A loop's body: the nearest around it that has its name."""
        name = element.text_of("pouref")
        places = (*(each for pou in reversed(within) for each in pou.children), *self.pou.below())
        body = next((each for each in places if each.tag == "Pou" and each.text_of("Name") == name), None)
        if body is None:
            raise fault(place, f"there is no <Pou> '{name}' for the loop's body", "Add it, or correct <pouref>")
        if body in within or len(within) > MAX_LOOPS:
            raise fault(place, f"the loop's body '{name}' holds the loop itself", "Give each loop its own <Pou>")
        self._body(builder, body, f"{place.element}/{name}", within)
        builder.close(element.tag, place)


def _is_strange(element: XmlNode) -> bool:
    """Whether something of an element is not understood."""
    parts = PARTS.get(element.tag)
    inside = list(element.below())
    return (
        parts is None
        or any(each.tag not in parts for each in inside)
        or any(each.attributes or (each.children and each.text) for each in (element, *inside))
    )


def _arguments(call: XmlNode) -> list[str]:
    """What a routine is called with, without what is left out at the end."""
    texts = [each.text for each in call.all("subroutine", "args", "arg")]
    while texts and not texts[-1]:
        texts.pop()
    return texts


def text_of(element: XmlNode) -> str:
    """An element as one line of RPL, as far as it has an equal there.

    Parameters
    ----------
    element : a statement

    Returns
    -------
    text : for others the tag and all text within it, 200 letters at most
    """
    inner = element.text_of
    match element.tag:
        case "mjoint" | "mlin":
            return f"{element.tag.upper()}({', '.join(map(inner, MOTION_PARTS)).rstrip(', ')})"
        case "set":
            return f"{inner('dest')} := {inner('expr')}"
        case "wait":
            return f"WAIT({inner('condition')})"
        case "dwell":
            return f"DWELL({inner('expr')})"
        case "while":
            return f"WHILE {inner('cond')} DO"
        case "for":
            step = f" BY {inner('by')}" if element.child("by") is not None else ""
            return f"FOR {inner('var')} := {inner('from')} TO {inner('to')}{step} DO"
        case "rem":
            return f"(* {inner('text')} *)"
        case "call":
            name = "".join(each.text_of("name") for each in element.all("subroutine"))
            return f"{name}({', '.join(_arguments(element))})"
    return f"<{element.tag}> {_all_text(element)}"[:200]


def _all_text(element: XmlNode) -> str:
    return " ".join(filter(None, (each.text for each in (element, *element.below()))))
