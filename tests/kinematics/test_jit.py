"""Compiled kernels are kept, and shared by copies of the package."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[2]
CALL = """
import numpy as np
from er3a.geometry.vectors import unsigned_angle

assert unsigned_angle(np.eye(3)[0], np.eye(3)[1]) == np.pi / 2
print(sum(unsigned_angle.stats.cache_hits.values()), sum(unsigned_angle.stats.cache_misses.values()))
"""


def test_a_copy_with_equal_kernels_compiles_nothing_and_one_with_others_does(tmp_path):
    def hits_and_misses(copy: Path) -> str:
        environment = os.environ | {"PYTHONPATH": str(copy), "XDG_CACHE_HOME": str(tmp_path / "cache")}
        command = [sys.executable, "-c", CALL]
        return subprocess.run(command, cwd=copy, env=environment, capture_output=True, text=True, check=True).stdout

    for name in ("one", "other"):
        shutil.copytree(ROOT / "er3a", tmp_path / name / "er3a", ignore=shutil.ignore_patterns("__pycache__"))
    assert hits_and_misses(tmp_path / "one") == "0 1\n"
    assert hits_and_misses(tmp_path / "other") == "1 0\n"
    edited = tmp_path / "other/er3a/geometry/vectors.py"
    edited.write_text(edited.read_text() + "\n# edited\n")
    assert hits_and_misses(tmp_path / "other") == "0 1\n"
