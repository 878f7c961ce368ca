"""Studies to start from: what they hold can be used, what can't be is refused, and nothing that stands is touched."""

from __future__ import annotations

import math
import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

import er3a
from er3a.collision.along import clearance
from er3a.errors import Er3aError, InputError
from er3a.files.dh_table import read_dh_table
from er3a.files.kept_files import ROOT
from er3a.files.reference_sets import load_references
from er3a.files.robot_library import load_robot, robot_of
from er3a.files.yaml_file import read_yaml
from er3a.formats.urdf import export_urdf
from er3a.kinematics.singularity import scaled_jacobian
from er3a.pipeline.check import check_file, check_study
from er3a.pipeline.cli import app
from er3a.pipeline.new_study.arms import arm_of
from er3a.pipeline.new_study.tasks import reach_of, scenes
from er3a.pipeline.new_study.write import write_study
from er3a.pipeline.stages.inverse.compute import compute as compute_inverse
from er3a.pipeline.stages.trajectory.compute import compute as compute_trajectory
from er3a.pipeline.study import Study, load_study
from er3a.robots.joint_limits import joint_columns

REGULAR = 0.02
"""Smallest singular value below which a pose is near-singular."""

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


LONG = [pytest.param(name, marks=pytest.mark.long) for name in ("ur5e", "lbr_iiwa_14")]


@pytest.fixture(scope="module", params=["er3_600", *LONG])
def written(request, tmp_path_factory) -> tuple[str, Path]:
    folder = tmp_path_factory.mktemp("new") / "a cell ü"
    write_study(arm_of(request.param), folder)
    return request.param, folder


def test_no_table_stands_where_the_arm_rests():
    """As of an arm on a stand that its file does not give."""
    arm = load_robot("er3_600")
    reach = reach_of(arm)
    table, deep = scenes(arm, reach)
    assert "boxes" in table
    low = reach.q[reach.poses[:, 2, 3].argmin()]
    assert scenes(arm.replace(home=low), reach) == [deep]
    assert scenes(arm.replace(home=np.zeros(6)), reach) == [table, deep]


@pytest.mark.long
def test_every_file_is_in_order(written, monkeypatch):
    name, folder = written
    monkeypatch.chdir(folder)
    for place in ("robots", "targets", "paths"):
        check_file(Path(f"data/{place}/{name}.yaml"))
    check_study(Path("config/config.yaml"))


def check_promise(study: Study, name: str) -> set[str]:
    """That targets and paths are within limits, away from singular poses and clear, by the study's own stages.

    Singular poses are judged by the Jacobian's smallest singular value, whatever rule the stages have for the arm.
    Returns the kinds of the paths.
    """
    robot = study.robot(name)
    inverse = compute_inverse(study, name)
    targets = inverse.summary.targets
    assert len(targets) >= 2
    assert [target.name for target in targets if target.chosen_deg is None] == []
    chosen = np.array([target.chosen_deg for target in targets])
    q = np.where(robot.slides, chosen / 1000, np.radians(chosen))
    assert (q > robot.lower).all()
    assert (q < robot.upper).all()
    assert np.linalg.svd(scaled_jacobian(robot, q), compute_uv=False)[:, -1].min() > REGULAR
    assert (clearance(robot, q, study.scene(name, "inverse")).distance > 0).all()
    found = compute_trajectory(study, name)
    assert {path.name: path.verdict for path in found.summary.paths if path.verdict != "safe"} == {}
    assert found.checks.within_limits.all()
    assert not found.checks.near_singular.any()
    assert found.checks.smallest_singular_value.min() > REGULAR / 2
    assert np.nanmin(found.clearance.clearance_mm) > 0
    return {path.name for path in found.summary.paths}


@pytest.mark.long
def test_its_targets_are_reached_and_its_paths_are_safe(written, monkeypatch):
    name, folder = written
    monkeypatch.chdir(folder)
    kinds = check_promise(load_study("config/config.yaml"), name)
    assert kinds == ({"joint_move"} if name == "lbr_iiwa_14" else {"joint_move", "line"})
    text = " ".join(Path("README.md").read_text(encoding="utf-8").split())
    assert "poses that the arm reaches within its limits, away from singular poses and clear of collisions" in text
    assert "Read this first" not in text


@pytest.mark.long
def test_the_readme_tells_what_stands_there_and_which_references_count(written):
    name, folder = written
    text = (folder / "README.md").read_text(encoding="utf-8")
    assert f"data/robots/{name}.yaml" in text
    assert ("no references yet" in text) == (not load_robot(name).references)
    for each in load_robot(name).references:
        assert len(load_references(folder / "data/manual_refs" / each).documents.by_name) > 0
    assert (folder / "data/robots" / f"{name}.yaml").read_bytes() == (ROOT / f"data/robots/{name}.yaml").read_bytes()


def test_the_references_of_a_robot_come_along(tmp_path):
    """A shipped robot's, and those that stand beside a robot's file wherever it is."""
    shipped = arm_of("er3a_c60").references
    assert shipped["data/manual_refs/er3a_c60/limits.csv"].startswith("joint")
    for place, text in shipped.items():
        assert text == (ROOT / place).read_text(encoding="utf-8")
    other = tmp_path / "cell"
    shutil.copytree(ROOT / "data/manual_refs/er3a_c60", other / "data/manual_refs/mine")
    text = (ROOT / "data/robots/er3a_c60.yaml").read_text(encoding="utf-8")
    file = other / "data/robots/er3a_c60.yaml"
    file.parent.mkdir()
    file.write_text(text.replace("references: [er3a_c60]", "references: [mine]"), encoding="utf-8")
    arm = arm_of(str(file))
    assert list(arm.references.values()) == list(shipped.values())
    for place in arm.references:
        assert place.startswith("data/manual_refs/mine/")
    shutil.rmtree(other / "data/manual_refs")
    with pytest.raises(InputError, match="no reference set 'mine'"):
        arm_of(str(file))


def test_a_urdf_with_an_odd_name(tmp_path):
    urdf = tmp_path / "KR-6 (R700) ü.urdf"
    urdf.write_text(export_urdf(load_robot("er3_600")), encoding="utf-8")
    assert arm_of(urdf).robot.name == "kr_6__r700"


@pytest.mark.parametrize(("stem", "name"), [("机械臂", "imported"), ("-_x", "x"), ("9" * 90, "9" * 64)])
def test_names_come_from_odd_files_too(tmp_path, stem, name):
    table = tmp_path / f"{stem}.csv"
    table.write_text(UR, encoding="utf-8")
    assert arm_of(table).robot.name == name


def test_a_table_says_its_units_in_its_columns_or_by_options(tmp_path):
    millimetres = [line.split(",") for line in UR.split()[1:]]
    metres = [
        [n, str(float(a) / 1000), str(math.radians(float(alpha))), str(float(d) / 25.4)]
        for n, a, alpha, d in millimetres
    ]
    texts = {
        "named": ("joint,a_m,alpha_rad,d_in", metres, {}),
        "asked": ("joint,a_mm,alpha_rad,d_in", metres, {"length_unit": "m"}),
    }
    (tmp_path / "usual.csv").write_text(UR, encoding="utf-8")
    usual = arm_of(tmp_path / "usual.csv").robot
    for name, (header, rows, options) in texts.items():
        file = tmp_path / f"{name}.csv"
        file.write_text("\n".join([header, *map(",".join, rows)]), encoding="utf-8")
        robot = arm_of(file, **options).robot
        assert np.allclose(robot.a, usual.a, atol=1e-12)
        assert np.allclose(robot.alpha, usual.alpha, atol=1e-12)
        assert np.allclose(robot.d, usual.d, atol=1e-12)
    file.write_text(
        "\n".join([texts["named"][0] + ",d_mm", *(",".join([*row, "1"]) for row in metres)]), encoding="utf-8"
    )
    with pytest.raises(InputError, match="d_mm"):
        arm_of(file)


@pytest.mark.long
def test_an_arm_without_a_spherical_wrist_gets_targets_and_paths(tmp_path, monkeypatch):
    table = tmp_path / "ur.csv"
    table.write_text(UR, encoding="utf-8")
    arm = arm_of(table)
    assert any("180 deg were assumed" in note for note in arm.notes)
    write_study(arm, tmp_path)
    monkeypatch.chdir(tmp_path)
    study = check_study(Path("config/config.yaml"))
    assert [target.name for target in compute_inverse(study, "ur").summary.targets if target.chosen_deg is None] == []
    told = Path("README.md").read_text(encoding="utf-8")
    assert "no references yet" in told
    assert "Lines of the tool" not in told


@pytest.mark.long
@pytest.mark.parametrize(("table", "joints"), [(SCARA, 4), (FIVE, 5), (ON_A_TRACK, 8)])
def test_arms_with_other_joints_get_a_study_that_holds(tmp_path, monkeypatch, table, joints):
    file = tmp_path / "arm.csv"
    file.write_text(table, encoding="utf-8")
    arm = arm_of(file)
    assert arm.robot.joints == joints
    write_study(arm, tmp_path / "cell")
    monkeypatch.chdir(tmp_path / "cell")
    study = check_study(Path("config/config.yaml"))
    tray = read_yaml(Path("config/config.yaml"))["capability"]["placement"]
    assert tray["tool_direction"] == [0, 0, -1]
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


def test_the_tray_of_an_arm_that_cannot_tilt_its_tool_is_served_as_the_tool_points(tmp_path):
    """A small SCARA whose last frame points up, as URDFs have them."""
    (tmp_path / "arm.csv").write_text(
        SCARA.replace("275,180", "275,0").replace("325,0,400", "125,0,100"), encoding="utf-8"
    )
    write_study(arm_of(tmp_path / "arm.csv"), tmp_path / "cell")
    tray = read_yaml(tmp_path / "cell/config/config.yaml")["capability"]["placement"]
    assert tray["tool_direction"] == [0, 0, 1]
    assert tray["box_mm"] == [150, 110, 40]  # it reaches 0.5 m


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
        arm_of(file)


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
        ("a_mm", "a_km", "column a_km"),
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
        arm_of(table)


def test_nothing_is_overwritten(tmp_path):
    (tmp_path / "README.md").write_text("mine", encoding="utf-8")
    arm = arm_of("er3_600")
    with pytest.raises(Er3aError, match=r"README\.md is there already, and is kept"):
        write_study(arm, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["README.md"]
    assert (tmp_path / "README.md").read_text(encoding="utf-8") == "mine"


@pytest.mark.filterwarnings("ignore::er3a.errors.InputWarning")  # joint values of so stiff an arm are small
def test_an_arm_without_a_clear_pose_says_so_and_why(tmp_path, monkeypatch):
    table = tmp_path / "stiff.csv"
    rows = [line + (",lower_deg,upper_deg" if "joint" in line else ",-1,7") for line in UR.splitlines()]
    table.write_text("\n".join(rows), encoding="utf-8")
    code, output, _ = new(tmp_path / "cell", "--dh", table)
    warning = output[output.index("WARNING: ") :]
    assert code == 0
    assert "joint values drawn at random, not tasks: of 1000 joint vectors drawn within the limits none are" in warning
    monkeypatch.chdir(tmp_path / "cell")
    check_study(Path("config/config.yaml"))
    text = Path("README.md").read_text(encoding="utf-8")
    assert "## Read this first" in text
    assert "joint vectors drawn within the limits none are" in text
    assert "poses of random joint values" in text
    assert "that the arm reaches" not in text


@pytest.fixture
def xacro(tmp_path) -> Path:
    """A xacro arm whose links stand in another package beside it, with a mesh and a joint type as arguments."""
    urdf = export_urdf(load_robot("er3_600").replace(envelopes=(), hulls=())).replace('<?xml version="1.0"?>', "")
    shape = '<collision><geometry><mesh filename="package://arm_shapes/meshes/$(arg mesh)"/></geometry></collision>'
    urdf = urdf.replace('<link name="link_1" />', f'<link name="link_1">{shape}</link>', 1)
    assert shape in urdf
    body = urdf[urdf.index(">") + 1 : urdf.rindex("<")]
    head = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"'
    files = {
        "arm_shapes/package.xml": "<package><name>arm_shapes</name></package>",
        "arm_shapes/urdf/arm.xacro": f'{head}><xacro:macro name="arm" params="">{body}</xacro:macro></robot>',
        "arm_support/package.xml": "<package><name>arm_support</name></package>",
        "arm_support/urdf/my arm.urdf.xacro": f'{head} name="arm"><xacro:arg name="mesh" default="l.stl"/>'
        '<xacro:include filename="$(find arm_shapes)/urdf/arm.xacro"/><xacro:arm/></robot>',
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "arm_shapes/meshes").mkdir()
    trimesh.creation.torus(0.1, 0.03, 16, 8).export(tmp_path / "arm_shapes/meshes/ring.stl")
    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "arm_shapes/meshes/box.stl")
    (tmp_path / "arm_shapes/meshes/torn.stl").write_bytes(b"solid torn")
    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "arm_shapes/meshes/box.dae")
    return tmp_path / "arm_support/urdf/my arm.urdf.xacro"


@pytest.mark.long
def test_xacro_is_expanded_with_its_packages_arguments_and_meshes(xacro):
    packaged = load_robot("er3_600")
    arm = arm_of(xacro, xacro=("mesh:=box.stl",))
    q = np.random.default_rng(1).uniform(packaged.lower, packaged.upper, (20, 6))
    assert np.allclose(er3a.forward(arm.robot, q), er3a.forward(packaged, q), atol=1e-9)
    assert arm.robot.name == "arm"  # as the file names it
    assert np.ptp(np.array(arm.robot.hulls[0].points), axis=0) == pytest.approx([0.1] * 3, abs=1e-6)
    assert arm_of(xacro, xacro=("mesh:=ring.stl",)).robot.hulls != arm.robot.hulls
    assert [path.name for path in xacro.parent.iterdir()] == [xacro.name]


def test_a_folder_without_a_manifest_is_the_package_of_its_name(xacro):
    for manifest in xacro.parents[2].glob("*/package.xml"):
        manifest.unlink()
    assert len(arm_of(xacro, xacro=("mesh:=box.stl",)).robot.hulls) == 1


def test_import_urdf_takes_xacro_too(xacro, tmp_path):
    done = CliRunner().invoke(
        app, ["import-urdf", str(xacro), "--xacro", "mesh:=box.stl", "--output", str(tmp_path / "arm.yaml")]
    )
    assert done.exit_code == 0, done.output
    assert len(load_robot(tmp_path / "arm.yaml").hulls) == 1


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("mesh=box.stl",), "'mesh=box.stl' is not an xacro argument. Write NAME:=VALUE"),
        ((":=box.stl",), "':=box.stl' is not an xacro argument"),
        (None, "--xacro: the file holds no xacro macros"),
    ],
)
def test_wrong_arguments_of_xacro_are_refused_in_one_line(xacro, tmp_path, words, told):
    if words is None:
        xacro = tmp_path / "plain.urdf"
        xacro.write_text(f"<!-- <xacro:arm/> -->{export_urdf(load_robot('er3_600')).split('?>')[1]}", encoding="utf-8")
        assert arm_of(xacro).robot.joints == 6
    with pytest.raises(InputError, match=re.escape(told)) as error:
        arm_of(xacro, xacro=words or ("mesh:=box.stl",))
    assert error.value.file == str(xacro)


@pytest.mark.long
def test_what_xacro_can_t_expand_and_what_the_expanded_file_lacks_name_the_file_given(xacro):
    text = xacro.read_text(encoding="utf-8")
    xacro.write_text(text.replace("find arm_shapes", "find arm_forms"), encoding="utf-8")
    with pytest.raises(InputError, match=r"needs the package arm_forms, which was not found"):
        arm_of(xacro)
    xacro.write_text(text.replace("<xacro:arm/>", ""), encoding="utf-8")
    with pytest.raises(InputError, match="holds no joints") as error:
        arm_of(xacro)
    assert error.value.file == str(xacro)


def test_without_xacrodoc_the_extra_is_named(xacro, monkeypatch):
    monkeypatch.setitem(sys.modules, "xacrodoc", None)
    with pytest.raises(InputError, match=r"is xacro, which xacrodoc expands\. Install it: pip install 'er3a\[xacro\]'"):
        arm_of(xacro)


@pytest.mark.parametrize(
    ("mesh", "told"),
    [
        ("gone.stl", r"are left out \(.*gone\.stl is no file of a mesh"),
        ("torn.stl", r"are left out \(.*torn\.stl: holds no triangles"),
        ("box.dae", r"box\.dae: can't be read without pycollada\. Install it: pip install 'er3a\[meshes\]'"),
    ],
)
def test_a_mesh_that_can_t_be_read_is_a_note(xacro, monkeypatch, mesh, told):
    monkeypatch.setattr("er3a.formats.mesh_file.find_spec", lambda name: None)
    arm = arm_of(xacro, xacro=(f"mesh:={mesh}",))
    assert arm.robot.hulls == ()
    assert [note for note in arm.notes if re.search(told, note)]


def test_a_urdf_without_shapes_is_said_to_have_guessed_ones(tmp_path):
    for shapes, told in ((load_robot("er3a_c60").envelopes, False), ((), True)):
        file = tmp_path / "arm.urdf"
        file.write_text(export_urdf(load_robot("er3a_c60").replace(envelopes=shapes)), encoding="utf-8")
        assert any("capsules are guessed" in note for note in arm_of(file).notes) == told


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--robot", "er3_601"), "there is no robot 'er3_601'"),
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
