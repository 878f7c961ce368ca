"""Fixtures that all tests share."""

from __future__ import annotations

import gc
import os
import re
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import yaml
from filelock import FileLock
from hypothesis import settings
from numba.core.registry import CPUDispatcher

from er3a.files.robot_library import load_robot
from er3a.kinematics.classes import six_revolute
from er3a.pipeline.cli import main
from er3a.pipeline.stages.run import compute
from er3a.pipeline.study import Study
from er3a.pipeline.viewing.viewer import without_statistics
from er3a.robots.robot import Robot
from testing.made_once import SHARED
from testing.processes import run
from testing.small_study import STUDY, fresh

ROBOTS = ("er3a_c60", "er3a_c60_article", "er3_600")
ROBOT = "er3_600"  # the one of those tests for which one is enough
LONGEST_S = 900
MOST_FAST_S, SHOWN_SLOW = 0.4, 20  # processor time of a test of the fast set
FIRST_FILES = (  # these compile most kernels, either other ones: one process each, then the longest
    "stages/test_checked.py",
    "kinematics/test_inverse.py",
    "kinematics/test_numerical.py",
    "integration/test_wheel.py",
    "identifiability/test_evidence.py",
    "browser/test_page_use.py",
    "browser/test_teach_page.py",
    "integration/test_killed_run.py",
    "integration/test_pipeline.py",
    "integration/test_strangers_study.py",
    "viewing/test_article.py",
    "browser/test_pages.py",
    "identifiability/test_oracle.py",
    "calibration/test_points.py",
    "robots/test_urdf_round_trip.py",
    "kinematics/test_by_class.py",
    "comparison/test_compare.py",
    "integration/test_offices.py",
    "collision/test_meshes.py",  # else beside test_surfaces.py, each compiling the same
)
ROOMS_OF_COLLISIONS = ("program_check", "programs", "robots", "stages", "vision", "workspace", "planning", "collision")
ROOT = Path(__file__).resolve().parents[1]
ALL_LONG = re.compile(r"^pytestmark = (\[\s*)?pytest\.mark\.long\b", re.MULTILINE)

settings.register_profile("no test asserts on time", deadline=None, max_examples=25)
settings.load_profile("no test asserts on time")


# What is imported and collected stays to the end: looking for garbage in it takes a tenth of all processor time.
gc.disable()


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop() -> None:
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)
    gc.enable()


def pytest_unconfigure() -> None:
    gc.unfreeze()


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """The fast set does not import modules whose tests are all long: some load peers for seconds."""
    if config.getoption("markexpr") != "not long" or collection_path.suffix != ".py":
        return None
    return True if ALL_LONG.search(collection_path.read_text(encoding="utf-8")) else None


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector: pytest.Collector) -> Iterator[None]:
    """Every other process collects backwards: what one has compiled to bytecode the others then load."""
    report = yield
    if not isinstance(collector, pytest.Module | pytest.Class) and _process_number() % 2:
        report.result.reverse()
    return report


def _process_number() -> int:
    return int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests of the small study or of a stage's results of it are long; time limits of long ones and of Snakemake's.

    Processes are given one file after the other (pyproject.toml): the longest first, then those that need none of the
    kernels that the first is compiling, those with short tests last.
    """
    ranks = {ROOT / "tests" / name: rank for rank, name in enumerate(FIRST_FILES)}
    rooms = {"kinematics": -1, **dict.fromkeys(ROOMS_OF_COLLISIONS, 1), "tests": 2}
    items.sort(key=lambda item: (ranks.get(item.path, len(ranks)), rooms.get(item.path.parent.name, 0), item.path))
    for item in items:
        fixtures = getattr(item, "fixturenames", ())
        if {"small_study", "small_results"} & set(fixtures):
            item.add_marker(pytest.mark.long)
        if "shared_folder" in fixtures or item.get_closest_marker("long"):
            item.add_marker(pytest.mark.timeout(LONGEST_S))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """How much processor time each test and the processes that it starts take, for the report at the end."""
    start = sum(os.times()[:4])
    try:
        return (yield)
    finally:
        item.user_properties.append(("processor_s", sum(os.times()[:4]) - start))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """With ``--durations`` name long tests of the fast set, so that they are marked; cold kernels count, too."""
    if terminalreporter.config.getoption("durations") is None:
        return
    passed = terminalreporter.stats.get("passed", ())
    spent = [(dict(each.user_properties).get("processor_s", 0.0), each) for each in passed]
    slow = [(used, each.nodeid) for used, each in spent if used > MOST_FAST_S and "long" not in each.keywords]
    for used, name in sorted(slow, reverse=True)[:SHOWN_SLOW]:
        terminalreporter.write_line(f"long, and not marked so: {name} ({used:.1f} s of processor time)")


def pytest_collection_finish() -> None:
    """Modules and tests live to the end: the collector goes through what is new, and seldom (a tenth of the time)."""
    gc.freeze()
    gc.set_threshold(50_000, 20, 50)


def pytest_sessionfinish() -> None:
    """Libraries written in C complain of what is left when Python ends."""
    gc.unfreeze()


@pytest.fixture(scope="session", autouse=True)
def _ask_nobody() -> Iterator[None]:
    """Rerun's programs that tests start collect no statistics; Snakemake's plugin waits for no Slurm.

    Where Slurm's client is installed and no controller answers, each start of Snakemake would wait 9 s for it.
    """
    with without_statistics() as environment, pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CONFIG_HOME", environment["XDG_CONFIG_HOME"])
        patch.setenv("SLURM_CONF", os.devnull)
        yield


@pytest.fixture(scope="session", autouse=True)
def _shared_by_processes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Name the folder that all processes of this test run share."""
    own = tmp_path_factory.getbasetemp()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(SHARED, str(own.parent if "PYTEST_XDIST_WORKER" in os.environ else own))
        yield


@pytest.fixture(params=["er3_600", "er3a_c60_article"])
def robot(request: pytest.FixtureRequest) -> Robot:
    """Two of the project's robots in turn: one with offsets of links 1 and 3, one without."""
    return load_robot(request.param)


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory):
    """Headless Chromium; skipped with its reason where there is none."""
    from testing import chromium  # half a second of Selenium, which the fast set does not need

    if reason := chromium.lacking():
        if os.environ.get("CI") == "true":
            pytest.fail("CI must have Chromium and its driver")
        pytest.skip(reason)
    started = chromium.start(tmp_path_factory.mktemp("chromium"))
    yield started
    started.quit()


@pytest.fixture
def random() -> np.random.Generator:
    """A generator with a fixed seed."""
    return np.random.default_rng(20261120)


@pytest.fixture
def uncompiled(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Kernels run as the Python that they are written in: those of the general arms take half a minute to compile.

    Long tests run them compiled. A chain's readings are tried at two poses only.
    """
    rooms = ("er3a.", "testing.", "tests.")
    for module in [module for name, module in sys.modules.items() if name.startswith(rooms)]:
        for name, value in list(vars(module).items()):
            if isinstance(value, CPUDispatcher):
                monkeypatch.setattr(module, name, value.py_func)
    monkeypatch.setattr(six_revolute, "TRIALS", 2)
    with np.errstate(all="ignore"):  # as kernels have it
        yield


Call = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def call(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    """Calls ``er3a`` with some words in a folder (the project's), as a person would, but in this process."""

    def called(*words: str | Path, folder: Path = ROOT) -> subprocess.CompletedProcess[str]:
        command = ["er3a", *map(str, words)]
        with monkeypatch.context() as patch, warnings.catch_warnings():
            patch.chdir(folder)
            patch.setattr(sys, "argv", command)
            patch.delenv("FORCE_COLOR", raising=False)
            warnings.simplefilter("default")
            with pytest.raises(SystemExit) as ended:
                main()
        return subprocess.CompletedProcess(command, ended.value.code or 0, *capfd.readouterr())

    return called


RUN_PARTS = ("results", "reports", "logs", ".snakemake")  # what a run leaves
ALL_THERE = "all results, recordings and reports are there"  # the message of rule all, which does nothing


@dataclass(frozen=True)
class StudyRun:
    """A copy of the project in which the small study is run."""

    folder: Path

    @property
    def robots(self) -> tuple[str, ...]:
        """The robots of its study."""
        return tuple(yaml.safe_load((self.folder / STUDY).read_text(encoding="utf-8"))["robots"])

    def snakemake(self, *words: str, check: bool = True) -> subprocess.CompletedProcess[str]:
        """Run Snakemake in the copy, on the copy's own package."""
        return self._run([sys.executable, "-m", "snakemake", "--configfile", STUDY, *words], check)

    def make_run(self, *words: str, check: bool = True) -> subprocess.CompletedProcess[str]:
        """What `make run` runs once the environment stands."""
        command = [sys.executable, "-m", "er3a", "run", "--study", STUDY, "--", *words]
        return self._run(command, check)

    def environment(self) -> dict[str, str]:
        """The environment that makes the copy's package the one that is imported."""
        return os.environ | {"PYTHONPATH": str(self.folder)}

    def planned(self, *words: str) -> set[str]:
        """Messages of the jobs that a run would do now, such as ``er3_600: compute workspace``."""
        output = self.snakemake("--dry-run", "--nocolor", *words).stdout
        return set(re.findall(r"^Job \d+: (.+)$", output, flags=re.MULTILINE)) - {ALL_THERE}

    def _run(self, command: list[str], check: bool) -> subprocess.CompletedProcess[str]:
        done = run(command, cwd=self.folder, env=self.environment())
        if check and done.returncode != 0:
            pytest.fail(f"{' '.join(command[1:])} ended with {done.returncode}:\n{done.stdout}\n{done.stderr}")
        return done


def copy_of_project(source_folder: Path, folder: Path) -> StudyRun:
    """Copy what a run needs, without results."""
    return StudyRun(fresh(folder, source_folder))


@pytest.fixture(scope="session")
def shared_folder() -> Path:
    """A folder that all processes of this test run share, with the project as it stood when the first one asked."""
    shared = Path(os.environ[SHARED])
    with once(shared / "snapshot") as wanted:
        if wanted:
            copy_of_project(ROOT, shared / "snapshot")
    return shared


def leave_one_robot(study: Path) -> None:
    """Take the other robots out of a study file, and leave the rest of its text as it is."""
    text = study.read_text(encoding="utf-8")
    for name in ROBOTS:
        if name != ROBOT:
            text = re.sub(rf"^  {name}:\n(    .*\n)+", "", text, flags=re.MULTILINE)
    study.write_text(text, encoding="utf-8")


@pytest.fixture(scope="session")
def fresh_project(shared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], StudyRun]:
    """Makes copies, without results, of the project as it stands at the start of the tests."""
    return lambda name: copy_of_project(shared_folder / "snapshot", tmp_path_factory.mktemp(name) / "project")


@pytest.fixture(scope="session")
def small_study(shared_folder: Path) -> StudyRun:
    """The small study, run once from nothing with two cores; tests must leave it as they found it.

    A checkout in which it stands finished already can be named by the environment variable SMALL_STUDY.
    """
    folder, finished = shared_folder / "small_study", os.environ.get("SMALL_STUDY")
    with once(folder) as wanted:
        if wanted:
            study = copy_of_project(shared_folder / "snapshot", folder)
            for part in RUN_PARTS if finished else ():
                shutil.copytree(Path(finished) / part, folder / part)
            study.make_run("--cores", "2")
    return StudyRun(folder)


@pytest.fixture(scope="session")
def small_results(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str, Study], Path]:
    """Makes a folder with a stage's results of a robot: of the finished study that SMALL_STUDY names, or computed."""
    finished = os.environ.get("SMALL_STUDY")

    def made(stage: str, name: str, study: Study) -> Path:
        folder = tmp_path_factory.mktemp(f"{name}_{stage}") / "results"
        there = Path(finished) / "results" / name / stage if finished else folder
        if there.is_dir():
            shutil.copytree(there, folder)
        else:
            compute(stage, study, name, folder)
        return folder

    return made


@contextmanager
def once(folder: Path) -> Iterator[bool]:
    """Whether this process is the one to make the folder; the others wait until it is made."""
    finished = folder.with_suffix(".finished")
    with FileLock(folder.with_suffix(".lock")):
        if not finished.exists():
            shutil.rmtree(folder, ignore_errors=True)
            yield True
            finished.touch()
        else:
            yield False
