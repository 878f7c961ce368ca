"""What several processes of a test run need, and one of them works out."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from filelock import FileLock

SHARED = "ER3A_TESTS_SHARED"
"""Environment variable with the folder that all processes of a test run share (tests/conftest.py)."""
Made = TypeVar("Made")


def made_once(name: str, make: Callable[[], Made]) -> Made:
    """What a function returns: in the first process that asks worked out, in all others read from its file.

    Parameters
    ----------
    name : of the file, within the shared folder
    make : returns what can be pickled
    """
    path = Path(os.environ[SHARED], f"{name}.pickle")
    with FileLock(path.with_suffix(".lock")):
        if not path.exists():
            path.write_bytes(pickle.dumps(make()))
        found: Made = pickle.loads(path.read_bytes())
    return found
