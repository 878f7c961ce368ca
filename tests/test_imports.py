"""Importing er3a changes nothing for the program that imports it."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytestmark = pytest.mark.long

IMPORT_ALL = """
import copy, os, pkgutil, signal, sys
from importlib import import_module

import matplotlib, numba, numpy

def settings():
    config = {name: value for name, value in vars(numba.config).items() if name.isupper()}
    state = [dict(matplotlib.rcParams), config, dict(os.environ), numpy.geterr(), numpy.get_printoptions()]
    return copy.deepcopy(state), signal.getsignal(signal.SIGINT), sys.excepthook

before = settings()
import er3a
modules = [found.name for found in pkgutil.walk_packages(er3a.__path__, "er3a.") if found.name != "er3a.__main__"]
for module in modules:
    import_module(module)
assert len(modules) > 100, modules
for old, new in zip(before, settings(), strict=True):
    assert old == new, (old, new)
"""


def test_importing_every_module_leaves_other_libraries_settings_alone():
    done = subprocess.run([sys.executable, "-c", IMPORT_ALL], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
