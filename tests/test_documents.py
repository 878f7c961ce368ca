"""README and docs hold what the project does: their code runs, their commands exist, their settings are accepted."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
import typer
import yaml

import er3a
from er3a.errors import InputError
from er3a.files.hand_eye_file import HandEyeFile
from er3a.files.program_file import ProgramsFile
from er3a.files.robot_file import RobotFile
from er3a.files.scene_file import SceneFile
from er3a.files.yaml_file import parse, read_yaml
from er3a.pipeline.cli import app
from er3a.pipeline.commands.names import COMMANDS
from er3a.pipeline.messages.pages import GLOSSARY
from er3a.pipeline.study import Study
from testing.documents import PAGES, ROOT, blocks, commands, name_of, prose
from testing.evidence import CAMPAIGNS
from testing.links import broken_links

SETTING = re.compile(r"`([a-z_]+: [^`]+)`")
DOTTED = re.compile(r"`(validation|workspace|capability|inverse|trajectory|report)\.([a-z_]+)`")
MODULES = {"report.py"}
PLACEHOLDERS = {"NAME", "FILE", "ROBOT", "OLD", "NEW", "..."}
# Lines that need no study are run below, in this order, each with what stands there for a name that the page gives.
STANDS_FOR = {
    "export-urdf": {"my_arm": "er3_600"},
    "import-urdf": {"their_arm.urdf": "my_arm.urdf"},
    "teach": {"ROBOT": "data/robots/er3_600.yaml", "FILE": "data/robots/er3_600.yaml"},
    "check": {"FILE": "data/paths/er3a_c60.yaml", "文件": "data/paths/er3a_c60.yaml"},
    "check-program": {"FILE": "data/programs/pick_place.src", "R": "er3a_c60"},
    "program": {},
    "calibrate": {"ROBOT": "er3a_c60", "MEASUREMENTS.csv": "measured.csv", "FILE.csv": "measured.csv"},
    "confirm": {"ROBOT": "er3a_c60", "POSES": "filled.csv"},
    "predict": {"ROBOT": "er3a_c60", "JOINTS.csv": "measured.csv", "mine_model.json": "corrected_model.json"},
    "import-calibration": {"ROBOT": "ur5e"},
    "hand-eye": {"FILE": "data/vision/fixed_camera.yaml", "R": "er3a_c60"},
    "compare": {
        "A": "er3a_c60",
        "B": "er3_600",
        "C": "ur5e",
        "my_arm": "er3a_c60",
        "their_arm.urdf": "er3_600",
        "table.csv": "er3a_c60_article",
        "arm.urdf": "er3a_c60",
    },
    "arms": {"WORD": "irb", "[WORD]": "irb"},
    "--help": {},
}
# Those of a study: tests/integration/test_wheel.py runs some, for others a terminal or a desktop is needed.
OF_A_STUDY = {"new", "compute", "run", "verdicts", "view", "diff", "--install-completion"}


def all_blocks(*languages: str) -> list[Any]:
    return [
        pytest.param(block, id=f"{name_of(page)}-{number}")
        for page in PAGES
        for number, block in enumerate(blocks(page, *languages))
    ]


@pytest.mark.long
@pytest.mark.parametrize("block", all_blocks("python"))
def test_python_in_documents_runs(block, monkeypatch):
    monkeypatch.chdir(ROOT)
    exec(compile(block, "a document", "exec"), {})


def merged(into: dict[str, Any], new: dict[str, Any]) -> dict[str, Any]:
    """Settings with others put into them, section by section."""
    both = dict(into)
    for key, value in new.items():
        below = both.get(key)
        both[key] = merged(below, value) if isinstance(value, dict) and isinstance(below, dict) else value
    return both


@pytest.mark.parametrize("block", all_blocks("yaml"))
def test_yaml_in_documents_is_accepted(block):
    settings = yaml.safe_load(block)
    if whole := {"programs": ProgramsFile, "scene": SceneFile}.get(settings.get("kind")):
        parse(whole, settings, None)
        return
    if "apiVersion" in settings:  # a cluster's, not ours
        return
    if settings.get("kind") == "hand_eye":
        files: list[tuple[Any, str]] = [(HandEyeFile, "data/vision/fixed_camera.yaml")]
    else:
        files = [(Study, "config/small.yaml"), (RobotFile, "data/robots/er3_600.yaml")]
    files = [(model, base) for model, base in files if set(settings) <= set(model.model_fields)]
    assert files
    problems = [problem for model, base in files if (problem := refusal(model, base, settings))]
    assert len(problems) < len(files), problems


def refusal(model: Any, base: str, settings: dict[str, Any]) -> str | None:
    """Why a file with more settings is refused."""
    try:
        parse(model, merged(read_yaml(ROOT / base), settings), base)
    except InputError as error:
        return str(error)
    return None


def paragraphs_of_settings() -> Iterator[Any]:
    """Paragraphs that advise settings such as ``samples: 100``, without those that stand for something else."""
    for page in PAGES:
        for number, paragraph in enumerate(re.split(r"\n\s*\n", prose(page))):
            given = [text for text in SETTING.findall(paragraph) if not PLACEHOLDERS & set(re.findall(r"[A-Z]+", text))]
            if given:
                yield pytest.param(given, id=f"{name_of(page)}-{number}")


def places_of(key: str) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """The schema of each property with this name in any input file, with the schema that it is part of."""
    found = []
    for path in sorted((ROOT / "config").glob("*.schema.json")):
        schema = json.loads(path.read_text(encoding="utf-8"))
        for part in (schema, *schema.get("$defs", {}).values()):
            if key in part.get("properties", {}):
                found.append((part["properties"][key], schema))
    return found


def schemas_with(key: str) -> list[Path]:
    return [path for path in (ROOT / "config").glob("*.schema.json") if f'"{key}": {{' in path.read_text("utf-8")]


def accepted(key: str, value: Any) -> bool:
    return any(
        jsonschema.Draft202012Validator({**wanted, "$defs": schema.get("$defs", {})}).is_valid(value)
        for wanted, schema in places_of(key)
    )


@pytest.mark.parametrize("given", list(paragraphs_of_settings()))
def test_settings_that_a_page_advises_are_accepted_one_by_one_and_together(given):
    settings = merged({}, {key: value for text in given for key, value in yaml.safe_load(text).items()})
    for key, value in settings.items():
        assert accepted(key, value), (key, value)
    study = read_yaml(ROOT / "config/config.yaml")
    sections = {name: now for name, now in study.items() if isinstance(now, dict) and name != "robots"}
    for key in settings:
        having = [name for name, now in sections.items() if key in now]
        together = ({name: {k: v for k, v in settings.items() if k in sections[name]}} for name in having)
        problems = [refusal(Study, "config/config.yaml", each) for each in together]
        elsewhere = any("study" not in path.name for path in schemas_with(key))
        assert not having or elsewhere or None in problems, problems


def test_a_setting_beyond_the_schema_would_be_seen():
    assert accepted("samples", 100_000_000_000)
    assert not accepted("samples", 1_000_000_000_000)
    assert not accepted("no_such_setting", 1)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_settings_named_with_their_section_exist(page):
    named = {f"{section}.{key}" for section, key in DOTTED.findall(prose(page))} - MODULES
    schema = json.loads((ROOT / "config/study.schema.json").read_text(encoding="utf-8"))

    def known(section: str) -> set[str]:
        wanted = json.dumps(schema["properties"][section])
        (definition,) = set(re.findall(r"#/\$defs/(\w+)", wanted))
        return set(schema["$defs"][definition]["properties"])

    assert [each for each in named if each.split(".")[1] not in known(each.split(".")[0])] == []


@pytest.mark.long
@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_of_documents_exist(page):
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    for room in {room for room, _, _ in COMMANDS.values()}:  # whose commands have options from now on
        import_module(f"er3a.pipeline.commands.{room}")
    known: Any = typer.main.get_command(app)
    for command in commands(page):
        program, verb, *words = shlex.split(command)
        if program == "make":
            assert verb in targets, command
            assert_make_words(verb, words)
            continue
        assert verb in known.commands or verb.startswith("-"), command
        own = known.commands.get(verb, known)
        if words and words[0] in getattr(own, "commands", {}):
            own = own.commands[words[0]]
        if own.context_settings.get("ignore_unknown_options"):  # those of Snakemake
            continue
        options = {option for each in own.params for option in each.opts} | {"--help"}
        assert [word for word in words if word.startswith("--") and word.split("=")[0] not in options] == [], command


def assert_make_words(target: str, words: list[str]) -> None:
    """Variables are those of the Makefile, studies are files, and campaigns exist."""
    for word in words:
        name, _, value = word.partition("=")
        assert name in {"STUDY", "ROBOT", "ARGS", "PYTHON"}, word
        if name == "STUDY" and not PLACEHOLDERS & {value}:
            assert (ROOT / value).is_file(), word
        if target == "campaigns":
            assert value in CAMPAIGNS, word


@pytest.mark.long
def test_commands_that_need_no_study_run_as_they_stand_in_the_documents(call, tmp_path):
    found = {command for page in PAGES for command in commands(page) if command.startswith("er3a ")}
    lines = [shlex.split(line)[1:] for line in sorted(found)]
    assert {verb for verb, *_ in lines} <= STANDS_FOR.keys() | OF_A_STUDY
    shutil.copytree(
        ROOT / "data/robots", tmp_path / "data/robots"
    )  # where a study has its own; all else comes with er3a
    write_measured(tmp_path / "measured.csv")
    write_typed(tmp_path / "filled.csv")
    deltas = (f"delta_{key} = [0, 0, 0, 0, 0, 0]" for key in ("theta", "a", "d", "alpha"))
    (tmp_path / "calibration.conf").write_text("\n".join(deltas), encoding="utf-8")
    for verb, stands_for in STANDS_FOR.items():
        named_only = 2 if verb == "program" else 1  # words of a line that is no more than the command's name
        of_verb = [words for own, *words in lines if own == verb and (len(words) >= named_only or verb == "--help")]
        assert of_verb, verb
        for words in of_verb:
            done = call(verb, *(stands_for.get(word, word) for word in words), folder=tmp_path)
            two = [word for word in words if not word.startswith("-")][1:2]  # one arm alone is that of the catalogue
            told = verb == "program" or (
                verb == "compare" and (bool(two) or words[0] == "table.csv")
            )  # an unsafe path, and arms that differ
            assert done.returncode == int(told), (verb, words, done.stderr)
    assert list((tmp_path / "programs").glob("*.src"))


def write_measured(file: Path) -> None:
    """Positions of an er3a_c60 whose upper arm is 1 mm longer than its table says."""
    robot = er3a.load_robot("er3a_c60")
    q = np.random.default_rng(1).uniform(-0.7, 0.7, (30, 6))
    longer = replace(robot, a=robot.a + np.array([0, 1e-3, 0, 0, 0, 0]))
    T = er3a.forward(longer.without_tool(), q)
    rows = [(*np.degrees(joints), *1000 * pose[:3, 3]) for joints, pose in zip(q, T, strict=True)]
    lines = [f"{','.join(map(str, row[:6]))},flange,{','.join(map(str, row[6:]))},0.05" for row in rows]
    head = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,point,x_mm,y_mm,z_mm,standard_deviation_mm"
    file.write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")


def write_typed(file: Path) -> None:
    """What the pendant of an er3a_c60 shows, to 0.01."""
    q = np.random.default_rng(1).uniform(-0.7, 0.7, (6, 6))
    T = er3a.forward(er3a.load_robot("er3a_c60"), q)
    rows = np.c_[np.degrees(q), 1000 * T[:, :3, 3], np.degrees(er3a.rpy(T))[:, ::-1]].round(2)
    text = "A1;A2;A3;A4;A5;A6;X;Y;Z;A;B;C\n" + "\n".join(";".join(map(str, row)) for row in rows)
    file.write_text(text, encoding="utf-8")


def test_links_between_documents_lead_somewhere():
    broken = []
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", prose(page)):
            if not (page.parent / target).exists() and "generated/" not in target:
                broken.append((name_of(page), target))
    assert broken == []


def test_the_glossary_has_the_terms_that_pages_explain():
    table = (ROOT / "docs/glossary.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([^|]+?) (?:\([^|]*\) )?\| ([^|]+) \|", table, re.MULTILINE)
    assert set(GLOSSARY.items()) <= set(rows)


def test_links_that_lead_nowhere_are_found(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "index.html").write_text('<p id="a"><a href="sub/b.html#b">b</a> <a href="sub/c.html">c</a>', "utf-8")
    (tmp_path / "sub/b.html").write_text(
        '<h1 id="b"><a href="../index.html#a">a</a><a href="#none">n</a><a href="https://example.org/x">x</a>'
        '<img src="data:,"><img src="no.webp"><a href="..">up</a><a href="b.html#q=1,2">q</a>',
        "utf-8",
    )
    assert broken_links(tmp_path) == [("index.html", "sub/c.html"), ("sub/b.html", "#none"), ("sub/b.html", "no.webp")]
