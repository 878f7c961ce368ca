"""Tables of results as Parquet files. The only module of the pipeline that imports PyArrow."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray


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
    schema = [pa.field(name, _arrow_type(spec), metadata=described) for name, _, spec, described in columns]
    arrays = [_arrow(values, spec) for _, values, spec, _ in columns]
    pq.write_table(pa.Table.from_arrays(arrays, schema=pa.schema(schema)), file, compression="zstd")


class ParquetColumns:
    """The columns of a file.

    Parameters
    ----------
    content : of the file
    """

    def __init__(self, content: bytes) -> None:
        self._stored = pq.ParquetFile(pa.BufferReader(content)).read()
        self.names: list[str] = self._stored.column_names

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
        whole = self._stored[name].combine_chunks()
        if pa.types.is_integer(whole.type) or pa.types.is_floating(whole.type):
            return np.array(np.from_dlpack(whole))
        rows = whole.to_pylist()
        return tuple(map(np.array, rows) if spec.lists else rows)


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
