"""Pairs of bodies that can collide, by number and name."""

from __future__ import annotations

from er3a.finding import Finding

BASE = 0  # number of the fixed link
TRIED = 1024  # joint vectors, spread over the limits, in which each pair is tried
PENETRATION_TOLERANCE = 0.001  # m; no deeper overlap goes unnoticed, unless set otherwise
ASSUMED_MARGIN = 0.02  # m, within this distance of assumed shapes nothing is settled, unless set otherwise


Pair = Finding
"""Two bodies that can meet: ``link_pair`` (``first``, ``second``: 0 for the base, 1..6 for the link that joint 1..6
turns), ``link_and_solid`` (``link``, ``solid`` of the scene by its name), ``carried_and_link`` (``carried``: what the
tool carries, by its name), ``carried_and_solid``."""
_BODIES = {
    "link_pair": ("first", "second"),
    "link_and_solid": ("link", "solid"),
    "carried_and_link": ("link", "carried"),
    "carried_and_solid": ("carried", "solid"),
}


def bodies_of(pair: Pair) -> tuple[int | str, int | str]:
    """Two bodies, a link first.

    Parameters
    ----------
    pair : of bodies that can meet

    Returns
    -------
    bodies : links by number, others by name
    """
    first, second = (pair.params[name] for name in _BODIES[pair.code])
    return first, second


def names_of(pair: Pair) -> tuple[str, str]:
    """Names of two bodies.

    Parameters
    ----------
    pair : of bodies that can meet

    Returns
    -------
    names : such as ``base`` and ``link_3``, a link first
    """
    first, second = (link_label(body) if isinstance(body, int) else body for body in bodies_of(pair))
    return first, second


def label_of(pair: Pair) -> str:
    """Names of two bodies as one.

    Parameters
    ----------
    pair : of bodies that can meet

    Returns
    -------
    label : both names with a slash between, for columns of text
    """
    return "/".join(names_of(pair))


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
