"""The archive of a finished study: whole, and RO-Crate by an independent validator's word."""

from __future__ import annotations

import shutil
import zipfile
from importlib.resources import files
from pathlib import Path

import pytest
import requests
import yaml
from rocrate_validator import models, services
from rocrate_validator.utils.http import HttpRequester

from er3a.errors import ResultError
from er3a.pipeline.archive import archive
from testing.small_study import stages_of

pytestmark = pytest.mark.long  # of the small study


@pytest.fixture
def pack(small_study, tmp_path, monkeypatch):
    """Packs the small study, cut down to the robots that are named."""
    monkeypatch.chdir(small_study.folder)

    def packed(*robots: str, **settings: object) -> Path:
        study = yaml.safe_load(Path("config/small.yaml").read_text()) | settings
        study["robots"] = {robot: study["robots"][robot] for robot in robots}
        (tmp_path / "small.yaml").write_text(yaml.safe_dump(study))
        count = archive(tmp_path / "small.yaml", Path("results"), Path("reports"), tmp_path / "study.zip")
        with zipfile.ZipFile(tmp_path / "study.zip") as zipped:
            assert len(zipped.namelist()) == count + 1
        return tmp_path / "study.zip"

    return packed


def test_archive_holds_pages_recordings_results_and_inputs(pack, small_study):
    with zipfile.ZipFile(pack(*small_study.robots)) as zipped:
        names = set(zipped.namelist())
        for page in small_study.folder.glob("reports/*/*.html"):
            assert zipped.read(page.relative_to(small_study.folder).as_posix()) == page.read_bytes()
    for robot in small_study.robots:
        asked = (f"data/targets/{robot}.yaml", f"data/paths/{robot}.yaml") if "trajectory" in stages_of(robot) else ()
        assert {f"data/robots/{robot}.yaml", *asked} <= names
        assert {f"reports/{robot}/workspace.rrd", f"results/{robot}/workspace/summary.json"} <= names
    assert {"reports/index.html", "config/small.yaml"} <= names


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # the validator's, of the libraries that it uses
def test_a_validator_accepts_it_but_for_a_file_that_is_listed_and_missing(pack, tmp_path, monkeypatch):
    crate = tmp_path / "crate"
    shutil.unpack_archive(pack("er3_600"), crate)
    (crate / "reports/index.html").unlink()

    def context(url: str, **_: object) -> requests.Response:
        """The validator asks the network for the context; the library that writes crates ships it."""
        assert url == "https://w3id.org/ro/crate/1.3/context"
        answer = requests.Response()
        answer.status_code, answer.url = 200, url
        answer.headers["Content-Type"] = "application/ld+json"
        answer._content = files("rocrate").joinpath("data/ro-crate.jsonld").read_bytes()
        return answer

    monkeypatch.setattr(HttpRequester, "get", staticmethod(context), raising=False)
    settings = services.ValidationSettings(
        rocrate_uri=str(crate),
        profile_identifier="ro-crate-1.3",
        requirement_severity=models.Severity.REQUIRED,
        skip_availability_check=True,
    )
    (issue,) = services.validate(settings).get_issues()
    assert "reports/index.html" in issue.message, issue.check.identifier


def test_an_unfinished_study_is_one_error(small_study, tmp_path, monkeypatch):
    monkeypatch.chdir(small_study.folder)
    folder = small_study.folder
    with pytest.raises(ResultError, match="missing"):
        archive(folder / "config/small.yaml", folder / "results", tmp_path / "reports", tmp_path / "study.zip")
    assert not list(tmp_path.glob("*.zip"))


def test_results_of_other_settings_than_those_at_hand_are_not_packed(pack, small_study):
    with pytest.raises(ResultError, match=r"computed before these changed: the study's settings\. Run the study again"):
        pack("er3_600", seed=7)
