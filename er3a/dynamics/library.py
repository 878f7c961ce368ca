"""The one place where Pinocchio [1]_ is imported.

References
----------
.. [1] J. Carpentier et al., "The Pinocchio C++ library", IEEE/SICE Int. Symp. on System Integration (2019).
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Any

from er3a.errors import Er3aError


def can_compute() -> bool:
    """Whether Pinocchio is installed."""
    return find_spec("pinocchio") is not None


def pinocchio() -> Any:
    """The library.

    Raises
    ------
    Er3aError
        if it is not installed
    """
    try:
        return import_module("pinocchio")
    except ModuleNotFoundError:
        raise Er3aError("dynamics needs the Pinocchio library, which has no wheels for this platform") from None
