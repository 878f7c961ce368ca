"""The archive of a finished study: whole, and RO-Crate by an independent validator's word."""

from __future__ import annotations

import shutil
import zipfile
from importlib.resources import files

import pytest
import requests
from rocrate_validator import models, services
from rocrate_validator.utils.http import HttpRequester

from er3a.archive import archive
from er3a.errors import ResultError


@pytest.fixture
def packed(small_study, tmp_path, monkeypatch):
    monkeypatch.chdir(small_study.folder)
    folder = small_study.folder
    output = tmp_path / "study.zip"
    count = archive(folder / "config/small.yaml", folder / "results", folder / "reports", output)
    with zipfile.ZipFile(output) as zipped:
        assert len(zipped.namelist()) == count + 1
    return output


def test_archive_holds_pages_recordings_results_and_inputs(packed, small_study):
    with zipfile.ZipFile(packed) as zipped:
        names = set(zipped.namelist())
        for page in small_study.folder.glob("reports/*/*.html"):
            assert zipped.read(page.relative_to(small_study.folder).as_posix()) == page.read_bytes()
    for robot in ("er3a_c60", "er3a_c60_article", "er3_600"):
        assert {f"data/robots/{robot}.yaml", f"data/targets/{robot}.yaml", f"data/paths/{robot}.yaml"} <= names
        assert {f"reports/{robot}/workspace.rrd", f"results/{robot}/workspace/summary.json"} <= names
    assert {"reports/index.html", "config/small.yaml"} <= names


def test_a_validator_accepts_it(packed, tmp_path, monkeypatch):
    crate = tmp_path / "crate"
    shutil.unpack_archive(packed, crate)

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
    result = services.validate(settings)
    assert [f"{issue.check.identifier}: {issue.message}" for issue in result.get_issues()] == []
    (crate / "reports/index.html").unlink()
    assert services.validate(settings).has_issues(), "a file that is listed and missing should be found"


def test_an_unfinished_study_is_one_error(small_study, tmp_path, monkeypatch):
    monkeypatch.chdir(small_study.folder)
    folder = small_study.folder
    with pytest.raises(ResultError, match="missing"):
        archive(folder / "config/small.yaml", folder / "results", tmp_path / "reports", tmp_path / "study.zip")
    assert not list(tmp_path.glob("*.zip"))
