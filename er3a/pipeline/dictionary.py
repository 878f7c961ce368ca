"""Documents about results: a JSON Schema of each stage's summary, and a dictionary of all tables."""

from __future__ import annotations

import inspect
from importlib import import_module
from typing import Any

from pydantic import TypeAdapter

from er3a.pipeline.results import CHECKSUMS, FORMAT_VERSION, Provenance, summary_type
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.stage import Stage
from er3a.pipeline.tables import Column, Table, table_types

HEAD = f"""# Data dictionary

What a run leaves in `results/<robot>/<stage>/`: `summary.json` (its schema stands beside this page), the tables below
as Parquet, and `{CHECKSUMS}`. Units and meanings stand in the files too, as metadata of each column. Format version
{FORMAT_VERSION}. This page is written by `make schema`; a test fails if it is out of date.
"""


def summary_schema(stage: Stage) -> dict[str, Any]:
    """The JSON Schema of a stage's ``summary.json``."""
    schema = TypeAdapter(summary_type(stage.module("model").RESULTS)).json_schema()
    origin = TypeAdapter(Provenance).json_schema()
    definitions = schema["$defs"] | origin.pop("$defs", {})
    reference = schema["properties"]["verdict"]["$ref"].rpartition("/")[2]
    definitions[reference] = _verdict_schema(definitions[reference], definitions)
    properties = {
        "format_version": {"const": FORMAT_VERSION},
        "robot": {"type": "string"},
        "stage": {"const": stage.name},
        **schema["properties"],
        "provenance": origin,
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"summary.json of the stage {stage.name}",
        "type": "object",
        "required": list(properties),
        "properties": properties,
        "$defs": dict(sorted(definitions.items())),
    }


def _verdict_schema(stored: dict[str, Any], definitions: dict[str, Any]) -> dict[str, Any]:
    """A verdict in the file: status, code and params."""
    finding = stored["properties"]["finding"]
    references = [part["$ref"] for part in finding.get("anyOf", [finding])]
    cases = []
    for reference in references:
        found = definitions[reference.rpartition("/")[2]]
        cases.append({"properties": {"code": found["properties"]["code"], "params": {"$ref": reference}}})
    properties = {"status": stored["properties"]["status"]}
    return {
        "type": "object",
        "required": ["status", "code", "params"],
        "properties": properties,
        "oneOf": cases,
    }


def data_dictionary() -> str:
    """All tables of all stages, as Markdown."""
    parts = [HEAD]
    for stage in STAGES.values():
        parts.append(f"## {stage.name}\n\nKey figures in `figures`:\n\n{_figures(stage)}")
        for name, table in table_types(stage.module("model").RESULTS).items():
            parts.append(f"### `{stage.name}/{name}.parquet`\n\n{_about(table)}\n\n{_columns(table)}")
    return "\n".join(parts)


def _figures(stage: Stage) -> str:
    names: dict[str, str] = import_module(stage.messages).KEY_FIGURES
    return "".join(f"- `{code}`: {name}\n" for code, name in names.items())


def _about(table: type[Table]) -> str:
    return " ".join(inspect.cleandoc(table.__doc__ or "").split("\n\n")[0].split())


def _columns(table: type[Table]) -> str:
    lines = ["| column | type | unit | meaning |", "|---|---|---|---|"]
    for column in table.columns().values():
        kind = "text" if column.dtype == object else str(column.dtype)
        lines.append(f"| {_names(column)} | {kind} | {column.unit} | {column.meaning} |")
    return "\n".join(lines) + "\n"


def _names(column: Column) -> str:
    if not column.is_group:
        return f"`{column.pattern}`"
    if column.parts:
        return ", ".join(f"`{name}`" for name in column.names(0))
    return f"`{column.pattern.format(1)}` … `{column.pattern.format('n')}`"
