"""Digests of the package: numbers rest on all code but that of views, views rest on all."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import er3a
from er3a.pipeline import code_digest

EDITS = {
    "numerics/jit.py": (True, True),
    "pipeline/study.py": (True, True),
    "pipeline/stages/inverse/compute.py": (True, True),
    "pipeline/stages/inverse/page/report.py": (False, True),
    "pipeline/stages/inverse/page/report.html.j2": (False, True),
    "pipeline/messages/inverse.py": (False, True),
    "pipeline/viewing/style.css": (False, True),
    "pipeline/teach/kinematics.js": (False, True),
    "pipeline/run_study.py": (False, True),
    "pipeline/messages/locale/zh/LC_MESSAGES/er3a.po": (False, False),  # an input of pages in that language alone
}
"""Of an edited file, whether it changes the digest of numbers and that of views."""


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("copy") / "er3a"
    return Path(shutil.copytree(Path(er3a.__file__).parent, folder, ignore=shutil.ignore_patterns("__pycache__")))


def digests(folder: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, str]:
    monkeypatch.setattr(code_digest, "_PACKAGE", folder)
    return code_digest.numbers_digest.__wrapped__(), code_digest.code_digest.__wrapped__()


def test_digests_are_of_the_content_not_of_the_place(copy, monkeypatch):
    assert digests(copy, monkeypatch) == digests(Path(er3a.__file__).parent, monkeypatch)


@pytest.mark.parametrize("name", EDITS)
def test_an_edit_changes_the_digests_of_what_rests_on_it(copy, monkeypatch, name):
    before, content = digests(copy, monkeypatch), (copy / name).read_bytes()
    (copy / name).write_bytes(content + b"\n")
    after = digests(copy, monkeypatch)
    (copy / name).write_bytes(content)
    assert tuple(old != new for old, new in zip(before, after, strict=True)) == EDITS[name]
