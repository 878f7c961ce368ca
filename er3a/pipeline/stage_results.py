"""What a stage computes, as one typed model, and how it is kept: ``summary.json``, Parquet tables, checksums.

A stage's ``model.py`` declares a summary and its results::

    @dataclass(frozen=True)
    class ReachSummary(Summary):
        verdict: Verdict[Reached | NotReached]
        farthest_mm: float

    @dataclass(frozen=True)
    class ReachResults(Results[ReachSummary]):
        points: Points  # a Table, written as points.parquet

``compute`` returns the results, views take what :func:`read_results` reads. The summary's verdict is a finding with a
status; in the file it is ``{status, code, params, text}``, the text in English for whoever reads the file alone.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, Generic, Literal, TypeVar, get_args, get_origin, get_type_hints

import numpy as np
from pydantic import TypeAdapter, ValidationError

from er3a.errors import ResultError
from er3a.findings import Finding
from er3a.pipeline.code_digest import code_digest
from er3a.pipeline.results import (
    _compare,
    _content,
    checksums,
    input_records,
    write_atomically,
    write_checksums,
)
from er3a.pipeline.study import Study
from er3a.pipeline.tables import Table

FORMAT_VERSION = 4
SUMMARY = "summary.json"

Status = Literal["pass", "caution", "fail", "no_reference", "not_computed"]
FindingT = TypeVar("FindingT", bound=Finding)


@dataclass(frozen=True)
class Verdict(Generic[FindingT]):
    """A stage's answer: pass, caution (usable, with something to know), fail, or no_reference, and what it found."""

    status: Status
    finding: FindingT


@dataclass(frozen=True)
class Figure:
    """A key figure.

    Attributes
    ----------
    name : code of what it is; value : None where it can't be had
    uncertainty : half-width of its 95 % interval in the same unit, None where it has none
    of : the whole that a count is part of
    """

    name: str
    value: float | int | None
    unit: str
    uncertainty: float | None = None
    of: int | None = None


@dataclass(frozen=True)
class Summary:
    """What all summaries begin with; a stage's own says what its verdict can be."""

    verdict: Verdict[Any]
    figures: tuple[Figure, ...]


SummaryT = TypeVar("SummaryT", bound=Summary)
ResultsT = TypeVar("ResultsT", bound="Results[Any]")


@dataclass(frozen=True, eq=False)
class Results(Generic[SummaryT]):
    """A stage's results: its summary, and the tables that a subclass adds."""

    summary: SummaryT


@dataclass(frozen=True)
class Input:
    """An input file of a stage: path from the project's root, checksum, and the grades that stand in it."""

    path: str
    sha256: str
    grades: dict[str, list[str] | int]


@dataclass(frozen=True)
class Provenance:
    """What a stage's numbers rest on."""

    inputs: tuple[Input, ...]
    config: dict[str, Any]
    seed: int
    code: str


@dataclass(frozen=True, eq=False)
class Stored(Generic[ResultsT]):
    """Results as they were read, and where they come from."""

    robot: str
    stage: str
    provenance: Provenance
    results: ResultsT


def write_results(
    folder: Path, study: Study, robot: str, stage: str, results: Results[Any], sentence: Callable[[Finding], str]
) -> None:
    """Write a stage's tables, summary and checksums into a folder.

    Parameters
    ----------
    sentence : the verdict's text in English
    """
    for name in table_types(type(results)):
        write_atomically(folder / f"{name}.parquet", getattr(results, name).write)
    summary = results.summary
    own = {part.name: plain(getattr(summary, part.name)) for part in fields(summary)}
    own["verdict"] = _verdict_record(summary.verdict, sentence(summary.verdict.finding))
    origin = {
        "inputs": input_records(study.inputs(robot, stage)),
        "config": study.computed_from(robot, stage),
        "seed": study.seed,
        "code": code_digest(f"er3a.pipeline.stages.{stage}.compute"),
    }
    content = {"format_version": FORMAT_VERSION, "robot": robot, "stage": stage, **own, "provenance": origin}
    text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    _parsed(folder / SUMMARY, json.loads(text), type(results))  # what is written can be read
    write_atomically(folder / SUMMARY, lambda file: file.write_text(text, encoding="utf-8"))
    write_checksums(folder)


def read_results(folder: Path, kind: type[ResultsT]) -> Stored[ResultsT]:
    """Read a stage's results.

    Raises
    ------
    ResultError
        naming the file that is missing, damaged or of another format version
    """
    sums = checksums(folder)
    path = folder / SUMMARY
    content = _content(path)
    stored = read_record(path, content)
    _compare(path, content, sums)
    tables = {}
    for name, table in table_types(kind).items():
        file = folder / f"{name}.parquet"
        content = _content(file)
        _compare(file, content, sums)
        try:
            tables[name] = table.read(content)
        except (OSError, ValueError, KeyError) as error:
            raise ResultError(file, f"damaged ({' '.join(str(error).split())})") from None
    summary, provenance = _parsed(path, stored, kind)
    return Stored(stored["robot"], stored["stage"], provenance, kind(summary=summary, **tables))


def read_record(path: Path, content: bytes) -> dict[str, Any]:
    """A summary file's content of the present format, as plain data."""
    try:
        stored = json.loads(content)
    except ValueError as error:
        raise ResultError(path, f"damaged ({error})") from None
    version = stored.get("format_version") if isinstance(stored, dict) else None
    if version != FORMAT_VERSION:
        raise ResultError(path, f"format version {version}, this er3a reads {FORMAT_VERSION}")
    return stored


def table_types(kind: type[Results[Any]]) -> dict[str, type[Table]]:
    """The tables of a stage's results, by the name of their file."""
    hints = get_type_hints(kind)
    return {name: hint for name, hint in hints.items() if isinstance(hint, type) and issubclass(hint, Table)}


def summary_type(kind: type[Results[Any]]) -> type[Summary]:
    """The summary of a stage's results."""
    for base in kind.__orig_bases__:  # type: ignore[attr-defined]
        if get_origin(base) is Results:
            return get_args(base)[0]
    raise TypeError(f"{kind.__name__} does not say what its summary is")


def plain(value: Any) -> Any:
    """Dataclasses, arrays and numpy's numbers as JSON has them."""
    if is_dataclass(value) and not isinstance(value, type):
        return {part.name: plain(getattr(value, part.name)) for part in fields(value)}
    if isinstance(value, dict):
        return {key: plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    if isinstance(value, np.ndarray):
        return value.tolist()
    return value.item() if isinstance(value, np.generic) else value


def _verdict_record(verdict: Verdict[Any], text: str) -> dict[str, Any]:
    params = plain(verdict.finding)
    return {"status": verdict.status, "code": params.pop("code"), "params": params, "text": text}


def _parsed(path: Path, stored: dict[str, Any], kind: type[Results[Any]]) -> tuple[Any, Provenance]:
    own = {key: value for key, value in stored.items() if key not in ("format_version", "robot", "stage", "provenance")}
    verdict = own.get("verdict")
    try:
        if isinstance(verdict, dict):
            own["verdict"] = {"status": verdict["status"], "finding": verdict["params"] | {"code": verdict["code"]}}
        summary = _adapter(summary_type(kind)).validate_python(own)
        return summary, _adapter(Provenance).validate_python(stored.get("provenance"))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise ResultError(path, f"damaged ({where}: {first['msg']})") from None
    except KeyError as error:
        raise ResultError(path, f"damaged (verdict without {error})") from None


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)
