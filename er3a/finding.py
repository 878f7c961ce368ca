"""What was found, as data: a code with parameters, and on what it rests.

A finding is no sentence: texts stand in ``er3a.pipeline.messages``, one for each code, and are filled in with the
parameters. A number with a unit is a :class:`Amount`, so that one code serves joints that turn and joints that slide.
What lists findings adds their places and levels. Code decides by code, basis and parameters, never by a text.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, fields, is_dataclass, replace
from typing import Any, Literal, TypeGuard

import numpy as np

from er3a.by_value import ReadOnly, crude_hash, slotted

Basis = Literal["documented", "assumed"]


@slotted
class Amount:
    """A number with its unit.

    Attributes
    ----------
    value : in the unit
    unit : as it is printed: ``mm``, ``deg``, ``deg/s``; empty for a ratio
    """

    value: float
    unit: str

    def __str__(self) -> str:
        return f"{self.value:.6g} {self.unit}".rstrip()


@slotted
class Finding:
    """Something that was found.

    Attributes
    ----------
    code : what; its text stands under it
    params : by name, what the text says of it: amounts, words, numbers, other findings, and tuples of these. They
        can be read as attributes
    basis : ``assumed`` where it rests on a value that no document gives
    """

    code: str
    params: Mapping[str, Any] = field(default_factory=dict)
    basis: Basis = "documented"

    def __post_init__(self) -> None:
        if taken := {"code", "params", "basis", "but"} & self.params.keys():
            raise TypeError(f"no parameter of a finding can be called {min(taken)}: it could not be read")
        object.__setattr__(self, "params", ReadOnly({name: revived(value) for name, value in self.params.items()}))

    def __hash__(self) -> int:
        return hash((self.code, *map(crude_hash, self.params.values())))

    def __getattr__(self, name: str) -> Any:
        """A parameter by its name."""
        if not name.startswith("_") and name != "params" and name in self.params:
            return self.params[name]
        raise AttributeError(f"'{name}' is no parameter of this finding")

    def but(self, **params: Any) -> Finding:
        """The same with other parameters.

        Parameters
        ----------
        params : in place of its own, or besides these
        """
        return replace(self, params={**self.params, **params})


def fact(code: str, /, **params: Any) -> Finding:
    """A finding, its parameters given by name.

    Parameters
    ----------
    code : what was found
    params : what its text says of it

    Returns
    -------
    finding : equal to any other with the same content
    """
    return Finding(code, params)


def is_one(found: object, *codes: str) -> TypeGuard[Finding]:
    """Whether something is a finding with one of these codes.

    Parameters
    ----------
    found : anything
    codes : of findings
    """
    return isinstance(found, Finding) and found.code in codes


def plain(value: Any) -> Any:
    """A value as JSON has it.

    Parameters
    ----------
    value : dataclasses, mappings, sequences, arrays and numpy's numbers, however deep

    Returns
    -------
    value : dicts, lists and plain values; a NaN stays
    """
    opened = opened_once(value)
    if isinstance(opened, dict):
        return {key: plain(part) for key, part in opened.items()}
    return [plain(part) for part in opened] if isinstance(opened, list | tuple) else opened


def opened_once(value: Any) -> Any:
    """A value as JSON has it, but for the values that it holds: what :func:`json.dump` takes as ``default``.

    Parameters
    ----------
    value : as :func:`plain` takes it

    Returns
    -------
    value : a dict, list, tuple or plain value
    """
    if isinstance(value, Finding):
        found = {"code": value.code, "params": value.params}
        return found | ({"basis": value.basis} if value.basis == "assumed" else {})
    if is_dataclass(value) and not isinstance(value, type):
        return {part.name: getattr(value, part.name) for part in fields(value)}
    if isinstance(value, Mapping):
        return dict(value)
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def revived(value: Any) -> Any:
    """A parameter, or a finding, out of what JSON has of it.

    Parameters
    ----------
    value : as :func:`plain` makes it; one that is no longer plain is kept
    """
    if isinstance(value, list | tuple):
        return tuple(revived(part) for part in value)
    if not isinstance(value, dict):
        return value
    if value.keys() == {"value", "unit"}:
        return Amount(**value)
    if "code" in value:
        return Finding(**value)
    return {name: revived(part) for name, part in value.items()}


def turned_or_moved(value: float, slides: bool, per: str = "") -> Amount:
    """A joint's value, or its rate, with the unit that suits the joint.

    Parameters
    ----------
    value : in deg, or mm if the joint ``slides``
    slides : whether the joint is prismatic
    per : of a rate ``/s``, ``/s²`` or ``/s³``
    """
    return Amount(value, ("mm" if slides else "deg") + per)
