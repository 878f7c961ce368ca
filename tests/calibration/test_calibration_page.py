"""The page of ``er3a calibrate``."""

from __future__ import annotations

import base64
import re
import warnings

import numpy as np
import pytest
from typer.testing import CliRunner

import er3a
from er3a.pipeline.cli import app
from er3a.pipeline.viewing.calibration import write_calibration
from tests.conftest import ROOT
from tests.viewing.untranslated import PageTexts, plain_words, wide_letters

pytestmark = pytest.mark.long

DATA = ROOT / "data" / "measurements"
ROWS = 60


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A folder with measurements of seven joints, the corrected file, and the page made of them."""
    folder = tmp_path_factory.mktemp("calibration")
    lines = (DATA / "wam.csv").read_text(encoding="utf-8").splitlines()
    (folder / "wam.csv").write_text("\n".join(lines[: ROWS + 1]) + "\n", encoding="utf-8")
    (folder / "others.csv").write_text("\n".join([lines[0], *lines[ROWS + 1 : ROWS + 21]]) + "\n", encoding="utf-8")
    words = ["calibrate", str(DATA / "wam.yaml"), str(folder / "wam.csv"), "--held-back", str(folder / "others.csv")]
    words += ["--output", str(folder / "mine.yaml"), "--html", str(folder / "page.html")]
    # A machine without Chinese letters warns of them.
    with warnings.catch_warnings(action="ignore", category=UserWarning):
        done = CliRunner().invoke(app, [*words, "--language", "zh"])
    assert done.exit_code == 0, done.output
    return folder


def test_the_page_hands_out_the_corrected_robot(written):
    page = (written / "page.html").read_text(encoding="utf-8")
    found = re.search(r'href="data:text/plain;base64,([^"]+)" download="mine.yaml"', page)
    assert found is not None
    assert f"er3a compare {DATA / 'wam.yaml'} mine.yaml" in page
    (written / "given").mkdir()
    (written / "given/mine.yaml").write_text(base64.b64decode(found[1]).decode(), encoding="utf-8")
    given, mine = (er3a.load_robot(written / name) for name in ("given/mine.yaml", "mine.yaml"))
    q = np.random.default_rng(1).uniform(-1, 1, (20, 7))
    assert er3a.forward(given, q) == pytest.approx(er3a.forward(mine, q), abs=1e-12)
    assert '<html lang="zh-CN">' in page
    assert "留出的 20 个位置" in page


def test_each_word_of_the_page_can_be_translated(written, tmp_path):
    robot = er3a.load_robot(DATA / "wam.yaml")
    rows = er3a.load_measurements(written / "wam.csv", robot)
    found = er3a.calibrate(robot, rows)
    with wide_letters() as shown:
        write_calibration(robot, rows, found, tmp_path / "page.html", command=["er3a"], files=[], corrected=found.robot)
    page = PageTexts((tmp_path / "page.html").read_text(encoding="utf-8")).texts
    entries = {f"{each.name}" for each in found.estimates}
    own = {robot.title, robot.name, "calibrate", "compare", "compared.html", *entries}
    assert plain_words([*page, *shown], own) == []
