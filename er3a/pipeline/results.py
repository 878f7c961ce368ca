"""Result files: written whole or not at all, with equal bytes for equal inputs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from er3a.errors import ResultError
from er3a.files.grades import grades_in
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.kept_files import (  # noqa: F401
    half_written,
    read_bytes,
    read_checked,
    sha256,
    shown_path,
    write_atomically,
    write_checked,
)
from er3a.pipeline.messages import language
from er3a.pipeline.study import STAGES, Study

FORMAT_VERSION = 3
CHECKSUMS = "SHA256SUMS"

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


def write_table(path: Path, table: pd.DataFrame) -> None:
    """Write a Parquet file (units stand in the column names)."""
    for column in table.select_dtypes(["object", "string"]):
        language.note_written(table[column].tolist())
    arrow = pa.Table.from_pandas(table, preserve_index=False).replace_schema_metadata(None)
    write_atomically(path, lambda file: pq.write_table(arrow, file, compression="zstd"))


def read_table(path: Path) -> pd.DataFrame:
    """Read a Parquet file of ours, or raise :class:`ResultError`; its checksum is compared if there is one."""
    content = read_bytes(path)
    if (path.parent / CHECKSUMS).is_file():
        _compare(path, content, checksums(path.parent))
    try:
        return pq.read_table(pa.BufferReader(content)).to_pandas()
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
    """Write ``summary.json``: the shape shared by all stages, then the stage's own keys (plain data).

    It comes last: with it the checksums of all files in the folder are written.
    """
    summary = {
        "format_version": FORMAT_VERSION,
        "robot": robot,
        "stage": stage,
        "verdict": asdict(verdict),
        "figures": [asdict(figure) for figure in figures],
        **stage_keys,
        "provenance": {
            "inputs": input_records(study.inputs(robot, stage)),
            "config": study.computed_from(robot, stage),
            "seed": study.seed,
            "code": code_digest(f"er3a.pipeline.stages.{stage}.compute"),
        },
    }
    language.note_written(summary)
    summary["sentences"] = language.sentences()
    text = json.dumps(summary, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    write_atomically(folder / "summary.json", lambda file: file.write_text(text, encoding="utf-8"))
    write_checksums(folder)


def write_checksums(folder: Path) -> None:
    """Write the checksums of a stage's files, in the form that ``sha256sum --check`` reads."""
    files = sorted(path for path in folder.iterdir() if path.is_file() and path.name[0] != ".")
    sums = "".join(f"{sha256(path)}  {path.name}\n" for path in files if path.name != CHECKSUMS)
    write_atomically(folder / CHECKSUMS, lambda file: file.write_text(sums, encoding="utf-8"))


def read_summary(folder: Path) -> dict[str, Any]:
    """Read a stage's ``summary.json``, or raise :class:`ResultError` if missing, damaged or of another version."""
    path = folder / "summary.json"
    content = read_bytes(path)
    try:
        summary = json.loads(content)
    except ValueError as error:
        raise ResultError(path, f"damaged ({error})") from None
    version = summary.get("format_version") if isinstance(summary, dict) else None
    if version != FORMAT_VERSION:
        raise ResultError(path, f"format version {version}, this er3a reads {FORMAT_VERSION}")
    for key in ("robot", "stage", "verdict", "figures", "provenance", "sentences"):
        if key not in summary:
            raise ResultError(path, f"damaged (no '{key}' in it)")
    _compare(path, content, checksums(folder))
    language.know(summary["sentences"])
    return summary


def check_results(folder: Path) -> None:
    """Check that a stage's results are whole, unchanged and of this version.

    Raises
    ------
    ResultError
        naming the first file that is not
    """
    read_summary(folder)
    sums = checksums(folder)
    for name in sums:
        _compare(folder / name, read_bytes(folder / name), sums)


def checksums(folder: Path) -> dict[str, str]:
    """The checksums that a stage wrote, by file name; :class:`ResultError` if they can't be read."""
    path = folder / CHECKSUMS
    try:
        lines = read_bytes(path).decode("ascii").removesuffix("\n").split("\n")
        return {name: checksum for checksum, name in (line.split("  ") for line in lines)}
    except ValueError:
        raise ResultError(path, "damaged (no list of checksums)") from None


def _compare(path: Path, content: bytes, sums: dict[str, str]) -> None:
    if sums.get(path.name) != hashlib.sha256(content).hexdigest():
        raise ResultError(path, f"damaged (not the bytes that {CHECKSUMS} beside it tells of)")


def input_records(files: Iterable[Path]) -> list[dict[str, Any]]:
    """What provenance says of input files: path from the project's root, checksum, and the grades in them."""
    return [{"path": shown_path(file), "sha256": sha256(file), "grades": grades_in(file)} for file in files]


def result_records(results: Path, robots: Iterable[str]) -> list[dict[str, Any]]:
    """What provenance says of the results of robots: their lists of checksums, and the checksum of each."""
    files = [results / robot / stage / CHECKSUMS for robot in robots for stage in STAGES]
    return [{"path": file.as_posix(), "sha256": sha256(file), "grades": {}} for file in files if file.is_file()]
