"""Pairs of bodies that can collide, by number and name."""

from __future__ import annotations

from abc import ABC, abstractmethod

from er3a.by_value import Coded

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


class LinkPair(TwoBodies, Coded):
    """Two links: 0 for the base, 1..6 for the link that joint 1..6 turns."""

    first: int
    second: int

    @property
    def names(self) -> tuple[str, str]:
        """Such as ``base`` and ``link_3``."""
        return link_label(self.first), link_label(self.second)


class LinkAndSolid(TwoBodies, Coded):
    """A link and a solid of the scene, by its name."""

    link: int
    solid: str

    @property
    def names(self) -> tuple[str, str]:
        """The link's label and the solid's name."""
        return link_label(self.link), self.solid


class CarriedAndLink(TwoBodies, Coded):
    """What the tool carries, by its name, and a link."""

    carried: str
    link: int

    @property
    def names(self) -> tuple[str, str]:
        """The link's label and the name of what is carried."""
        return link_label(self.link), self.carried


class CarriedAndSolid(TwoBodies, Coded):
    """What the tool carries and a solid of the scene, by their names."""

    carried: str
    solid: str

    @property
    def names(self) -> tuple[str, str]:
        """The name of what is carried and the solid's name."""
        return self.carried, self.solid


Pair = LinkPair | LinkAndSolid | CarriedAndLink | CarriedAndSolid


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
