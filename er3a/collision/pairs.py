"""Pairs of bodies that can collide, by number and name."""

from __future__ import annotations

from abc import ABC, abstractmethod

from er3a.by_value import Finding

BASE = 0  # number of the fixed link
TRIED = 1024  # joint vectors, spread over the limits, in which each pair is tried
PENETRATION_TOLERANCE = 0.001  # m; no deeper overlap goes unnoticed, unless set otherwise
ASSUMED_MARGIN = 0.02  # m, within this distance of assumed shapes nothing is settled, unless set otherwise


class TwoBodies(ABC):
    """Two bodies that can meet."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, str]:
        """Names of both bodies."""

    @property
    def label(self) -> str:
        """Both names with a slash between, for columns of text."""
        return "/".join(self.names)


class LinkPair(TwoBodies, Finding):
    """Two links: 0 for the base, 1..6 for the link that joint 1..6 turns."""

    first: int
    second: int

    @property
    def names(self) -> tuple[str, str]:
        """Such as ``base`` and ``link_3``."""
        return link_label(self.first), link_label(self.second)


class LinkAndSolid(TwoBodies, Finding):
    """A link and a solid of the scene, by its name."""

    link: int
    solid: str

    @property
    def names(self) -> tuple[str, str]:
        """The link's label and the solid's name."""
        return link_label(self.link), self.solid


class CarriedAndLink(TwoBodies, Finding):
    """What the tool carries, by its name, and a link."""

    carried: str
    link: int

    @property
    def names(self) -> tuple[str, str]:
        """The link's label and the name of what is carried."""
        return link_label(self.link), self.carried


class CarriedAndSolid(TwoBodies, Finding):
    """What the tool carries and a solid of the scene, by their names."""

    carried: str
    solid: str

    @property
    def names(self) -> tuple[str, str]:
        """The name of what is carried and the solid's name."""
        return self.carried, self.solid


Pair = LinkPair | LinkAndSolid | CarriedAndLink | CarriedAndSolid


class PairOverlaps(Finding):
    """Two bodies overlap, by a depth."""

    pair: Pair
    depth_mm: float


class PairTooNear(Finding):
    """Two bodies come nearer to each other than the margin that is to be kept."""

    pair: Pair
    clearance_mm: float
    margin_mm: float


class PairsUnexamined(Finding):
    """Pairs whose collisions were not looked at, because their shapes overlap in all joint vectors tried
    and so can't be right."""

    pairs: tuple[Pair, ...]


class ShapesAssumed(Finding):
    """No document that verdicts rest on gives the shapes of an arm's links: what is said of collisions rests on
    assumed ones.

    Attributes
    ----------
    given : whether the robot's file gives shapes, inferred or claimed; else they were guessed from its table
    margin_mm : within which of assumed shapes nothing is settled
    near : what comes so near to them without touching, by name
    partial : whether a document gives them, but for some links only in part
    """

    given: bool
    margin_mm: float
    near: tuple[str, ...] = ()
    partial: bool = False


def link_label(number: int) -> str:
    """A link's name in columns of text.

    Parameters
    ----------
    number : 0 for the base, k for the link that row k moves

    Returns
    -------
    label : ``base``, or such as ``link_3``
    """
    return "base" if number == BASE else f"link_{number}"
