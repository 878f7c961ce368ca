"""Poses that add most."""

from __future__ import annotations

import numpy as np
import pytest

from er3a.calibration.plan import d_optimal


def test_blocks_that_add_most_are_those_of_a_brute_force(random):
    blocks = list(random.normal(size=(12, 3, 4)))
    chosen = d_optimal(np.zeros((4, 4)), blocks, 3)
    information = 1e-9 * np.eye(4)
    for at in chosen:
        dets = [np.linalg.det(information + block.T @ block) for block in blocks]
        assert dets[at] == pytest.approx(max(dets))
        information = information + blocks[at].T @ blocks[at]
