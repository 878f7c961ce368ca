"""Reads ABB RAPID: a module with the modules beside it that it uses.

Instructions that are not understood are kept; blocks and texts without an end are errors. Traps, error handlers and
records of the program's own are passed over. The grammar is that of ABB's *Technical reference manual: RAPID overview*
(3HAC050947-001), section 1, Basic RAPID programming; sources are named in :mod:`er3a.programs.rapid.data_types`.
"""

from __future__ import annotations

import bisect
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from er3a.errors import InputError
from er3a.programs import syntax
from er3a.programs.code_builder import CodeBuilder, fault, is_no_statement, linked, mapped, within
from er3a.programs.evaluation import variable_of
from er3a.programs.instructions import Place
from er3a.programs.lexing import NUMBER, Lexicon, MisreadError, ProgramText, Words, read_program_text
from er3a.programs.rapid import known_names
from er3a.programs.rapid.data_types import starting

PATTERN = re.compile(
    rf"""(?P<comment>![^\n]*)|(?P<text>"(?:[^"\n]|"")*")|(?P<number>{NUMBER})|(?P<name>[^\W\d]\w*)"""
    r"""|(?P<mark>:=|<>|<=|>=|\S)"""
)
RAPID = Lexicon(
    PATTERN,
    ranks={
        **dict.fromkeys(("OR", "XOR"), 1),
        "AND": 2,
        **dict.fromkeys(("=", "<>", "<", ">", "<=", ">="), 3),
        **dict.fromkeys(("+", "-"), 4),
        **dict.fromkeys(("*", "/", "DIV", "MOD"), 5),
    },
    right={"NOT": 2, "+": 5, "-": 5},
    constants={"TRUE": True, "FALSE": False},
    folds=True,
)
"""RAPID Reference Manual, 7.7 Priority between operators: NOT, OR and XOR bind least."""
ENDS_TEXT = """
ENDPROC ENDFUNC ENDTRAP ENDMODULE ENDRECORD ENDIF ENDWHILE ENDFOR ENDTEST ELSE ELSEIF ERROR UNDO BACKWARD CASE DEFAULT
PROC FUNC TRAP MODULE
"""
ENDS = frozenset(ENDS_TEXT.split())
"""Words that no instruction goes on beyond."""
DECLARED = ("VAR", "PERS", "CONST")
HANDLERS = ("ERROR", "UNDO", "BACKWARD")
MOTIONS = frozenset(("MOVEJ", "MOVEL", "MOVEC", "MOVEABSJ", "MOVEJDO", "MOVELDO", "MOVECDO"))
MAX_ELEMENTS = 1000
Given = tuple[tuple[syntax.Expression | None, ...], tuple[tuple[str, syntax.Expression], ...]]
"""Arguments by place and by name."""


@dataclass(frozen=True, slots=True)
class Token:
    """A word of a module's text."""

    kind: str
    text: str
    raw: str
    start: int
    end: int
    line: int


class RapidWords(Words):
    """Words of an instruction of RAPID."""

    def __init__(self, tokens: Iterable[Token]):
        self.lexicon = RAPID
        self.at, self._depth, self._length = 0, 0, 0
        kept = [each for each in tokens if each.kind != "comment"]
        self.kinds = [*(token.kind for token in kept), "end"]
        self.texts = [*(token.text for token in kept), ""]

    def special(self) -> syntax.Expression | None:
        """Aggregates, texts, the target that only the pendant shows."""
        if self.kind == "text":
            return syntax.Constant(self.take()[1:-1])
        if self.next == "*" and self.kind == "mark":
            return syntax.Opaque(self.take())
        if not self.accept("["):
            return None
        items: list[syntax.Expression] = []
        while not self.accept("]"):
            items.append(self.expression())
            if not self.accept(","):
                self.expect("]")
                break
        values = tuple(each.value for each in items if isinstance(each, syntax.Constant))
        return syntax.Constant(values) if len(values) == len(items) else syntax.Listed("", tuple(items))

    def parts_of(self, found: syntax.Expression) -> syntax.Expression:
        """An expression with the fields and arguments after it, and elements in braces.

        Parameters
        ----------
        found : what was read before them

        Raises
        ------
        MisreadError
            if a brace is not closed
        """
        while True:
            found = super().parts_of(found) if self.next != "[" else found
            if not self.accept("{"):
                return found
            for index in self.in_braces():
                found = syntax.Element(found, (index,))

    def in_braces(self) -> list[syntax.Expression]:
        """Expressions up to a closing brace."""
        found = [self.expression()]
        while self.accept(","):
            found.append(self.expression())
        self.expect("}")
        return found

    def arguments(self, close: str = ")") -> Given:
        """Arguments by place and, after a backslash, by name.

        Parameters
        ----------
        close : the bracket that ends them; empty for an instruction, which ends with its last word

        Returns
        -------
        placed : by place
        named : pairs of name and expression; a name alone is a switch, and True

        Raises
        ------
        MisreadError
            if the bracket or a comma is missing
        """
        placed: list[syntax.Expression | None] = []
        named: list[tuple[str, syntax.Expression]] = []
        first = self.at
        while not (self.accept(close) if close else self.kind == "end"):
            if self.kind == "end":
                raise MisreadError(f"'{close}' is missing")
            if self.accept(","):
                continue
            if self.accept("\\"):
                name = self.name()
                named.append((name, self.expression() if self.accept(":=") else syntax.Constant(True)))
            elif self.at > first and self.texts[self.at - 1] not in ",(":
                raise MisreadError(f"',' expected before '{self.next}'")
            else:
                placed.append(self.expression())
        return tuple(placed), tuple(named)


def read_rapid(source: ProgramText) -> syntax.Program:
    """The program of a module: its ``main``, or else the first of its procedures that no other calls.

    Raises
    ------
    InputError
        for texts and blocks without an end
    """
    readers = [_ModuleReader(read_program_text(path), path.stem.upper()) for path in modules_of(source.path)]
    own = _ModuleReader(source, source.path.stem.upper())
    readers.append(own)
    data = [each for reader in readers for each in reader.data]
    by_name = linked(each for reader in readers for each in reader.routines)
    constants = frozenset(variable_of(each.target) for each in data if each.text[:5].upper() == "CONST")
    return syntax.Program(
        "rapid",
        source.path.stem,
        source.path,
        by_name,
        _entry(own.routines, by_name),
        tuple(data) * 2,  # what stands after that which is made of it is known the second time
        lines=source.lines,
        constants=constants,
    )


def _entry(own: list[syntax.Routine], routines: Mapping[str, syntax.Routine]) -> str:
    if "MAIN" in routines:
        return "MAIN"
    calls = ((name, op) for name, each in routines.items() for op in each.code if isinstance(op, syntax.Call))
    called = {op.routine for name, op in calls if name != op.routine}
    starts = [each for each in own if not each.parameters and "/" not in each.name]
    free = [each for each in starts if each.name not in called] or starts or own
    return free[0].name if free else ""


def _tokens(source: ProgramText, module: str) -> list[Token]:
    """The words of a module; what it declares LOCAL gets the module's name before its own."""
    text = HEADER.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), source.text)
    breaks = [match.start() for match in re.finditer("\n", text)]
    hidden = {name.upper(): f"{module}/{name.upper()}" for name in LOCAL.findall(text)}
    found: list[Token] = []
    for match in PATTERN.finditer(text):
        kind, raw = match.lastgroup or "", match.group()
        line = bisect.bisect_left(breaks, match.start()) + 1
        if raw == '"':
            raise fault(Place(source.path, line), "a text has no end", 'Close it with "')
        word = raw.upper() if kind == "name" else raw
        if kind == "name" and not (found and found[-1].text in (".", "\\")):
            word = hidden.get(word, word)
        found.append(Token(kind, word, raw, match.start(), match.end(), line))
    return found


class _ModuleReader:
    """The words of one module, read one after another: its declarations and routines."""

    def __init__(self, source: ProgramText, module: str):
        self.source, self.tokens, self.at = source, _tokens(source, module), 0
        self.routines: list[syntax.Routine] = []
        self.data: list[syntax.Assign] = []
        while (token := self.next()) is not None:
            self._part(token)

    def next(self, comments: bool = False) -> Token | None:
        """The next word of the module, which is not passed.

        Parameters
        ----------
        comments : whether a comment counts as a word; else comments before the word are passed

        Returns
        -------
        token : None at the end of the text
        """
        while not comments and self.at < len(self.tokens) and self.tokens[self.at].kind == "comment":
            self.at += 1
        return self.tokens[self.at] if self.at < len(self.tokens) else None

    def word(self) -> str:
        """The next name, in capital letters; empty for anything else."""
        token = self.next()
        return token.text if token is not None and token.kind == "name" else ""

    def take(self) -> str:
        """The next name, which is passed."""
        word = self.word()
        self.at += 1
        return word

    def place(self) -> Place:
        """The place of the next word."""
        token = self.next() or (self.tokens[-1] if self.tokens else None)
        return Place(self.source.path, token.line if token else 1)

    def text(self, tokens: list[Token]) -> str:
        """The text of words, in one line and without comments.

        Parameters
        ----------
        tokens : that follow each other

        Returns
        -------
        text : as it was written if it is on one line; else the words with one blank between them
        """
        if not tokens:
            return ""
        lines = self.source.text[tokens[0].start : tokens[-1].end].split("\n")
        return lines[0] if len(lines) == 1 else " ".join(each.raw for each in tokens if each.kind != "comment")

    def simple(self) -> list[Token]:
        """The words of an instruction up to its semicolon, which is passed, or to a word that can't belong to it."""
        self.next()
        first = self.at
        while self.at < len(self.tokens):
            token = self.tokens[self.at]
            if token.text == ";" and token.kind == "mark":
                self.at += 1
                return self.tokens[first : self.at - 1]
            if token.kind == "name" and token.text in ENDS and self.at > first:
                break
            self.at += 1
        return self.tokens[first : self.at]

    def until(self, *words: str) -> list[Token]:
        """The words up to one of some words, which is not passed.

        Parameters
        ----------
        words : in capital letters

        Returns
        -------
        tokens : all up to the end of the text if there is none
        """
        first = self.at
        while self.at < len(self.tokens) and self.tokens[self.at].text not in words:
            self.at += 1
        return self.tokens[first : self.at]

    def head(self, *words: str) -> list[Token]:
        """The words up to one of some words, or a semicolon, which is passed.

        Parameters
        ----------
        words : in capital letters, such as ``THEN``

        Returns
        -------
        tokens : all up to the end of the text if there is none
        """
        found = self.until(*words, ";")
        self.at += 1
        return found

    def _part(self, token: Token) -> None:
        """A declaration or a routine; anything else is passed over."""
        if token.text in ("MODULE", "ENDMODULE") and token.kind == "name":
            self.at += 1
            if token.text == "MODULE":
                self.take()
                if (after := self.next()) is not None and after.text == "(":
                    self.head(")")
            return
        first = self.at
        while self.word() in ("LOCAL", "TASK"):
            self.at += 1
        word, place = self.word(), self.place()
        if word in DECLARED:
            builder = CodeBuilder("", (), place)
            self.declaration(builder, local=False)
            self.data += [each for each in builder.code if isinstance(each, syntax.Assign)]
        elif word in ("PROC", "FUNC"):
            self._routine(word)
        else:
            self.at = first
            if word not in ("TRAP", "RECORD"):
                self.simple()
            elif not (self.until(f"END{word}") and self.take()):
                raise fault(place, f"the {word} that begins here has no end", f"Close it with END{word}")

    def declaration(self, builder: CodeBuilder, local: bool) -> None:
        """Read a declaration, such as ``VAR num n{3} := [1, 2, 3];``, and add it to the code.

        Parameters
        ----------
        local : whether it is a routine's own

        Notes
        -----
        Without a value it holds what its type starts with, but for a PERS, whose value is in the controller. One that
        is not understood is kept as unknown.
        """
        place, tokens = self.place(), self.simple()
        words = RapidWords(tokens)
        try:
            elsewhere = words.take() == "PERS"  # where it has no value here
            kind, name = words.name(), words.name()
            initial = starting(kind)
            for size in reversed(words.in_braces() if words.accept("{") else []):
                kind += "[]"
                count = syntax.number(size.value) if isinstance(size, syntax.Constant) else None
                known = count is not None and 0 < count <= MAX_ELEMENTS
                initial = (initial,) * int(count or 0) if known and initial is not None else None
            value: syntax.Expression | None = words.expression() if words.accept(":=") else None
            words.finish()
        except MisreadError:
            builder.unknown(place, self.text(tokens), may_move=False)
            return
        if value is None and initial is not None and not elsewhere:
            value = syntax.Constant(initial)
        builder.add(syntax.Assign(place, syntax.Variable(name), value, self.text(tokens), kind, local))

    def _routine(self, word: str) -> None:
        place = self.place()
        self.at += 1
        kind = self.take() if word == "FUNC" else ""
        name = self.take()
        opened = self.next()
        if not name or opened is None or opened.text != "(":
            raise fault(place, f"this head of a {word} can't be read", f"Write {word} name()")
        self.at += 1
        inside = self.until(")")
        self.at += 1
        parameters, kinds = _parameters(inside, place)
        builder = CodeBuilder(name, tuple(parameters), place)
        for parameter, its in zip([*parameters, syntax.RoutineParameter(syntax.RETURNED)], [*kinds, kind]):
            if its:
                builder.add(syntax.Assign(place, syntax.Variable(parameter.name), None, "", its, local=True))
        _BodyReader(self, builder).read(f"END{word}")
        self.routines.append(builder.routine(self.place()))
        self.at += 1


def _parameters(tokens: list[Token], place: Place) -> tuple[list[syntax.RoutineParameter], list[str]]:
    """Parameters with their types; one that may be left out is given by its name."""
    found: list[syntax.RoutineParameter] = []
    kinds: list[str] = []
    optional = False
    words: list[str] = []
    for token in [*tokens, Token("mark", ",", ",", 0, 0, place.line)]:
        if token.text not in (",", "\\", "|"):
            words += [token.text] if token.kind == "name" or token.text == "*" else []
            continue
        names = [each for each in words if each != "*"]
        if len(names) == 1:
            raise fault(place, "a parameter has no type or no name", "Write PROC name(num n)")
        if names:
            kinds.append(names[-2] + "[]" * words.count("*"))
            out = names[0] in ("INOUT", "VAR", "PERS")
            found.append(syntax.RoutineParameter(names[-1], out, named=optional))
        optional, words = token.text != ",", []
    return found, kinds


class _BodyReader:
    """The instructions of one routine."""

    def __init__(self, module: _ModuleReader, builder: CodeBuilder):
        self.module, self.builder = module, builder

    def read(self, end: str) -> None:
        """Read a routine's instructions, and pass over its handlers (ERROR, UNDO, BACKWARD).

        Parameters
        ----------
        end : the word that ends the routine, which is not passed

        Raises
        ------
        InputError
            if that word is missing, or a block in the routine has no end
        """
        self.instructions(end)
        if self.module.word() in HANDLERS:
            self.module.until(end)
            if not self.module.word():
                raise fault(self.builder.place, f"{self.builder.name} has no {end}", f"Close it with {end}")

    def instructions(self, *ends: str) -> None:
        """Read instructions up to a word that ends them, or a handler's, which is not passed.

        Parameters
        ----------
        ends : in capital letters

        Raises
        ------
        InputError
            at the end of the text, or at the end of another block
        """
        module, builder = self.module, self.builder
        while True:
            token = module.next(comments=True)
            if token is None:
                raise fault(builder.place, f"{builder.name} has no {ends[0]}", f"Close it with {ends[0]}")
            word = token.text if token.kind == "name" else ""
            place = Place(module.source.path, token.line)
            following = module.tokens[module.at + 1 : module.at + 2]
            is_set = bool(following) and following[0].text == ":="
            if token.kind == "comment":
                builder.remark(place, token.raw[1:].strip())
                module.at += 1
            elif word in (*ends, *HANDLERS) and not is_set:
                return
            elif word in BLOCKS:
                BLOCKS[word](self, place)
            elif word in ENDS and not is_set:
                raise fault(place, f"{word} stands within {builder.name}", f"Close it with {ends[0]} before")
            elif word in DECLARED:
                module.declaration(builder, local=True)
            else:
                self.instruction(place, module.simple())

    def instruction(self, place: Place, tokens: list[Token]) -> None:
        """Read one instruction; one that is not understood is kept as such, and what it assigns to becomes unclear.

        Parameters
        ----------
        tokens : up to its semicolon

        Raises
        ------
        InputError
            if brackets are nested too deeply
        """
        text = self.module.text(tokens)
        words = RapidWords(tokens)
        if words.kind == "end":
            return
        try:
            self._instruction(place, words, text)
        except MisreadError:
            self.builder.unknown(place, text, stops=is_no_statement(text, calls_without_brackets=True))
            if ":=" in words.texts and words.kinds[0] == "name":
                self.builder.unclear(place, syntax.Variable(words.texts[0]), text)
        except RecursionError:
            raise InputError(place.file, place.where, "nested too deeply", "Split this line") from None

    def condition(self, tokens: list[Token]) -> syntax.Expression:
        """A condition, or another expression by itself.

        Parameters
        ----------
        tokens : all of it

        Returns
        -------
        expression : :class:`Opaque` with its text if it is not understood
        """
        words = RapidWords(tokens)
        try:
            found = words.expression()
            words.finish()
        except MisreadError:
            return syntax.Opaque(self.module.text(tokens))
        return found

    def close(self, place: Place, kind: str, end: str) -> None:
        """End a block; its last word is passed.

        Parameters
        ----------
        kind : the block's, as :class:`CodeBuilder` calls it
        end : the word that must be there, such as ``ENDIF``

        Raises
        ------
        InputError
            if another word is there
        """
        if self.module.word() != end:
            raise fault(place, f"the {end[3:]} that begins here has no end", f"Close it with {end}")
        self.builder.close(kind, self.module.place())
        self.module.at += 1

    def _instruction(self, place: Place, words: RapidWords, text: str) -> None:
        builder, first = self.builder, words.name()
        if words.next in (":=", ".", "{"):
            target = words.parts_of(syntax.Variable(first))
            words.expect(":=")
            value = words.expression()
            words.finish()
            builder.add(syntax.Assign(place, target, value, text))
        elif first == "RETURN":
            found = None if words.kind == "end" else words.expression()
            words.finish()
            builder.add(syntax.Return(place, found))
        elif first in ("EXIT", "EXITCYCLE"):
            words.finish()
            builder.add(syntax.Return(place, ends=True))
        elif first in COUNTED:
            target = words.reference()
            sign, amount = COUNTED[first]
            by = words.expression() if words.accept(",") else syntax.Constant(amount)
            words.finish()
            builder.add(syntax.Assign(place, target, syntax.Binary(sign, target, by), text))
        else:
            self._called(place, first, words.arguments(""), text)

    def _called(self, place: Place, name: str, given: Given, text: str) -> None:
        """A call of a procedure, or an instruction of the controller."""
        builder, (placed, named) = self.builder, given
        if name in MOTIONS:
            builder.add(syntax.Move(place, name, placed, text, (), named))
        elif name == "WAITTIME" and placed:
            builder.add(syntax.Waiting(place, "seconds", placed[0], text))
        elif name == "STOP" and not placed:
            builder.add(syntax.Waiting(place, "operator", None, text))
        elif name in known_names.WAITS:
            builder.add(syntax.Waiting(place, "condition", None, text))
        else:
            builder.add(syntax.Doing(place, syntax.Invocation(name, placed, named), text))
        for key, each in named:
            if key in known_names.CHANGING_OPTIONS:
                builder.unclear(place, each, text)


COUNTED = {"INCR": ("+", 1), "DECR": ("-", 1), "ADD": ("+", 0), "CLEAR": ("*", 0)}
"""Instructions that change a number: by which operator, and with what if nothing else is given."""


def _if(body: _BodyReader, place: Place) -> None:
    """``IF condition THEN``, or ``IF condition instruction;``."""
    module, builder = body.module, body.builder
    start = module.at
    module.at += 1
    condition = module.until("THEN", ";")
    if (token := module.next()) is not None and token.text == "THEN":
        module.at += 1
        builder.open_if(place, body.condition(condition), module.text(condition))
        body.instructions("ENDIF", "ELSEIF", "ELSE")
        while module.word() in ("ELSEIF", "ELSE"):
            other = [] if module.take() == "ELSE" else module.head("THEN")
            builder.next_arm(place, body.condition(other) if other else None, module.text(other))
            body.instructions("ENDIF", "ELSEIF", "ELSE")
        body.close(place, "if", "ENDIF")
        return
    module.at = start + 1
    tokens = [each for each in module.simple() if each.kind != "comment"]
    words = RapidWords(tokens)
    try:
        test = words.expression()
    except MisreadError:
        builder.unknown(place, module.text(tokens))
        return
    builder.open_if(place, test, module.text(tokens[: words.at]))
    body.instruction(place, tokens[words.at :])
    builder.close("if", place)


def _while(body: _BodyReader, place: Place) -> None:
    body.module.at += 1
    condition = body.module.head("DO")
    body.builder.open_while(place, body.condition(condition), body.module.text(condition))
    body.instructions("ENDWHILE")
    body.close(place, "while", "ENDWHILE")


def _for(body: _BodyReader, place: Place) -> None:
    """``FOR i FROM first TO last STEP step DO``; without a step it counts towards the last. The counter hides data of
    its name in the loop alone."""
    module, builder = body.module, body.builder
    module.at += 1
    tokens = module.head("DO")
    words = RapidWords(tokens)
    try:
        name = words.name()
        words.expect("FROM")
        first = words.expression()
        words.expect("TO")
        last = words.expression()
        step = words.expression() if words.accept("STEP") else None
        words.finish()
    except MisreadError as error:
        raise fault(place, f"this FOR can't be read ({error})", "Write FOR i FROM 1 TO 9 DO") from None
    if step is None and isinstance(first, syntax.Constant) and isinstance(last, syntax.Constant):
        ends = syntax.number(first.value), syntax.number(last.value)
        step = syntax.Constant(-1 if None not in ends and ends[0] > ends[1] else 1)  # type: ignore[operator]
    before = len(builder.code)
    counter = syntax.Variable(f"{name}%{before}")
    builder.add(syntax.Assign(place, counter, None, "", local=True))
    builder.open_for(place, counter.name, first, last, step, module.text(tokens))
    inside = len(builder.code)
    body.instructions("ENDFOR")

    def each(expression: syntax.Expression) -> syntax.Expression:
        return counter if expression == syntax.Variable(name) else within(expression, each)

    for at in range(inside, len(builder.code)):
        operation = mapped(builder.code[at], each)
        if isinstance(operation, syntax.Assign):
            operation = replace(operation, target=each(operation.target))
        builder.code[at] = operation
    body.close(place, "for", "ENDFOR")


def _test(body: _BodyReader, place: Place) -> None:
    """``TEST subject CASE 1, 2: ... DEFAULT: ... ENDTEST``."""
    module = body.module
    module.at += 1
    asked = module.until("CASE", "DEFAULT", "ENDTEST")
    body.builder.open_switch(place, body.condition(asked), f"TEST {module.text(asked)}")
    while (word := module.word()) in ("CASE", "DEFAULT"):
        at = module.place()
        module.at += 1
        tokens = module.head(":")
        words = RapidWords(tokens)
        values: list[syntax.Expression] = []
        try:
            while word == "CASE" and (not values or words.accept(",")):
                values.append(words.expression())
            words.finish()
        except MisreadError as error:
            raise fault(at, f"this CASE can't be read ({error})", "Write CASE 1, 2:") from None
        body.builder.case(at, values or None, f"CASE {module.text(tokens)}")
        body.instructions("CASE", "DEFAULT", "ENDTEST")
    body.close(place, "switch", "ENDTEST")


BLOCKS: dict[str, Callable[[_BodyReader, Place], None]] = {"IF": _if, "WHILE": _while, "FOR": _for, "TEST": _test}

SUFFIXES = (".mod", ".prg", ".sys", ".modx", ".sysx")
HEADER = re.compile(r"(?s)\A\s*%%%.*?%%%")
COMMENT_OR_TEXT = re.compile(r'(![^\n]*)|("(?:[^"\n]|"")*")')
DECLARATION = r"(?:(?:TASK\s+)?(?:CONST|PERS|VAR)\s+\w+|PROC|FUNC\s+\w+)\s+(\w+)"
GLOBAL = re.compile(rf"(?i)(?<!LOCAL )(?<!LOCAL\t)\b{DECLARATION}")
LOCAL = re.compile(rf"(?i)\bLOCAL\s+{DECLARATION}")
WORD = re.compile(r"[^\W\d]\w*")
MAX_MODULES = 200


def modules_of(path: Path) -> tuple[Path, ...]:
    """The modules in a module's folder that hold what it uses and does not define, and what these use.

    Parameters
    ----------
    path : of the module that is started

    Returns
    -------
    files : in the order of their names. One with a routine ``main`` of its own is another program; one that is not text
        is left out. At most ``MAX_MODULES``.
    """
    used, given = _names(read_program_text(path))
    waiting: dict[Path, tuple[set[str], set[str]]] = {}
    for each in sorted(path.parent.iterdir()):
        if each.suffix.lower() in SUFFIXES and each.is_file() and each.resolve() != path.resolve():
            try:
                names = _names(read_program_text(each))
            except InputError:  # such as those that a manufacturer has encoded
                continue
            if "MAIN" not in names[1]:
                waiting[each] = names
    found: list[Path] = []
    while new := [each for each, names in waiting.items() if names[1] & (used - given)][: MAX_MODULES - len(found)]:
        for each in new:
            more, own = waiting.pop(each)
            used |= more
            given |= own
        found += new
    return tuple(found)


def _names(source: ProgramText) -> tuple[set[str], set[str]]:
    """The words of a module, and the names that it gives to others, in capital letters."""
    text = COMMENT_OR_TEXT.sub(lambda match: match[2] or "", HEADER.sub("", source.text))
    return set(map(str.upper, WORD.findall(text))), set(map(str.upper, GLOBAL.findall(text)))
