"""What the workspace stage's verdict can be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from er3a.workspace.causes import VoidCause
from er3a.workspace.surface import Surface


@dataclass(frozen=True)
class Flat:
    """The tool point moves on a line or not at all."""

    code: Literal["workspace.flat"] = "workspace.flat"


@dataclass(frozen=True)
class OnSurface:
    """The tool point moves on a surface; its area as :class:`er3a.workspace.surface.Surface` has it."""

    surface: Surface
    code: Literal["workspace.on_surface"] = "workspace.on_surface"


@dataclass(frozen=True)
class Undersampled:
    """Too few samples for the cells, without a proof."""

    unseen_percent: float
    code: Literal["workspace.undersampled"] = "workspace.undersampled"


@dataclass(frozen=True)
class VoidUnexpected:
    """An enclosed void away from the shoulder, proven empty."""

    litres: float
    x_mm: float
    y_mm: float
    z_mm: float
    cause: VoidCause
    code: Literal["workspace.void_unexpected"] = "workspace.void_unexpected"


@dataclass(frozen=True)
class VoidUncertain:
    """An enclosed void away from the shoulder that only samples tell of."""

    litres: float
    x_mm: float
    y_mm: float
    z_mm: float
    code: Literal["workspace.void_uncertain"] = "workspace.void_uncertain"


@dataclass(frozen=True)
class VoidAtShoulder:
    """An enclosed void about the shoulder, as every arm leaves that can't fold onto itself."""

    litres: float
    x_mm: float
    y_mm: float
    z_mm: float
    code: Literal["workspace.void_at_shoulder"] = "workspace.void_at_shoulder"


@dataclass(frozen=True)
class NoVoid:
    """No enclosed void, by the proof or by samples alone; ``undecided_percent`` is what the general proof leaves
    undecided of the volume."""

    proven: bool
    undecided_percent: float | None = None
    code: Literal["workspace.no_void"] = "workspace.no_void"


WorkspaceFinding = Flat | OnSurface | Undersampled | VoidUnexpected | VoidUncertain | VoidAtShoulder | NoVoid
