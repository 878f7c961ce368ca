"""The tray where the workspace stage can put it, in words: on what it stands, its centre, edges and margins."""

from __future__ import annotations

from dataclasses import dataclass

from er3a.pipeline.language import as_text, own_title, tr
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import bracketed
from er3a.pipeline.messages.workspace import millimetres
from er3a.pipeline.stages.workspace.model import PlacementSummary, PlaceSummary, StandSummary


@dataclass(frozen=True, eq=False)
class Tray:
    """A tray at a place, with the stand that it needs.

    Attributes
    ----------
    place : of the tray
    below : the surface that it stands on or over, None in open space
    """

    place: PlaceSummary
    below: StandSummary | None

    @property
    def underside(self) -> float:
        """The height of its underside, m."""
        return float(self.place.centre_m[2] - self.place.size_m[2] / 2)

    @property
    def floor(self) -> float | None:
        """The height (m) that its stand comes from; None without one."""
        return self.below.height_m if self.below and self.below.place is None else None

    @property
    def where(self) -> str:
        """On what it stands."""
        if self.below is None:
            return tr("In the air: no surface is known there")
        name = own_title(self.below.name)
        if (height := millimetres([self.below.height_m])) != "0":
            name = bracketed(name, f"z = {height} mm")
        if self.floor is None:
            return tr("On {name}", name=name)
        return tr("On a stand {gap} mm high on {name}", gap=millimetres([self.underside - self.floor]), name=name)

    @property
    def line(self) -> str:
        """Where it stands, its centre and its edges."""
        return tr(
            "{where}, centre ({centre}) mm, edges {size} mm along x, y, z",
            where=self.where,
            centre=millimetres(self.place.centre_m),
            size=self.edges,
        )

    @property
    def edges(self) -> str:
        """Its edges along x, y and z, mm."""
        return " × ".join(as_text(1000 * edge, ".6g") for edge in self.place.size_m)

    @property
    def row(self) -> list[str]:
        """It as a row of a table: where, centre, edges, margins."""
        margins = limit_text(self.place), fixed(self.place.clearance_mm, 0)
        return [self.where, millimetres(self.place.centre_m), self.edges, *margins]


def limit_text(place: PlaceSummary) -> str:
    """How near to its limit a joint comes at a place, deg, and which."""
    margin = fixed(place.limit_margin_deg, 1)
    return bracketed(margin, f"J{place.limit_joint}" if place.limit_joint is not None else "")


def trays(summary: object) -> list[Tray]:
    """The tray at its best place, then at the best ones on or over other surfaces; empty if these results put none."""
    placement = getattr(summary, "placement", None)
    if not isinstance(placement, PlacementSummary) or not placement.named_places:
        return []
    best = placement.best
    below = placement.over if placement.stand is None else placement.stand
    standing = [(stand.place or stand.above, stand) for stand in placement.stands]
    return [Tray(best, below), *(Tray(place, stand) for place, stand in standing if place and place != best)]
