"""Kernels: how they are compiled, and that processes share what one of them has compiled."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from er3a.numerics.jit import cache_folder, compile_seconds, inner_kernel, kernel
from testing.small_study import ROOT


@inner_kernel
def _power(x: float, n: int) -> float:
    return x**n


@kernel
def _cubes_and_squares(x: float) -> float:
    return _power(x, 3) + _power(x, 2)


def test_constants_make_no_versions_of_their_own():
    assert _cubes_and_squares(3.0) == 36.0
    _cubes_and_squares.recompile()  # what the disk kept was loaded without the kernels that it calls
    assert len(_power.signatures) == 1


def test_waiting_for_kernels_is_counted_and_their_work_is_not():
    before = compile_seconds()
    _cubes_and_squares.recompile()
    waited = compile_seconds()
    assert waited > before
    _cubes_and_squares(2.0)
    assert compile_seconds() == waited


def test_an_inner_kernel_is_not_called_from_python():
    with pytest.raises(TypeError, match="compiled for kernels only"):
        _power(2.0, 3)


def test_kernels_are_kept_where_numba_is_told_to_else_in_the_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for told, home in (("", "cache"), (str(tmp_path / "numba"), "numba")):
        monkeypatch.setenv("NUMBA_CACHE_DIR", told)
        assert cache_folder() == tmp_path / home / "er3a"


@pytest.mark.long
def test_two_processes_compile_a_kernel_once(tmp_path):
    code = (
        "import sys, numpy as np\n"
        "from er3a.kinematics.forward import forward\n"
        "from er3a.kinematics import forward as room\n"
        "from er3a.files.robot_library import load_robot\n"
        "sys.stdin.readline()\n"
        "forward(load_robot('er3_600'), np.zeros((4, 6)))\n"
        "kernels = [k for k in vars(room).values() if hasattr(k, 'stats')]\n"
        "print(sum(sum(k.stats.cache_misses.values()) for k in kernels))\n"
    )
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path), "PYTHONPATH": str(ROOT)}
    environment.pop("NUMBA_CACHE_DIR", None)
    both = [
        subprocess.Popen(
            [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment, text=True
        )
        for _ in range(2)
    ]
    missed = sorted(int(each.communicate("go\n")[0]) for each in both)
    assert missed[0] == 0 < missed[1]
