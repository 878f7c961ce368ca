"""Reads EFORT's controller files (.XPL): RPL as XML.

Elements that are not understood are kept; a loop's body is another ``Pou`` that is named by its number.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from functools import partial
from xml.etree.ElementTree import Element

from er3a.errors import InputError
from er3a.programs.code_builder import CodeBuilder, fault, linked
from er3a.programs.instructions import Place
from er3a.programs.lexing import ProgramText
from er3a.programs.rpl.reader import expression, initial, statement
from er3a.programs.syntax import Assign, Program, Return, Routine, RoutineParameter, Variable
from er3a.xml_lines import LINE, read_xml


def _text(element: Element, tag: str) -> str:
    """The text of the first child with a tag; empty if there is none."""
    found = element.find(tag)
    return "" if found is None else _own_text(found)


def _own_text(element: Element) -> str:
    """All text that is not within the children."""
    return "".join((element.text or "", *(each.tail or "" for each in element))).strip()


def _place(source: ProgramText, element: Element, path: str) -> Place:
    return Place(source.path, int(element.attrib[LINE]), path)


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


def read_xpl(source: ProgramText) -> Program:
    """The program of an .XPL file.

    Raises
    ------
    InputError
        for text that is not XML, entities, loops whose body is missing or is the loop itself
    """
    if not source.text.lstrip().startswith("<"):
        problem = "is text, not XML: the controller refuses it (alarm 4902)"
        raise InputError(source.path, None, problem, "Save it as .pgm, or export it from the pendant")
    top = read_xml(source.text, source.path)
    environment = top.find("XplEnvironment")
    if top.tag != TOP or environment is None:
        problem = f"the top element is <{top.tag}>" if top.tag != TOP else "holds no <XplEnvironment>"
        raise fault(_place(source, top, ""), problem, f"An .XPL file has <{TOP}> with <XplEnvironment>")
    pous = environment.findall("Pous/Pou")
    if not pous:
        raise fault(_place(source, environment, ""), "holds no <Pou>", "Give a program with its Main")
    by_name = linked([_Pou(source, pou).routine() for pou in pous])
    entry = next((pou for pou in pous if _text(pou, "Type").upper() == "PROGRAM"), pous[0])
    data = tuple(_declared(source, var, local=False) for var in environment.findall("VarDeclarations/*/Var"))
    name = _text(entry, "Name")
    return Program("xpl", source.path.stem, source.path, by_name, name, data, lines=source.lines)


def _declared(source: ProgramText, var: Element, local: bool) -> Assign:
    kind, name, first = _text(var, "Type"), _text(var, "Name"), _text(var, "InitValue")
    place = _place(source, var, f"Var {name}")
    value = initial(first, kind) if first else None
    return Assign(place, Variable(name), value, f"{kind} {name} := {first}", kind, local)


class _Pou:
    """One routine, with the bodies of its loops."""

    def __init__(self, source: ProgramText, pou: Element):
        self.source, self.pou = source, pou
        self.name = _text(pou, "Name")
        self.place = _place(source, pou, self.name)

    def routine(self) -> Routine:
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
            RoutineParameter(_text(var, "Name"), _text(var, "Attrib").upper() not in ("IN", ""))
            for var in self.pou.findall("VarDeclarations/VarInterface/Var")
        )
        builder = CodeBuilder(self.name, parameters, self.place)
        for var in self.pou.findall("VarDeclarations/VarLocal/Var"):
            builder.add(_declared(self.source, var, local=True))
        self._body(builder, self.pou, self.name, ())
        return builder.routine(self.place)

    def _body(self, builder: CodeBuilder, pou: Element, path: str, within: tuple[Element, ...]) -> None:
        counts: Counter[str] = Counter()
        for element in pou.findall("Body/*"):
            counts[element.tag] += 1
            place = _place(self.source, element, f"{path}/{element.tag}[{counts[element.tag]}]")
            switch = element.attrib.pop("disable", "false").lower()
            if switch == "true" and len(element.attrib) == 1:
                builder.remark(place, f"disabled: {text_of(element)}")
            elif switch != "false" or _is_strange(element):
                builder.unread(place, f"{text_of(element)} {_all_text(element)}")
            elif element.tag == "rem":
                builder.remark(place, _text(element, "text"))
            elif element.tag == "end_pro":
                builder.add(Return(place, ends=True))
            else:
                statement(builder, place, text_of(element))
            if element.find("pouref") is not None and element.tag in ("while", "for"):
                self._inside(builder, element, place, (*within, pou))
            elif element.tag == "wait" and (flag := _text(element, "var")):  # whether it came in time
                builder.unclear(place, expression(flag), flag)

    def _inside(self, builder: CodeBuilder, element: Element, place: Place, within: tuple[Element, ...]) -> None:
        """A loop's body: the nearest around it that has its name."""
        name = _text(element, "pouref")
        places = (*(each for pou in reversed(within) for each in pou.findall("Pou")), *self.pou.iter("Pou"))
        body = next((each for each in places if each is not self.pou and _text(each, "Name") == name), None)
        if body is None:
            raise fault(place, f"there is no <Pou> '{name}' for the loop's body", "Add it, or correct <pouref>")
        if body in within or len(within) > MAX_LOOPS:
            raise fault(place, f"the loop's body '{name}' holds the loop itself", "Give each loop its own <Pou>")
        self._body(builder, body, f"{place.element}/{name}", within)
        builder.close(element.tag, place)


def _is_strange(element: Element) -> bool:
    """Whether something of an element is not understood."""
    parts = PARTS.get(element.tag)
    return (
        parts is None
        or any(each.tag not in parts for each in element.iter() if each is not element)
        or any(len(each.attrib) > 1 or (len(each) and _own_text(each)) for each in element.iter())
    )


def text_of(element: Element) -> str:
    """An element as one line of RPL, as far as it has an equal there.

    Parameters
    ----------
    element : a statement

    Returns
    -------
    text : for others the tag and all text within it, 200 letters at most
    """
    inner = partial(_text, element)
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
            step = f" BY {inner('by')}" if element.find("by") is not None else ""
            return f"FOR {inner('var')} := {inner('from')} TO {inner('to')}{step} DO"
        case "call":
            name = "".join(_text(each, "name") for each in element.findall("subroutine"))
            arguments = ", ".join(map(_own_text, element.findall("subroutine/args/arg")))
            return f"{name}({arguments.rstrip(', ')})"
    return f"<{element.tag}> {_all_text(element)}"[:200]


def _all_text(element: Element) -> str:
    return " ".join(filter(None, map(_own_text, element.iter())))
