"""What files may say of masses, what stands out of them, guesses from capsules, and URDF."""

from __future__ import annotations

import itertools
import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pinocchio
import pytest
import trimesh
import yaml
from scipy.spatial.transform import Rotation

import er3a
from er3a.dynamics import arm_model
from er3a.dynamics.arm_model import capsule_body, estimated_links, filled
from er3a.dynamics.plausibility import mass_findings
from er3a.errors import InputError
from er3a.files.robot_file import DriveRow, drive_keys
from er3a.files.robot_library import LoadFields, load_of
from er3a.files.robot_writer import write_robot
from er3a.finding import fact, is_one
from er3a.formats.urdf import export_urdf, import_urdf
from er3a.robots.masses import Drives, LinkMass, MassBody, Masses, WristLoad, about, moved, no_body, together
from er3a.robots.robot import ConvexPiece, Envelope, Robot
from testing.arms import scara
from testing.fleet import UrdfFile, urdf_files


@pytest.fixture(scope="module")
def arm() -> Robot:
    return er3a.load_robot("er3a_c60")


def with_body(arm: Robot, link: int, change) -> Robot:
    links = tuple(LinkMass(e.link, change(e.body) if e.link == link else e.body) for e in arm.masses.links)
    return arm.replace(masses=replace(arm.masses, links=links))


def test_the_real_arm_lacks_link_6_and_nothing_else_stands_out(arm):
    assert mass_findings(arm) == (fact("missing_link", link=6, singular=True),)
    rotor = replace(Drives.unknown(6), armature=np.full(6, 0.01))
    assert mass_findings(arm.replace(masses=replace(arm.masses, drives=rotor))) == (
        fact("missing_link", link=6, singular=False),
    )


def scaled(factor: float):
    return lambda body: replace(body, inertia=tuple(factor * value for value in body.inertia))


def about_origin(body: MassBody) -> MassBody:
    tensor = body.inertia_matrix + body.mass * about(np.array(body.centre))
    return replace(body, inertia=(tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2]))


@pytest.mark.parametrize(
    ("change", "kind", "link"),
    [
        (lambda body: replace(body, mass=1000 * body.mass, inertia=scaled(1000)(body).inertia), "unlikely_density", 2),
        (lambda body: replace(body, centre=tuple(1000 * value for value in body.centre)), "centre_outside", 2),
        (scaled(1e6), "unlikely_inertia", 2),
        (scaled(1e-3), "unlikely_inertia", 2),
        (lambda body: replace(body, inertia=(0.0,) * 6), "point_mass", 3),
        (lambda body: replace(body, inertia=(1.0, 0.1, 0.1, 0, 0, 0)), "impossible_inertia", 3),
        (lambda body: replace(body, mass=0.0), "inertia_without_mass", 3),
        (lambda body: replace(body, mass=-1.0), "impossible_inertia", 3),
        (about_origin, "about_origin", 4),
    ],
)
def test_faults_of_masses_are_named_with_their_link(arm, change, kind, link):
    found = [each for each in mass_findings(with_body(arm, link, change)) if not is_one(each, "missing_link")]
    assert [each.code for each in found] == [kind]
    assert found[0].link == link


def test_a_flange_of_grams_needs_no_inertia(arm):
    for mass, doubted in ((0.02, False), (0.5, True)):
        links = (*arm.masses.links, LinkMass(6, MassBody(mass)))
        found = mass_findings(arm.replace(masses=replace(arm.masses, links=links)))
        assert [each.code for each in found] == ["point_mass"] * doubted


def test_the_sum_against_the_manufacturers_weight(arm):
    def findings(weight):
        found = mass_findings(arm.replace(masses=replace(arm.masses, weight=weight)))
        return [each for each in found if is_one(each, "sum_off_weight")]

    assert findings(21.0) == []
    assert findings(27.0) == []  # link 6 is missing, so less is no fault
    (off,) = findings(15.0)
    assert (off.sum_kg, off.weight_kg, off.complete) == (pytest.approx(20.06), 15.0, False)
    flange = LinkMass(6, MassBody(0.1, inertia=(1e-4, 1e-4, 1e-4, 0, 0, 0)))
    arm = arm.replace(masses=replace(arm.masses, links=(*arm.masses.links, flange)))
    assert [each.complete for each in findings(27.0)] == [True]
    arm = arm.replace(masses=replace(arm.masses, links=tuple(each for each in arm.masses.links if each.link)))
    assert findings(27.0) == []  # the base is missing


def test_what_no_body_can_be():
    assert no_body(MassBody(1.0, inertia=(1, 1, 1, 0, 0, 0))) is None
    assert no_body(MassBody(1.0, inertia=(1, 1, 2, 0, 0, 0))) is None  # a disc
    assert no_body(MassBody(1.0, inertia=(1, 1, 2.1, 0, 0, 0))) == "triangle"
    assert no_body(MassBody(1.0, inertia=(1, 1, 1, 2, 0, 0))) == "negative_moment"
    assert no_body(MassBody(-1.0)) == "negative_mass"
    assert no_body(MassBody(np.nan)) == "not_finite"


def test_capsules_are_solid_capsules():
    capsule = Envelope(1, (0.1, 0.0, 0.2), (0.1, 0.3, 0.4), 0.05)
    body = capsule_body(capsule, 2700.0)
    length = np.hypot(0.3, 0.2)
    mesh = trimesh.creation.capsule(height=length, radius=0.05, count=[256, 256])
    mesh.density = 2700.0
    assert body.mass == pytest.approx(mesh.mass, rel=1e-3)
    assert body.centre == pytest.approx((0.1, 0.15, 0.3))
    np.testing.assert_allclose(
        np.linalg.eigvalsh(body.inertia_matrix), np.sort(np.diagonal(mesh.moment_inertia)), rtol=2e-3
    )
    along = np.array([0.0, 0.3, 0.2]) / length
    assert along @ body.inertia_matrix @ along == pytest.approx(np.linalg.eigvalsh(body.inertia_matrix)[0])


def test_guessed_masses_stand_out_of_nothing(arm):
    guessed = arm.replace(masses=Masses(estimated_links(arm, 2700.0)))
    assert {each.code for each in mass_findings(guessed)} == {"missing_link"}  # link 5 has no capsule
    assert {each.link for each in mass_findings(guessed)} == {5}


def test_bodies_together_and_moved():
    rng = np.random.default_rng(0)
    points, masses = rng.normal(size=(6, 3)), rng.uniform(1, 2, 6)
    dust = [MassBody(m, tuple(p)) for p, m in zip(points.tolist(), masses.tolist())]
    halves = together([together(dust[:2]), together(dust[2:])])
    centre = masses @ points / masses.sum()
    tensor = sum(m * about(p - centre) for m, p in zip(masses, points))
    np.testing.assert_allclose(halves.inertia_matrix, tensor, atol=1e-12)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.linalg.qr(rng.normal(size=(3, 3)))[0], (1, 2, 3)
    np.testing.assert_allclose(moved(halves, T).inertia_matrix, T[:3, :3] @ tensor @ T[:3, :3].T, atol=1e-12)
    np.testing.assert_allclose(moved(halves, T).centre, T[:3, :3] @ centre + T[:3, 3], atol=1e-12)


# Files


def changed_file(tmp_path, change):
    content = yaml.safe_load(Path("data/robots/er3a_c60.yaml").read_text(encoding="utf-8"))
    change(content)
    path = tmp_path / "er3a_c60.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


DRIVES = {"source": "made up", "grade": "claim"}


@pytest.mark.parametrize(
    ("change", "field", "problem"),
    [
        (lambda c: c["inertia"]["links"][2].update(mass_kg=-5.664), "inertia.links[2].mass_kg", "below 0"),
        (lambda c: c["inertia"]["links"][2].update(mass_kg=5664e3), "inertia.links[2].mass_kg", "in grams"),
        (
            lambda c: c["inertia"]["links"][2].update(inertia_kg_m2=[1, 0.1, 0.1, 0, 0, 0]),
            "inertia.links[2].inertia_kg_m2",
            "no body can have",
        ),
        (lambda c: c["inertia"]["links"].append({"link": 3, "mass_kg": 1}), "inertia.links", "named twice"),
        (lambda c: c["inertia"]["links"].append({"link": 9, "mass_kg": 1}), "inertia", "link"),
        (lambda c: c["inertia"].update(frame="urdf"), "inertia.frame", "'joint' or 'dh'"),
        (
            lambda c: c.update(drives=DRIVES | {"rows": [{"joint": 1, "peak_n_m": 0}]}),
            "drives.rows[0].peak_n_m",
            "leave it out if it is unknown",
        ),
        (
            lambda c: c.update(drives=DRIVES | {"rows": [{"joint": 1, "peak_n_m": 1, "rated_n_m": 2}]}),
            "drives.rows[0]",
            "below the rated",
        ),
        (lambda c: c.update(drives=DRIVES | {"rows": [{"joint": 1, "peak_n": 5}]}), "drives.rows[0].peak_n", "turns"),
        (lambda c: c.update(drives=DRIVES | {"rows": [{"joint": 7}]}), "drives.rows", "the joints come as"),
        (lambda c: c.update(wrist_load=DRIVES | {"payload_kg": 0}), "wrist_load.payload_kg", "unknown"),
        (lambda c: c.update(weight=DRIVES | {"kg": -27}), "weight.kg", "above 0"),
    ],
)
def test_each_fault_of_a_file_is_one_error(tmp_path, change, field, problem):
    with pytest.raises(InputError) as caught:
        er3a.load_robot(changed_file(tmp_path, change))
    assert caught.value.field.startswith(field)
    assert problem in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("frame", ["joint", "dh"])
def test_frames_of_a_file_give_equal_torques(arm, tmp_path, frame):
    """The same bodies, written in the frames of the joints and of the D-H rows."""
    fields = []
    for each in arm.masses.links:
        T = np.eye(4)
        if frame == "dh" and each.link:
            row = each.link - 1
            c, s = np.cos(-arm.alpha[row]), np.sin(-arm.alpha[row])
            turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
            T[:3, :3] = turn
            T[:3, 3] = turn @ [-arm.a[row], 0, -arm.d[row]]
        body = moved(each.body, T)
        centre = [1000 * value for value in body.centre]
        fields.append(
            {"link": each.link, "mass_kg": body.mass, "centre_mm": centre, "inertia_kg_m2": list(body.inertia)}
        )

    def change(content):
        content["inertia"] |= {"frame": frame, "links": fields}

    other = er3a.load_robot(changed_file(tmp_path, change))
    q, qd, qdd = np.random.default_rng(0).normal(size=(3, 50, 6))
    np.testing.assert_allclose(er3a.torques(other, q, qd, qdd), er3a.torques(arm, q, qd, qdd), atol=1e-11)


def everything(arm: Robot) -> Robot:
    drives = Drives(*(np.linspace(1, 2, 6) * k for k in (0.1, 100, 0.3, 0.4, 5, 9)))
    wrist = WristLoad(3.0, ((5, 10.0), (6, 3.0)), ((6, 0.03),))
    return arm.replace(masses=replace(arm.masses, drives=drives, wrist=wrist, weight=27.0))


def test_a_written_file_reads_back(arm, tmp_path):
    full = everything(arm)
    write_robot(full, tmp_path / "er3a_c60.yaml")
    back = er3a.load_robot(tmp_path / "er3a_c60.yaml").masses
    assert (back.wrist, back.weight) == (full.masses.wrist, 27.0)
    assert back.drives == full.masses.drives
    for one, other in zip(back.links, full.masses.links):
        np.testing.assert_allclose(one.body.inertia, other.body.inertia, atol=1e-15)
        np.testing.assert_allclose(one.body.centre, other.body.centre, atol=1e-13)


def test_each_field_of_each_drive_reads_back_from_its_key(tmp_path):
    """Of joints that turn and of one that slides, by numbers that no two fields share."""
    robot = scara()
    names = [field.name for field in fields(Drives)]
    values = np.arange(1.0, 1 + 4 * len(names)).reshape(len(names), 4)
    drives = Drives(**dict(zip(names, values, strict=True)))
    write_robot(robot.replace(name="scara", masses=Masses(drives=drives)), tmp_path / "scara.yaml")
    back = er3a.load_robot(tmp_path / "scara.yaml").masses.drives
    for name, expected in zip(names, values, strict=True):
        np.testing.assert_array_equal(getattr(back, name), expected, err_msg=name)
    keys = {key for key in DriveRow.model_fields if key != "joint"}
    assert keys == {*drive_keys(False).values(), *drive_keys(True).values()}
    assert sorted(drive_keys(False)) == sorted(names)


def test_without_pinocchio_the_error_names_the_package(monkeypatch):
    monkeypatch.setitem(sys.modules, "pinocchio", None)  # what import then raises is a ModuleNotFoundError
    with pytest.raises(er3a.Er3aError, match=r"Pinocchio \(package pin\), which is not installed"):
        arm_model.pinocchio()


# URDF


@pytest.mark.parametrize("rpy_deg", [(90, 0, 0), (0, 90, 0), (0, -90, 30), (180, 0, 0), (25, 0, 70)])
def test_torques_of_an_arm_on_a_wall_a_ceiling_or_a_slope_are_pinocchios(rpy_deg):
    """Pinocchio has the URDF of the arm on the floor, and a gravity turned the other way."""
    robot = er3a.load_robot("er3a_c60").without_tool()
    R = Rotation.from_euler("xyz", rpy_deg, degrees=True).as_matrix()
    base = np.eye(4)
    base[:3, :3], base[:3, 3] = R, (0.5, -1.0, 2.0)
    model = pinocchio.buildModelFromXML(export_urdf(robot))
    model.gravity.linear = R.T @ [0.0, 0.0, -9.81]
    random = np.random.default_rng(3)
    q, qd, qdd = random.uniform(-1, 1, (3, 20, 6))
    theirs = [pinocchio.rnea(model, model.createData(), *each) for each in zip(q, qd, qdd)]
    ours = er3a.torques(robot.replace(base=base), q, qd, qdd)
    np.testing.assert_allclose(ours, theirs, atol=1e-9 * np.abs(theirs).max())
    upright = er3a.torques(robot, q, qd, qdd)
    assert np.abs(ours - upright).max() > 1.0


def test_urdf_out_and_in_keeps_the_torques(arm, tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(export_urdf(arm))
    found = import_urdf(path)
    assert "no mass is given for what moves with joint_6" in found.notes
    q, qd, qdd = np.random.default_rng(0).normal(size=(3, 50, 6))
    np.testing.assert_allclose(er3a.torques(found.robot, q, qd, qdd), er3a.torques(arm, q, qd, qdd), atol=1e-9)
    assert found.robot.sources["inertia"].grade == "export"


def test_urdf_is_what_pinocchio_makes_of_it(arm, tmp_path):
    pinocchio = pytest.importorskip("pinocchio")
    path = tmp_path / "arm.urdf"
    path.write_text(export_urdf(arm))
    model = pinocchio.buildModelFromUrdf(str(path))
    data = model.createData()
    q, qd, qdd = np.random.default_rng(0).normal(size=(3, 50, 6))
    expected = [pinocchio.rnea(model, data, *row) for row in zip(q, qd, qdd)]
    np.testing.assert_allclose(er3a.torques(arm, q, qd, qdd), expected, atol=1e-10)


def test_links_fixed_to_one_another_count_as_one(arm, tmp_path):
    text = export_urdf(arm)
    extra = '<link name="box"><inertial><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" '
    extra += 'iyz="0"/></inertial></link><joint name="glue" type="fixed"><parent link="link_3"/><child link="box"/>'
    extra += '<origin xyz="0.1 0.2 0.3" rpy="0 0 0"/></joint></robot>'
    path = tmp_path / "arm.urdf"
    path.write_text(text.replace("</robot>", extra))
    pinocchio = pytest.importorskip("pinocchio")
    model = pinocchio.buildModelFromUrdf(str(path))
    q = np.random.default_rng(0).normal(size=(10, 6))
    expected = [pinocchio.computeGeneralizedGravity(model, model.createData(), row) for row in q]
    np.testing.assert_allclose(er3a.gravity(import_urdf(path).robot, q), expected, atol=1e-10)


# Loads of a study

SOURCE = {"source": "weighed", "grade": "measured"}


def load_fields(**content) -> LoadFields:
    return LoadFields.model_validate(SOURCE | content)


def test_loads_on_the_flange_are_one_body():
    two = [load_fields(body={"mass_kg": 2.0, "centre_mm": [0.0, 0.0, z]}) for z in (60.0, -60.0)]
    both = load_of(two)
    assert both.mass == pytest.approx(4.0)
    assert both.centre == pytest.approx((0, 0, 0), abs=1e-9)
    assert load_of([]) is None


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ({"body": {"mass_kg": 3000.0}}, "Write 3 if it is g"),
        ({"body": {"mass_kg": -3.0}}, "below 0"),
        ({"body": {"mass_kg": 3.0, "inertia_kg_m2": [1.0, 0.1, 0.1, 0.0, 0.0, 0.0]}}, "no body can have"),
        ({}, "body"),
    ],
)
def test_a_bad_load_is_refused(content, problem):
    with pytest.raises(ValueError, match=problem):
        load_fields(**content)


# Shapes


def test_filled_hulls_are_those_of_a_mesh_library():
    points = np.random.default_rng(0).normal([0.3, -0.2, 0.5], 0.1, (40, 3))
    mesh = trimesh.convex.convex_hull(points)
    mesh.density = 1000.0
    body = filled(points)
    assert body.mass == pytest.approx(mesh.mass, rel=1e-9)
    np.testing.assert_allclose(body.centre, mesh.center_mass, atol=1e-12)
    np.testing.assert_allclose(body.inertia_matrix, mesh.moment_inertia, atol=1e-12)


def test_masses_are_judged_by_meshes_where_there_are_any(arm):
    """Link 2's mesh is a box beside its axis, which its capsules know nothing of; a flat piece has no volume."""
    corners = 0.05 * np.array(list(itertools.product([-1, 1], repeat=3))) + [0.13, 0.0, 0.3]
    pieces = (ConvexPiece(2, tuple(map(tuple, corners.tolist())), 0.0),)
    flat = ConvexPiece(3, ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.1, 0.1, 0.0)), 0.0)
    meshed = arm.replace(hulls=(*pieces, flat))

    def findings(centre):
        moments = (0.01, 0.01, 0.01, 0.0, 0.0, 0.0)
        own = with_body(meshed, 2, lambda body: replace(body, mass=2.0, centre=centre, inertia=moments))
        return [each for each in mass_findings(own) if not is_one(each, "missing_link")]

    assert findings((0.13, 0.0, 0.3)) == []
    (off,) = findings((0.13, 0.0, 0.15))
    assert (off.code, off.link, off.outside_mm) == ("centre_outside", 2, pytest.approx(100.0))


def test_shapes_guessed_from_a_table_accuse_only_what_is_off_by_orders_of_magnitude():
    """The table of a SCARA may have its links at any height along the parallel axes."""
    moments = (0.04, 0.04, 0.04, 0.0, 0.0, 0.0)
    links = (LinkMass(1, MassBody(4.0, (0.15, 0, 0.4), moments)), LinkMass(2, MassBody(3.0, (0.12, 0, 0.42), moments)))
    scara = Robot(
        name="scara", title="scara", convention="standard", a=[0.3, 0.25], alpha=[0.0, 0.0], d=[0.0, 0.0],
        direction=[1.0, 1.0], offset=[0.0, 0.0], lower=[-2.0, -2.0], upper=[2.0, 2.0], masses=Masses(links),
    )  # fmt: skip
    assert mass_findings(scara) == ()
    grams = with_body(scara, 2, lambda body: replace(body, mass=3000.0))
    assert {each.code for each in mass_findings(grams)} == {"unlikely_density"}
    metres = with_body(scara, 2, lambda body: replace(body, centre=(120.0, 0.0, 420.0)))
    assert {each.code for each in mass_findings(metres)} == {"centre_outside"}


@pytest.mark.long
def test_known_faults_of_published_urdfs_are_named_and_sound_ones_are_not(tmp_path):
    """The UR5's wrist has inertias of a far greater body; KUKA's files give each link 2 kg, a placeholder; the others
    are sound."""
    found, sound = {}, ("vx300s.urdf", "urdf/z1.urdf", "xarm7.urdf", "robots/kinova.urdf")
    names = (*sound, "ur5_robot", "kr16_2")
    for file in urdf_files(tmp_path, lambda name: any(each in name for each in names)):
        if isinstance(file, UrdfFile):
            name = next(each for each in names if each in file.name)
            robot = import_urdf(file.path, snap=True).robot
            found[name] = {(each.code, each.link) for each in mass_findings(robot)}
    assert found["ur5_robot"] >= {("unlikely_inertia", link) for link in (4, 5, 6)}
    assert found["kr16_2"] == {("missing_link", link) for link in range(1, 7)}
    assert [found[name] for name in sound] == [set()] * 4


def test_masses_that_no_file_may_state_are_one_error_when_an_arm_is_written(arm, tmp_path):
    heavy = with_body(arm, 2, lambda body: replace(body, mass=40_000.0))
    with pytest.raises(InputError, match="heavier than any link") as caught:
        write_robot(heavy, tmp_path / "er3a_c60.yaml")
    assert caught.value.field.startswith("inertia.links[2].mass_kg")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "er3a_c60.yaml").exists()
