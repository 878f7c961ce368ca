"""Studies to start from: what they hold can be used, what can't be is refused, and nothing that stands is touched."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from er3a.errors import Er3aError, InputError
from er3a.files.dh_table import read_dh_table
from er3a.files.robot_library import load_robot, robot_of
from er3a.files.shipped import ROOT
from er3a.formats.urdf import export_urdf
from er3a.pipeline.check import check_file, check_study
from er3a.pipeline.cli import app
from er3a.pipeline.new_study.brought_arm import arm_of
from er3a.pipeline.new_study.write import write_study
from er3a.pipeline.stages.inverse.compute import compute as compute_inverse
from er3a.pipeline.stages.trajectory.compute import compute as compute_trajectory
from er3a.pipeline.study import load_study
from er3a.robots.shown import joint_columns

UR = """joint,a_mm,alpha_deg,d_mm
1,0,90,162.5
2,-425,0,0
3,-392.2,0,0
4,0,90,133.3
5,0,-90,99.7
6,0,0,99.6
"""


SCARA = """joint,type,theta_deg,a_mm,alpha_deg,d_mm,lower_deg,upper_deg,lower_mm,upper_mm
1,revolute,,325,0,400,-130,130,,
2,revolute,,275,180,0,-140,140,,
3,prismatic,0,0,0,0,,,0,200
4,revolute,,0,0,50,-360,360,,
"""
FIVE = """joint,a_mm,alpha_deg,d_mm
1,0,90,160
2,220,0,0
3,190,0,0
4,0,-90,0
5,0,0,120
"""
ON_A_TRACK = """joint,type,theta_deg,a_mm,alpha_deg,d_mm,lower_deg,upper_deg,lower_mm,upper_mm
1,prismatic,90,0,90,0,,,0,2000
2,revolute,,0,-90,360,-170,170,,
3,revolute,,0,90,0,-120,120,,
4,revolute,,0,90,420,-170,170,,
5,revolute,,0,-90,0,-120,120,,
6,revolute,,0,-90,400,-170,170,,
7,revolute,,0,90,0,-120,120,,
8,revolute,,0,0,126,-175,175,,
"""


def new(*words: object) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, ["new", *map(str, words)])
    return done.exit_code, done.output, str(done.exception or "")


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> tuple[str, Path]:
    folder = tmp_path_factory.mktemp("new") / "a cell ü"
    write_study(arm_of(None, None, "er3_600"), folder)
    return "er3_600", folder


@pytest.mark.long
def test_every_file_is_in_order(written, monkeypatch):
    name, folder = written
    monkeypatch.chdir(folder)
    for place in ("robots", "targets", "paths"):
        check_file(Path(f"data/{place}/{name}.yaml"))
    check_study(Path("config/config.yaml"))


@pytest.mark.long
def test_its_targets_are_reached_and_its_paths_are_safe(written, monkeypatch):
    name, folder = written
    monkeypatch.chdir(folder)
    study = load_study("config/config.yaml")
    targets = compute_inverse(study, name).summary.targets
    assert len(targets) >= 2
    assert [target.name for target in targets if target.chosen_deg is None] == []
    paths = compute_trajectory(study, name).summary.paths
    assert {path.name: path.verdict for path in paths} == {"joint_move": "safe", "line": "safe", "arc": "safe"}


@pytest.mark.long
def test_the_readme_tells_what_stands_there_and_which_references_count(written):
    name, folder = written
    text = (folder / "README.md").read_text(encoding="utf-8")
    assert f"data/robots/{name}.yaml" in text
    assert "no references yet" not in text
    assert (folder / "data/robots" / f"{name}.yaml").read_bytes() == (ROOT / f"data/robots/{name}.yaml").read_bytes()


def test_a_urdf_with_an_odd_name(tmp_path):
    urdf = tmp_path / "KR-6 (R700) ü.urdf"
    urdf.write_text(export_urdf(load_robot("er3_600")), encoding="utf-8")
    assert arm_of(urdf, None, None).robot.name == "kr_6__r700"


@pytest.mark.parametrize(("stem", "name"), [("机械臂", "imported"), ("-_x", "x"), ("9" * 90, "9" * 64)])
def test_names_come_from_odd_files_too(tmp_path, stem, name):
    table = tmp_path / f"{stem}.csv"
    table.write_text(UR, encoding="utf-8")
    assert arm_of(None, table, None).robot.name == name


@pytest.mark.long
def test_an_arm_without_a_spherical_wrist_gets_targets_and_paths(tmp_path, monkeypatch):
    table = tmp_path / "ur.csv"
    table.write_text(UR, encoding="utf-8")
    arm = arm_of(None, table, None)
    assert any("180 deg were assumed" in note for note in arm.notes)
    write_study(arm, tmp_path)
    monkeypatch.chdir(tmp_path)
    study = check_study(Path("config/config.yaml"))
    assert [target.name for target in compute_inverse(study, "ur").summary.targets if target.chosen_deg is None] == []
    told = Path("README.md").read_text(encoding="utf-8")
    assert "no references yet" in told
    assert "Lines and arcs of the tool" not in told


@pytest.mark.long
@pytest.mark.parametrize(("table", "joints"), [(SCARA, 4), (FIVE, 5), (ON_A_TRACK, 8)])
def test_arms_with_other_joints_get_a_study_that_holds(tmp_path, monkeypatch, table, joints):
    file = tmp_path / "arm.csv"
    file.write_text(table, encoding="utf-8")
    arm = arm_of(None, file, None)
    assert arm.robot.joints == joints
    write_study(arm, tmp_path / "cell")
    monkeypatch.chdir(tmp_path / "cell")
    study = check_study(Path("config/config.yaml"))
    targets = compute_inverse(study, "arm").summary.targets
    assert len(targets) >= 2
    assert [target.name for target in targets if target.chosen_deg is None] == []
    found = compute_trajectory(study, "arm")
    assert [path.verdict for path in found.summary.paths] == ["safe"]
    languages = set(found.programs.language)
    assert languages == (
        {"csv", "krl"} if joints == 5 else {"csv"}
    )  # of those with joints that turn, KRL has fewer too
    text = found.programs.text[list(found.programs.language).index("csv")]
    header, row, *_ = [line for line in text.splitlines() if not line.startswith("#")]
    assert len(header.split(",")) == len(row.split(",")) == 1 + joints + 6
    assert [name for name in header.split(",") if name.startswith("q")] == list(joint_columns(arm.robot))


@pytest.mark.parametrize(
    ("old", "new_text", "told"),
    [
        ("3,prismatic,0,0,0,0,,,0,200", "3,prismatic,0,0,0,0,-10,10,0,200", "row 4, column lower_deg: joint 3 slides"),
        ("3,prismatic,0,0,0,0,,,0,200", "3,prismatic,0,0,0,0,,,,200", "row 4, column lower_mm: empty"),
        ("3,prismatic", "3,sliding", "'sliding' is not known"),
    ],
)
def test_cells_of_the_other_kind_of_joint_are_refused(tmp_path, old, new_text, told):
    file = tmp_path / "scara.csv"
    file.write_text(SCARA.replace(old, new_text), encoding="utf-8")
    with pytest.raises(InputError, match=told):
        arm_of(None, file, None)


def test_a_table_with_all_columns(tmp_path):
    table = tmp_path / "arm.csv"
    rows = ["joint,a_mm,alpha_deg,d_mm,offset_deg,direction,lower_deg,upper_deg,speed_deg_s"]
    rows += [f"{joint},100,90,50,10,-1,-100,120,200" for joint in range(1, 7)]
    table.write_text("\n".join(rows), encoding="utf-8")
    content, notes = read_dh_table(table, "arm", "modified")
    robot = robot_of(content)
    assert notes == ()
    assert robot.convention == "modified"
    assert robot.direction.tolist() == [-1.0] * 6
    assert {group.grade for group in robot.sources.values()} == {"claim"}


@pytest.mark.parametrize(
    ("old", "new_text", "told"),
    [
        ("a_mm", "a_m", "column a_m"),
        ("2,-425,0,0\n", "", "the joints are 1, 3, 4, 5"),
        ("-425", "-0.425", "looks like metres"),
        ("-425", "nan", "row 3, column a_mm"),
        ("d_mm\n", "d_mm,lower_deg\n", "fields where the header has"),
    ],
)
def test_a_table_that_can_t_be_used_is_refused_with_its_place(tmp_path, old, new_text, told):
    table = tmp_path / "ur.csv"
    table.write_text(UR.replace(old, new_text, 1), encoding="utf-8")
    with pytest.raises(InputError, match=told):
        arm_of(None, table, None)


def test_nothing_is_overwritten(tmp_path):
    (tmp_path / "README.md").write_text("mine", encoding="utf-8")
    arm = arm_of(None, None, "er3_600")
    with pytest.raises(Er3aError, match=r"README\.md is there already, and is kept"):
        write_study(arm, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["README.md"]
    assert (tmp_path / "README.md").read_text(encoding="utf-8") == "mine"


@pytest.mark.filterwarnings("ignore::er3a.errors.InputWarning")  # joint values of so stiff an arm are small
def test_an_arm_that_finds_no_clear_pose_gets_random_ones_and_is_told(tmp_path, monkeypatch):
    table = tmp_path / "stiff.csv"
    rows = [line + (",lower_deg,upper_deg" if "joint" in line else ",-1,7") for line in UR.splitlines()]
    table.write_text("\n".join(rows), encoding="utf-8")
    write_study(arm_of(None, table, None), tmp_path / "cell")
    monkeypatch.chdir(tmp_path / "cell")
    check_study(Path("config/config.yaml"))
    assert "no poses were found" in " ".join(Path("README.md").read_text(encoding="utf-8").split()).lower()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((), "which arm?"),
        (("--robot", "er3_600", "--dh", "x.csv"), "--dh and --robot each name an arm"),
        (("--robot", "er3_601"), "there is no robot 'er3_601'"),
        (("--robot", "er3_600", "--name", "Arm"), "can't be a robot's name"),
        (("--robot", "er3_600", "--modified"), "--modified says how a table is meant"),
        (("--urdf", "nowhere.urdf"), "there is no such file"),
    ],
)
def test_a_wrong_call_is_told_in_one_line(tmp_path, words, told):
    code, _, error = new(tmp_path / "cell", *words)
    assert code != 0
    assert told in error
    assert "\n" not in error
    assert not (tmp_path / "cell").exists()


def test_a_robot_and_its_references_are_the_study_s_own_first(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    packaged = load_robot("er3_600")
    own = Path("data/robots/er3_600.yaml")
    own.parent.mkdir(parents=True)
    own.write_text((ROOT / own).read_text(encoding="utf-8").replace("EFORT ER3-600", "Mine"), encoding="utf-8")
    assert load_robot("er3_600").title == "Mine"
    own.unlink()
    assert load_robot("er3_600").title == packaged.title
