"""Several descriptions of one arm: who agrees with whom, layer by layer, and which is the odd one out."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

from er3a.by_value import frozen
from er3a.comparison.compare import Comparison, compare
from er3a.robots.robot import Robot

LAYERS = "units", "geometry", "zero", "directions", "base", "flange", "coupling", "limits", "speeds"
Pairs = Mapping[tuple[str, str], Comparison]


@frozen
class Agreement:
    """Of one layer, the sources that agree with each other, the largest group first.

    ``silent``: sources that don't give this layer, or whose joints can't be paired with those of any other. ``odd``:
    those that differ from more than half of all that speak.
    """

    layer: str
    groups: tuple[tuple[str, ...], ...]
    silent: tuple[str, ...]
    odd: tuple[str, ...]


def compared_in_pairs(arms: Mapping[str, Robot], *, tolerance_mm: float, tolerance_deg: float) -> Pairs:
    """Each of several arms compared with each later one.

    Parameters
    ----------
    arms : by name
    tolerance_mm, tolerance_deg : by how much lengths and angles may differ and still agree

    Returns
    -------
    pairs : comparisons by the two names
    """
    return {
        (one, other): compare(arms[one], arms[other], tolerance_mm=tolerance_mm, tolerance_deg=tolerance_deg)
        for one, other in itertools.combinations(arms, 2)
    }


def agreements(names: Sequence[str], pairs: Pairs) -> list[Agreement]:
    """Who agrees with whom, for each layer that any two of them differ in or agree on.

    Parameters
    ----------
    names : of all arms
    pairs : as :func:`compared_in_pairs` finds them

    Returns
    -------
    found : a source is in the first group all of whose members it agrees with
    """
    found = []
    for layer in LAYERS:
        agree = {frozenset(pair): _agrees(each, layer) for pair, each in pairs.items()}
        speaking = [name for name in names if any(name in pair and said is not None for pair, said in agree.items())]
        groups: list[list[str]] = []
        for name in speaking:
            home = next((group for group in groups if all(agree[frozenset((name, each))] for each in group)), None)
            if home is None:
                groups.append([name])
            else:
                home.append(name)
        groups.sort(key=len, reverse=True)
        majority = bool(groups) and 2 * len(groups[0]) > len(speaking)
        odd = tuple(name for group in groups[1:] for name in group) if majority else ()
        silent = tuple(name for name in names if name not in speaking)
        found.append(Agreement(layer, tuple(map(tuple, groups)), silent, odd))
    return found


def _agrees(found: Comparison, layer: str) -> bool | None:
    """None where a side says nothing of a layer."""
    own = getattr(found, layer)
    return None if own is None else own.same
