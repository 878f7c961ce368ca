"""Reads EFORT's controller files (.XPL): RPL as XML.

Elements that are not understood are kept; a loop's body is another ``Pou`` that is named by its number.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from er3a.errors import InputError
from er3a.programs import syntax
from er3a.programs.code_builder import CodeBuilder, fault, linked
from er3a.programs.instructions import Disabled, Place
from er3a.programs.lexing import ProgramText
from er3a.programs.program_findings import NotUnderstood
from er3a.programs.rpl.reader import WORD, expression, initial

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
    passed: bool = False  # whether it was read
    asked: bool = False  # whether its attributes were

    @property
    def text(self) -> str:
        """Its own text."""
        return "".join(self.parts).strip()

    def child(self, tag: str) -> XmlNode | None:
        """The first child of a tag."""
        found = next((each for each in self.children if each.tag == tag), None)
        if found is not None:
            found.passed = True
        return found

    def text_of(self, tag: str) -> str:
        """The text of the first child of a tag; empty if there is none."""
        found = self.child(tag)
        return "" if found is None else found.text

    def all(self, tag: str) -> list[XmlNode]:
        """The children of a tag."""
        found = [each for each in self.children if each.tag == tag]
        for each in found:
            each.passed = True
        return found

    def below(self) -> Iterator[XmlNode]:
        """All elements within it."""
        for each in self.children:
            yield each
            yield from each.below()

    def pass_over(self) -> None:
        """Nothing of it needs to be read."""
        for each in (self, *self.below()):
            each.passed = each.asked = True

    def unread(self) -> Iterator[XmlNode]:
        """What was not read of it: elements, and those with attributes that nothing asked for, itself too."""
        stray = self.children and self.text
        if not self.passed or ((self.attributes or stray) and not self.asked):
            yield self
        else:
            for each in self.children:
                yield from each.unread()


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
        raise _no_xml(source.path, error) from None
    return top.children[0]


def _no_xml(path: Path, error: expat.ExpatError) -> InputError:
    problem = f"not valid XML ({expat.ErrorString(error.code)})"
    return InputError(path, f"line {error.lineno}", problem, "Correct the file, or save it on the pendant again")


TOP = "Xpl-source"
HEAD = ("Info", "Title", "Description", "Version", "Author")
MAX_LOOPS = 50
MOTION_PARTS = ("target", "speed", "zone", "tool", "refsys")


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
    top.passed = True
    for each in (*top.all("HostEnvironment"), *(part for tag in HEAD for part in environment.all(tag))):
        each.pass_over()
    pous = [each for group in environment.all("Pous") for each in group.all("Pou")]
    if not pous:
        raise InputError(source.path, f"line {environment.line}", "holds no <Pou>", "Give a program with its Main")
    readers = [_Pou(source, pou) for pou in pous]
    routines = [reader.routine() for reader in readers]
    by_name, findings = linked(routines)
    entry = next((pou for pou in pous if pou.text_of("Type").upper() == "PROGRAM"), pous[0])
    declarations = [each for group in environment.all("VarDeclarations") for each in group.children]
    data = tuple(
        _declared(source, var, local=False)
        for tag in {each.tag: None for each in declarations}
        for group in environment.all("VarDeclarations")
        for kind in group.all(tag)
        for var in kind.all("Var")
    )
    for each in (part for reader in readers for part in reader.whole):
        each.pass_over()
    unread = (
        NotUnderstood(text_of(each), Place(source.path, each.line, f"<{each.tag}>"))
        for each in top.unread()
        if each.attributes or any(part.text for part in (each, *each.below()))
    )
    found = (*findings, *unread)
    return syntax.Program(
        "xpl", source.path.stem, source.path, by_name, entry.text_of("Name"), data, found, source.lines
    )


def _declared(source: ProgramText, var: XmlNode, local: bool) -> syntax.Assign:
    kind, name, first = var.text_of("Type"), var.text_of("Name"), var.text_of("InitValue")
    for tag in ("Comment", "Array"):
        var.child(tag)
    place = Place(source.path, var.line, f"Var {name}")
    value = initial(first, kind) if first else None
    return syntax.Assign(place, syntax.Variable(name), value, f"{kind} {name} := {first}", kind, local)


class _Pou:
    """One routine, with the bodies of its loops."""

    def __init__(self, source: ProgramText, pou: XmlNode):
        self.source, self.pou = source, pou
        self.name = pou.text_of("Name")
        self.place = Place(source.path, pou.line, self.name)
        self.whole: list[XmlNode] = []  # what is named as a whole, or left out

    def routine(self) -> syntax.Routine:
        interface = [
            var
            for group in self.pou.all("VarDeclarations")
            for kind in group.all("VarInterface")
            for var in kind.all("Var")
        ]
        for var in interface:
            for tag in ("Type", "Comment", "Array"):
                var.child(tag)
        parameters = tuple(
            syntax.RoutineParameter(var.text_of("Name"), var.text_of("Attrib").upper() not in ("IN", ""))
            for var in interface
        )
        builder = CodeBuilder(self.name, parameters, self.place)
        for group in self.pou.all("VarDeclarations"):
            for kind in group.all("VarLocal"):
                for var in kind.all("Var"):
                    builder.add(_declared(self.source, var, local=True))
        self._body(builder, self.pou, self.name, ())
        return builder.routine(self.place)

    def _body(self, builder: CodeBuilder, pou: XmlNode, path: str, within: tuple[XmlNode, ...]) -> None:
        counts: dict[str, int] = {}
        for tag in ("Name", "Type"):
            pou.child(tag)
        for body in pou.all("Body"):
            for element in body.children:
                counts[element.tag] = counts.get(element.tag, 0) + 1
                place = Place(self.source.path, element.line, f"{path}/{element.tag}[{counts[element.tag]}]")
                element.passed, switch = True, element.attributes.get("disable", "false").lower()
                element.asked = element.attributes.keys() == {"disable"} and switch in ("true", "false")
                first, known = len(builder.code), True
                disabled = element.asked and switch == "true"
                if disabled:
                    builder.add(syntax.Fixed(place, Disabled(text_of(element))))
                    self._leave_out(element, (*within, pou))
                elif element.tag in ("while", "for"):
                    self._loop(builder, element, place, (*within, pou))
                elif element.child("pouref") is not None:  # as an if, of which no file was at hand
                    builder.unknown(place, text_of(element))
                    self._leave_out(element, (*within, pou))
                else:
                    known = _element(builder, element, place)
                    if known and any(element.unread()):
                        del builder.code[first:]
                if not known:
                    self.whole.append(element)
                elif (unread := next(element.unread(), None)) is not None and not disabled:
                    self.whole.append(element)
                    builder.unread(place, f"{text_of(element)} <{unread.tag}> {' '.join(_texts(unread))}")

    def _leave_out(self, element: XmlNode, within: tuple[XmlNode, ...]) -> None:
        """Nothing of an element is to be read, nor of the bodies that it names."""
        self.whole.append(element)
        for name in [each.text for each in element.below() if each.tag == "pouref"]:
            body = self._named(name, within)
            if body is not None and body not in self.whole:
                self._leave_out(body, (*within, body))

    def _loop(self, builder: CodeBuilder, element: XmlNode, place: Place, within: tuple[XmlNode, ...]) -> None:
        name = element.text_of("pouref")
        body = self._named(name, within)
        if body is None:
            raise fault(place, f"there is no <Pou> '{name}' for the loop's body", "Add it, or correct <pouref>")
        if body in within or len(within) > MAX_LOOPS:
            raise fault(place, f"the loop's body '{name}' holds the loop itself", "Give each loop its own <Pou>")
        source = text_of(element)
        if element.tag == "while":
            builder.open_while(place, expression(element.text_of("cond")), source)
        else:
            first, last = (expression(element.text_of(tag)) for tag in ("from", "to"))
            step = expression(element.text_of("by")) if element.child("by") is not None else None
            if not WORD.match(counter := element.text_of("var")):
                raise fault(place, f"'{counter}' is not a variable that a loop can count", "Name a variable in <var>")
            builder.open_for(place, counter, first, last, step, source)
        self._body(builder, body, f"{place.element}/{name}", within)
        builder.close(element.tag, place)

    def _named(self, name: str, within: tuple[XmlNode, ...]) -> XmlNode | None:
        """The body of a loop: the nearest around that has this name."""
        places = (*(each for pou in reversed(within) for each in pou.children), *self.pou.below())
        found = next((each for each in places if each.tag == "Pou" and each.text_of("Name") == name), None)
        if found is not None:
            found.passed = True
        return found


def _element(builder: CodeBuilder, element: XmlNode, place: Place) -> bool:
    """An element other than a loop; False if it is not understood."""
    source = text_of(element)
    if element.tag in ("mjoint", "mlin"):
        parts = [element.child(tag) for tag in MOTION_PARTS]
        given = tuple(None if part is None or not part.text else expression(part.text) for part in parts)
        builder.add(syntax.Move(place, element.tag.upper(), given, source))
    elif element.tag == "set":
        target = expression(element.text_of("dest"))
        builder.add(syntax.Assign(place, target, expression(element.text_of("expr")), source))
    elif element.tag == "wait":
        condition = element.text_of("condition")
        builder.add(syntax.Waiting(place, "condition", expression(condition), condition))
        element.child("timeout")
        if flag := element.text_of("var"):  # whether it came in time
            builder.add(syntax.Assign(place, expression(flag), syntax.Opaque(source), source))
    elif element.tag == "end_pro":
        builder.add(syntax.Halt(place))
    elif element.tag == "dwell":
        builder.add(syntax.Waiting(place, "seconds", expression(element.text_of("expr")), source))
    elif element.tag == "rem":
        builder.remark(place, element.text_of("text"))
        element.pass_over()
    elif element.tag == "call" and (routine := element.child("subroutine")) is not None:
        name = routine.text_of("name")
        arguments = routine.child("args")
        texts = [] if arguments is None else [each.text for each in arguments.all("arg")]
        while texts and not texts[-1]:
            texts.pop()
        given_arguments = tuple(expression(each) if each else None for each in texts)
        builder.add(syntax.Doing(place, syntax.Invocation(name, given_arguments), source))
    else:
        builder.unknown(place, source)
        return False
    return True


def text_of(element: XmlNode) -> str:
    """An element as one line of RPL, as far as it has an equal there."""
    inner = element.text_of
    match element.tag:
        case "mjoint" | "mlin":
            given = [part for tag in MOTION_PARTS if (part := inner(tag))]
            return f"{element.tag.upper()}({', '.join(given)})"
        case "set":
            return f"{inner('dest')} := {inner('expr')}"
        case "wait":
            return f"WAIT({inner('condition')})"
        case "dwell":
            return f"DWELL({inner('expr')})"
        case "while":
            return f"WHILE {inner('cond')} DO"
        case "for":
            return f"FOR {inner('var')} := {inner('from')} TO {inner('to')} DO"
        case "rem":
            return f"(* {inner('text')} *)"
        case "call":
            routine = element.child("subroutine")
            if routine is not None:
                given = [each.text for arguments in routine.all("args") for each in arguments.all("arg") if each.text]
                return f"{routine.text_of('name')}({', '.join(given)})"
    return f"<{element.tag}> {' '.join(_texts(element))}"[:200]


def _texts(element: XmlNode) -> Iterator[str]:
    if element.text:
        yield element.text
    for each in element.children:
        yield from _texts(each)
