"""URDFs with more than one chain, followers, grippers, joints that slide; and the fleet that packages bring."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest

from er3a.comparison.axis_table import table_from_axes
from er3a.errors import Er3aError, InputError, InputWarning
from er3a.files.robot_library import load_robot
from er3a.files.robot_writer import write_robot
from er3a.formats.urdf import export_urdf, import_urdf
from er3a.kinematics.by_class import arm_solver
from er3a.kinematics.forward import forward, frames
from er3a.pipeline.check import check_file
from testing.arms import make_arm
from testing.fleet import DhModel, UrdfFile, dh_models, urdf_files
from testing.fleet_study import round_trip, singular_joints

LIMIT = '<limit lower="-1.5" upper="1.5" velocity="2" effort="0"/>'


def joint(name, kind, parent, child, *, xyz="0 0 0.2", rpy="0 0 0", axis="0 0 1", more=LIMIT) -> str:
    return (
        f'<link name="{child}"/><joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>{more}</joint>'
    )


def follows(source, multiplier=1.0, offset=0.0) -> str:
    return f'{LIMIT}<mimic joint="{source}" multiplier="{multiplier}" offset="{offset}"/>'


def row(count, first=0, start="base", axis="0 1 0") -> str:
    """So many joints in series, turning about z and y by turns."""
    text, parent = "", start
    for k in range(first, first + count):
        text += joint(f"j{k}", "revolute", parent, f"l{k}", axis="0 0 1" if k % 2 else axis)
        parent = f"l{k}"
    return text


@pytest.fixture
def written(tmp_path):
    def write(*parts, name="arm.urdf"):
        path = tmp_path / name
        path.write_text(f'<robot name="r"><link name="base"/>{"".join(parts)}</robot>')
        return path

    return write


@pytest.mark.parametrize(("away", "named"), [("0 0 0", False), ("0 0 0.1", True)])
def test_frames_at_the_flange_are_no_choice(written, away, named):
    """As ``ee`` and ``tcp``, which makers' files put at one place."""
    ends = [joint(name, "fixed", "l5", name, xyz=xyz, more="") for name, xyz in (("ee", "0 0 0"), ("tcp", away))]
    found = import_urdf(written(row(6), *ends))
    assert any("fixed frames" in note for note in found.notes) == named
    assert found.tip == "l5"


@pytest.mark.parametrize("names", [("camera", "flange"), ("flange", "camera", "tool0"), ("r1_tool0", "r1_flange")])
def test_of_several_frames_tool0_is_the_flange_or_else_the_one_called_so(written, names):
    ends = [joint(name, "fixed", "l5", name, xyz=f"0 0 {k}", more="") for k, name in enumerate(names, 1)]
    found = import_urdf(written(row(6), *ends))
    assert found.tip == next((name for name in names if "tool0" in name), names[-1])
    assert not any("fixed frames" in note for note in found.notes)


def peer_poses(path, names, q, frame):
    """Flange poses by Pinocchio, which knows joints by their names and followers by their <mimic>."""
    model = pinocchio.buildModelFromUrdf(str(path), mimic=True)
    data, poses = model.createData(), []
    for values in q:
        full = pinocchio.neutral(model)
        for name, value in zip(names, values):
            at = model.joints[model.getJointId(name)]
            full[at.idx_q : at.idx_q + at.nq] = value if at.nq == 1 else [np.cos(value), np.sin(value)]
        pinocchio.framesForwardKinematics(model, data, full)
        poses.append(data.oMf[model.getFrameId(frame, pinocchio.FrameType.BODY)].homogeneous.copy())
    return np.array(poses)


def test_two_arms_are_asked_for_by_name(written):
    weight = '<link name="l10"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>'
    path = written(row(5), row(4, 10).replace('<link name="l10"/>', weight), row(3, 20, "l1"))
    with pytest.raises(InputError, match=r"branches into moving joints j0, j10.*by --tip: l4, l22, l13"):
        import_urdf(path)
    assert load_robot(path, tip="l4").joints == 5  # the arm that it names can be had in each way
    assert check_file(path, tip="l4") == "a URDF"
    first, second = import_urdf(path, tip="l4"), import_urdf(path, tip="l13", base="base")
    assert (first.robot.joints, second.robot.joints) == (5, 4)
    assert not any("mass" in note for note in first.notes)  # what another arm weighs loads no joint of this one
    assert first.joints == ("j0", "j1", "j2", "j3", "j4")
    box = '<collision><origin xyz="1 0 0"/><geometry><box size="0.1 0.1 0.1"/></geometry></collision>'
    stand = path.read_text().replace('<link name="base"/>', f'<link name="base">{box}</link>')
    path.write_text(stand.replace('name="j10" type="revolute"', 'name="j10" type="fixed"'))
    part = import_urdf(path, base="l10", tip="l13")
    assert (part.robot.joints, part.base, part.tip) == (3, "l10", "l13")
    (post,) = part.robot.hulls  # on what the arm's base is fixed on
    assert post.link == 0
    np.testing.assert_allclose(np.mean(post.points, axis=0), [1, 0, -0.2], atol=1e-12)
    with pytest.raises(InputError, match="there is no link 'nose'"):
        import_urdf(path, tip="nose")
    with pytest.raises(InputError, match="'l10' is not above 'l4'"):
        import_urdf(path, base="l10", tip="l4")


def test_grippers_and_linkages_that_only_follow_are_left_out(written):
    linkage = joint("p1", "revolute", "l0", "p1", more=follows("j1")) + joint(
        "p2", "revolute", "p1", "p2", more=follows("j2")
    )
    fingers = joint("f1", "prismatic", "hand", "f1") + joint("f2", "prismatic", "hand", "f2", more=follows("f1"))
    inertial = '<inertial><origin xyz="0 0 0.1"/><mass value="0.3"/><inertia/></inertial>'
    fingers = fingers.replace('<link name="f2"/>', f'<link name="f2">{inertial}</link>')
    hand = joint("h", "fixed", "l5", "hand", more="")
    imported = import_urdf(written(row(6), linkage, hand, fingers))
    weighs, last = imported.robot.masses.body(6), frames(imported.robot, np.zeros(6))[5]
    np.testing.assert_allclose([weighs.mass, *(last @ [*weighs.centre, 1])], [0.3, 0, 0, 8 * 0.2 + 0.1, 1], atol=1e-9)
    assert imported.robot.joints == 6
    assert imported.tip == "hand"
    assert any("only follow" in note and "p1" in note for note in imported.notes)
    assert any("gripper" in note and "f1, f2" in note for note in imported.notes)
    assert import_urdf(written(row(3), joint("gripper_joint", "revolute", "l2", "jaw"))).robot.joints == 4
    assert import_urdf(written(row(4), joint("gripper_joint", "revolute", "l3", "jaw"))).robot.joints == 4
    box = '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>'
    jaw = joint("gripper_joint", "revolute", "l5", "jaw")
    alone = import_urdf(written(row(6), jaw.replace('<link name="jaw"/>', f'<link name="jaw">{box}</link>')))
    assert alone.robot.joints == 6
    assert [each.link for each in alone.robot.hulls] == [6]
    assert alone.robot.sources["envelopes"].grade == "export"
    assert any("gripper_joint" in note for note in alone.notes)
    wrist = joint("joint_6", "revolute", "l4", "no_gripper")
    assert import_urdf(written(row(5), wrist)).robot.joints == 6


def test_followers_in_the_chain_become_coupling(written, random, tmp_path):
    """A wrist kept level by a linkage: one row more than joints; a follower of a joint beside the chain."""
    chain = (
        joint("j0", "revolute", "base", "l0")
        + joint("j1", "revolute", "l0", "l1", axis="0 1 0")
        + joint("j2", "prismatic", "l1", "l2", axis="1 0 0")
        + joint("level", "revolute", "l2", "l3", axis="0 1 0", more=follows("j1", -1.0, 0.3))
        + joint("twice", "revolute", "l3", "l4", axis="0 0 1", more=follows("driver", 2.0))
        + joint("driver", "revolute", "l0", "side")
    )
    path = written(chain)
    imported = import_urdf(path, tip="l4")
    robot = imported.robot
    assert (robot.joints, robot.rows) == (4, 5)
    assert imported.joints == ("j0", "j1", "j2", "driver")
    q = random.uniform(-1, 1, (50, 4))
    np.testing.assert_allclose(forward(robot, q), peer_poses(path, imported.joints, q, "l4"), atol=1e-12)
    write_robot(robot, tmp_path / "arm.yaml")
    np.testing.assert_allclose(forward(load_robot(tmp_path / "arm.yaml"), q), forward(robot, q), atol=1e-11)


def test_sliding_endless_and_coupled_joints_go_out_and_come_in(tmp_path, random):
    arm = make_arm(
        sliding=np.arange(6) == 2,
        offset=[0, 0, 0.4, 0, 0.2, 0],
        direction=[1, -1, -1, 1, 1, -1],
        lower=[-1, -1, 0.1, -1, -1, -np.pi],
        upper=[1, 1, 0.8, 1, 1, np.pi],
        continuous=np.arange(6) == 5,
        speed=np.ones(6),
    )
    path = tmp_path / "arm.urdf"
    path.write_text(export_urdf(arm))
    back = import_urdf(path)
    q = random.uniform(arm.lower, arm.upper, (100, 6))
    np.testing.assert_allclose(forward(back.robot, q), forward(arm, q), atol=1e-12)
    np.testing.assert_allclose(
        peer_poses(path, [f"joint_{k}" for k in range(1, 7)], q, "tool"), forward(arm, q), atol=1e-12
    )
    np.testing.assert_array_equal(back.robot.sliding, arm.sliding)
    np.testing.assert_array_equal(back.robot.continuous, arm.continuous)
    np.testing.assert_allclose(back.robot.lower, arm.lower)
    level = np.vstack([np.eye(5), [0, -1.0, 0, 0, 0]])
    follower = arm.replace(coupling=level, lower=arm.lower[:5], upper=arm.upper[:5], speed=np.ones(5), continuous=[])
    path.write_text(export_urdf(follower))
    np.testing.assert_allclose(forward(import_urdf(path).robot, q[:, :5]), forward(follower, q[:, :5]), atol=1e-12)
    summed = np.eye(6) + np.eye(6, k=-1)
    with pytest.raises(Er3aError, match="row 2 is moved by 2 joints"):
        export_urdf(arm.replace(coupling=summed))


def test_axes_parallel_but_for_an_error_make_a_table_that_can_be_written(tmp_path, random):
    """Angles to five digits put common normals kilometres away; Hayati's beta needs none."""
    for tilt in (3.7e-6, -2e-9, 4e-4):
        arm = make_arm(alpha=np.array([-np.pi / 2, tilt, -np.pi / 2, np.pi / 2, -np.pi / 2, 0]))
        T = frames(arm, np.zeros(6))
        table = table_from_axes(T[:6, :3, 2], T[:6, :3, 3], T[6])
        derived = arm.replace(**vars(table))
        q = random.uniform(-3, 3, (50, 6))
        np.testing.assert_allclose(forward(derived, q), forward(arm, q), atol=1e-12)
        assert np.abs([derived.a, derived.d]).max() < 1
        write_robot(derived, tmp_path / "made.yaml")
        np.testing.assert_allclose(forward(load_robot(tmp_path / "made.yaml"), q), forward(arm, q), atol=1e-11)


def test_residues_of_a_derivation_are_no_metres(tmp_path):
    tool, base = np.eye(4), np.eye(4)
    tool[:3, 3], base[:3, 3] = (0, 0, 0.000239), (-1.2e-9, 0, 0)
    arm = make_arm(tool=tool, base=base)
    write_robot(arm, tmp_path / "made.yaml")
    with pytest.warns(InputWarning, match="0.239"):
        again = load_robot(tmp_path / "made.yaml")
    np.testing.assert_allclose(again.tool, tool, atol=1e-12)
    np.testing.assert_allclose(again.base, base, atol=1e-12)


def test_models_of_robotics_toolbox_have_its_poses(random, tmp_path):
    models = [each for each in dh_models() if isinstance(each, DhModel)]  # not at import: each process would make them
    assert len(models) > 20
    for model in models:
        robot = model.robot
        q = random.uniform(robot.lower, robot.upper, (20, robot.joints))
        np.testing.assert_allclose(forward(robot, q), model.poses(q), atol=1e-12, err_msg=model.name)
        path = tmp_path / f"{robot.name}.urdf"
        path.write_text(export_urdf(robot))
        back = import_urdf(path).robot
        write_robot(back, tmp_path / f"{robot.name}.yaml")
        again = load_robot(tmp_path / f"{robot.name}.yaml")
        np.testing.assert_allclose(forward(again, q), model.poses(q), atol=1e-10, err_msg=model.name)


PACKAGED = {
    "ur_description/urdf/ur5_robot.urdf": "three_parallel",
    "xacro/kuka_description/kuka_kr16/urdf/kr16_2.urdf": "spherical_wrist",
    "xacro/abb_irb140_description/urdf/irb140.urdf": "general_six",
    "panda_description/urdf/panda.urdf": "redundant",
    "so_arm_description/urdf/so100.urdf": "planar_wrist",
    "finger_edu_description/robots/finger_edu.urdf": "position",
}


@pytest.fixture(scope="module")
def packaged(tmp_path_factory):
    found = urdf_files(tmp_path_factory.mktemp("expanded"), PACKAGED.__contains__)
    return {each.name: each.path for each in found if isinstance(each, UrdfFile)}


@pytest.mark.long
@pytest.mark.parametrize(("name", "arm_class"), PACKAGED.items())
def test_urdfs_of_packages_from_import_to_the_inverse(packaged, name, arm_class, random, tmp_path):
    path = packaged[name]
    plain = import_urdf(path, snap=False)
    q = random.uniform(plain.robot.lower, plain.robot.upper, (20, plain.robot.joints))
    expected = np.array(peer_poses(path, plain.joints, q, plain.tip))
    np.testing.assert_allclose(forward(plain.robot, q), expected, atol=1e-9)
    write_robot(import_urdf(path, snap=True).robot.replace(name="made"), tmp_path / "made.yaml")
    made = load_robot(tmp_path / "made.yaml")
    assert arm_solver(made).chain.code == arm_class
    whole = arm_class not in ("free_roll", "position")
    assert {round_trip(made, own, 1e-6, whole) for own in q[:3]} == {None}
    assert {round_trip(made, own, 1e-5, whole) for own in singular_joints(made)} <= {None}
    (tmp_path / "out.urdf").write_text(export_urdf(made), encoding="utf-8")
    back = import_urdf(tmp_path / "out.urdf", base="base", tip="tool").robot
    np.testing.assert_allclose(forward(back, q), forward(made, q), atol=1e-9)


def test_what_urdfs_leave_out_or_overdo_is_assumed_with_a_note(written):
    far = '<limit lower="-1000" upper="5" velocity="180" effort="0"/>'
    sphere = '<link name="ball"><collision><geometry><sphere radius="0.0005"/></geometry></collision></link>'
    path = written(
        joint("far", "prismatic", "base", "a", more=far),
        joint("open", "prismatic", "a", "b", more=""),
        row(2, start="b"),
        sphere,
        '<joint name="f" type="fixed"><parent link="l1"/><child link="ball"/></joint>',
    )
    imported = import_urdf(path)
    assert imported.robot.lower[:2].tolist() == [-1, -1]
    assert imported.robot.upper[:2].tolist() == [1, 1]
    told = " ".join(imported.notes)
    assert np.isnan(imported.robot.speed[0])
    assert "joint far has a speed of 180 m/s, which counts as unknown" in told
    for word in ("far has limits of -1000 to 5, which no joint has", "open has no limits: +-1000 mm"):
        assert word in told
    write_robot(imported.robot, path.with_suffix(".yaml"))
    limits = load_robot(path.with_suffix(".yaml")).sources["limits"]
    assert (limits.grade, "but for far, open: assumed" in limits.source) == ("inferred", True)


def test_a_frame_beside_the_arm_can_be_its_base(tmp_path):
    """As of Universal Robots in ROS, whose controllers give poses in ``base``, half a turn from ``base_link``."""
    path = tmp_path / "arm.urdf"
    beside = joint("fixed", "fixed", "base_link", "base", xyz="0.1 0 0.3", rpy="0 0 3.141592653589793", more="")
    path.write_text(f'<robot name="r"><link name="base_link"/>{row(6, start="base_link")}{beside}</robot>')
    own, by_controller = (import_urdf(path, base=name) for name in ("base_link", "base"))
    assert "(100, 0, 300) mm, roll 0, pitch 0, yaw 180 deg" in "".join(own.notes)
    assert "--base base" in "".join(own.notes)
    assert not any("--base" in note for note in by_controller.notes)
    q = np.random.default_rng(3).uniform(own.robot.lower, own.robot.upper, (20, 6))
    there = np.diag([-1.0, -1.0, 1.0, 1.0])
    there[:3, 3] = 0.1, 0.0, 0.3  # T_base_link_base
    np.testing.assert_allclose(there @ forward(by_controller.robot, q), forward(own.robot, q), atol=1e-9)
