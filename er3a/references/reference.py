"""One checkable number from one source, and sets of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from er3a.files.reference_rows import AxisRow, PositionRow, Row
from er3a.pipeline.messages.language import N_
from er3a.references.quantities import Quantity
from er3a.robots.robot import WEIGHTY_GRADES, Grade

GROUPS = (
    N_("zero pose"),
    N_("axes"),
    N_("key poses"),
    N_("reach"),
    N_("envelope"),
    N_("limits"),
    N_("speeds"),
)


@dataclass(frozen=True)
class Reference:
    """A scalar that a source states.

    Attributes
    ----------
    name : for people
    group : one of ``GROUPS``
    quantity : what it is about
    expected : in the quantity's unit; None where the source says that it gives no value
    uncertainty : half-width of the interval that the source leaves open, same unit
    """

    name: str
    group: str
    quantity: Quantity
    expected: float | None
    uncertainty: float
    source: str
    grade: Grade

    @property
    def unit(self) -> str:
        """mm, deg or deg/s."""
        return self.quantity.unit

    @property
    def weighty(self) -> bool:
        """Whether a verdict may rest on it."""
        return self.grade in WEIGHTY_GRADES


@dataclass(frozen=True)
class ReferenceSet:
    """All references of one folder.

    Attributes
    ----------
    name : the folder's name
    references : the scalars
    rows : the rows they come from, per kind (file stem)
    """

    name: str
    references: tuple[Reference, ...]
    rows: dict[str, tuple[Row, ...]] = field(hash=False)

    @property
    def checkable(self) -> tuple[Reference, ...]:
        """References that state a value."""
        return tuple(reference for reference in self.references if reference.expected is not None)

    @property
    def axes(self) -> tuple[AxisRow, ...]:
        """Axis lines, for drawing."""
        return self.rows.get("axes", ())

    @property
    def positions(self) -> tuple[PositionRow, ...]:
        """Key poses, for drawing."""
        return self.rows.get("positions", ())


def expected_of(references: tuple[Reference, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Expected values and uncertainties, (n,) each, of references that state a value."""
    return np.array([r.expected for r in references]), np.array([r.uncertainty for r in references])


def vectors_of(references: tuple[Reference, ...]) -> tuple[np.ndarray, list[str]]:
    """Coordinates of one vector from one source belong together: their differences add up to a distance.

    Returns
    -------
    group : (n,), number of the vector that each reference belongs to; numbers count up from 0
    unit : of each vector
    """
    keys = [(reference.source, reference.quantity.vector) for reference in references]
    number = {key: i for i, key in enumerate(dict.fromkeys(keys))}
    unit = dict(zip(keys, (reference.unit for reference in references)))
    return np.array([number[key] for key in keys]), [unit[key] for key in number]


def lengths_of(values: np.ndarray, group: np.ndarray) -> np.ndarray:
    """Length of each vector (..., m) of coordinates (..., n) that :func:`vectors_of` has put together."""
    return np.sqrt(np.stack([(values[..., group == i] ** 2).sum(axis=-1) for i in range(group.max() + 1)], axis=-1))


def conflicts(references: tuple[Reference, ...]) -> list[tuple[int, int]]:
    """Pairs (i, j), i < j, of references about the same quantity that no value can meet both of."""
    about: dict[Quantity, list[int]] = {}
    for i, reference in enumerate(references):
        if reference.expected is not None:
            about.setdefault(reference.quantity, []).append(i)
    pairs = []
    for i, j in (pair for same in about.values() for pair in combinations(same, 2)):
        first, second = references[i], references[j]
        apart = first.quantity.apart(first.expected, second.quantity, second.expected)
        if apart > first.uncertainty + second.uncertainty:
            pairs.append((i, j))
    return sorted(pairs, key=lambda pair: pair[::-1])
