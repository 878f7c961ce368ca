"""Result files: written whole or not at all, with equal bytes for equal inputs."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from er3a.code_digest import code_digest
from er3a.errors import ResultError
from er3a.study import Study

FORMAT_VERSION = 1

Status = Literal["pass", "caution", "fail", "no_reference"]


@dataclass(frozen=True)
class Verdict:
    """A stage's answer in one sentence.

    Attributes
    ----------
    status : pass, caution (usable, with something to know), fail, or no_reference (nothing to check against)
    code : stable identifier of the sentence; params : the values in it
    text : the sentence in English
    """

    status: Status
    code: str
    text: str
    params: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Figure:
    """A key figure; ``uncertainty`` is the half-width of its 95 % interval in the same unit, None where it has none."""

    name: str
    value: float | int | None
    unit: str
    uncertainty: float | None = None


def write_atomically(path: Path, write: Callable[[Path], None]) -> None:
    """Call ``write`` with a temporary path beside ``path``, then move the finished file into place."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        write(temporary)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_table(path: Path, table: pd.DataFrame) -> None:
    """Write a Parquet file (units stand in the column names)."""
    arrow = pa.Table.from_pandas(table, preserve_index=False).replace_schema_metadata(None)
    write_atomically(path, lambda file: pq.write_table(arrow, file, compression="zstd"))


def read_table(path: Path) -> pd.DataFrame:
    """Read a Parquet file of ours, or raise :class:`ResultError`."""
    try:
        return pq.read_table(path, partitioning=None).to_pandas()
    except FileNotFoundError:
        raise ResultError(path, "missing") from None
    except (OSError, pa.ArrowException) as error:
        raise ResultError(path, f"damaged ({' '.join(str(error).split())})") from None


def write_summary(
    folder: Path,
    study: Study,
    robot: str,
    stage: str,
    verdict: Verdict,
    figures: Iterable[Figure],
    **stage_keys: Any,
) -> None:
    """Write ``summary.json``: the shape shared by all stages, then the stage's own keys (plain data)."""
    summary = {
        "format_version": FORMAT_VERSION,
        "robot": robot,
        "stage": stage,
        "verdict": asdict(verdict),
        "figures": [asdict(figure) for figure in figures],
        **stage_keys,
        "provenance": {
            "inputs": input_records(study.inputs(robot, stage)),
            "config": study.settings(robot, stage),
            "seed": study.seed,
            "code": code_digest(f"er3a.stages.{stage}.compute"),
        },
    }
    text = json.dumps(summary, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    write_atomically(folder / "summary.json", lambda file: file.write_text(text, encoding="utf-8"))


def read_summary(folder: Path) -> dict[str, Any]:
    """Read a stage's ``summary.json``, or raise :class:`ResultError` if missing, damaged or of another version."""
    path = folder / "summary.json"
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ResultError(path, "missing") from None
    except (ValueError, OSError) as error:
        raise ResultError(path, f"damaged ({error})") from None
    version = summary.get("format_version") if isinstance(summary, dict) else None
    if version != FORMAT_VERSION:
        raise ResultError(path, f"format version {version}, this er3a reads {FORMAT_VERSION}")
    for key in ("robot", "stage", "verdict", "figures", "provenance"):
        if key not in summary:
            raise ResultError(path, f"damaged (no '{key}' in it)")
    return summary


def input_records(files: Iterable[Path]) -> list[dict[str, str]]:
    """What provenance says of input files: path from the project's root, and checksum."""
    return [{"path": _shown_path(file), "sha256": sha256(file)} for file in files]


def sha256(path: Path) -> str:
    """Checksum of a file, in hex."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def _shown_path(path: Path) -> str:
    """Path from the project's root, so that the summary names no machine."""
    root = Path(__file__).resolve().parents[1]
    resolved = Path(path).resolve()
    return resolved.relative_to(root).as_posix() if resolved.is_relative_to(root) else resolved.name
