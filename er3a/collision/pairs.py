"""Pairs of bodies that can collide, by number and name."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Literal

BASE = 0  # number of the link that stands still
TRIED = 1024  # joint vectors, spread over the limits, in which each pair is tried
PENETRATION_TOLERANCE = 0.001  # m; no overlap deeper than this goes unnoticed, where nothing else is asked
ASSUMED_MARGIN = 0.02  # m, within which of assumed shapes nothing is settled, where nothing else is asked


class TwoBodies(ABC):
    """Two bodies that can meet."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, str]:
        """Of both bodies."""

    @property
    def label(self) -> str:
        """For columns of text."""
        return "/".join(self.names)


@dataclass(frozen=True)
class LinkPair(TwoBodies):
    """Two links: 0 for the base, 1..6 for the link that joint 1..6 turns."""

    first: int
    second: int
    code: Literal["link_pair"] = "link_pair"

    @property
    def names(self) -> tuple[str, str]:
        return link_label(self.first), link_label(self.second)


@dataclass(frozen=True)
class LinkAndSolid(TwoBodies):
    """A link and a solid of the scene, by its name."""

    link: int
    solid: str
    code: Literal["link_and_solid"] = "link_and_solid"

    @property
    def names(self) -> tuple[str, str]:
        return link_label(self.link), self.solid


@dataclass(frozen=True)
class CarriedAndLink(TwoBodies):
    """What the tool carries, by its name, and a link."""

    carried: str
    link: int
    code: Literal["carried_and_link"] = "carried_and_link"

    @property
    def names(self) -> tuple[str, str]:
        return link_label(self.link), self.carried


@dataclass(frozen=True)
class CarriedAndSolid(TwoBodies):
    """What the tool carries and a solid of the scene, by their names."""

    carried: str
    solid: str
    code: Literal["carried_and_solid"] = "carried_and_solid"

    @property
    def names(self) -> tuple[str, str]:
        return self.carried, self.solid


Pair = LinkPair | LinkAndSolid | CarriedAndLink | CarriedAndSolid


@dataclass(frozen=True)
class PairOverlaps:
    """Two bodies overlap, by a depth."""

    pair: Pair
    depth_mm: float
    code: Literal["pair_overlaps"] = "pair_overlaps"


@dataclass(frozen=True)
class PairTooNear:
    """Two bodies come nearer to each other than the margin that is to be kept."""

    pair: Pair
    clearance_mm: float
    margin_mm: float
    code: Literal["pair_too_near"] = "pair_too_near"


@dataclass(frozen=True)
class PairsUnexamined:
    """Pairs whose collisions were not looked at, because their shapes overlap in all joint vectors tried
    and so can't be right."""

    pairs: tuple[Pair, ...]
    code: Literal["pairs_unexamined"] = "pairs_unexamined"


@dataclass(frozen=True)
class ShapesAssumed:
    """No document that verdicts rest on gives the shapes of an arm's links: what is said of collisions rests on
    assumed ones.

    Attributes
    ----------
    given : whether the robot's file gives shapes, inferred or claimed; else they were guessed from its table
    margin_mm : within which of assumed shapes nothing is settled
    near : what comes so near to them without touching, by name
    """

    given: bool
    margin_mm: float
    near: tuple[str, ...] = ()
    code: Literal["shapes_assumed"] = "shapes_assumed"


def link_label(number: int) -> str:
    """A link's name in columns of text."""
    return "base" if number == BASE else f"link_{number}"
