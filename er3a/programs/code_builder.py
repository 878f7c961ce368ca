"""Puts the flat code of a routine together while its text is read: loops and branches become jumps.

Calls of a program's own routines, wherever they stand in expressions, become operations of their own.

``LIN shifted(P1, 50)`` is carried out as a call whose value goes to a hidden variable, and a line to that variable.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

from er3a.errors import InputError
from er3a.programs import syntax
from er3a.programs.instructions import Aside, Place, Remark, Unknown
from er3a.programs.lexing import MisreadError, ProgramText, Words
from er3a.programs.syntax import (
    Assign,
    Binary,
    Branch,
    Call,
    Constant,
    Doing,
    Expression,
    Fixed,
    GoTo,
    Operation,
    Return,
    Routine,
    Variable,
)

MAX_NESTED = 200
ASSIGNED = re.compile(r"(?:(?:global|local)\s+)?([A-Za-z_$][\w$]*+)[^=\"'(]*+=(?!=)")


@dataclass
class Block:
    """A loop or branch that is still open."""

    kind: str
    place: Place
    start: int
    exits: list[int] = field(default_factory=list)  # jumps past the block
    skips: list[int] = field(default_factory=list)  # branches or jumps to the next arm, or to the next round
    subject: Expression | None = None
    step: Expression | None = None
    text: str = ""  # its first line, of a switch


LOOPS = ("loop", "while", "for", "repeat")


WORDS = re.compile(r'"[^"]*"|[A-Za-z_$][\w.$%]*|\d[\w.]*|\S')
OPERATORS = frozenset(["AND", "OR", "NOT", "XOR", "EXOR", "DIV", "MOD", "B_AND", "B_OR", "B_EXOR", "B_NOT"])


def is_no_statement(text: str, calls_without_brackets: bool = False) -> bool:
    """Whether a text is neither call nor assignment in any language: two values follow each other without an operator.

    Parameters
    ----------
    calls_without_brackets : whether a procedure's name stands before its arguments, as in RAPID
    """
    words = WORDS.findall(text.partition("{")[0])[calls_without_brackets:]  # a list in braces names its fields
    values = [(each[0].isalnum() or each[0] in '_$"') and each.upper() not in OPERATORS for each in words]
    return any(map(all, pairwise(values)))


class CodeBuilder:
    """The code of one routine."""

    def __init__(self, name: str, parameters: tuple[syntax.RoutineParameter, ...], place: Place, thread: bool = False):
        self.name, self.parameters, self.place, self.thread = name, parameters, place, thread
        self.code: list[Operation] = []
        self.blocks: list[Block] = []
        self._labels: dict[str, int] = {}
        self._gotos: list[tuple[int, str]] = []
        self._hidden = 0

    def add(self, operation: Operation) -> None:
        """Add one operation at the end of the code.

        Parameters
        ----------
        operation : its number is that of the code's length before; jumps lead to such numbers
        """
        self.code.append(operation)

    def remark(self, place: Place, text: str) -> None:
        """Add a comment, which writers keep.

        Parameters
        ----------
        place : where it was read
        text : without the language's own signs of a comment
        """
        self.add(Fixed(place, Remark(text)))

    def aside(self, place: Place, text: str) -> None:
        """Add an instruction that is known to move nothing.

        Parameters
        ----------
        place : where it was read
        text : as it was read; writers of the same language repeat it
        """
        self.add(Fixed(place, Aside(text)))

    def unknown(self, place: Place, text: str, may_move: bool = True, stops: bool = False) -> None:
        """Add an instruction that is not understood, or not followed.

        Parameters
        ----------
        text : as it was read
        may_move : whether it may move the arm, for all that is known
        stops : whether the controller stops here, as at a text that is no statement
        """
        self.add(Fixed(place, Unknown(text, may_move, stops=stops)))

    def unread(self, place: Place, text: str, may_move: bool = True, folds: bool = False) -> None:
        """A statement that is not understood; what it assigns something to has no known value from here.

        Parameters
        ----------
        folds : whether ``a`` and ``A`` are one name
        """
        self.unknown(place, text, may_move, stops=is_no_statement(text))
        assigned = ASSIGNED.match(text)
        if assigned is not None:
            name = assigned[1].upper() if folds else assigned[1]
            self.unclear(place, Variable(name), text)

    def unclear(self, place: Place, target: Expression | None, text: str) -> None:
        """Make a variable, field or element unclear, because nothing is known of it from here.

        Parameters
        ----------
        target : what is assigned to; anything else than a variable, field or element is left out
        text : what the value was read from, for messages
        """
        if isinstance(target, Variable | syntax.Member | syntax.Element):
            self.add(Assign(place, target, syntax.Opaque(text), text))

    def inside(self, *kinds: str) -> bool:
        """Whether the innermost open block is one of some kinds.

        Parameters
        ----------
        kinds : such as ``if``, ``for`` or ``switch``

        Returns
        -------
        inside : False where no block is open
        """
        return bool(self.blocks) and self.blocks[-1].kind in kinds

    def open(
        self,
        kind: str,
        place: Place,
        condition: Expression | None = None,
        text: str = "",
        *,
        counted: bool = False,
    ) -> None:
        """Begin a loop or a branch.

        Parameters
        ----------
        kind : ``if``, ``loop``, ``repeat``, ``while``, ``for`` or ``switch``
        condition : without which the code goes on behind the block, or at its next part; a ``while`` of one that is
            always true is a loop for ever
        text : the line, for messages
        counted : whether the condition is that of a counter

        Raises
        ------
        InputError
            if too many blocks are nested
        """
        if len(self.blocks) >= MAX_NESTED:
            raise fault(place, f"more than {MAX_NESTED} blocks within each other", "Nest fewer")
        if kind in LOOPS:
            self.add(syntax.Enter(place))
        self.blocks.append(Block(kind, place, len(self.code)))
        for_ever = kind == "while" and isinstance(condition, Constant) and condition.value is True
        if condition is not None and not for_ever:
            self._test(place, condition, text, counted)

    def next_part(self, kind: str, place: Place, condition: Expression | None = None, text: str = "") -> None:
        """End a part of a branch, if one is open, and begin the next: ``ELSE``, ``ELSEIF``, ``CASE``.

        Parameters
        ----------
        kind : ``if`` or ``switch``
        condition : None of ``ELSE`` and ``DEFAULT``
        text : the line, for messages

        Raises
        ------
        InputError
            if the innermost block is another one
        """
        block = self._innermost(kind, place)
        if block.skips or block.exits:
            block.exits.append(self._jump(place))
        self._patch(block.skips)
        block.skips = []
        if condition is not None:
            self._test(place, condition, text)

    def open_for(
        self,
        place: Place,
        name: str,
        first: Expression,
        last: Expression,
        step: Expression | None,
        text: str,
    ) -> None:
        """Begin ``FOR name = first TO last STEP step``.

        Parameters
        ----------
        name : of the counter
        step : 1 if None
        text : the line, for messages

        Notes
        -----
        The last value and the step are fixed when the loop is entered. A round is done as long as (last - counter) *
        step is not below 0, so that steps can be negative.
        """
        self._hidden += 1
        limit, by = (Variable(f"%{part}{self._hidden}") for part in ("last", "step"))
        counter = Variable(name)
        self.add(Assign(place, counter, first, text))
        self.add(Assign(place, limit, last, text, local=True))
        self.add(Assign(place, by, Constant(1) if step is None else step, text, local=True))
        # One test for steps of either sign: until the last value is passed, what is left and the step have one sign.
        span = Binary("*", Binary("-", limit, counter), by)
        self.open("for", place, Binary(">=", span, Constant(0)), text, counted=True)
        self.blocks[-1].subject, self.blocks[-1].step = counter, by

    def open_switch(self, place: Place, subject: Expression, text: str) -> None:
        """Begin ``SWITCH subject``; cases follow.

        Parameters
        ----------
        subject : worked out once, and kept in a hidden variable
        text : the line, for messages

        Raises
        ------
        InputError
            if too many blocks are nested
        """
        self._hidden += 1
        value = Variable(f"%subject{self._hidden}")
        self.add(Assign(place, value, subject, text, local=True))
        self.open("switch", place)
        self.blocks[-1].subject, self.blocks[-1].text = value, text

    def case(self, place: Place, values: list[Expression], text: str) -> None:
        """Begin ``CASE values``.

        Parameters
        ----------
        values : the case is taken where the subject is one of them
        text : the line, for messages

        Raises
        ------
        InputError
            if the innermost block is no SWITCH
        """
        block = self._innermost("switch", place)
        assert block.subject is not None
        condition: Expression | None = None
        for value in values:
            test = Binary("==", block.subject, value)
            condition = test if condition is None else Binary("OR", condition, test)
        self.next_part("switch", place, condition, f"{block.text} {text}")

    def close(self, kind: str, place: Place, until: Expression | None = None, text: str = "") -> None:
        """End the innermost block, which must be of this kind; its open jumps lead here.

        Parameters
        ----------
        kind : the word with which it was opened
        until : the condition that ends a REPEAT, which needs one; of no other block

        Raises
        ------
        InputError
            if the innermost block is another one, or none is open
        """
        block = self._innermost(kind, place)
        if kind == "repeat":
            assert until is not None
            # A ``continue`` goes on at the condition, not after the loop.
            self._patch(block.skips)
            self.add(Branch(place, until, block.start, text))
        else:
            if kind in LOOPS:
                self._again(block, place)
            self._patch(block.skips)
        self._patch(block.exits)
        self.blocks.pop()

    def leave_loop(self, place: Place, goes_on: bool = False) -> None:
        """Go on after the innermost loop (``EXIT``, ``break``), or with its next round (``continue``).

        Parameters
        ----------
        goes_on : with the next round; a counter is advanced first, and a REPEAT goes on at its condition

        Raises
        ------
        InputError
            if no loop is open
        """
        loop = next((block for block in reversed(self.blocks) if block.kind in LOOPS), None)
        if loop is None:
            raise fault(place, "leaves a loop, but none is open", "Remove it")
        if goes_on and loop.kind != "repeat":
            self._again(loop, place)
        else:
            (loop.skips if goes_on else loop.exits).append(self._jump(place))

    def label(self, name: str) -> None:
        """Name the next operation, so that :meth:`goto` can lead to it.

        Parameters
        ----------
        name : within the routine; of two with one name the later one counts
        """
        self._labels[name] = len(self.code)

    def goto(self, place: Place, name: str) -> None:
        """Go on at a label, before or after this place: ``GOTO name``.

        Parameters
        ----------
        name : looked up when the routine is finished (:meth:`routine`), which refuses one without a label
        """
        self._gotos.append((self._jump(place), name))

    def routine(self, end: Place) -> Routine:
        """The finished routine.

        Raises
        ------
        InputError
            for a block without end, or a label that is not there
        """
        if self.blocks:
            block = self.blocks[-1]
            raise fault(block.place, f"the {block.kind.upper()} that begins here has no end", "Close it")
        for at, name in self._gotos:
            place = self.code[at].place
            if name not in self._labels:
                raise fault(place, f"there is no label '{name}'", "Name a label of this routine")
            self.code[at] = GoTo(place, self._labels[name])
        code = (*self.code, Return(end))
        return Routine(self.name, self.parameters, code, self.place, self.thread)

    def _innermost(self, kind: str, place: Place) -> Block:
        if not self.inside(kind):
            opened = f"the {self.blocks[-1].kind.upper()} of line {self.blocks[-1].place.line}" if self.blocks else None
            problem = f"ends or continues a {kind.upper()}, but {opened or 'none'} is open"
            raise fault(place, problem, "Close blocks in the order in which they were opened")
        return self.blocks[-1]

    def _again(self, loop: Block, place: Place) -> None:
        """Go on with a loop's next round, its counter advanced."""
        if loop.subject is not None and loop.step is not None:
            self.add(Assign(place, loop.subject, Binary("+", loop.subject, loop.step), ""))
        self.add(GoTo(place, loop.start))

    def _test(self, place: Place, condition: Expression, text: str, counted: bool = False) -> None:
        self.blocks[-1].skips.append(len(self.code))
        self.add(Branch(place, condition, -1, text, counted))

    def _jump(self, place: Place) -> int:
        self.add(GoTo(place, -1))
        return len(self.code) - 1

    def _patch(self, places: list[int]) -> None:
        """Let jumps lead to what comes next."""
        for at in places:
            self.code[at] = led_to(self.code[at], len(self.code))


def led_to(operation: Operation, to: int) -> Operation:
    """A jump that leads to an operation of another number; one that jumps nowhere is returned as it is."""
    return replace(operation, to=to) if isinstance(operation, GoTo | Branch) else operation


Blocks = Mapping[str, tuple[str, str]]
"""What a language's words do to blocks: an action of :func:`block`, and what it needs: the word that ends a head, the
block that is closed, or the words within a FOR."""


def block(builder: CodeBuilder, words: Words, place: Place, text: str, blocks: Blocks) -> bool:
    """Begin, go on with, leave or end a block or a routine; False, with nothing done, if a statement does none of it.

    Raises
    ------
    MisreadError
        for a statement that can't be read
    InputError
        for one without which the next lines would mean something else
    """
    word = words.next.upper()
    action, needs = blocks.get(word, ("", ""))
    if not action:
        return False
    words.take()
    match action:
        case "if" | "while":
            builder.open(action, place, words.condition(needs), text)
        case "elif":
            builder.next_part("if", place, words.condition(needs), text)
        case "until":
            builder.close("repeat", place, words.condition(needs), text)
        case "switch":
            builder.open_switch(place, words.condition(needs), text)
        case "for" | "case":
            try:
                _counted(builder, words, place, text, needs) if action == "for" else _case(builder, words, place, text)
            except MisreadError as error:
                remedy = "Write a counter with its first and last value, or values after CASE"
                raise fault(place, f"this {word} can't be read ({error})", remedy) from None
        case "return":
            value = None if words.kind == "end" else words.expression()
            words.finish()
            builder.add(Return(place, value))
        case "label":
            builder.label(words.name())
        case "goto":
            builder.goto(place, words.name())
        case _:
            words.accept(needs)
            words.finish()
            _simple(builder, place, action)
    return True


def _simple(builder: CodeBuilder, place: Place, action: str) -> None:
    """A word that stands alone."""
    match action:
        case "else" | "default":
            builder.next_part("if" if action == "else" and not builder.inside("switch") else "switch", place)
        case "loop" | "repeat":
            builder.open(action, place)
        case "leave" | "next":
            builder.leave_loop(place, goes_on=action == "next")
        case "end":
            builder.add(Return(place, ends=True))
        case kind if kind.startswith("close "):
            builder.close(kind.removeprefix("close "), place)


def _counted(builder: CodeBuilder, words: Words, place: Place, text: str, needs: str) -> None:
    """``FOR name = first TO last STEP step``, by the words that a language has there."""
    given, to, by, *end = needs.split()
    name = words.name()
    words.expect(given)
    first = words.expression()
    words.expect(to)
    last = words.expression()
    step = words.expression() if words.accept(by) else None
    words.accept("".join(end))
    words.finish()
    if isinstance(step, Constant) and step.value == 0:
        raise MisreadError(f"{by} 0")
    if words.counts_down and isinstance(first, Constant) and isinstance(last, Constant):
        ends = syntax.numbers((first.value, last.value))
        step = Constant(-1) if step is None and ends and ends[0] > ends[1] else step
    builder.open_for(place, name, first, last, step, text)


def _case(builder: CodeBuilder, words: Words, place: Place, text: str) -> None:
    values = [words.expression()]
    while words.accept(","):
        values.append(words.expression())
    words.accept(":")
    words.finish()
    builder.case(place, values, text)


def fault(place: Place, problem: str, remedy: str) -> InputError:
    """An error at a place of a program, to be raised.

    Parameters
    ----------
    problem : what is wrong
    remedy : how to correct it

    Returns
    -------
    error : names the place's file, line and element
    """
    return InputError(place.file, place.where, problem, remedy)


COMMENT_SIGNS = re.compile(r"^(?:[!;#]|//|\(\*)|\*\)$")


def statements(
    source: ProgramText, breaks: re.Pattern[str], is_over: Callable[[str, str], bool]
) -> Iterator[tuple[Place, str, bool]]:
    """Divide a program's text into statements and comments.

    Parameters
    ----------
    breaks : what matters for that, by groups: ``comment``; ``text`` in quotes; ``bad``, what begins one of these
        without its end; ``alone``, a word that is a statement; ``begin``, a word with which one begins; ``mark``, with
        which one may end; ``line``, the end of a line that ends none
    is_over : whether a statement ends, by its text so far and the mark after it, which is empty at the end of the file

    Returns
    -------
    statements : each with its first line, its text without comments, and whether it is a comment. Comments within a
        statement are left out.

    Raises
    ------
    InputError
        for texts, comments and statements without an end
    """
    text, line, first = "", 1, 1
    for kind, part in _parts(source.text, breaks):
        place = Place(source.path, line)
        if not text:
            first = line
        if kind == "bad":
            what, close = ("text", part) if part in "\"'" else ("comment", "*)")
            raise fault(place, f"a {what} has no end", f"Close it with {close}")
        over = kind in ("alone", "begin") or (kind == "mark" and is_over(text, part))
        if over:
            whole = _in_one_line(text + part if kind == "mark" and part not in ";\n" else text)
            if whole:
                yield Place(source.path, first), whole, False
            text, first = part if kind == "begin" else "", line
        if kind == "alone":
            yield place, part, False
        elif kind == "comment" and not text:
            yield place, COMMENT_SIGNS.sub("", part).strip(), True
        elif kind != "comment" and not over and (text or part.strip()):
            text += part
        line += part.count("\n")
    if text.strip() and not is_over(text, ""):
        problem = f"'{_in_one_line(text)[:40]}' has no end"
        raise fault(Place(source.path, first), problem, "End each statement with ; and close each bracket")
    if text.strip():
        yield Place(source.path, first), _in_one_line(text), False


def _parts(text: str, breaks: re.Pattern[str]) -> Iterator[tuple[str, str]]:
    """What is found in a text, by its group, and what stands between."""
    at = 0
    for match in breaks.finditer(text):
        if match.start() > at:
            yield "", text[at : match.start()]
        yield match.lastgroup or "", match.group()
        at = match.end()
    yield "", text[at:]


def _in_one_line(text: str) -> str:
    return " ".join(text.split()) if "\n" in text.strip() else text.strip()


def linked(routines: Iterable[Routine]) -> dict[str, Routine]:
    """The routines by name, with calls of each other taken out of expressions.

    Of two routines with one name the later one counts; the other is kept under a name that nothing calls. A function in
    an expression that is not the program's is carried out before, for what it may do.
    """
    by_name: dict[str, Routine] = {}
    for routine in routines:
        if routine.name in by_name:
            hidden = f"{routine.name}@{len(by_name)}"
            by_name[hidden] = replace(by_name[routine.name], name=hidden)
        by_name[routine.name] = routine
    return {name: replace(each, code=_linked(each.code, by_name)) for name, each in by_name.items()}


def _linked(given: tuple[Operation, ...], known: Container[str]) -> tuple[Operation, ...]:
    code: list[Operation] = []
    starts: list[int] = []
    for operation in given:
        starts.append(len(code))
        calls = _Calls(known, operation)
        last = syntax.mapped(operation, calls.out)
        if isinstance(last, Doing) and last.what.function in known:
            call = last.what
            last = Call(last.place, call.function, call.arguments, call.keywords, last.text)
        code += [*calls.found, last]
    starts.append(len(code))
    if len(code) > len(given):
        code = [led_to(each, starts[each.to]) if isinstance(each, GoTo | Branch) else each for each in code]
    return tuple(code)


class _Calls:
    """Takes calls out of the expressions of an operation, the innermost first."""

    def __init__(self, known: Container[str], operation: Operation):
        self.known, self.place = known, operation.place
        self.found: list[Operation] = []

    def out(self, expression: Expression) -> Expression:
        """An expression without calls: each is done before, and its value read from a hidden variable.

        Returns
        -------
        expression : calls of the program's own routines are replaced. Calls of other functions stay where they are, and
            are also done before, for what they may change.
        """
        if isinstance(expression, Constant | Variable):
            return expression
        expression = syntax.within(expression, self.out)
        if not isinstance(expression, syntax.Invocation):
            return expression
        name = expression.function
        if name in self.known:
            result = f"%value{len(self.found) + 1}"
            self.found.append(Call(self.place, name, expression.arguments, expression.keywords, name, result))
            return Variable(result)
        if name[0] != "%":
            self.found.append(Doing(self.place, expression, f"{name}(...)", within=True))
        return expression
