"""Open3D loads without a system package, and through one module only."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import er3a
from er3a.geometry.open3d_loader import load_open3d


def test_open3d_has_the_geometry_we_use():
    open3d = load_open3d()
    assert open3d.geometry.TriangleMesh.create_box().get_volume() == pytest.approx(1.0)
    assert load_open3d() is open3d


def test_no_other_module_imports_open3d():
    package = Path(er3a.__file__).parent
    importing = [
        path.relative_to(package).as_posix()
        for path in package.rglob("*.py")
        if re.search(r"^\s*(import|from) open3d\b", path.read_text(encoding="utf-8"), re.MULTILINE)
    ]
    assert importing == ["geometry/open3d_loader.py"]


@pytest.mark.long
def test_open3d_is_loaded_without_its_web_server():
    words = "import sys, er3a.geometry.open3d_loader as here; here.load_open3d(); print('dash' in sys.modules)"
    ended = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True)
    assert ended.stdout.strip() == "False"
