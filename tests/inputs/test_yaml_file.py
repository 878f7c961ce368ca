"""YAML reading: what is refused before any model sees it, and how a model's faults are told."""

from __future__ import annotations

import os
from typing import Annotated, Literal

import pytest
from pydantic import Field, model_validator

from er3a.errors import InputError
from er3a.files.yaml_file import MAX_YAML_BYTES, StrictModel, load, parse, read_yaml


class Part(StrictModel):
    length_mm: float
    colour: Literal["red", "blue"] = "red"

    @model_validator(mode="after")
    def _positive(self):
        if self.length_mm < 0:
            raise ValueError(f"length_mm: {self.length_mm:g} is negative | Write a length")
        return self


class Whole(StrictModel):
    kind: Literal["whole"]
    count: Annotated[int, Field(ge=1)] = 1
    parts: list[Part] = []

    @model_validator(mode="after")
    def _all_counted(self):
        if self.parts and len(self.parts) != self.count:
            raise ValueError(f"{len(self.parts)} parts, not {self.count}")
        return self


@pytest.fixture
def write(tmp_path):
    def write(content: str | bytes):
        path = tmp_path / "file.yaml"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def refusal(path) -> InputError:
    with pytest.raises(InputError) as caught:
        load(Whole, path)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(path))
    assert len(str(caught.value)) < 500
    return caught.value


BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\nb: &b [*a, *a, *a, *a, *a, *a, *a, *a]\nc: [*b, *b, *b, *b, *b, *b, *b]\n"


@pytest.mark.parametrize(
    ("content", "field", "problem"),
    [
        ("", None, "the top level is nothing"),
        ("# nothing but this\n", None, "the top level is nothing"),
        ("- kind: whole\n", None, "the top level is a list"),
        ("just words", None, "the top level is a str"),
        ("kind: whole\nkind: whole\n", "line 2, column 1", "the key 'kind' is given twice"),
        ("kind: whole\nparts:\n- {length_mm: 1, length_mm: 2}\n", "line 3, column 18", "the key 'length_mm' is given"),
        ("kind: [whole\n", "line 2, column 1", "expected ',' or ']'"),
        ("kind: whole\n\tcount: 1\n", "line 2, column 1", "a tab character"),
        ("kind: whole\x85\tcount: 1\n", "line 2, column 1", "a tab character"),
        ("kind: whole\x85parts: [\n", "line 3, column 1", "expected"),  # was a traceback
        ("kind: whole\nparts:\n\t- length_mm: 1\n", "line 3, column 1", "a tab character at the start"),
        ("kind: whole\nparts:\n- {length_mm: 50,0}\n", "line 3, column 18", "write decimals with a point, not a comma"),
        (BOMB, "line 2, column 8", "aliases (*name) are not supported"),
        ("kind: whole\n<<: {count: 1}\n", "line 2, column 1", "merge"),
        ("kind: whole\n1: 2\n", "line 2, column 1", "the key 1 is not a word"),
        ("kind: whole\n? [a, b]\n: 2\n", "line 2, column 3", "is not a word"),
        ("kind: !!python/object/apply:os.getcwd []\n", "line 1, column 7", "tags (!name) are not supported"),
        ("kind: whole\n---\nkind: whole\n", "line 2, column 1", "another document"),
        ("kind: " + "[" * 3000, None, "nested too deeply"),
        ("kind: whole\ncount: " + "9" * 5000 + "\n", None, "not valid YAML"),
        ("kind: \x00\n", None, "not valid YAML"),
        ("kind: whole\ntitle: 2020-13-45\n", None, "not valid YAML"),
        (b"kind: \xff\xfe\n", "byte 6", "not UTF-8 text"),
        ("kind: whole\n".encode("utf-16"), "byte 0", "not UTF-8 text"),
        ("#" + " " * MAX_YAML_BYTES, None, f"larger than {MAX_YAML_BYTES} bytes"),
        ("kind: hole\n", "kind", "'hole' is refused"),
        ("kind: hole\nextra: 1\n", "kind", "'hole' is refused"),
        ("count: 1\n", "kind", "missing"),
        ("kind: whole\ncoutn: 1\n", "coutn", "unknown key 'coutn'"),
        ('kind: whole\n"a\\nb": 1\n', "'a\\nb'", r"unknown key 'a\nb'"),
        ("kind: whole\nparts:\n- {length_mm: .nan}\n", "parts[0].length_mm", "nan is not a finite number"),
        ("kind: whole\nparts:\n- {length_mm: .inf}\n", "parts[0].length_mm", "inf is not a finite number"),
        ("kind: whole\nparts:\n- {length_mm: -2}\n", "parts[0].length_mm", "-2 is negative"),
        ("kind: whole\ncount: 2\nparts:\n- {length_mm: 2}\n", None, "1 parts, not 2"),
        ("kind: whole\ncount: yes\n", "count", "True is refused"),
        ("kind: whole\ncount: 1.5\n", "count", "1.5 is refused"),
        ("kind: whole\ncount: 0\n", "count", "0 is refused"),
        ("kind: whole\nparts: red\n", "parts", "'red' is refused"),
    ],
)
def test_refusals_name_place_and_problem(write, content, field, problem):
    error = refusal(write(content))
    assert error.field == field
    assert problem in error.problem
    assert error.remedy


def test_a_misspelt_key_gets_a_hint(write):
    assert refusal(write("kind: whole\ncoutn: 1\n")).remedy == "Did you mean 'count'?"
    assert "Did you mean" not in refusal(write("kind: whole\nzzz: 1\n")).remedy


def test_missing_file_folder_pipe_and_unreadable_name(tmp_path):
    assert refusal(tmp_path / "none.yaml").problem == "there is no such file"
    assert refusal(tmp_path).problem == "not a file"
    os.mkfifo(tmp_path / "pipe.yaml")
    assert refusal(tmp_path / "pipe.yaml").problem == "not a file"
    with pytest.raises(InputError, match="can't be read"):
        read_yaml(tmp_path / "a\0b.yaml")
    assert refusal(tmp_path / ("x" * 300)).problem == "can't be read (File name too long)"


def test_values_given_in_python_have_no_file():
    with pytest.raises(InputError) as caught:
        parse(Whole, {"kind": "whole", "count": 0}, None)
    assert caught.value.file is None
    assert str(caught.value).startswith("count: 0 is refused")


def test_a_good_file_with_byte_order_mark_and_windows_line_ends(write):
    whole = load(Whole, write(b"\xef\xbb\xbfkind: whole\r\ncount: 1\r\nparts:\r\n- {length_mm: 1e3}\r\n"))
    assert whole.parts[0].length_mm == 1000.0


def test_models_are_frozen(write):
    whole = load(Whole, write("kind: whole\n"))
    with pytest.raises(ValueError, match="frozen"):
        whole.count = 2


def test_who_reads_a_file_may_change_what_it_holds(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("list: [1, {key: [2]}]\n", encoding="utf-8")
    first = read_yaml(path)
    first["list"][1]["key"].append(3)
    first["other"] = first.pop("list")
    assert read_yaml(path) == {"list": [1, {"key": [2]}]}
    path.write_text("list: [4]\n", encoding="utf-8")
    assert read_yaml(path) == {"list": [4]}
