"""A folder that a stranger has filled: whatever er3a does there, nothing that lies in it runs."""

from __future__ import annotations

import os
import pickle
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from er3a.errors import InputError
from er3a.files.hand_eye_file import grey_image
from er3a.pipeline.working_folder import CODE_OF_LIBRARIES, STATE
from testing.processes import run
from testing.small_study import on_least_budgets
from tests.conftest import ROOT

LIBRARIES = """babel coal collada IPython jinja2 llvmlite matplotlib networkx numba numpy ompl open3d pandas PIL
pinocchio psutil pyarrow pydantic pygments rerun rich rocrate scipy snakemake snakemake_logger_plugin_er3b
snakemake_executor_plugin_b toppra trimesh typer xacro xacrodoc yaml yappi conftest setup usercustomize re socket json
gettext random string decimal select code"""
BEFORE_ER3A = ("re", "usercustomize")  # what Python itself loads, from where PYTHONPATH says
PROGRAMS = ("git", "bash", "sh", "python", "python3", "rerun", "latex", "dvipng", "gs", "timeout", "snakemake", "gcc")
SMALL = on_least_budgets((ROOT / "config/small.yaml").read_text(encoding="utf-8"))
ENTRY = """robots:
  er3_600: {targets: data/targets/er3_600.yaml, paths: data/paths/er3_600.yaml, stages: [validation, workspace]}

"""
STUDY = SMALL[: SMALL.index("robots:")] + ENTRY + SMALL[SMALL.index("validation:") :]
REFERENCES = "references: [er3_600]\n"
PROGRAM = "DEF p( )\nPTP {A1 10, A2 -20, A3 -20, A4 0, A5 -40, A6 0}\nEND\n"


def poison(folder: Path, marker: Path) -> None:
    """Files of all kinds that some library or program would run, take for its settings, or load as a pickle."""
    python = f"open({str(marker)!r}, 'a').write(__name__ + chr(10))\n"
    shell = f"echo shell >> {marker}"
    evaluated = f"__import__('os').system('{shell}')"
    text: dict[str, str] = {f"{name}.py": python for name in LIBRARIES.split()}
    text |= {
        f"evil.dist-info/{name}": "Metadata-Version: 2.1\nName: evil\nVersion: 1\n" for name in ("METADATA", "PKG-INFO")
    }
    text["evil.dist-info/entry_points.txt"] = "[numba_extensions]\ninit = conftest:x\n[pydantic]\nx = conftest:x\n"
    profile = (
        f"cores: 1\ndefault-resources:\n  mem_mb: {evaluated}\nset-resources:\n  index:\n    mem_mb: {evaluated}\n"
    )
    for place in ("profiles/default", "default", "profile", "profiles/slurm", "site"):
        text |= {f"{place}/{name}.yaml": profile for name in ("config", "profile", "profile.v9+")}
    for place in (
        "Snakefile",
        "workflow/Snakefile",
        "workflow/rules/common.smk",
        "er3a.smk",
        "workflow/rules/stages.smk",
    ):
        text[place] = python
    text["matplotlibrc"] = "backend: module://conftest\ntext.usetex: True\n"
    text[".env"] = text["pip.conf"] = text["setup.cfg"] = text["pyvenv.cfg"] = text["er3a.yaml"] = (
        "PYTHONSTARTUP = conftest.py\n"
    )
    text["evil.pth"] = f"import sys; {python}"
    text["workflow/report/index.rst"] = text["base.html.j2"] = "{{ cycler.__init__.__globals__.os }}"
    text["data/targets/zh.po"] = f'msgid ""\nmsgstr "Plural-Forms: nplurals=2; plural={evaluated};"\n'
    text["config/study.yaml"], text["p.src"], text["data/a.csv"] = (
        STUDY,
        PROGRAM,
        "joint,a_mm,alpha_deg,d_mm\n1,50,0,100\n2,200,90,0\n",
    )
    text |= {f"{name}": f"#!/bin/sh\n{shell}\n" for name in PROGRAMS}
    shutil.copytree(ROOT / "data", folder / "data")
    for place, content in text.items():
        path = folder / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content, encoding="utf-8")
    for name in PROGRAMS:
        (folder / name).chmod(0o755)
    for place in (".snakemake/iocache/latest.pkl", "results/er3_600/workspace/parts/1-of-1.npz", "cache/er3a/x.nbi"):
        path = folder / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(pickle.dumps(_Evil(shell)))


class _Evil:
    def __init__(self, command: str) -> None:
        self.command = command

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.system, (self.command,)


@pytest.fixture
def stranger(tmp_path: Path) -> Iterator[tuple[Path, Callable[..., str]]]:
    """A poisoned folder, in which a function calls the installed commands; nothing of it may have run at the end."""
    folder, marker = tmp_path / "study $(touch ran); `touch ran`", tmp_path / "ran.txt"
    folder.mkdir()
    poison(folder, marker)

    def call(*words: str | Path, code: int | None = 0, **environment: str) -> str:
        program, *rest = words
        command = [Path(sys.prefix, "bin", program), *rest] if program != "python" else [sys.executable, *rest]
        done = run(command, cwd=folder, env=os.environ | environment)
        assert code is None or done.returncode == code, done.stderr
        return done.stderr

    yield folder, call
    assert not marker.exists(), marker.read_text()
    assert not list(folder.rglob("ran"))


@pytest.mark.long
@pytest.mark.parametrize("words", [("-c", "import numba"), ("-Pm", "snakemake", "-s", ROOT / "Snakefile", "-n")])
def test_the_poison_works(tmp_path, words):
    """As of a Python and a Snakemake that nobody calls with care."""
    folder, marker = tmp_path / "study", tmp_path / "ran.txt"
    folder.mkdir()
    poison(folder, marker)
    study = ["--configfile", "config/study.yaml"] if "snakemake" in words else []
    run([sys.executable, *words, *study], cwd=folder, env=os.environ | {"PYTHONSAFEPATH": ""})
    assert marker.exists()


@pytest.mark.long
@pytest.mark.parametrize(
    ("words", "code"),
    [(("check-program", "p.src", "--robot", "er3_600"), 0), (("compare", "data/a.csv", "er3_600"), 1)],
    ids=lambda words: words[0] if isinstance(words, tuple) else "",
)
def test_commands_run_nothing_of_the_folder(stranger, words, code):
    _, call = stranger
    call("er3a", *words, code=code)


@pytest.mark.long
@pytest.mark.parametrize(("path", "words"), [(".", ("er3a",)), (":", ("python", "-m", "er3a"))])
def test_a_folder_in_the_path_of_python_is_taken_out_of_it(stranger, path, words):
    folder, call = stranger
    for name in BEFORE_ER3A:
        (folder / f"{name}.py").unlink()
    call(*words, "check", "p.src", "config/study.yaml", PYTHONPATH=path)


@pytest.mark.long
@pytest.mark.parametrize("place", [".snakemake", "results", "reports/er3_600", "logs"])
def test_a_folder_written_into_that_links_elsewhere_is_refused_and_nothing_there_is_deleted(tmp_path, call, place):
    foreign = tmp_path / "foreign"
    (foreign / "locks").mkdir(parents=True)
    (foreign / "locks/precious").touch()
    study = tmp_path / "study"
    (study / place).parent.mkdir(parents=True)
    (study / place).symlink_to(foreign)
    at_start = [sys.executable, "-P", "-m", "er3a", "run"]  # looks at STATE before anything else is loaded
    done = run(at_start, cwd=study) if place == STATE else call("run", folder=study)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert done.stderr.startswith(f"error: {place}: ")
    assert (foreign / "locks/precious").exists()


@pytest.mark.long
@pytest.mark.parametrize("place", CODE_OF_LIBRARIES)
def test_a_folder_with_code_of_libraries_is_refused_by_jobs_too(stranger, place):
    folder, call = stranger
    (folder / place).parent.mkdir(exist_ok=True)
    (folder / place).touch()
    for words in (["run", "--study", "config/study.yaml"], ["compute", "validation", "er3_600"]):
        assert call("er3a", *words, code=2).startswith(f"error: {place}: ")


@pytest.mark.long
@pytest.mark.parametrize(
    ("words", "environment", "code"),
    [
        ((), {"SNAKEMAKE_PROFILE": "site"}, 2),
        (("--workflow-profile", "site"), {}, 2),
        (("--workflow-profile", "slurm"), {}, 0),
    ],
)
def test_a_name_means_no_profile_of_the_folder(stranger, call, monkeypatch, words, environment, code):
    """In this process, which Snakemake would evaluate a profile in."""
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    done = call("run", "--study", "config/study.yaml", "--", "-n", *words, folder=stranger[0])
    assert done.returncode == code, done.stderr


@pytest.mark.long
def test_a_run_from_nothing_to_its_pages_runs_nothing_of_the_folder(stranger):
    folder, call = stranger
    robot = folder / "data/robots/er3_600.yaml"
    text = robot.read_text(encoding="utf-8")
    assert REFERENCES in text
    robot.write_text(text.replace(REFERENCES, ""), encoding="utf-8")  # of a table without evidence, a second's work
    (folder / ".snakemake/locks").mkdir()
    (folder / ".snakemake/locks/0.input.lock").write_text("reports/index.html\n", encoding="utf-8")
    call("er3a", "run", "--study", "config/study.yaml", "--", "--cores", "2")
    assert (folder / "reports/index.html").is_file()
    call("er3a", "teach", "er3_600", "--study", "config/study.yaml")
    call("er3a", "verdicts", "--study", "config/study.yaml")


def test_no_program_is_called_for_a_picture(stranger, monkeypatch):
    folder, _ = stranger
    monkeypatch.setenv("PATH", str(folder), prepend=os.pathsep)
    (folder / "board.png").write_text("%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\nshowpage\n")
    with pytest.raises(InputError, match="not a readable image"):
        grey_image(folder / "board.png")
