"""Checking input files, and the schemas that editors use."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import yaml

from er3a.errors import InputError
from er3a.pipeline.check import SCHEMAS, check_file, check_study

ROOT = Path(__file__).resolve().parents[1]
INPUTS = sorted(
    [
        *ROOT.glob("data/**/*.yaml"),
        *(path for path in ROOT.glob("data/**/*.csv") if path.parent.name != "arms"),  # the catalogue is no input
        *ROOT.glob("config/*.yaml"),
    ],
)


@pytest.mark.parametrize("path", INPUTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_committed_input_is_in_order(path):
    assert check_file(path)


@pytest.mark.parametrize("kind", SCHEMAS)
def test_committed_schema_is_the_models(kind):
    committed = json.loads((ROOT / "config" / f"{kind}.schema.json").read_text())
    assert committed == SCHEMAS[kind].model_json_schema(), "run `make schema`"


@pytest.mark.parametrize("path", [p for p in INPUTS if p.suffix == ".yaml"], ids=lambda path: path.name)
def test_every_yaml_input_names_its_schema(path):
    first = next(line for line in path.read_text().splitlines() if "$schema=" in line)
    assert (path.parent / first.partition("$schema=")[2]).resolve().is_file()


@pytest.mark.parametrize("study", ["config/config.yaml", "config/small.yaml"])
def test_the_studies_lead_to_sound_files(study, monkeypatch):
    monkeypatch.chdir(ROOT)
    assert list(check_study(Path(study)).robots) == ["er3a_c60", "er3a_c60_article", "er3_600"]


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("name,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\np,590,0,295,180,0,0\n", "targets"),
        ("t_s,q1_deg,q2_deg\n0,0,0\n1,10,20\n", "a path"),
        ("i,α(i-1),a(i-1),d(i),θ(i)\n1,0,0,300,θ1\n", "a D-H table"),
    ],
)
def test_a_table_is_known_by_its_header_wherever_it_stands(tmp_path, text, kind):
    (tmp_path / "mine.csv").write_text(text, encoding="utf-8")
    assert check_file(tmp_path / "mine.csv") == kind


POINTS = "[{positions: [0, 0], time_from_start: {sec: 0}}, {positions: [0.1, 0], time_from_start: {sec: 1}}]"
TRAJECTORY = f"{{joint_names: [joint_1, joint_2], points: {POINTS}}}\n"


@pytest.mark.parametrize("ending", ["json", "yaml", "yml"])
@pytest.mark.parametrize("form", ["{}", "{{joint_trajectory: {}}}"])
def test_a_trajectory_of_ros_is_a_path_as_paths_take_it(tmp_path, ending, form):
    text = form.format(TRAJECTORY.strip())
    file = tmp_path / f"ros.{ending}"
    as_json = json.dumps(yaml.safe_load(text))
    file.write_text(as_json if ending == "json" else text, encoding="utf-8")
    assert check_file(file) == "a path"
    file.write_text(as_json.replace("[0, 0]", "[0, NaN]"), encoding="utf-8")
    with pytest.raises(InputError, match=r"points\[0\]\.positions\[1\]: .* is refused"):
        check_file(file)


@pytest.mark.parametrize(
    ("file", "old", "new", "told"),
    [
        ("paths", "end_deg: [", "end_deg: [1, ", r"paths\.yaml: paths\[0\]\.end_deg: 7 joint values"),
        ("targets", "q_ref_deg: [", "q_ref_deg: [1, ", "targets.yaml: target .*7 joint values"),
    ],
)
def test_a_study_s_joint_values_are_held_against_its_robot(tmp_path, monkeypatch, file, old, new, told):
    monkeypatch.chdir(ROOT)
    study = yaml.safe_load(Path("config/small.yaml").read_text(encoding="utf-8"))
    entry = study["robots"] = {"er3a_c60": dict(study["robots"]["er3a_c60"])}
    entry["er3a_c60"][file] = str(tmp_path / f"{file}.yaml")
    text = Path(f"data/{file}/er3a_c60.yaml").read_text(encoding="utf-8")
    assert old in text
    (tmp_path / f"{file}.yaml").write_text(text.replace(old, new, 1), encoding="utf-8")
    (tmp_path / "study.yaml").write_text(yaml.safe_dump(study), encoding="utf-8")
    with pytest.raises(InputError, match=told):
        check_study(tmp_path / "study.yaml")


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("a.yaml", "name: x\n", "kind: missing"),
        ("a.yaml", "kind: robto\n", "kind: 'robto' is not known"),
        ("a.txt", "kind: robot\n", "'.txt' files are none"),
        ("a.json", '{"name": "x"}', "'.json' files are none"),
        ("other.csv", "a,b\n1,2\n", "other.csv"),
        ("a.yaml", "kind: targets\ntargets: []\n", "targets"),
        ("a.yaml", "kind: paths\npaths:\n- {name: a, kind: linear}\n", "paths[0].kind: 'linear' is not known"),
        ("a.yaml", "kind: paths\npaths:\n- {name: a}\n", "paths[0].kind: missing"),
        ("arm", "kind: robot\n", "files without an ending are none"),
    ],
)
def test_a_file_that_is_none_of_ours_is_one_clear_error(tmp_path, name, text, told):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        check_file(path)
    assert told in str(caught.value)
    assert name in str(caught.value)


PATH = "kind: paths\npaths:\n- {{name: a, title: A, samples: 11, kind: {}}}\n"
CAMERA = "kind: hand_eye\ntitle: A\nsource: A\nsetup: eye_to_hand\nsamples: away.csv\n"


@pytest.mark.parametrize(
    "text",
    [
        PATH.format("table, file: away.csv"),
        PATH.format("program, program: away.src"),
        "kind: programs\nprograms:\n- {name: a, title: A, file: away.src}\n",
        CAMERA,
        CAMERA.replace("away", "seen") + "images: {board: {pattern: chessboard, squares: [9, 6], square_mm: 25}}\n",
    ],
)
def test_a_file_that_leads_to_a_missing_one_is_not_in_order(tmp_path, monkeypatch, text):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.yaml").write_text(text)
    (tmp_path / "seen.csv").write_text("image\naway.png\n")
    with pytest.raises(InputError, match=r"away\.\w+"):
        check_file(Path("a.yaml"))


@pytest.mark.parametrize(
    ("header", "more", "told"),
    [
        ("t_s,", {"duration_s": 349.4}, r"paths\[0\]\.duration_s: the table's t_s gives it too"),
        ("", {}, r"paths\[0\]\.duration_s: missing, and the table has no column t_s"),
        ("t_s,", {"blend_mm": 5}, r"paths\[0\]\.blend_mm: the table holds joint angles"),
        ("t_s,", {}, None),
    ],
)
def test_a_path_file_is_held_against_the_table_that_it_names(tmp_path, monkeypatch, header, more, told):
    """Without a robot, as `er3a check paths.yaml` reads it."""
    monkeypatch.chdir(tmp_path)
    rows = [f"{'0,' if header else ''}0,0,0,0,45,0", f"{'2,' if header else ''}5,0,0,0,45,0"]
    Path("t1.csv").write_text("\n".join([f"{header}q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg", *rows]))
    path = {"name": "own", "title": "Own", "kind": "table", "file": "t1.csv", "samples": 11} | more
    Path("paths.yaml").write_text(json.dumps({"kind": "paths", "paths": [path]}))
    if told is None:
        assert check_file(Path("paths.yaml")) == "paths"
        return
    with pytest.raises(InputError, match=told):
        check_file(Path("paths.yaml"))


def test_files_of_a_project_are_checked_from_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert check_file(ROOT / "data/programs/er3a_c60.yaml") == "programs"


def test_who_works_below_a_folder_called_data_names_files_from_there(tmp_path, monkeypatch):
    own = tmp_path / "data" / "cell"
    own.mkdir(parents=True)
    monkeypatch.chdir(own)
    Path("a.yaml").write_text("kind: programs\nprograms:\n- {name: a, title: A, file: a.src}\n")
    Path("a.src").write_text("DEF a( )\nEND\n")
    assert check_file(Path("a.yaml")) == "programs"


def test_a_study_that_names_a_missing_file_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    content = yaml.safe_load((ROOT / "config/small.yaml").read_text())
    content["robots"]["er3_600"]["targets"] = "data/targets/nowhere.yaml"
    path = tmp_path / "study.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(InputError, match=r"nowhere\.yaml: there is no such file"):
        check_study(path)


@pytest.mark.parametrize(
    "place",
    [
        *(("robots", "er3_600", key) for key in ("targets", "paths", "programs", "vision", "scene", "file")),
        *((key, "scene") for key in ("capability", "collision", "inverse", "trajectory", "vision")),
    ],
    ids=".".join,
)
def test_each_file_that_a_study_names_is_looked_at(tmp_path, monkeypatch, place):
    monkeypatch.chdir(ROOT)
    elsewhere = tmp_path / "users.txt"
    elsewhere.write_text("root:x:0:0:root:/root:/bin/sh\n")
    content = yaml.safe_load((ROOT / "config/small.yaml").read_text())
    content["robots"] = {"er3_600": content["robots"]["er3_600"]}
    inner = content
    for key in place[:-1]:
        inner = inner.setdefault(key, {})
    inner[place[-1]] = str(elsewhere)
    study = tmp_path / "study.yaml"
    study.write_text(yaml.safe_dump(content))
    with pytest.raises(InputError, match=r"users\.txt"):
        check_file(study)


def test_a_robot_that_names_an_unknown_document_is_refused_with_its_field(tmp_path):
    """As in a study with it: the robot's own reference sets say which documents there are."""
    text = Path("data/robots/er3a_c60.yaml").read_text(encoding="utf-8")
    file = tmp_path / "er3a_c60.yaml"
    file.write_text(re.sub(r"(?m)^  origin: \w+", "  origin: hearsay", text, count=1), encoding="utf-8")
    with pytest.raises(InputError, match="the document 'hearsay' is not known") as found:
        check_file(file)
    assert found.value.field == "dh.origin"
    file.write_text(text, encoding="utf-8")
    assert check_file(file) == "a robot"
