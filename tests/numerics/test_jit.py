"""Kernels: where they are kept, and what waiting for them costs."""

from __future__ import annotations

import gc

from er3a.numerics.jit import cache_folder, compile_seconds, inner_kernel, kernel


@inner_kernel
def _power(x: float, n: int) -> float:
    return x**n


@kernel
def _cubes_and_squares(x: float) -> float:
    return _power(x, 3) + _power(x, 2)


def test_waiting_for_kernels_is_counted_and_their_work_is_not():
    _cubes_and_squares(3.0)
    before = compile_seconds()
    _cubes_and_squares.recompile()
    waited = compile_seconds()
    assert waited > before
    _cubes_and_squares(2.0)
    assert compile_seconds() == waited
    assert gc.isenabled()


def test_kernels_are_kept_where_numba_is_told_to_else_in_the_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for told, home in (("", "cache"), (str(tmp_path / "numba"), "numba")):
        monkeypatch.setenv("NUMBA_CACHE_DIR", told)
        assert cache_folder() == tmp_path / home / "er3a"
