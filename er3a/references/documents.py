"""Documents that references and tables rest on, and which of them are independent of each other.

A document that was made from another says nothing that the other does not say. Two documents are independent if neither
was made from the other, directly or by way of others, and no third stands behind both. Documents of one publisher are
different documents; that they have it in common is told beside.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from er3a.by_value import ReadOnly

NO_DOCUMENT = "none"
"""The origin of a value that rests on no document."""


@dataclass(frozen=True)
class Document:
    """A document.

    Attributes
    ----------
    name : what origins call it; title : for people
    publisher : who made it
    derived_from : names of the documents that it was made from
    """

    name: str
    title: str
    publisher: str
    derived_from: tuple[str, ...] = ()


@dataclass(frozen=True)
class Documents:
    """Documents by name. A name that isn't among them stands for a document of its own, made from no other."""

    by_name: Mapping[str, Document] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "by_name", ReadOnly(self.by_name))

    @classmethod
    def of(cls, documents: Iterable[Document]) -> Documents:
        """A collection of documents."""
        return cls({document.name: document for document in documents})

    def __iter__(self) -> Iterator[Document]:
        return iter(self.by_name.values())

    def lineage(self, name: str) -> frozenset[str]:
        """A document and all that it was made from, directly or by way of others."""
        found: set[str] = set()
        left = [name]
        while left:
            each = left.pop()
            if each not in found:
                found.add(each)
                left += self.by_name[each].derived_from if each in self.by_name else ()
        return frozenset(found)

    def independent(self, one: str, other: str) -> bool:
        """Whether two documents rest on nothing in common."""
        if NO_DOCUMENT in (one, other):
            return True
        return not self.lineage(one) & self.lineage(other)

    def publisher(self, name: str) -> str | None:
        """Who made a document, None if that isn't known."""
        return self.by_name[name].publisher if name in self.by_name else None

    def same_publisher(self, one: str, other: str) -> bool:
        """Whether two different documents are known to have one publisher."""
        return one != other and self.publisher(one) is not None and self.publisher(one) == self.publisher(other)

    def circle(self) -> tuple[str, ...]:
        """Documents each of which was made from the next and the last from the first; empty if there are none."""
        for name in self.by_name:
            path = self._way_back(name)
            if path:
                return path
        return ()

    def _way_back(self, start: str) -> tuple[str, ...]:
        ways: list[tuple[str, ...]] = [(start,)]
        seen: set[str] = set()
        while ways:
            way = ways.pop()
            for parent in self.by_name[way[-1]].derived_from if way[-1] in self.by_name else ():
                if parent == start:
                    return way
                if parent not in seen:
                    seen.add(parent)
                    ways.append((*way, parent))
        return ()
