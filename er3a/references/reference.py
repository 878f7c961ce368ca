"""One checkable number from one source, and sets of them.

The documents of references and tables, and which of them are independent of each other.

A document that was made from another adds nothing to it. Two documents are independent if neither was made from the
other, directly or indirectly, and no third is the origin of both. Documents of one publisher count as different; that
they share the publisher is stated.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from graphlib import CycleError, TopologicalSorter
from itertools import combinations
from typing import Any, ClassVar, TypeVar

import numpy as np

from er3a.by_value import Displayed, ReadOnly, Sheet, frozen
from er3a.numerics.arrays import Reals
from er3a.references.quantities import NotOfArm, Pose, Quantity, Unit
from er3a.references.subjects import Subject
from er3a.robots.robot import AUTHORITATIVE_GRADES, Grade

NO_DOCUMENT = "none"
"""The origin of a value that rests on no document."""


@frozen
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


@frozen
class Documents:
    """Documents by name. Any other name is a separate document, made from no other."""

    by_name: Mapping[str, Document] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "by_name", ReadOnly(self.by_name))

    @classmethod
    def of(cls, documents: Iterable[Document]) -> Documents:
        """A collection of documents.

        Parameters
        ----------
        documents : with different names

        Returns
        -------
        collection : by name
        """
        return cls({document.name: document for document in documents})

    def __iter__(self) -> Iterator[Document]:
        return iter(self.by_name.values())

    def lineage(self, name: str) -> frozenset[str]:
        """A document and all that it was made from, directly or through others.

        Parameters
        ----------
        name : of a document; an unknown one was made from no other

        Returns
        -------
        names : the document's own included
        """
        found: set[str] = set()
        left = [name]
        while left:
            each = left.pop()
            if each not in found:
                found.add(each)
                left += self.by_name[each].derived_from if each in self.by_name else ()
        return frozenset(found)

    def independent(self, one: str, other: str) -> bool:
        """Whether two documents rest on nothing in common.

        Parameters
        ----------
        one, other : names; ``NO_DOCUMENT`` is independent of all

        Returns
        -------
        independent : False for a document and itself
        """
        if NO_DOCUMENT in (one, other):
            return True
        return not self.lineage(one) & self.lineage(other)

    def publisher(self, name: str) -> str | None:
        """Who made a document.

        Parameters
        ----------
        name : of a document

        Returns
        -------
        publisher : None if that isn't known
        """
        return self.by_name[name].publisher if name in self.by_name else None

    def same_publisher(self, one: str, other: str) -> bool:
        """Whether two different documents are known to have one publisher.

        Parameters
        ----------
        one, other : names

        Returns
        -------
        same : False if a publisher is unknown, and for a document and itself
        """
        return one != other and self.publisher(one) is not None and self.publisher(one) == self.publisher(other)

    def circle(self) -> tuple[str, ...]:
        """A circle among the documents, each of which was made from the next and the last from the first.

        Returns
        -------
        names : of one circle; empty if there is none
        """
        try:
            TopologicalSorter({each.name: each.derived_from for each in self}).prepare()
        except CycleError as error:
            return tuple(error.args[1][:0:-1])
        return ()


INTERVAL_95 = 1.959963984540054  # standard deviations to either side of 95 % of a normal distribution


@frozen
class Reference:
    """A scalar that a source states.

    Attributes
    ----------
    subject : what it is about, as it is named in practice
    group : a key of :data:`er3a.references.rows.GROUPS`
    quantity : what it is about, as a model has it
    expected : in the quantity's unit; None where the source says that it gives no value
    uncertainty : half-width of the interval that the source leaves open, same unit
    origin : the document that it rests on; empty if none is named
    deviation : standard deviation, if that is what the source states; ``uncertainty`` is half of the 95 % interval then
    rounding : half of the last digit of each joint value of its pose, deg or mm; empty if these are exact, or once
        :func:`er3a.references.predict.with_rounding` has added what they leave open to the uncertainty
    """

    subject: Subject
    group: str
    quantity: Quantity
    expected: float | None
    uncertainty: float
    source: str
    grade: Grade
    origin: str = ""
    deviation: float | None = None
    rounding: Pose = ()

    @property
    def document(self) -> str:
        """What distinguishes its document from others: its origin, else its source."""
        return self.origin or self.source

    @property
    def unit(self) -> Unit:
        """mm, deg or deg/s."""
        return self.quantity.unit

    @property
    def is_authoritative(self) -> bool:
        """Whether a verdict may rest on it."""
        return self.grade in AUTHORITATIVE_GRADES


Scalar = tuple[Subject, str, Quantity, float | None, float]
"""Subject, group, quantity, expected value and uncertainty of a reference."""


@frozen
class Row(ABC):
    """What every row of a reference table has: its line in the file, its source, grade and document.

    ``gaussian``: its uncertainties are standard deviations, and not half-widths. ``rounding``: half of the last digit
    of each joint value, deg or mm; empty if these are exact.

    A kind of reference is a row class: ``kind`` is the name of its tables, and ``scalars`` splits
    a row into references. :data:`er3a.references.rows.KINDS` lists all kinds.
    """

    kind: ClassVar[str]
    line: int
    source: str
    grade: Grade
    origin: str = field(default="", kw_only=True)
    gaussian: bool = field(default=False, kw_only=True)
    rounding: Pose = field(default=(), kw_only=True)

    @abstractmethod
    def scalars(self) -> Iterator[Scalar]:
        """What the row states, number by number.

        Yields
        ------
        scalar : subject, group, quantity, expected value (None where the source gives none) and uncertainty, in the
            quantity's unit
        """

    def references(self) -> list[Reference]:
        """The references that the row states, with its source and grade.

        Returns
        -------
        references : in the order of :meth:`scalars`
        """
        return [self.reference(scalar) for scalar in self.scalars()]

    def reference(self, scalar: Scalar) -> Reference:
        """A number of the row as a reference, with the row's source, grade and document.

        Parameters
        ----------
        scalar : of :meth:`scalars`

        Returns
        -------
        reference : if the row is ``gaussian``, the uncertainty is 1.96 standard deviations
        """
        reference = Reference(*scalar, self.source, self.grade, self.origin, rounding=self.rounding)
        if not self.gaussian:
            return reference
        return replace(reference, uncertainty=INTERVAL_95 * reference.uncertainty, deviation=reference.uncertainty)


RowT = TypeVar("RowT", bound=Row)


@frozen
class ReferenceSet(Displayed):
    """All references of one folder.

    Attributes
    ----------
    name : the folder's name
    references : the scalars
    rows : the rows they come from, per kind
    documents : that their origins name
    set_aside : rows about what the arm does not have that the set was loaded for, with why
    """

    name: str
    references: tuple[Reference, ...]
    rows: Mapping[str, tuple[Row, ...]] = field(hash=False)
    documents: Documents = field(default_factory=Documents, hash=False)
    set_aside: tuple[tuple[Row, NotOfArm], ...] = field(default=(), hash=False)

    @property
    def checkable(self) -> tuple[Reference, ...]:
        """References that state a value."""
        return tuple(reference for reference in self.references if reference.expected is not None)

    def of(self, kind: type[RowT]) -> tuple[RowT, ...]:
        """The rows of a kind.

        Parameters
        ----------
        kind : a row class

        Returns
        -------
        rows : in the order of the file; empty if the set has no such table
        """
        return tuple(row for row in self.rows.get(kind.kind, ()) if isinstance(row, kind))

    def sheet(self) -> Sheet:
        """How many numbers each group has, and by which grades, for printing.

        Returns
        -------
        sheet : a row for each group, in alphabetical order
        """
        rows = (
            (group, len(own), tuple(sorted({each.grade for each in own})))
            for group in sorted({each.group for each in self.references})
            for own in [[each for each in self.references if each.group == group]]
        )
        heading = f"Reference set {self.name}: {len(self.references)} numbers, {len(self.checkable)} to check against"
        return Sheet.of_table(heading, ("group", "numbers", "grades"), rows)


def quantities_of(references: Iterable[Reference]) -> tuple[Quantity, ...]:
    """What references are about.

    Parameters
    ----------
    references : n of them

    Returns
    -------
    quantities : n, in the same order
    """
    return tuple(reference.quantity for reference in references)


def expected_of(references: Sequence[Reference]) -> tuple[Reals, Reals]:
    """Expected values and uncertainties of references.

    Parameters
    ----------
    references : n of them that state a value

    Returns
    -------
    expected, uncertainty : (n,) each, in the quantities' units
    """
    expected: list[Any] = [reference.expected for reference in references]
    return np.array(expected), np.array([reference.uncertainty for reference in references])


def vectors_of(references: Sequence[Reference]) -> list[tuple[int, ...]]:
    """Group the coordinates of one vector from one source: their differences add up to a distance.

    Parameters
    ----------
    references : n of them

    Returns
    -------
    vectors : for each the places (from 0) of its references; a number that is no coordinate is alone
    """
    found: dict[Any, list[int]] = {}
    for place, reference in enumerate(references):
        found.setdefault((reference.source, reference.quantity.vector), []).append(place)
    return [tuple(places) for places in found.values()]


def lengths_of(values: Reals, vectors: Sequence[tuple[int, ...]]) -> Reals:
    """Lengths of vectors from their coordinates.

    Parameters
    ----------
    values : (..., n), coordinates, in the unit of each
    vectors : m groups of places, of :func:`vectors_of`

    Returns
    -------
    lengths : (..., m), in the unit of the coordinates
    """
    squares = [(values[..., list(places)] ** 2).sum(axis=-1) for places in vectors]
    lengths: Reals = np.sqrt(np.stack(squares, axis=-1))
    return lengths


def conflicts(references: Sequence[Reference]) -> list[tuple[int, int]]:
    """Pairs of references about the same quantity that no value can meet both of.

    Parameters
    ----------
    references : without those that state no value, and those whose poses are rounded as long as what that leaves open
        is unknown

    Returns
    -------
    pairs : (i, j) with i < j, ordered by j: the two statements differ by more than the sum of their uncertainties
    """
    about: dict[Quantity, list[tuple[int, float]]] = {}
    for i, reference in enumerate(references):
        if reference.expected is not None and not reference.rounding:
            about.setdefault(reference.quantity, []).append((i, reference.expected))
    pairs = []
    for (i, stated), (j, other_stated) in (pair for same in about.values() for pair in combinations(same, 2)):
        first, second = references[i], references[j]
        apart = first.quantity.apart(stated, second.quantity, other_stated)
        if apart > first.uncertainty + second.uncertainty:
            pairs.append((i, j))
    return sorted(pairs, key=lambda pair: pair[::-1])
