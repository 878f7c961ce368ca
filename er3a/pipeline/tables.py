"""Tables of results: typed columns with unit and meaning, kept as Parquet.

A table is a frozen dataclass of equally long arrays, made from arrays, sequences, and texts or numbers that stand in
every row::

    class Samples(Table):
        path: Texts = column("name of the path")
        t_s: Reals = column("time since the path's start")
        q_deg: Reals = per_joint("joint angle")
        point_mm: Reals = vector("{}_mm", "tool point in the base frame")

``q_deg`` is (rows, n) and written as ``q1_deg ... qn_deg`` (of prismatic joints ``q3_mm``, in mm), ``point_mm`` (rows,
3) as ``x_mm, y_mm, z_mm``. Unit and meaning are stored in the file. The unit is the name's ending
(:mod:`er3a.numerics.si_units`) unless a column states another; the annotation gives the type of the values. A column of
findings is written as JSON texts, with each finding's code and parameters.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, fields, replace
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Self, dataclass_transform, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from er3a.by_value import ByValue, frozen
from er3a.finding import plain, revived
from er3a.numerics.si_units import filled, split_unit, unit_text

Texts = NDArray[np.object_]
Findings = NDArray[np.object_]


@frozen
class Column:
    """What a column, or a group of columns with one array, holds.

    Attributes
    ----------
    pattern : name in the file; with ``{}`` for a group: what replaces it is in ``parts``, or counts from 1
    coded : whether it holds findings
    lists : whether each row holds a list of real numbers
    heading : what it is called at an axis or over a table, in few words; empty where the meaning serves
    """

    pattern: str
    meaning: str
    unit: str
    dtype: np.dtype
    parts: tuple[str, ...] | None = None
    coded: bool = False
    lists: bool = False
    heading: str = ""

    @property
    def is_group(self) -> bool:
        """Whether the array has two dimensions and each column of it a name of its own."""
        return "{}" in self.pattern

    def names(self, width: int, slides: tuple[bool, ...] = ()) -> list[str]:
        """Names of the column in the file.

        Parameters
        ----------
        width : how many columns a group has
        slides : marks prismatic joints, whose values are distances

        Returns
        -------
        names : one, or as many as the group has, such as ``q1_deg``, ``q2_deg``, ``q3_mm``
        """
        if not self.is_group:
            return [self.pattern]
        if self.parts or not any(slides):
            return [self.pattern.format(part) for part in self.parts or range(1, width + 1)]
        return [(self.in_mm if slides[k] else self.pattern).format(k + 1) for k in range(width)]

    @property
    def in_mm(self) -> str:
        """The name's pattern where the joint is a distance."""
        return self.pattern.replace("_deg", "_mm")

    def found_in(self, names: Iterable[str]) -> list[str]:
        """Those names of a file that belong to this column.

        Parameters
        ----------
        names : of all columns of the file

        Returns
        -------
        names : in order of their numbers, with deg or mm for a group of joints; none if the file lacks the column
        """
        present = set(names)
        if not self.is_group or self.parts:
            return [name for name in self.names(0) if name in present]
        both = "|".join(re.escape(each).replace(r"\{\}", r"\d+") for each in (self.pattern, self.in_mm))
        pattern = re.compile(rf"(?=\D*(\d+))(?:{both})")
        numbered = {int(match[1]): name for name in present if (match := pattern.fullmatch(name))}
        return [numbered[number] for number in sorted(numbered)]


def column(meaning: str, unit: str = "", *, name: str = "", heading: str = "") -> Any:
    """Declare a column of one value per row.

    Parameters
    ----------
    meaning : for the dictionary of results
    unit : where the name's ending does not say it
    name : in the file; by default the attribute's
    heading : at an axis of a figure; by default the meaning
    """
    return _declared(name, meaning, unit, heading=heading)


def findings(meaning: str) -> Any:
    """Declare a column of findings, or None, which is kept as JSON texts.

    Parameters
    ----------
    meaning : for the dictionary of results
    """
    return _declared("", meaning, coded=True)


def per_joint(meaning: str, unit: str = "", *, name: str = "", heading: str = "") -> Any:
    """Declare one column for each joint, (rows, n): ``q_deg`` is written as ``q1_deg ... qn_deg``.

    Parameters
    ----------
    meaning : for the dictionary of results
    unit : where the name's ending does not say it
    name : in the file, if it is not the attribute's
    heading : at an axis of a figure; by default the meaning
    """
    return _declared(_numbered(name) if name else PER_JOINT, meaning, unit, heading=heading)


def vector(pattern: str, meaning: str, unit: str = "", *, parts: Iterable[str] = "xyz") -> Any:
    """Declare columns that belong together, (rows, len(parts)).

    Parameters
    ----------
    pattern : of the names in the file; ``"{}_mm"`` is written as ``x_mm, y_mm, z_mm``
    meaning : for the dictionary of results
    parts : what replaces ``{}``
    """
    return _declared(pattern, meaning, unit, parts=tuple(parts))


def lists(meaning: str, unit: str = "") -> Any:
    """Declare a column with a list of real numbers in each row.

    Parameters
    ----------
    meaning : for the dictionary of results
    unit : of the numbers, where the name's ending does not say it
    """
    return _declared("", meaning, unit, lists=True)


def _declared(pattern: str, meaning: str, unit: str = "", **more: Any) -> Any:
    return field(metadata={"column": Column(pattern, meaning, unit, np.dtype(object), **more)})


PER_JOINT = "{}"
"""In place of a pattern until the attribute's name is known."""


@cache
def _columns(table: type[Table]) -> dict[str, Column]:
    """The columns of a table by attribute, with what follows from the attribute's name and annotation."""
    hints, found = get_type_hints(table), {}
    for each in fields(table):
        spec: Column = each.metadata["column"]
        of_joints = spec.pattern == PER_JOINT and not spec.parts
        pattern = _numbered(each.name) if of_joints else spec.pattern or each.name
        last = get_args(hints[each.name])[-1]  # numpy before 2.5: the dtype of the numbers; since then their type
        numbers = last if isinstance(last, type) else get_args(last)[0]
        found[each.name] = replace(spec, pattern=pattern, unit=spec.unit or unit_text(pattern), dtype=np.dtype(numbers))
    return found


def _numbered(name: str) -> str:
    stem, unit = split_unit(name)
    return f"{stem}{{}}_{unit}" if unit else f"{stem}{{}}"


@dataclass_transform(frozen_default=True, eq_default=False)
@frozen
class Table(ByValue):
    """Base of all tables, which makes frozen dataclasses of its subclasses; see the module."""

    joints: ClassVar[int] = 6
    """Columns of a group that counts joints, in a table without rows."""
    slides: ClassVar[tuple[bool, ...]] = ()
    """Which joints are distances, whose columns are in mm; of a table of its own by :meth:`of_joints`."""

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, eq=False)(cls)

    def __post_init__(self) -> None:
        arrays = {name: _array(getattr(self, name), spec) for name, spec in self.columns().items()}
        lengths = {name: len(array) for name, array in arrays.items() if array.ndim}
        if len(set(lengths.values())) != 1:
            raise ValueError(f"{type(self).__name__}: columns of different lengths: {lengths}")
        for name, spec in self.columns().items():
            array = arrays[name] if arrays[name].ndim else np.full(lengths[min(lengths)], arrays[name][()], spec.dtype)
            if array.ndim != (2 if spec.is_group else 1):
                raise ValueError(f"{type(self).__name__}.{name} has shape {array.shape}")
            object.__setattr__(self, name, array)

    def of_joints(self, slides: Iterable[bool]) -> Self:
        """The same table, of an arm some of whose joints are prismatic.

        Parameters
        ----------
        slides : (n,), whether each joint slides; its columns are then named and written in mm

        Returns
        -------
        table : one without rows gets n columns per joint group
        """
        flags = tuple(bool(each) for each in slides)
        groups = {name for name, spec in self.columns().items() if spec.is_group and not spec.parts}
        if len(self) or not groups:
            found = replace(self)
        else:
            empty = {name: np.empty((0, len(flags)), self.columns()[name].dtype) for name in groups}
            found = replace(self, **empty)
        # The table is frozen, and the flags are no column: they only decide names and units in the file.
        if any(flags):
            object.__setattr__(found, "slides", flags)
        return found

    def __eq__(self, other: object) -> bool:
        equal = super().__eq__(other)
        return equal if equal is NotImplemented or not equal else self.slides == other.slides  # type: ignore[attr-defined]

    __hash__ = ByValue.__hash__

    @classmethod
    def columns(cls) -> dict[str, Column]:
        """The columns by attribute."""
        return _columns(cls)  # type: ignore[arg-type]  # a class can be hashed

    @classmethod
    def empty(cls) -> Self:
        """A table without rows."""
        shapes = {
            name: (0, len(spec.parts or range(cls.joints))) if spec.is_group else (0,)
            for name, spec in cls.columns().items()
        }
        return cls(**{name: np.empty(shape, cls.columns()[name].dtype) for name, shape in shapes.items()})

    @classmethod
    def stacked(cls, tables: Iterable[Self]) -> Self:
        """The rows of several tables, one after another.

        Parameters
        ----------
        tables : with equally many joints

        Returns
        -------
        table : without rows if there are none; which joints slide is not taken over (:meth:`of_joints`)
        """
        parts = list(tables)
        if not parts:
            return cls.empty()
        return cls(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in cls.columns()})

    @classmethod
    def of(cls, found: object = None, /, **given: Any) -> Self:
        """A table filled with what the library found, as :func:`er3a.numerics.si_units.stated` fills a dataclass."""
        return cls(**filled(cls, found, given))

    @classmethod
    def of_rows(cls, rows: Iterable[tuple[Any, ...]]) -> Self:
        """A table from rows.

        Parameters
        ----------
        rows : each with the values in the order of the attributes

        Returns
        -------
        table : without rows if there are none
        """
        listed = list(rows)
        return cls(**dict(zip(cls.columns(), zip(*listed)))) if listed else cls.empty()

    def __len__(self) -> int:
        return len(getattr(self, fields(self)[0].name))

    def take(self, rows: NDArray[Any]) -> Self:
        """Some rows of the table.

        Parameters
        ----------
        rows : a mask (rows,), or row numbers

        Returns
        -------
        table : of the same arm
        """
        taken = type(self)(**{name: getattr(self, name)[rows] for name in self.columns()})
        if self.slides:
            object.__setattr__(taken, "slides", self.slides)
        return taken

    def _described(self, name: str, spec: Column) -> dict[str, str]:
        """Unit and meaning of a column of the file."""
        unit = spec.unit.replace("deg", "mm") if self.slides and name not in spec.names(len(name)) else spec.unit
        return {"unit": unit, "meaning": spec.meaning}

    def _flat(self) -> Iterator[tuple[str, NDArray[Any], Column]]:
        for name, spec in self.columns().items():
            array = getattr(self, name)
            parts = array.T if spec.is_group else [array]
            for part_name, part in zip(spec.names(len(parts), self.slides), parts):
                yield part_name, _coded(part) if spec.coded else part, spec

    def write(self, file: Path) -> None:
        """Write a Parquet file, with unit and meaning of each column; equal tables give equal bytes.

        Parameters
        ----------
        file : which is replaced
        """
        from er3a.pipeline.parquet import write_columns

        write_columns(file, [(name, values, spec, self._described(name, spec)) for name, values, spec in self._flat()])

    @classmethod
    def read(cls, content: bytes) -> Self:
        """Read what :meth:`write` wrote.

        Parameters
        ----------
        content : of a Parquet file; columns that the table does not declare are passed over

        Raises
        ------
        KeyError
            naming a column that is missing
        """
        from er3a.pipeline.parquet import ParquetColumns

        stored = ParquetColumns(content)
        arrays: dict[str, Any] = {}
        slides: tuple[bool, ...] = ()
        for name, spec in cls.columns().items():
            names = spec.found_in(stored.names)
            if spec.is_group and not spec.parts and any("_mm" in each for each in names):
                slides = tuple("_mm" in each for each in names)
            if not names or (spec.parts and len(names) != len(spec.parts)):
                raise KeyError(spec.pattern)
            parts = [_array(stored.values(part, spec), replace(spec, pattern="")) for part in names]
            arrays[name] = np.stack(parts, axis=1).astype(spec.dtype) if spec.is_group else parts[0]
            if spec.coded:
                arrays[name] = [*map(cache(_decoded), parts[0])]
        found = cls(**arrays)
        if slides:
            object.__setattr__(found, "slides", slides)
        return found


def _array(values: Any, spec: Column) -> NDArray[Any]:
    """A column from an array, a sequence, or one value for every row."""
    if spec.dtype != object or spec.is_group or not isinstance(values, list | tuple):
        return np.asarray(values, spec.dtype)
    array = np.empty(len(values), object)
    array[:] = values
    return array


def _coded(findings: NDArray[Any]) -> NDArray[Any]:
    """Findings (rows,) as text: code first, then parameters; one that is in many rows is written out once."""
    texts: dict[int, str | None] = {id(None): None}
    for finding in findings:
        if id(finding) not in texts:
            texts[id(finding)] = json.dumps(plain(finding), ensure_ascii=False)
    return np.array([texts[id(finding)] for finding in findings], object)


def _decoded(text: str | None) -> Any:
    return None if text is None else revived(json.loads(text))


@cache
def adapter(kind: Any) -> TypeAdapter[Any]:
    """What checks and reads values of a type, made once.

    Parameters
    ----------
    kind : a type, or a union of types, that pydantic knows

    Returns
    -------
    adapter : the same object for the same type
    """
    return TypeAdapter(kind)


def table_types(results: type) -> dict[str, type[Table]]:
    """The tables of a stage's results.

    Parameters
    ----------
    results : the stage's class of results

    Returns
    -------
    types : by attribute, which is the name of their file
    """
    hints = get_type_hints(results)
    return {name: hint for name, hint in hints.items() if isinstance(hint, type) and issubclass(hint, Table)}
