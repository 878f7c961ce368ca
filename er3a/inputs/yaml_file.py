"""YAML files checked against a pydantic model."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from er3a.errors import InputError

Model = TypeVar("Model", bound=BaseModel)

MAX_BYTES = 1_000_000


class StrictModel(BaseModel):
    """Base of all file models: no unknown keys, no NaN, no silent conversion of types."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class _UniqueKeyLoader(yaml.SafeLoader):
    """Safe YAML loader that refuses a key written twice and aliases (no file of ours needs them)."""

    def compose_node(self, parent, index):
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark
            raise yaml.constructor.ConstructorError(None, None, "aliases (*name) are not supported", mark)
        return super().compose_node(parent, index)

    def construct_mapping(self, node, deep=False):
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, str):
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {key!r} is not a word; put it in quotes", key_node.start_mark
                )
            if key in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key '{key}' stands here twice; keep one of the two", key_node.start_mark
                )
            seen.add(key)
        return super().construct_mapping(node, deep=True)


def read_yaml(path: str | Path) -> dict[str, Any]:
    """Read a YAML file whose top level is a mapping.

    Raises
    ------
    InputError
        if the file is missing, too large, not UTF-8, not YAML, or holds a key twice (with line and column)
    """
    path = Path(path)
    text = read_text(path)
    try:
        data = yaml.load(text, Loader=_UniqueKeyLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}" if mark else None
        raise InputError(path, where, error.problem or "not valid YAML", "Mend this line") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())[:200]
        raise InputError(path, None, f"not valid YAML ({reason})", "Mend the file") from None
    if not isinstance(data, dict):
        kind = "nothing" if data is None else f"a {type(data).__name__}"
        raise InputError(path, None, f"the top level is {kind}", "Write `key: value` lines there")
    return data


def read_text(path: Path) -> str:
    """Read a UTF-8 text file of at most 1 MB, or raise :class:`InputError`."""
    try:
        raw = path.read_bytes() if path.stat().st_size <= MAX_BYTES else None
    except FileNotFoundError:
        raise InputError(path, None, "there is no such file", "Check the path") from None
    except (OSError, ValueError) as error:
        raise InputError(path, None, f"can't be read ({error})", "Check the path and its permissions") from None
    if raw is None:
        raise InputError(path, None, f"larger than {MAX_BYTES} bytes", "Input tables are small text files")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(path, f"byte {error.start}", "not UTF-8 text", "Save the file as UTF-8") from None


def parse(model: type[Model], data: dict[str, Any], path: str | Path | None) -> Model:
    """Validate ``data`` as ``model``; the first fault found is raised as :class:`InputError`."""
    try:
        return model.model_validate(data)
    except ValidationError as error:
        faults = error.errors()
        first = min(faults, key=lambda fault: fault["type"] != "extra_forbidden")
        field = _dotted(first["loc"])
        problem, remedy = _explain(first, model)
        if len(faults) > 1:
            remedy += f" ({len(faults) - 1} more to mend after this one)"
        raise InputError(path, field or None, problem, remedy) from None


def load(model: type[Model], path: str | Path) -> Model:
    """Read and validate a YAML file."""
    return parse(model, read_yaml(path), path)


def _dotted(loc: tuple[int | str, ...]) -> str:
    text = ""
    for part in loc:
        text += f"[{part}]" if isinstance(part, int) else (f".{part}" if text else part)
    return text


def _explain(fault: dict[str, Any], model: type[BaseModel]) -> tuple[str, str]:
    kind, key = fault["type"], fault["loc"][-1] if fault["loc"] else ""
    if kind == "extra_forbidden":
        if any(word in str(key) for word in ("coupl", "parallelogram", "mimic")):
            return "coupled joints are not supported", "er3a needs six independent joints; remove the key"
        known = _known_keys(model)
        close = difflib.get_close_matches(str(key), known, n=1)
        hint = f"Did you mean '{close[0]}'?" if close else "Remove it, or check its place in the file"
        return f"unknown key '{key}'", hint
    if kind == "missing":
        return "missing", f"Add the key '{key}'"
    if kind == "value_error":
        problem, _, remedy = str(fault["ctx"]["error"]).partition(" | ")
        return problem, remedy or "Mend the value"
    if kind == "finite_number":
        return f"{fault['input']} is not a finite number", "Write a number"
    given = repr(fault["input"])
    return f"{given[:80]} is refused", fault["msg"]


def _known_keys(model: type[BaseModel]) -> list[str]:
    schema = model.model_json_schema()
    parts = [schema, *schema.get("$defs", {}).values()]
    return sorted({key for part in parts for key in part.get("properties", {})})
