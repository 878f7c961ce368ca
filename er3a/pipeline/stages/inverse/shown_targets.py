"""Which targets pages and recordings show where a study names many."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from er3a.pipeline.stages.inverse.model import TargetResult

MOST_SHOWN = 60


def shown_targets(targets: Sequence[TargetResult]) -> list[TargetResult]:
    """All targets, in their order; of more than 60 as many of each outcome, taken evenly over the list."""
    if len(targets) <= MOST_SHOWN:
        return list(targets)
    by_outcome: dict[str, list[int]] = {}
    for number, target in enumerate(targets):
        by_outcome.setdefault(target.outcome, []).append(number)
    taken: list[int] = []
    left, kinds = MOST_SHOWN, len(by_outcome)
    for done, numbers in enumerate(sorted(by_outcome.values(), key=len)):
        count = min(len(numbers), left // (kinds - done))
        taken += [numbers[int(k)] for k in np.linspace(0, len(numbers) - 1, count).round()]
        left -= count
    return [targets[number] for number in sorted(taken)]
