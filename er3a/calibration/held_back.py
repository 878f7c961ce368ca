"""What measured positions that a calibration did not fit say of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from er3a.calibration.calibrate import Calibration
from er3a.calibration.observations import Measurement
from er3a.finding import Finding, fact

CONTRADICTING = 3.0
"""Times the error at poses left out: positions held back that are farther off are not where the model puts them."""
AGAINST = ("held_back_contradict", "held_back_elsewhere")


def held_back_findings(
    found: Calibration, fitted: Sequence[Measurement], others: Sequence[Measurement]
) -> tuple[Finding, ...]:
    """That positions held back were fitted, that they contradict the fit, or that it does not hold where they are.

    Parameters
    ----------
    fitted, others : measured positions that it rests on, and those held back

    Returns
    -------
    findings : ``held_back_all_fitted``; or ``held_back_fitted`` with how many test nothing, and one of ``AGAINST``
    """
    fitted_too = {(each.pose, each.point) for each in fitted}
    unseen = [each for each in others if (each.pose, each.point) not in fitted_too]
    seen = len(others) - len(unseen)
    if seen and not unseen:
        return (fact("held_back_all_fitted"),)
    findings = [fact("held_back_fitted", count=seen)] if seen else []
    expected = found.beyond.left_out if found.beyond else found.left_out
    if not (expected and unseen):
        return tuple(findings)
    poses, known = (np.array([each.pose for each in rows]) for rows in (unseen, fitted))
    inside = ((poses >= known.min(axis=0)) & (poses <= known.max(axis=0))).all(axis=1)
    distances, usual = found.distances_mm(unseen), max(expected.mean_mm, expected.far_mean_mm)
    for code, where in zip(AGAINST, (inside, ~inside)):
        if where.any() and (mean := float(distances[where].mean())) > CONTRADICTING * usual:
            return (*findings, fact(code, count=int(where.sum()), mean_mm=mean, usual_mm=usual))
    return tuple(findings)
