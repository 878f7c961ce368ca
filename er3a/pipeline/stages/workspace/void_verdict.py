"""What the voids say about the model."""

from __future__ import annotations

from collections.abc import Sequence

from er3a.pipeline.results import Verdict
from er3a.pipeline.stages.workspace.workspace_findings import (
    Flat,
    NoVoid,
    Undersampled,
    VoidAtShoulder,
    VoidUncertain,
    VoidUnexpected,
    WorkspaceFinding,
)
from er3a.workspace.sampled_voids import UNSEEN_RATIO
from er3a.workspace.voids import Void


def judge(
    hull_volume: float,
    voids: Sequence[Void],
    touched: int,
    unseen: float,
    proof: bool,
    undecided_percent: float | None = None,
) -> Verdict[WorkspaceFinding]:
    """The stage's verdict.

    An enclosed void about the shoulder is what every arm leaves that can't fold onto itself. Any other one is a hole
    where none is expected, which points to a wrong limit or direction of joints 2 or 3.

    Parameters
    ----------
    hull_volume : m^3
    touched : number of touched cells; unseen : cells that more samples would touch
    proof : whether there is a proof that settles most; undecided_percent : what it leaves undecided, where that is told
    """
    if hull_volume == 0:
        return Verdict("caution", Flat())
    if not proof and unseen > UNSEEN_RATIO * touched:
        return Verdict("caution", Undersampled(100 * unseen / (unseen + touched)))
    enclosed = [void for void in voids if void.kind == "enclosed"]
    elsewhere = [void for void in enclosed if not void.holds_shoulder]
    unexpected = [void for void in elsewhere if void.status == "proven_empty"]
    if unexpected:
        return Verdict("caution", VoidUnexpected(*_size_and_place(unexpected[0]), unexpected[0].cause))
    if elsewhere:
        return Verdict("caution", VoidUncertain(*_size_and_place(elsewhere[0])))
    if enclosed:
        return Verdict("pass", VoidAtShoulder(*_size_and_place(enclosed[0])))
    return Verdict("pass", NoVoid(proof, undecided_percent))


def _size_and_place(void: Void) -> tuple[float, float, float, float]:
    """Litres, and the centre in mm."""
    x, y, z = (1000 * value for value in void.centroid.tolist())
    return 1000 * (void.lower or void.upper), x, y, z
