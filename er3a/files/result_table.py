"""Tables of results for pandas."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from er3a.errors import InputError


def load_table(path: str | Path) -> pd.DataFrame:
    """A table of results, such as ``results/er3_600/validation/checks.parquet``, as it was written.

    Returns
    -------
    frame : ``frame.attrs["columns"]`` has unit and meaning of each column by its name

    Raises
    ------
    InputError
        naming the file that is missing, or none of er3a's tables
    """
    remedy = "Give a .parquet file of a study's results"
    try:
        stored = pq.ParquetFile(pa.BufferReader(Path(path).read_bytes())).read()
    except OSError as error:
        raise InputError(path, None, error.strerror or str(error), remedy) from None
    except ValueError:
        raise InputError(path, None, "this is no Parquet file", remedy) from None
    columns = {part.name: {k.decode(): v.decode() for k, v in (part.metadata or {}).items()} for part in stored.schema}
    if not all({"unit", "meaning"} <= set(described) for described in columns.values()):
        raise InputError(path, None, "its columns don't say unit and meaning", remedy)
    frame = stored.to_pandas()
    frame.attrs["columns"] = columns
    return frame
