"""Results that are computed when a test first needs them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

V = TypeVar("V")


class OnDemand(dict[str, V]):
    """Results by name, each computed once."""

    def __init__(self, make: Callable[[str], V]):
        super().__init__()
        self._make = make

    def __missing__(self, name: str) -> V:
        self[name] = self._make(name)
        return self[name]
