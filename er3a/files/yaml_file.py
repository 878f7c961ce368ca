"""YAML files checked against a pydantic model."""

from __future__ import annotations

import difflib
import re
import warnings
from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails
from yaml.composer import Composer

from er3a.errors import DoubtfulUnit, InputError, InputWarning
from er3a.formats.mesh_file import read_text

Model = TypeVar("Model", bound=BaseModel)
Content = dict[str, Any]
"""What a file, or a part of one, holds by its keys."""

MAX_YAML_BYTES = 250_000  # of which the worst takes seconds to read

CLOSE = 0.7  # how alike a key and the one that was meant are at least

_KINDS = ("union_tag_invalid", "union_tag_not_found")  # faults of the key that says which of several entries one is
_FIELD = re.compile(r"([A-Za-z_]\w*(?:\.[\w-]+|\[\d+\])*): ")
_REMEDIES = {
    "float_type": "Write a number, without quotes or unit",
    "int_type": "Write a whole number, without point, quotes or unit",
    "bool_type": "Write true or false",
    "string_type": "Write a text, in quotes if it looks like a number",
    "list_type": "Write a list",
    "dict_type": "Write `key: value` lines below it",
    "model_type": "Write `key: value` lines below it",
}


class StrictModel(BaseModel):
    """Base of all file models: no unknown keys, no NaN, no silent conversion of types."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class InputFile(StrictModel):
    """The base of files that people write.

    ``units_checked: true`` says that numbers which look like radians or metres are degrees and mm all the same.
    """

    units_checked: bool = False


class _PlainLoader(Composer, yaml.CSafeLoader):
    """Safe YAML loader with numbers as in YAML 1.2, which rejects a key written twice, aliases and tags.

    YAML 1.1 would read ``0650`` as octal 424, ``1:30`` as 90, and ``1e3`` as a text; a tag (``!!int 0650``) would
    bring that back. The text is parsed by libyaml; Python's composer shows each node's event before it is built.
    """

    def __init__(self, stream):
        yaml.CSafeLoader.__init__(self, stream)  # type: ignore[no-untyped-call]
        Composer.__init__(self)  # type: ignore[no-untyped-call]

    def compose_node(self, parent, index):
        """Build the next node, unless it is an alias (``*name``) or has a tag (``!name``).

        Raises
        ------
        yaml.constructor.ConstructorError
            with line and column of the alias or tag
        """
        event: Any = self.peek_event()
        unsupported = "aliases (*name)" if isinstance(event, yaml.AliasEvent) else "tags (!name)"
        if isinstance(event, yaml.AliasEvent) or getattr(event, "tag", None) is not None:
            raise yaml.constructor.ConstructorError(None, None, f"{unsupported} are not supported", event.start_mark)
        return super().compose_node(parent, index)

    def construct_mapping(self, node, deep=False):
        """The mapping of a node, with all that is in it.

        Raises
        ------
        yaml.constructor.ConstructorError
            with line and column of a key that is not a text, or is given twice
        """
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, str):
                raise yaml.constructor.ConstructorError(
                    None,
                    None,
                    f"the key {key!r} is not a word: put it in quotes, or write decimals with a point, not a comma",
                    key_node.start_mark,
                )
            if key in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {key!r} is given twice; keep one of the two", key_node.start_mark
                )
            seen.add(key)
        return super().construct_mapping(node, deep=True)


_NUMBERS = {
    "tag:yaml.org,2002:int": r"[-+]?(?:0|[1-9][0-9]*)$",
    "tag:yaml.org,2002:float": r"""(?x)[-+]?(?:[0-9]+\.[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?$
        |[-+]?[0-9]+[eE][-+]?[0-9]+$ |[-+]?\.(?:inf|Inf|INF)$ |\.(?:nan|NaN|NAN)$""",
}
_PlainLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag not in _NUMBERS]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
for _tag, _pattern in _NUMBERS.items():
    _PlainLoader.add_implicit_resolver(_tag, re.compile(_pattern), list("-+.0123456789"))


_LINE_END = re.compile("\r\n|[\n\r\x85\u2028\u2029]")  # what PyYAML counts as one; a fault can lie after the last line


@lru_cache(maxsize=128)
def _content(text: str) -> Any:
    """What a text holds; the start of a run reads the file of each robot a dozen times."""
    return yaml.load(text, Loader=_PlainLoader)


def _own(content: Any) -> Any:
    """Lists and mappings of one's own, which may be changed."""
    if isinstance(content, dict):
        return {key: _own(value) for key, value in content.items()}
    return [_own(value) for value in content] if isinstance(content, list) else content


def read_yaml(path: str | Path) -> Content:
    """Read a YAML file whose top level is a mapping.

    Raises
    ------
    InputError
        if the file is missing, too large, not UTF-8, not YAML, or holds a key twice (with line and column)
    """
    path = Path(path)
    text = read_text(path, MAX_YAML_BYTES)
    try:
        data = _own(_content(text))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}" if mark else None
        if mark and any(line.lstrip(" ").startswith("\t") for line in _LINE_END.split(text)[mark.line : mark.line + 1]):
            raise InputError(path, where, "a tab character at the start of the line", "Indent by spaces") from None
        raise InputError(path, where, error.problem or "not valid YAML", "Correct this line") from None
    except RecursionError:
        raise InputError(path, None, "nested too deeply", "Input tables are flat; correct the brackets") from None
    except (yaml.YAMLError, ValueError) as error:
        reason = " ".join(str(error).split())[:200]
        raise InputError(path, None, f"not valid YAML ({reason})", "Correct the file") from None
    if not isinstance(data, dict):
        kind = "nothing" if data is None else f"a {type(data).__name__}"
        raise InputError(path, None, f"the top level is {kind}", "Write `key: value` lines there")
    return data


def parse(model: type[Model], data: Content, path: str | Path | None, context: Content | None = None) -> Model:
    """Validate ``data`` as ``model``, in pydantic's ``context``; the first fault is raised as :class:`InputError`.

    Values that look like a mistake give an :class:`InputWarning` that names the file, and numbers of doubtful unit one
    that names their place in it, unless the file says that its units are checked.
    """
    try:
        with warnings.catch_warnings(record=True) as seen:
            warnings.simplefilter("always")
            valid = model.model_validate(data, context=context)
        for told in _told(seen, valid, path):
            warnings.warn(told, stacklevel=3)
        return valid
    except ValidationError as error:
        faults = error.errors()
        first = min(faults, key=lambda fault: (fault["loc"] != ("kind",), fault["type"] != "extra_forbidden"))
        field = _dotted((*first["loc"], "kind") if first["type"] in _KINDS else first["loc"])
        problem, remedy = _explain(first, model)
        if named := _FIELD.match(problem):
            field, problem = ".".join(filter(None, (field, named[1]))), problem[named.end() :]
        if len(faults) > 1:
            remedy += f" ({len(faults) - 1} more to correct after this one)"
        raise InputError(path, field or None, problem, remedy) from None


def _told(seen: list[warnings.WarningMessage], valid: BaseModel, path: str | Path | None) -> Iterator[Warning]:
    """Warnings with the file and the place that they are about; none of values that were tried and not taken."""
    doubts = [warning.message for warning in seen if isinstance(warning.message, DoubtfulUnit)]
    places = {id(part): place for place, part in _parts(valid)} if doubts else {}
    for doubt in doubts if not getattr(valid, "units_checked", False) else ():
        if (place := places.get(id(doubt.part))) is not None:
            yield doubt.at(path, _dotted((*place, *filter(None, [doubt.key]))))
    for warning in seen:
        if not isinstance(warning.message, DoubtfulUnit):
            named = path and warning.category is InputWarning
            yield warning.category(f"{path}: {warning.message}") if named else warning.message  # type: ignore[misc]


def _parts(part: object, place: tuple[int | str, ...] = ()) -> Iterator[tuple[tuple[int | str, ...], object]]:
    """A file's content and all of its parts, each with its place."""
    yield place, part
    inner: Iterable[tuple[int | str, object]] = ()
    if isinstance(part, BaseModel):
        keys = type(part).model_fields
        inner = [(keys[name].alias or name, value) for name, value in part.__dict__.items()]
    elif isinstance(part, dict | list):
        inner = part.items() if isinstance(part, dict) else enumerate(part)
    for key, each in inner:
        if isinstance(each, BaseModel | dict | list):
            yield from _parts(each, (*place, key))


def load(model: type[Model], path: str | Path) -> Model:
    """Read and validate a YAML file.

    Parameters
    ----------
    model : the class of the file's content
    path : of at most ``MAX_YAML_BYTES`` bytes

    Raises
    ------
    InputError
        naming file, field, problem and remedy: if the file can't be read, or a value is not as the model asks
    """
    return parse(model, read_yaml(path), path)


def check_own_names(field: str, names: list[str]) -> None:
    """Reject a name that an earlier entry of a list has too.

    Parameters
    ----------
    field : key of the list, for the error
    names : of its entries, in their order

    Raises
    ------
    ValueError
        as ``field: problem | remedy``, naming both entries
    """
    places: dict[str, int] = {}
    for i, name in enumerate(names):
        if (first := places.setdefault(name, i)) < i:
            raise ValueError(f"{field}[{i}].name: '{name}' is also that of {field}[{first}] | Rename it")


def _dotted(loc: tuple[int | str, ...]) -> str:
    text = ""
    for part in loc:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            text += ("." if text else "") + (part if part.isprintable() else repr(part))
    return text


def _explain(fault: ErrorDetails, model: type[BaseModel]) -> tuple[str, str]:
    kind, key = fault["type"], fault["loc"][-1] if fault["loc"] else ""
    if kind == "extra_forbidden":
        if any(word in str(key) for word in ("parallelogram", "mimic")):
            return f"unknown key {str(key)!r}", "Write coupled joints as `coupling:`; see docs/new-robot.md"
        known = _known_keys(model)
        close = difflib.get_close_matches(str(key), known, n=1, cutoff=CLOSE)
        hint = f"Did you mean '{close[0]}'?" if close else "Remove it, or check its place in the file"
        if str(key) in known:
            hint = "It belongs elsewhere in the file: check its place"
        return f"unknown key {str(key)!r}", hint
    if kind == "union_tag_invalid":
        return f"'{fault['ctx']['tag']}' is not known", f"Write one of: {fault['ctx']['expected_tags']}".replace(
            "'", ""
        )
    if kind == "union_tag_not_found":
        return "missing", "Add the key 'kind'"
    if kind == "missing":
        return "missing", f"Add the key '{key}'"
    if kind == "value_error":
        problem, _, remedy = str(fault["ctx"]["error"]).partition(" | ")
        return problem, remedy or "Correct the value"
    if kind == "finite_number":
        return f"{fault['input']} is not a finite number", "Write a number"
    if kind in ("too_short", "too_long") and isinstance(fault["input"], list):
        problem = f"a list of {len(fault['input'])} items where {_asked(fault['ctx'])} items belong"
        return problem, "Write as many, in brackets"
    given = repr(fault["input"])
    return f"{given[:80]} is refused", _REMEDIES.get(kind, fault["msg"])


def _asked(bounds: Content) -> str:
    return f"at least {bounds['min_length']}" if "min_length" in bounds else f"at most {bounds['max_length']}"


def _known_keys(model: type[BaseModel]) -> list[str]:
    schema = model.model_json_schema()
    parts = [schema, *schema.get("$defs", {}).values()]
    return sorted({key for part in parts for key in part.get("properties", {})})
