"""Tables of results as Parquet files. The only module of the pipeline that imports PyArrow."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

ROWS_AT_ONCE = 1 << 15  # all texts of a million rows would take a hundred MB


class Kept(Protocol):
    """What a file has to know of a column (``er3a.pipeline.tables.Column``)."""

    @property
    def dtype(self) -> np.dtype:
        """Type of the values; ``object`` for texts."""
        ...

    @property
    def lists(self) -> bool:
        """Whether each row holds a list of real numbers."""
        ...


def write_columns(file: Path, columns: Sequence[tuple[str, NDArray[Any], Kept, dict[str, str]]]) -> None:
    """Write columns to a file; equal ones give equal bytes.

    Parameters
    ----------
    file : which is replaced
    columns : name, values, what it holds, and unit and meaning, of each
    """
    schema = pa.schema([pa.field(name, _arrow_type(spec), metadata=described) for name, _, spec, described in columns])
    with pq.ParquetWriter(file, schema, compression="zstd") as out:
        for start in range(0, max(len(columns[0][1]), 1), ROWS_AT_ONCE):
            arrays = [_arrow(values[start : start + ROWS_AT_ONCE], spec) for _, values, spec, _ in columns]
            out.write_table(pa.Table.from_arrays(arrays, schema=schema))


class ParquetColumns:
    """The columns of a file.

    Parameters
    ----------
    content : of the file
    """

    def __init__(self, content: bytes) -> None:
        self._file = pq.ParquetFile(pa.BufferReader(content))
        self.names: list[str] = self._file.schema_arrow.names

    def values(self, name: str, spec: Kept) -> Any:
        """A column's values; its own ``to_numpy`` would load pandas.

        Parameters
        ----------
        name : of the column
        spec : what it holds

        Returns
        -------
        values : an array, or a tuple with what each row has
        """
        if spec.dtype != object and spec.dtype != bool and not spec.lists:
            return np.array(np.from_dlpack(self._file.read([name])[0].combine_chunks()))
        parts = (batch[0].to_pylist() for batch in self._file.iter_batches(columns=[name]))
        if spec.lists:
            return tuple(np.array(row) for part in parts for row in part)
        kept: dict[Any, Any] = {}  # one object for equal texts: a few of them fill a million rows
        return tuple(kept.setdefault(each, each) for part in parts for each in part)


def _arrow_type(spec: Kept) -> pa.DataType:
    """How a column is kept in the file."""
    if spec.lists:
        return pa.list_(pa.float64())
    return pa.string() if spec.dtype == object else pa.from_numpy_dtype(spec.dtype)


def _arrow(values: NDArray[Any], spec: Kept) -> pa.Array:
    """A column for a file, as it lies in memory: ``pa.array`` would load pandas, a quarter of a second in each job."""
    kind = _arrow_type(spec)
    if spec.lists:
        items = pa.py_buffer(np.concatenate([np.empty(0), *values]))
        whole = pa.Array.from_buffers(pa.float64(), items.size // 8, [None, items])
        return pa.Array.from_buffers(kind, len(values), [None, _ends(map(len, values))], children=[whole])
    if spec.dtype == object:
        there = np.array([text is not None for text in values], bool)
        texts = [(text or "").encode() for text in values]
        marks = None if there.all() else _bits(there)
        return pa.Array.from_buffers(kind, len(texts), [marks, _ends(map(len, texts)), pa.py_buffer(b"".join(texts))])
    return pa.Array.from_buffers(
        kind, len(values), [None, _bits(values) if spec.dtype == bool else pa.py_buffer(np.ascontiguousarray(values))]
    )


def _bits(flags: NDArray[Any]) -> pa.Buffer:
    return pa.py_buffer(np.packbits(flags, bitorder="little"))


def _ends(lengths: Iterable[int]) -> pa.Buffer:
    """Where rows of different lengths begin, and the last ends, in the values of all of them."""
    return pa.py_buffer(np.cumsum([0, *lengths]).astype(np.int32))
