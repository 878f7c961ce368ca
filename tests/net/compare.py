"""A net under the move to typed results: every number of the default study is the same, bit for bit.

    python tests/net/compare.py freeze RESULTS     write frozen.json.gz from a results folder
    python tests/net/compare.py check RESULTS      hold a results folder against it

Imports no er3a. ``frozen.json.gz`` holds, for the results before the move, a checksum per table column and every
number of every summary. ``names/*.json`` map old names to new ones, per stage: ``columns`` from ``table.column`` to
``table.column``; ``paths`` a list of [pattern, replacement] (regular expressions over a summary's paths such as
``figures[2].value``, the first that matches the whole path is taken; null as replacement: the number is no longer
stored, with the reason in ``gone``). Columns of text are compared up to renaming: the same text before is the same
text now, and the other way round. ``changed`` names what is different on purpose, with the reason.
"""

from __future__ import annotations

import gzip
import hashlib
import json
import re
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

HERE = Path(__file__).parent
FROZEN = HERE / "frozen.json.gz"
STAGES = ("validation", "workspace", "inverse", "trajectory")


def column_digest(column) -> str:
    """Kind of a column, its length, and a checksum of its values' bits."""
    if hasattr(column.type, "value_type"):
        column = column.combine_chunks().flatten()
    values = column.to_numpy()
    if values.dtype.kind == "f":
        values = np.where(np.isnan(values), np.array(np.nan, values.dtype), values)
        kind = str(values.dtype)
    elif values.dtype.kind in "iu":
        values, kind = values.astype(np.int64), "integer"
    elif values.dtype.kind == "b":
        values, kind = values.astype(np.uint8), "truth"
    else:
        seen: dict = {}
        codes = [-1 if value is None or value != value else seen.setdefault(str(value), len(seen)) for value in values]
        values, kind = np.array(codes, dtype=np.int64), "text"
    digest = hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()[:24]
    return f"{kind}:{len(values)}:{digest}"


def numbers(data, path: str = ""):
    """Every number and truth value in nested plain data, with its path."""
    if isinstance(data, bool | int | float):
        yield path, data
    elif isinstance(data, dict):
        for key, value in data.items():
            yield from numbers(value, f"{path}.{key}" if path else key)
    elif isinstance(data, list):
        for index, value in enumerate(data):
            yield from numbers(value, f"{path}[{index}]")


def observed(results: Path) -> dict:
    """What a results folder holds, by robot and stage."""
    found = {}
    for summary in sorted(results.glob("*/*/summary.json")):
        folder = summary.parent
        content = json.loads(summary.read_text(encoding="utf-8"))
        for key in ("provenance", "sentences", "format_version"):
            content.pop(key, None)
        tables = {}
        for file in sorted(folder.glob("*.parquet")):
            table = pq.read_table(file)
            tables |= {f"{file.stem}.{name}": column_digest(table[name]) for name in table.column_names}
        found[f"{folder.parent.name}/{folder.name}"] = {"numbers": dict(numbers(content)), "columns": tables}
    return found


def freeze(results: Path) -> None:
    text = json.dumps(observed(results), indent=0, sort_keys=True)
    FROZEN.write_bytes(gzip.compress(text.encode(), mtime=0))


def renamed(path: str, rules: list) -> str | None:
    for pattern, replacement in rules:
        if match := re.fullmatch(pattern, path):
            return None if replacement is None else match.expand(replacement)
    return path


def differences(old: dict, new: dict, names: dict) -> list[str]:
    """What is not the same in one stage of one robot."""
    found = []
    columns, gone = names.get("columns", {}), names.get("gone", {})
    changed = [re.compile(pattern) for pattern in names.get("changed", {})]
    for column, digest in old["columns"].items():
        name = columns.get(column, column)
        if name is None or any(pattern.fullmatch(column) for pattern in changed):
            continue
        if name not in new["columns"]:
            found.append(f"column {column} -> {name}: missing")
        elif new["columns"][name] != digest:
            found.append(f"column {column} -> {name}: {digest} was, {new['columns'][name]} is")
    rules = [*([pattern, None] for pattern in gone), *names.get("paths", [])]
    for path, value in old["numbers"].items():
        name = renamed(path, rules)
        if name is None or any(pattern.fullmatch(path) for pattern in changed):
            continue
        if name not in new["numbers"]:
            found.append(f"number {path} -> {name}: missing (was {value!r})")
        elif repr(new["numbers"][name]) != repr(value) and float(new["numbers"][name]) != float(value):
            found.append(f"number {path} -> {name}: {value!r} was, {new['numbers'][name]!r} is")
    return found


def check(results: Path) -> int:
    frozen = json.loads(gzip.decompress(FROZEN.read_bytes()))
    found, now, counted = [], observed(results), 0
    for key, old in frozen.items():
        stage = key.split("/")[1]
        file = HERE / "names" / f"{stage}.json"
        names = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
        if key not in now:
            found.append(f"{key}: no results")
            continue
        own = differences(old, now[key], names)
        found += [f"{key}: {line}" for line in own]
        counted += len(old["columns"]) + len(old["numbers"])
    print(*found[:200], sep="\n")
    print(f"{counted} columns and numbers compared, {len(found)} differ")
    return 1 if found else 0


if __name__ == "__main__":
    verb, folder = sys.argv[1:]
    raise SystemExit(freeze(Path(folder)) if verb == "freeze" else check(Path(folder)))
