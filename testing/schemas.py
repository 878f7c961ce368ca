"""The JSON schemas of input files, and the dictionary of all tables of results: `make schema` writes them."""

from __future__ import annotations

import inspect
import json
from importlib import import_module
from pathlib import Path

from er3a.pipeline.check import SCHEMAS
from er3a.pipeline.results import CHECKSUMS, FORMAT_VERSION
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.stage import Stage
from er3a.pipeline.tables import Column, Table, table_types

HEAD = f"""# Data dictionary

What a run leaves in `results/<robot>/<stage>/`: `summary.json`, the tables below
as Parquet, and `{CHECKSUMS}`. Units and meanings stand in the files too, as metadata of each column. Format version
{FORMAT_VERSION}. This page is written by `make schema`; a test fails if it is out of date.
"""


def data_dictionary() -> str:
    """The dictionary of all tables of all stages.

    Returns
    -------
    text : Markdown: key figures, then for each table its columns with type, unit and meaning
    """
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


def main() -> None:
    """Write the schemas and the dictionary where they are kept."""
    for kind, model in SCHEMAS.items():
        text = json.dumps(model.model_json_schema(), indent=2, ensure_ascii=False) + "\n"
        Path("config", f"{kind}.schema.json").write_text(text, encoding="utf-8")
    Path("docs/results/dictionary.md").write_text(data_dictionary(), encoding="utf-8")


if __name__ == "__main__":
    main()
