"""Whether positions suffice to estimate a level of entries, and what more it takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from er3a.calibration.parameters import (
    LEVELS,
    SCALE,
    Parameter,
    Subspace,
    jacobian,
    listed,
    parameters_of,
    subspace,
)
from er3a.errors import IdentificationError
from er3a.kinematics.table_batch import tables_of
from er3a.numerics.quasi_random import spread
from er3a.pipeline.messages.language import N_, joined, said
from er3a.references.quantities import CarriedCoordinate, PointCoordinate
from er3a.references.reference import Reference
from er3a.robots.robot import Robot

RICH_POSES = 64
SHOWN_POSES = 3


@dataclass(frozen=True, eq=False)
class Level:
    """The entries that are estimated.

    Attributes
    ----------
    name : one of ``LEVELS``
    parameters : its entries; subspace : which of them the references determine
    deviation : (n,), standard deviation of the references, mm
    more : what a fuller level would take, in words
    """

    name: str
    parameters: tuple[Parameter, ...]
    subspace: Subspace
    deviation: np.ndarray
    more: str = ""


def choose_level(robot: Robot, references: tuple[Reference, ...], deviation: np.ndarray) -> Level:
    """The fullest level that the references determine as far as positions of these points ever can, with numbers to
    spare.

    Raises
    ------
    IdentificationError
        if even the lengths ask for more; the message says what is needed
    """
    if not references:
        raise IdentificationError(N_("there are no positions of single points to identify anything from"))
    rich = _rich(robot, references)
    more = ""
    for name in LEVELS[::-1]:
        parameters = parameters_of(robot, name)
        here = subspace(robot, parameters, references, deviation)
        best = subspace(robot, parameters, rich, np.full(len(rich), np.median(deviation)))
        lacking = len(best.kept) - len(here.kept)
        if not lacking and len(references) > len(here.kept):
            return Level(name, parameters, here, deviation, more)
        more = _what_more(robot, name, parameters, here, best, references)
    raise IdentificationError(more)


def _rich(robot: Robot, references: Sequence[Reference]) -> tuple[Reference, ...]:
    """The same points at poses all over the joint range."""
    points = dict.fromkeys(
        replace(r.quantity, coordinate=c)
        if isinstance(r.quantity, CarriedCoordinate | PointCoordinate)
        else PointCoordinate(r.quantity.seen_at, "wrist_centre", c)
        for r in references
        for c in "xyz"
    )
    kinds = dict.fromkeys(replace(quantity, pose=(0.0,) * 6) for quantity in points)
    return tuple(
        Reference("", "key poses", replace(kind, pose=pose), 0.0, 1.0, "", "inferred")
        for pose in _spread(robot)
        for kind in kinds
    )


def _spread(robot: Robot) -> list[tuple[float, ...]]:
    low, high = np.degrees(robot.lower), np.degrees(robot.upper)
    return [tuple(map(float, row)) for row in np.round(spread(low, high, RICH_POSES) / 5) * 5 + 0.0]


def _what_more(
    robot: Robot,
    name: str,
    parameters: tuple[Parameter, ...],
    here: Subspace,
    best: Subspace,
    references: tuple[Reference, ...],
) -> str:
    poses = len({reference.quantity.seen_at for reference in references})
    lacking = len(best.kept) - len(here.kept)
    undetermined = [parameters[k].name for k in best.kept if k not in here.kept]
    least = -(-max(lacking, len(best.kept) + 1 - len(references)) // 3)
    template = (
        N_(
            "{coordinates} coordinates at {poses} poses determine {here} of the {best} entries ({level}) that "
            "positions of these points can determine"
        )
        if poses > 1
        else N_(
            "{coordinates} coordinates at 1 pose determine {here} of the {best} entries ({level}) that positions of "
            "these points can determine"
        )
    )
    known = said(
        template, coordinates=len(references), poses=poses, here=len(here.kept), best=len(best.kept), level=name
    )
    needed = (
        said("it takes at least {least} more positions", least=least)
        if least > 1
        else N_("it takes at least 1 more position")
    )
    if undetermined:
        needed = said("{needed} for {entries}", needed=needed, entries=joined(undetermined, ", "))
    return said(
        "{known}; {needed}. Spread them over all joints, for example {examples}.",
        known=known,
        needed=needed,
        examples=_examples(robot, parameters, best, references),
    )


def _examples(
    robot: Robot, parameters: tuple[Parameter, ...], best: Subspace, references: tuple[Reference, ...]
) -> str:
    """Poses that add most to what is known: greedily the greatest gain in ln det of the information matrix."""
    kept = [parameters[k] for k in best.kept]
    spread = _spread(robot)
    candidates = [
        Reference("", "key poses", PointCoordinate(pose, "flange", c), 0.0, 1.0, "", "inferred")
        for pose in spread
        for c in "xyz"
    ]
    table = tables_of(robot)
    blocks = SCALE * jacobian(table, robot, kept, candidates).reshape(len(spread), 3, len(kept))
    known = SCALE * jacobian(table, robot, kept, references)
    information = known.T @ known + 1e-9 * np.eye(len(kept))
    chosen = []
    for _ in range(SHOWN_POSES):
        gain = [np.linalg.slogdet(information + block.T @ block)[1] for block in blocks]
        at = int(np.argmax(gain))
        information += blocks[at].T @ blocks[at]
        chosen.append("(" + ", ".join(f"{angle:g}" for angle in spread[at]) + ") deg")
    return listed(chosen)
