"""KRL's words and expressions."""

from __future__ import annotations

import math
import re

from er3a.programs.lexing import NUMBER, Lexicon, MisreadError, Words
from er3a.programs.syntax import Aggregate, Constant, Expression, Opaque
from er3a.programs.values import Record

KRL = Lexicon(
    re.compile(
        rf"""(?P<text>"[^"]*")|(?P<number>{NUMBER})|(?P<enum>\#\s*[A-Za-z_]\w*)|(?P<whole>'[HhBb][0-9A-Fa-f]+')"""
        r"""|(?P<name>[A-Za-z_$][\w$]*)|(?P<mark>==|<>|<=|>=|\.\.|\S)"""
    ),
    ranks={
        **dict.fromkeys(("==", "<>", "<", ">", "<=", ">="), 1),
        **dict.fromkeys(("OR", "B_OR"), 2),
        **dict.fromkeys(("EXOR", "B_EXOR"), 3),
        **dict.fromkeys(("AND", "B_AND"), 4),
        "+": 5,
        "-": 5,
        "*": 6,
        "/": 6,
        ":": 7,
    },
    right={"NOT": 8, "B_NOT": 8, "+": 8, "-": 8},
    constants={"TRUE": True, "FALSE": False},
    folds=True,
)

PLAIN = re.compile(
    r"(?i)(PTP|LIN|SPTP|SLIN|SPL)\s*\{\s*(?:(E6POS|E6AXIS|POS|FRAME|AXIS)\s*:)?([^{}\"]*)\}\s*((?:C_\w+(?:\s+|$))*)$"
)
PLAIN_DATA = re.compile(r"(?i)DECL\s+(?:GLOBAL\s+)?(\w+)\s+(\w+)\s*=\s*\{([^{}\"]*)\}$")


class KrlWords(Words):
    """Words of a line of KRL."""

    def __init__(self, text: str):
        super().__init__(KRL, text)

    def special(self) -> Expression | None:
        """Aggregates, enumerations, numbers in other bases, the point that is to be taught."""
        if self.kind == "enum":
            return Constant("#" + self.take()[1:].strip().upper())
        if self.kind == "whole":
            word = self.take()
            try:
                return Constant(int(word[2:-1], 16 if word[1] in "Hh" else 2))
            except ValueError:
                raise MisreadError(f"{word} is no number") from None
        if self.accept("{"):
            return self._aggregate()
        return Opaque(self.take()) if self.next in ("?", "!") else None

    def _aggregate(self) -> Expression:
        kind = ""
        if self.kind == "name" and self.texts[self.at + 1] == ":":
            kind = self.take()
            self.take()
        items: list[tuple[str, Expression]] = []
        if self.accept("}"):
            return Aggregate(kind, ())
        while True:
            name = self.name()
            if any(name == other for other, _ in items):
                raise MisreadError(f"{name} is given twice")
            if self.accept("["):
                self.expect("]")
            items.append((name, self.expression()))
            if not self.accept(","):
                self.expect("}")
                return Aggregate(kind, tuple(items))


def plain_record(kind: str | None, items: str) -> Constant | None:
    """A record of numbers and enumerations alone, without a look at its words."""
    words = items.replace(",", " ").split()
    names, texts = words[::2], words[1::2]
    if len(names) != len(texts) or len(names) != items.count(",") + 1 or "_" in "".join(texts):
        return None
    try:
        found = [(name.upper(), text.upper() if text[0] == "#" else float(text)) for name, text in zip(names, texts)]
    except ValueError:
        return None
    if len(dict(found)) < len(found) or not all(isinstance(value, str) or math.isfinite(value) for _, value in found):
        return None
    return Constant(Record((kind or "").upper(), tuple(found)))
