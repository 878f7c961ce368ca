"""Valid degrees and millimetres are never refused for being small; radians and metres are, with the column that says
that the values are meant as they are written."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from er3a.errors import InputError
from er3a.files.reference_sets import check_reference_file

HEADER = "name,point,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm,uncertainty_mm,source,grade,origin"
BEHIND = "0.1,s,measured,sheet"


def positions(folder, q, xyz, checked=None):
    """A file of positions; ``checked``: what each row has in the column units_checked."""
    marks = checked or [None] * len(q)
    rows = [
        f"p{k},flange,{','.join(f'{v:.6g}' for v in pose)},{','.join(f'{v:.6g}' for v in point)},{BEHIND}"
        + ("" if mark is None else f",{mark}")
        for k, (pose, point, mark) in enumerate(zip(q, xyz, marks))
    ]
    path = folder / "positions.csv"
    head = HEADER if checked is None else f"{HEADER},units_checked"
    path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("seed", range(20))
def test_small_angles_among_degrees_are_read(tmp_path, seed):
    random = np.random.default_rng(seed)
    q = random.uniform(-170, 170, (60, 6)).round(3)
    q[3, 2], q[7, 4], q[9] = -1.047, 1.571, random.uniform(-3, 3, 6).round(3)
    xyz = random.uniform(-900, 900, (60, 3)).round(2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert len(check_reference_file(positions(tmp_path, q, xyz))) == 60


def test_radians_and_metres_are_refused_unless_every_row_says_that_it_was_checked(tmp_path):
    random = np.random.default_rng(0)
    q, xyz = np.radians([[90.0, 45, -30, 60, 15, 180]] * 3) + 0.0, random.uniform(200, 900, (3, 3))
    q[:, 0] = [np.pi / 2, np.pi / 3, np.pi / 4]
    for values, lengths, text in ((q, xyz, "radians"), (np.degrees(q), xyz / 1000, "metres")):
        with pytest.raises(InputError, match=rf"{text}.*units_checked") as refused:
            check_reference_file(positions(tmp_path, values, lengths))
        assert "column" in str(refused.value)
        with pytest.raises(InputError, match=text):
            check_reference_file(positions(tmp_path, values, lengths, ["yes", "", "yes"]))
        found = check_reference_file(positions(tmp_path, values, lengths, ["yes"] * 3))
        assert found[0].pose == pytest.approx(values[0], abs=1e-5)
        assert found[0].xyz_mm == pytest.approx(lengths[0], abs=1e-2)
    with pytest.raises(InputError, match="units_checked: 'no' is not known"):
        check_reference_file(positions(tmp_path, q, xyz, ["no"] * 3))
