"""The study file: refusals, resolved settings, overrides."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import pytest
import yaml

from er3a.errors import InputError
from er3a.files.robot_library import ROBOTS, load_robot
from er3a.kinematics.forward import forward
from er3a.pipeline.settings import TrajectorySettings
from er3a.pipeline.stages.trajectory.motion import near_singular
from er3a.pipeline.study import STAGES, RobotEntry, Study, load_study
from er3a.program_check.check_program import CheckOptions
from testing.arms import placement

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def content():
    return yaml.safe_load((ROOT / "config" / "small.yaml").read_text(encoding="utf-8"))


@pytest.fixture
def study_with(tmp_path, content):
    """Loads the small study after a change."""

    def load(change) -> Study:
        changed = copy.deepcopy(content)
        change(changed)
        path = tmp_path / "study.yaml"
        path.write_text(yaml.safe_dump(changed, sort_keys=False), encoding="utf-8")
        return load_study(path)

    return load


@pytest.fixture
def study(study_with) -> Study:
    return study_with(lambda content: None)


@pytest.mark.parametrize("name", ["config.yaml", "small.yaml"])
def test_the_studies_that_ship_load(name):
    study = load_study(ROOT / "config" / name)
    assert list(study.robots) == ["er3a_c60", "er3a_c60_article", "er3_600"]
    for robot in study.robots:
        assert study.robot(robot).name == robot


@pytest.mark.parametrize(
    ("change", "field", "words"),
    [
        (lambda c: c.update(sede=1), "sede", "unknown key 'sede'. Did you mean 'seed'?"),
        (lambda c: c["workspace"].update(sampels=1), "workspace.sampels", "Did you mean 'samples'?"),
        (lambda c: c["robots"]["er3_600"].update(targest="x"), "robots.er3_600.targest", "Did you mean 'targets'?"),
        (lambda c: c.pop("seed"), "seed", "missing"),
        (lambda c: c.update(seed=-1), "seed", "-1 is refused"),
        (lambda c: c.update(seed=1.5), "seed", "1.5 is refused. Write a whole number"),
        (lambda c: c.update(robots={}), "robots", "{} is refused"),
        (lambda c: c.update(robots={"Ärm": c["robots"]["er3_600"]}), "robots.Ärm.[key]", "'Ärm' is refused"),
        (lambda c: c.update(robots={"con": c["robots"]["er3_600"]}), "robots.con.[key]", "Windows keeps the name con"),
        (lambda c: c["workspace"].update(samples=4, blocks=5), "workspace", "4 samples can't fill 5 blocks. Lower"),
        (lambda c: c["workspace"].update(samples=1e6), "workspace.samples", "1000000.0 is refused. Write a whole"),
        (lambda c: c["trajectory"].update(near_wrist_deg=float("nan")), "trajectory.near_wrist_deg", "not a finite"),
        (lambda c: c.update(kind="robot"), "kind", "'robot' is refused"),
    ],
)
def test_a_wrong_study_is_refused_with_field_and_remedy(study_with, change, field, words):
    with pytest.raises(InputError) as caught:
        study_with(change)
    assert caught.value.field == field
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_robot_that_the_study_lacks(study):
    with pytest.raises(InputError, match=r"robots\.er3: the study has no such robot\. Known: er3a_c60, "):
        study.robot("er3")


def test_a_robot_without_a_file_names_its_entry(study_with):
    study = study_with(lambda content: content["robots"].update(er3_601=content["robots"].pop("er3_600")))
    with pytest.raises(InputError, match=r"^robots\.er3_601: there is no robot 'er3_601'\. Known: er3_600"):
        study.robot("er3_601")
    with pytest.raises(InputError, match=r"^robots\.er3_601: there is no robot"):
        study.inputs("er3_601", "workspace")


def test_a_file_of_one_s_own(study_with, tmp_path):
    text = (ROBOTS / "er3_600.yaml").read_text(encoding="utf-8").replace("name: er3_600", "name: mine")
    own = tmp_path / "mine.yaml"
    own.write_text(text, encoding="utf-8")
    study = study_with(lambda content: content["robots"]["er3_600"].update(file=str(own)))
    assert study.robot("er3_600").name == "er3_600"
    assert study.inputs("er3_600", "workspace")[0] == own
    missing = study_with(lambda content: content["robots"]["er3_600"].update(file="no/such/file.yaml"))
    with pytest.raises(InputError, match=r"^no/such/file\.yaml: there is no such file"):
        missing.robot("er3_600")


def test_base_and_tool_of_the_study_replace_those_of_the_file(study_with):
    base, tool = {"xyz_mm": [0, 0, 500.0], "rpy_deg": [180.0, 0, 0]}, {"xyz_mm": [0, 0, 120.0]}
    study = study_with(lambda content: content["robots"]["er3_600"].update(base=base, tool=tool))
    plain, placed = load_robot("er3_600"), study.robot("er3_600")
    q = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    expected = placement([0, 0, 0.5], [np.pi, 0, 0]) @ forward(plain, q) @ placement([0, 0, 0.12], [0, 0, 0])
    np.testing.assert_allclose(forward(placed, q), expected, atol=1e-15)
    np.testing.assert_array_equal(study.robot("er3a_c60").tool, np.eye(4))


def test_settings_are_plain_and_hold_just_what_the_stage_depends_on(study_with, content):
    study = study_with(lambda content: content["robots"]["er3_600"].update(tool={"xyz_mm": [0, 0, 120.0]}))
    for stage in STAGES:
        own = {"workspace": content["workspace"], "trajectory": content["trajectory"]}.get(stage)
        settings = study.settings("er3_600", stage)
        assert settings["seed"] == content["seed"]
        assert settings["robot"] == {"tool": {"xyz_mm": [0, 0, 120.0], "rpy_deg": [0, 0, 0]}}
        assert set(settings) == {"seed", "robot", stage}
        if own:
            assert settings[stage].items() >= own.items()
        assert study.settings("er3a_c60", stage)["robot"] == {}


def test_a_robot_s_own_scene_replaces_those_of_the_stages(study_with):
    study = study_with(lambda content: content["robots"]["er3_600"].update(scene="other.yaml"))
    for stage in ("collision", "inverse", "trajectory"):
        assert study.settings("er3_600", stage)[stage]["scene"] == "other.yaml"
        assert study.settings("er3a_c60", stage)[stage]["scene"] == "data/scenes/table_and_post.yaml"
    assert "other.yaml" not in str(study.settings("er3_600", "workspace"))


def test_each_stage_s_inputs_exist_and_are_its_own(study, monkeypatch):
    monkeypatch.chdir(ROOT)
    robot = Path("data/robots/er3a_c60_article.yaml")
    scene, low_floor = Path("data/scenes/table_and_post.yaml"), Path("data/scenes/wall_and_low_floor.yaml")
    assert study.inputs("er3a_c60_article", "workspace") == [robot, low_floor]
    targets = Path("data/targets/er3a_c60_article.yaml")
    assert study.inputs("er3a_c60_article", "inverse") == [robot, targets, low_floor]
    article = [robot, Path("data/paths/er3a_c60_article.yaml"), low_floor]
    assert study.inputs("er3a_c60_article", "trajectory") == article
    tables = [Path("data/paths/er3a_c60.yaml"), Path("data/paths/er3a_c60_seam.csv"), scene]
    assert study.inputs("er3a_c60", "trajectory") == [Path("data/robots/er3a_c60.yaml"), *tables]
    references = study.inputs("er3a_c60_article", "validation")[1:]
    assert {path.parent.name for path in references} == {"er3a_c60_article", "er3a_c60"}
    assert {path.suffix for path in references} == {".csv"}


def test_a_study_is_frozen(study):
    with pytest.raises(ValueError, match="frozen"):
        study.seed = 1


def test_a_robot_goes_through_the_stages_that_are_named(study_with):
    named = ["validation", "workspace", "trajectory"]
    study = study_with(lambda content: content["robots"]["er3a_c60_article"].update(stages=named, expect={}))
    assert study.stages("er3a_c60_article") == ("validation", "workspace", "trajectory")
    assert len(study.stages("er3a_c60")) == len(STAGES)


@pytest.mark.parametrize("stage", ["programs", "dynamics"])
def test_an_expectation_of_a_stage_that_does_not_run_is_refused(study_with, stage):
    """Nothing would ever hold it against what the stage comes to."""
    named = ["validation", "workspace", "trajectory", "programs"]

    def change(content):
        content["robots"]["er3a_c60"].update(stages=named, programs=None, expect={stage: "pass"})

    with pytest.raises(
        InputError, match=rf"robots\.er3a_c60\.expect\.{stage}: the robot does not go through this stage"
    ):
        study_with(change)


@pytest.mark.parametrize(
    ("stages", "told"),
    [(["workspace"], "validation is missing"), (["validation", "workspace", "painting"], "no stage 'painting'")],
)
def test_stages_that_are_not_there_or_can_t_be_left_out_are_named(study, stages, told):
    with pytest.raises(ValueError, match=told):
        RobotEntry(targets="a", paths="b", stages=stages)


@pytest.mark.parametrize(
    ("section", "change", "stages"),
    [
        ("workspace", {"samples": 200_008}, {"workspace"}),
        ("capability", {"directions": 101}, {"workspace"}),
        ("inverse", {"scene": None}, {"inverse"}),
        ("validation", {"round_trips": 201}, {"validation"}),
        ("report", {"language": "zh"}, set()),
    ],
)
def test_the_numbers_of_a_stage_depend_on_its_own_settings(study, study_with, section, change, stages):
    other = study_with(lambda content: content.setdefault(section, {}).update(change))
    for robot in study.robots:
        of_robot = study.stages(robot)
        differing = {
            stage for stage in of_robot if study.computed_from(robot, stage) != other.computed_from(robot, stage)
        }
        assert differing == stages & set(of_robot)


def test_checks_without_a_study_have_the_thresholds_of_the_studies():
    """Near-singular and the margin of assumed shapes: of the library, of all studies here, and of the notebook."""
    usual = CheckOptions()
    assert (np.degrees(usual.near.wrist_rad), np.degrees(usual.near.elbow_rad)) == pytest.approx((5, 5))
    assert (usual.near.shoulder_m, usual.assumed_margin) == (0.03, 0.02)
    for file in (ROOT / "config").glob("*.yaml"):
        settings = load_study(file).section(TrajectorySettings)
        assert near_singular(settings) == usual.near, file
        assert settings.assumed_margin_mm == 1000 * usual.assumed_margin, file
    stated = "NearSingular(wrist_rad=np.radians(5), elbow_rad=np.radians(5), shoulder_m=0.03)"
    assert stated in (ROOT / "docs" / "notebooks" / "is_the_path_safe.md").read_text(encoding="utf-8")
