"""URDF in and out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from er3a.collision.shapes import arm_shapes
from er3a.comparison.axis_table import table_from_axes
from er3a.errors import InputError
from er3a.files.robot_library import load_robot, read_arm
from er3a.files.robot_writer import write_robot
from er3a.formats.urdf import export_urdf, import_urdf
from er3a.kinematics.forward import forward, frames
from er3a.pipeline.new_study.arms import arm_of
from er3a.robots.masses import Masses
from er3a.robots.robot import Robot

# The real arm as its published URDF has it: joint origins to 0.1 mm, right angles rounded to five digits.
REAL_ARM = [
    ("revolute", "0 0 0.1815", "0 0 0", "0 0 1"),
    ("revolute", "0.05 0 0.14", "1.5708 -1.5708 0", "0 0 1"),
    ("revolute", "0.27 0 0", "0 0 0", "0 0 1"),
    ("revolute", "0.07 -0.299 0", "1.5708 0 0", "0 0 1"),
    ("revolute", "0 0 0", "-1.5708 0 0", "0 0 1"),
    ("continuous", "0 -0.0785 0", "1.5708 0 0", "0 0 1"),
]


def urdf(joints=REAL_ARM, limit='<limit lower="-2" upper="2" velocity="3" effort="0"/>', extra="") -> str:
    text = '<robot name="r"><link name="l0"/>'
    for k, (kind, xyz, rpy, axis) in enumerate(joints):
        text += f'<link name="l{k + 1}"/><joint name="j{k + 1}" type="{kind}"><parent link="l{k}"/>'
        text += f'<child link="l{k + 1}"/><origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>{limit}</joint>'
    return text + extra + "</robot>"


def shaped(shape: str) -> str:
    return f'<link name="l6"><collision><geometry>{shape}</geometry></collision></link>'


def written(folder: Path, text: str) -> Path:
    path = folder / "arm.urdf"
    path.write_text(text)
    return path


def pinocchio_poses(path: Path, q: np.ndarray, frame: str) -> np.ndarray:
    model = pinocchio.buildModelFromUrdf(str(path))
    data = model.createData()
    poses = []
    for row in q:
        pinocchio.framesForwardKinematics(model, data, row)
        poses.append(data.oMf[model.getFrameId(frame)].homogeneous.copy())
    return np.array(poses)


def test_export_is_the_same_arm_to_pinocchio(robot, random, tmp_path):
    tool = np.eye(4)
    tool[:3, :3] = Rotation.from_euler("xyz", [0.3, -0.8, 2.0]).as_matrix()
    tool[:3, 3] = 0.1, -0.05, 0.2
    robot = robot.replace(tool=tool)
    path = written(tmp_path, export_urdf(robot))
    q = random.uniform(robot.lower, robot.upper, (200, 6))
    np.testing.assert_allclose(pinocchio_poses(path, q, "tool"), forward(robot, q), atol=1e-12)


def test_round_trip_gives_the_table_back(robot, tmp_path):
    imported = import_urdf(written(tmp_path, export_urdf(robot.replace(masses=Masses()))))
    back = imported.robot
    for key in ("a", "alpha", "d", "direction", "offset", "lower", "upper", "base", "flange"):
        np.testing.assert_allclose(getattr(back, key), getattr(robot, key), atol=1e-12, err_msg=key)
    assert imported.misfit_m < 1e-12
    assert imported.notes == ()


def test_import_agrees_with_pinocchio_and_survives_the_robot_file(random, tmp_path):
    path = written(tmp_path, urdf([(kind.replace("continuous", "revolute"), *rest) for kind, *rest in REAL_ARM]))
    imported = import_urdf(path, snap=False)
    assert imported.misfit_m < 1e-9
    q = random.uniform(-3, 3, (200, 6))
    np.testing.assert_allclose(forward(imported.robot, q), pinocchio_poses(path, q, "l6"), atol=1e-9)


@pytest.mark.parametrize(
    ("angle", "meant"),
    [
        ("1.571", np.pi / 2),
        ("-1.57", -np.pi / 2),
        ("0.785", np.pi / 4),
        ("3.1416", np.pi),
        ("3.14", np.pi),
        ("1.569", None),
        ("0.79", None),
    ],
)
def test_an_angle_is_a_multiple_of_45_deg_where_its_digits_allow_it(tmp_path, angle, meant):
    rounded, full = (
        import_urdf(written(tmp_path, urdf().replace('rpy="1.5708 -1.5708 0"', f'rpy="{text} 0 0"')), snap=snap).robot
        for text, snap in ((angle, True), (repr(float(meant or angle)), True))
    )
    kept = import_urdf(written(tmp_path, urdf().replace('rpy="1.5708 -1.5708 0"', f'rpy="{angle} 0 0"')), snap=False)
    np.testing.assert_allclose(rounded.alpha, full.alpha, atol=1e-12)
    assert np.allclose(rounded.alpha[:2], kept.robot.alpha[:2], atol=1e-6) == (meant is None)


def test_snapping_gives_the_real_arm_and_says_what_it_changed(tmp_path):
    imported = import_urdf(written(tmp_path, urdf()), snap=True)
    assert not any("rounded" in note for note in imported.notes)  # 1.5708: no arm repeats a pose that well
    imported = import_urdf(written(tmp_path, urdf().replace("1.5708", "1.571")), snap=True)
    real, got = load_robot("er3a_c60"), imported.robot
    np.testing.assert_allclose(got.a, real.a, atol=1e-12)
    np.testing.assert_allclose(got.d, [0.3215, 0, 0, 0.299, 0, 0.0785], atol=1e-12)
    np.testing.assert_allclose(got.alpha, real.alpha, atol=1e-12)
    assert "rounded angles were taken as multiples of 45 deg" in imported.notes[0]
    assert any("continuous" in note for note in imported.notes)
    assert (got.continuous.any(), got.lower[5], got.upper[5]) == (False, -2, 2)  # as the file states them
    path = tmp_path / "arm.yaml"
    write_robot(got, path)
    q = np.random.default_rng(1).uniform(-3, 3, (100, 6))
    np.testing.assert_allclose(forward(load_robot(path), q), forward(got, q), atol=1e-12)


@pytest.mark.long
def test_any_six_axes_get_an_exact_table(random):
    for k in range(300):
        alpha = random.uniform(-np.pi, np.pi, 6) if k % 3 else random.choice([0, np.pi / 2, -np.pi / 2, np.pi], 6)
        arm = Robot(
            name="any",
            title="any",
            convention="standard" if k % 2 else "modified",
            a=random.uniform(-1, 1, 6) * random.choice([0, 1], 6),
            alpha=alpha,
            d=random.uniform(-1, 1, 6) * random.choice([0, 1], 6),
            direction=random.choice([-1.0, 1.0], 6),
            offset=random.uniform(-3, 3, 6),
            lower=-np.ones(6),
            upper=np.ones(6),
        )
        T = frames(arm, np.zeros(6))
        directions = T[:6, :3, 2] * arm.direction[:, None]
        table = table_from_axes(directions, T[:6, :3, 3] + 0.3 * directions, T[6])
        derived = arm.replace(convention="standard", **vars(table))
        q = random.uniform(-np.pi, np.pi, (20, 6))
        np.testing.assert_allclose(forward(derived, q), forward(arm, q), atol=1e-9)


def test_fixed_joints_are_merged_and_side_frames_ignored(tmp_path, random):
    fixed = '<link name="cam"/><joint name="c" type="fixed"><parent link="l2"/><child link="cam"/></joint>'
    flange = (
        '<link name="fl"/><joint name="f" type="fixed"><parent link="l6"/><child link="fl"/>'
        '<origin xyz="0 0 0.05"/></joint>'
    )
    q = random.uniform(-3, 3, (50, 6))
    plain = import_urdf(written(tmp_path, urdf())).robot
    with_flange = import_urdf(written(tmp_path, urdf(extra=fixed + flange))).robot
    expected = forward(plain, q) @ np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.05], [0, 0, 0, 1.0]])
    np.testing.assert_allclose(forward(with_flange, q), expected, atol=1e-9)


def test_a_limit_that_is_not_given_is_0_as_the_specification_says(tmp_path):
    found = import_urdf(written(tmp_path, urdf(limit='<limit upper="1" velocity="inf"/>')))
    np.testing.assert_array_equal(found.robot.lower[:5], 0)  # the sixth turns without end
    np.testing.assert_array_equal(found.robot.upper[:5], 1)
    assert np.isnan(found.robot.speed).all()
    assert sum("states upper 1: 0 to 1 was taken; likewise j2, j3, j4, j5" in note for note in found.notes) == 1


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (urdf([REAL_ARM[0]] * 11), "11 moving joints"),
        (urdf([("planar", *REAL_ARM[0][1:]), *REAL_ARM[1:]]), "type 'planar'"),
        (urdf().replace('name="j2"', 'name="j1"'), "2 joints have this name"),
        (urdf([("revolute", "0, 0, 1", "0 0 0", "0 0 1"), *REAL_ARM[1:]]), "'0, 0, 1' is not 3 finite numbers"),
        (
            urdf(limit='<mimic joint="j1"/><limit lower="-2" upper="2"/>'),
            "follows 'j1', which is not an independent joint",
        ),
        (urdf([("revolute", "0 0 nan", "0 0 0", "0 0 1"), *REAL_ARM[1:]]), "'0 0 nan'"),
        (urdf([("revolute", "0 0 1", "0 0 0", "0 0 0"), *REAL_ARM[1:]]), "no length"),
        (urdf().replace("<robot", "<sdf").replace("</robot", "</sdf"), "<sdf>"),
        (urdf()[:-20], "not valid XML"),
        ('<!DOCTYPE x [<!ENTITY a "b">]>' + urdf(), "entities"),
        ("<robot/>", "no joints"),
        (urdf([("revolute", "0 0 300", "0 0 0", "0 0 1"), *REAL_ARM[1:]]), "divide millimetres by 1000"),
        (urdf([("revolute", "0 0 1e308", "0 0 0", "0 0 1"), *REAL_ARM[1:]]), "stands 1e+308 m"),
        (urdf([("rotary", *REAL_ARM[0][1:]), *REAL_ARM[1:]]), "Write revolute, continuous, prismatic or fixed"),
        (urdf([("revolute", "${x} 0 0", "0 0 0", "0 0 1"), *REAL_ARM[1:]]), "'${x} 0 0' is not 3 finite numbers"),
        (urdf().replace('<parent link="l0"/>', '<parent link="l6"/>'), "form a closed loop"),
    ],
)
def test_what_is_no_six_axis_chain_is_one_clear_error(tmp_path, text, told):
    path = written(tmp_path, text)
    with pytest.raises(InputError, match=r"arm\.urdf") as caught:
        import_urdf(path)
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_base_within_a_loop_of_joints_is_refused(tmp_path):
    loop = urdf().replace('<parent link="l0"/>', '<parent link="l6"/>')
    for base, tip in (("l3", None), (None, "l3"), ("l2", "l5")):
        with pytest.raises(InputError, match="closed loop"):
            import_urdf(written(tmp_path, loop), base=base, tip=tip)


def test_numbers_that_can_be_other_units_are_taken_with_a_note(tmp_path):
    far = import_urdf(written(tmp_path, urdf([("revolute", "0 0 60", "0 90 0", "0 0 1"), *REAL_ARM[1:]])))
    notes, source = far.notes, far.robot.sources["dh"]
    assert (source.grade, "places of j1 may be in other units" in source.source) == ("inferred", True)
    assert any("stands 60 m from" in note and "in metres" in note for note in notes)
    assert any("turned by 90 rad" in note and "in radians" in note for note in notes)
    many = import_urdf(written(tmp_path, urdf(limit='<limit lower="-45" upper="45" velocity="3"/>')))
    (told,) = [note for note in many.notes if "limits of -45 to 45 rad, more than two turns" in note]
    assert told.endswith("likewise j2, j3, j4, j5, j6")
    assert many.robot.sources["limits"].grade == "inferred"  # so that no verdict passes by them
    plain = import_urdf(written(tmp_path, urdf(limit='<limit lower="-12.56" upper="12.56" velocity="3"/>')))
    assert not any("radians" in note or "metres" in note for note in plain.notes)
    assert {source.grade for source in plain.robot.sources.values()} == {"export"}


def test_soft_limits_of_a_safety_controller_hold_the_joint(tmp_path):
    def arm(soft: str, limit: str = '<limit lower="-2" upper="2" velocity="3"/>'):
        return import_urdf(written(tmp_path, urdf(limit=f"{limit}<safety_controller {soft}/>")))

    held = arm('k_velocity="1" soft_lower_limit="-1" soft_upper_limit="2.5"')
    np.testing.assert_allclose(np.stack([held.robot.lower, held.robot.upper])[:, 0], [-1, 2])
    assert "joint j1 is held to its soft limits; likewise j2, j3, j4, j5, j6" in held.notes
    unsaid = arm('k_velocity="1"')  # the specification's 0 and 0 are meant by nobody
    np.testing.assert_allclose(unsaid.robot.upper[0], 2)
    beyond = arm('soft_lower_limit="3" soft_upper_limit="4"')
    np.testing.assert_allclose(beyond.robot.upper[0], 2)
    assert any("soft_upper_limit 4: -2 to 2 was taken" in note for note in beyond.notes)
    alone = arm('soft_lower_limit="-1" soft_upper_limit="1"', '<limit effort="1" velocity="3"/>')
    np.testing.assert_allclose(alone.robot.upper[0], 1)


@pytest.mark.parametrize(
    ("limit", "ends"),
    [
        ('lower="-6.2831853" upper="6.2831853"', (-6.2831853, 6.2831853)),
        ('lower="-1.5" upper="1.5"', (-1.5, 1.5)),
        ("", None),
        ('lower="0" upper="0"', None),
        ('lower="0"', None),
        ('lower="-1e16" upper="1e16"', None),
    ],
)
def test_limits_that_a_continuous_joint_states_are_kept(tmp_path, limit, ends):
    got = import_urdf(written(tmp_path, urdf(limit=f'<limit {limit} effort="1" velocity="1"/>')))
    assert got.robot.continuous[5] == (ends is None)
    assert (got.robot.lower[5], got.robot.upper[5]) == pytest.approx(ends or (-np.pi, np.pi), rel=1e-15)
    told = [note for note in got.notes if "joint j6 is continuous with limits" in note]
    assert [note.split(": ")[1][:8] for note in told] == (["they are"] if ends else ["not kept"] * ("1e16" in limit))


@pytest.mark.parametrize("urdf_file", ["arm.urdf", "name/urdf/arm.urdf", "robots/arm.urdf", "robots/urdf/arm.urdf"])
@pytest.mark.parametrize(
    ("mesh", "named", "found"),
    [
        ("name/meshes/x.stl", "name/meshes/x.stl", True),
        ("name/meshes/x.stl", "name/urdf/../meshes/x.stl", True),
        ("renamed/meshes/x.stl", "name/meshes/x.stl", True),  # by its package.xml
        ("repository/renamed/meshes/x.stl", "name/meshes/x.stl", True),  # as in a workspace of several
        ("secret/x.stl", "name/../secret/x.stl", False),
        ("secret/x.stl", "../secret/x.stl", False),
        ("secret/x.stl", "name/{root}/secret/x.stl", False),
    ],
)
def test_a_package_holds_its_meshes_and_no_others(tmp_path, urdf_file, mesh, named, found):
    for folder in ("name" if mesh.startswith("secret") else ".", Path(urdf_file).parent, Path(mesh).parent):
        (tmp_path / folder).mkdir(parents=True, exist_ok=True)
    if "renamed" in mesh:
        (tmp_path / mesh).parents[1].joinpath("package.xml").write_text("<package><name>name</name></package>")
    trimesh.creation.box((0.1, 0.1, 0.2)).export(tmp_path / mesh)
    text = urdf(extra=shaped(f'<mesh filename="package://{named.format(root=tmp_path)}"/>'))
    (tmp_path / urdf_file).write_text(text)
    renamed = "renamed" in mesh and urdf_file.startswith("name")  # the file is in a package of that name
    assert bool(import_urdf(tmp_path / urdf_file).robot.hulls) == (found and not renamed)


def test_an_axis_of_any_length_is_a_direction(tmp_path, random):
    long = urdf([(kind, xyz, rpy, "0 0 1e300") for kind, xyz, rpy, _ in REAL_ARM])
    q = random.uniform(-2, 2, (20, 6))
    expected = forward(import_urdf(written(tmp_path, urdf())).robot, q)
    np.testing.assert_allclose(forward(import_urdf(written(tmp_path, long)).robot, q), expected, atol=1e-12)


@pytest.mark.parametrize(("side", "shapes"), [(0.001, 0), (0.003, 1)])
def test_a_cube_that_marks_a_frame_is_no_shape(tmp_path, side, shapes):
    cube = shaped(f'<box size="{side} {side} {side}"/>')
    assert len(import_urdf(written(tmp_path, urdf(extra=cube))).robot.hulls) == shapes
    drawn = import_urdf(written(tmp_path, urdf(extra=cube.replace("collision", "visual")))).robot
    assert len(drawn.meshes) == shapes  # a link without a shape is checked as it looks


def test_a_flat_mesh_is_a_shape(tmp_path):
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n")
    (piece,) = import_urdf(written(tmp_path, urdf(extra=shaped('<mesh filename="flat.obj"/>')))).robot.meshes
    assert len(piece.points) == 3
    sides = np.linalg.norm(np.diff(np.array(piece.points)[[0, 1, 2, 0]], axis=0), axis=1)
    np.testing.assert_allclose(np.sort(sides), [1, 2, np.sqrt(5)])


@pytest.mark.parametrize(("more", "grade"), [("", "export"), ('<mesh filename="lost.stl"/>', "inferred")])
def test_shapes_of_which_one_could_not_be_read_are_assumed(tmp_path, more, grade):
    box = '<box size="0.1 0.1 0.1"/>'
    text = shaped(box).replace("</link>", "") + (shaped(more).partition(">")[2] if more else "</link>")
    found = import_urdf(written(tmp_path, urdf(extra=text)))
    source = found.robot.sources["envelopes"]
    assert source.grade == grade
    assert ("but for shapes of l6, which are left out" in source.source) == bool(more)
    assert arm_shapes(found.robot).assumed or not more


def test_shapes_of_levers_that_are_left_out_make_the_arm_s_assumed(tmp_path):
    box = shaped('<box size="0.1 0.1 0.1"/>')
    levers = "".join(
        f'{box.replace("l6", name)}<joint name="to_{name}" type="revolute"><parent link="l1"/><child link="{name}"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1"/><mimic joint="j2"/></joint>'
        for name in ("lever", "rod")
    )
    found = import_urdf(written(tmp_path, urdf(extra=box + levers)))
    assert arm_shapes(found.robot).assumed
    assert "lever, rod" in found.robot.sources["envelopes"].source
    assert len([note for note in found.notes if "rod" in note]) == 2  # the joints, and the shapes


@pytest.mark.parametrize(("unit", "side"), [("", 0.12), ('<unit name="mm" meter="0.001"/>', 0.12), ("", 120.0)])
def test_a_mesh_has_the_unit_of_its_file_and_a_link_s_size(tmp_path, unit, side):
    length = 120.0 if unit else side
    trimesh.creation.box((length, length / 2, length / 3)).export(tmp_path / "box.dae")
    text = (tmp_path / "box.dae").read_text(encoding="utf-8")
    (tmp_path / "box.dae").write_text(text.replace("<up_axis>", f"{unit}<up_axis>", 1), encoding="utf-8")
    found = import_urdf(written(tmp_path, urdf(extra=shaped('<mesh filename="box.dae"/>'))))
    if side > 100:
        assert found.robot.hulls == ()
        assert any("its longest side is 120 m, which no link is" in note and "0.001" in note for note in found.notes)
    else:
        sides = np.ptp(np.array(found.robot.hulls[0].points), axis=0)
        np.testing.assert_allclose(np.sort(sides), [0.04, 0.06, 0.12], atol=1e-9)


def test_what_a_follower_states_of_itself_holds_the_joint_that_it_follows(tmp_path):
    """Joint 2 turns three times as far as joint 1, and 0.5 rad more; limits 0 and 0 say
    nothing, nor does one whole turn, 20 and 21 can't be."""
    follower = '<mimic joint="j1" multiplier="{}" offset="0.5"/>'
    cases = (
        ("3", (-6.5, 6.5, 9), (-2, 2, 3), False),
        ("3", (-6.4, 6.4, 9), (-2, 5.9 / 3, 3), True),
        ("-3", (-4, 6.4, 9), (-5.9 / 3, 1.5, 3), True),
        ("3", (20, 21, 9), (-2, 2, 3), True),
        ("3", (0, 0, 3), (-2, 2, 1), True),
        ("0.5", (-6.5, 6.5, 3), (-2, 2, 3), False),
        ("0.5", (0, 6.2832, 3), (-2, 2, 3), False),
        ("0.5", (0, 6.2, 3), (-1, 2, 3), True),
    )
    for factor, (least, most, own), (lower, upper, speed), told in cases:
        text = urdf()
        at = text.index("</joint>", text.index('"j2"'))
        start = text.rindex("<limit", 0, at)
        limit = f'<limit lower="{least}" upper="{most}" velocity="{own}"/>'
        found = import_urdf(written(tmp_path, text[:start] + limit + follower.format(factor) + text[at:]))
        assert any("j2 follows j1" in note for note in found.notes) == told
        robot = found.robot
        assert (robot.lower[0], robot.upper[0], robot.speed[0]) == pytest.approx((lower, upper, speed), rel=1e-6)
        ends = [robot.coupling[1, 0] * end + 0.5 for end in (robot.lower[0], robot.upper[0])]
        assert least in (0, 20) or least - 1e-6 <= min(ends) <= max(ends) <= most + 1e-6
        again = import_urdf(written(tmp_path, export_urdf(robot)))
        assert not [note for note in again.notes if "follows" in note]
        assert (again.robot.lower[0], again.robot.upper[0], again.robot.speed[0]) == pytest.approx(
            (lower, upper, speed)
        )


STATE = """<robot name="r"><group name="arm"/><group_state name="folded" group="arm">{}</group_state>
<group_state name="home" group="arm">{}</group_state><group_state name="open" group="hand"><joint name="f" value="1"/>
</group_state></robot>"""


def states(*poses: np.ndarray) -> str:
    return STATE.format(*("".join(f'<joint name="j{k + 1}" value="{v}"/>' for k, v in enumerate(q)) for q in poses))


def test_a_group_state_of_an_srdf_becomes_the_home_of_the_robot_file(tmp_path):
    folded, home, out = np.linspace(-1, 1, 6), np.array([0.1, -0.5, 0.7, 0.2, -1.1, 1.5]), np.full(6, 2.5)
    (tmp_path / "arm.urdf").write_text(urdf(), encoding="utf-8")
    zero = np.zeros(6)  # singular: home only if it is called so
    cases = ((folded, home, home), (folded, [], folded), (folded, zero, zero), (zero, [], None), ([], [], None))
    for first, named, expected in cases:
        (tmp_path / "arm.srdf").write_text(states(first, named), encoding="utf-8")
        arm = read_arm(str(tmp_path / "arm.urdf"), whole=True, srdf=tmp_path / "arm.srdf")
        noted = "arm.srdf has no regular state" in " ".join(arm.notes)
        assert (arm.robot.home is None) == noted == (expected is None)
        if expected is None:
            continue
        robot = arm.robot
        write_robot(robot, tmp_path / "arm.yaml")
        np.testing.assert_allclose(load_robot(tmp_path / "arm.yaml").home, expected, atol=1e-9)
    with pytest.raises(InputError) as caught:
        write_robot(robot.replace(home=out), tmp_path / "arm.yaml")
    assert caught.value.field == "home_deg"
    with pytest.raises(InputError) as caught:
        arm_of("ur5e", srdf=tmp_path / "arm.srdf")  # of which no URDF is given
    assert caught.value.field == "--srdf"
