"""Recordings of ROS: written by rosbags, read as the controller's poses."""

import numpy as np
import pytest

from er3a.confirmation.bag import recorded_lines
from er3a.confirmation.confirm import confirm
from er3a.confirmation.poses import read_pairs
from er3a.errors import InputError
from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import forward

rosbag1 = pytest.importorskip("rosbags.rosbag1")
rosbag2 = pytest.importorskip("rosbags.rosbag2")
typesys = pytest.importorskip("rosbags.typesys")
UR = ["elbow_joint", "shoulder_lift_joint", "shoulder_pan_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]
"""In the alphabetical order in which a driver publishes them."""
KINDS = {"bag": typesys.Stores.ROS1_NOETIC, "mcap": typesys.Stores.ROS2_HUMBLE, "sqlite3": typesys.Stores.ROS2_HUMBLE}


def write(folder, kind, names, q, poses, frame="", topic="/tcp_pose_broadcaster/pose"):
    """A recording at 50 Hz, with poses 1 ms after the joint states; ``frame``: poses as transforms to it."""
    store = typesys.get_typestore(KINDS[kind])
    types, first = store.types, kind == "bag"
    path = folder / ("a.bag" if first else "a")
    if first:
        bag, pack = rosbag1.Writer(path), store.serialize_ros1
    else:
        plugin = rosbag2.StoragePlugin.MCAP if kind == "mcap" else rosbag2.StoragePlugin.SQLITE3
        bag, pack = rosbag2.Writer(path, version=8, storage_plugin=plugin), store.serialize_cdr
    stamp = types["builtin_interfaces/msg/Time"](0, 0)
    number = {"seq": 0} if first else {}
    header = types["std_msgs/msg/Header"](**number, stamp=stamp, frame_id="base")
    state = types["sensor_msgs/msg/JointState"]
    kind_of_pose = "tf2_msgs/msg/TFMessage" if frame else "geometry_msgs/msg/PoseStamped"
    with bag:
        joints = bag.add_connection("/joint_states", state.__msgtype__, typestore=store)
        tool = bag.add_connection("/tf" if frame else topic, kind_of_pose, typestore=store)
        for k, (values, T) in enumerate(zip(q, poses)):
            message = state(header, names, np.ascontiguousarray(values), np.zeros(len(names)), np.zeros(0))
            bag.write(joints, 20_000_000 * (k + 1), pack(message, state.__msgtype__))
            x, y, z, w = rotation(T)
            place, turn = types["geometry_msgs/msg/Point"](*T[:3, 3]), types["geometry_msgs/msg/Quaternion"](x, y, z, w)
            if frame:
                moved = types["geometry_msgs/msg/Transform"](types["geometry_msgs/msg/Vector3"](*T[:3, 3]), turn)
                message = types[kind_of_pose]([types["geometry_msgs/msg/TransformStamped"](header, frame, moved)])
            else:
                message = types[kind_of_pose](header, types["geometry_msgs/msg/Pose"](place, turn))
            bag.write(tool, 20_000_000 * (k + 1) + 1_000_000, pack(message, kind_of_pose))
    return path


def rotation(T):
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(T[:3, :3]).as_quat()


def poses_of(robot):
    """Twelve joint vectors within +-1 rad, and the flange's poses."""
    q = np.random.default_rng(3).uniform(-1, 1, (12, robot.joints))
    return q, forward(robot, q)


@pytest.mark.parametrize("kind", KINDS)
def test_a_recording_gives_joints_and_poses(tmp_path, kind):
    robot = load_robot("er3a_c60")
    q, poses = poses_of(robot)
    path = write(tmp_path, kind, [f"joint_{k}" for k in range(1, 7)], q, poses)
    pairs = read_pairs(path, robot)
    np.testing.assert_allclose(pairs.q, q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(pairs.xyz, poses[:, :3, 3], rtol=0, atol=1e-12)
    assert confirm(robot, pairs).verdict == "agrees"


def test_the_joints_of_a_driver_are_found_in_any_order_beside_a_gripper_s(tmp_path):
    robot = load_robot("ur5e")
    q, poses = poses_of(robot)
    published = np.column_stack([q[:, [2, 1, 0, 3, 4, 5]], np.full(len(q), 0.01)])
    path = write(tmp_path, "mcap", [*UR, "finger_joint"], published, poses, frame="tool0_controller")
    np.testing.assert_allclose(read_pairs(path, robot).q, q, rtol=0, atol=1e-12)


def test_what_is_no_recording_of_poses_ends_in_one_line(tmp_path):
    robot = load_robot("er3a_c60")
    q, poses = poses_of(robot)
    (tmp_path / "no.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(400))
    (tmp_path / "no.mcap").write_bytes(b"nothing")
    for name in ("no.bag", "no.mcap", "absent.bag"):
        with pytest.raises(InputError, match="can't be read as a recording of ROS"):
            recorded_lines(tmp_path / name)
    with pytest.raises(InputError, match="no geometry_msgs/msg/PoseStamped"):
        recorded_lines(write(tmp_path, "bag", [f"joint_{k}" for k in range(6)], q, poses, topic="/goal_pose"))


def test_no_part_of_a_recording_is_left_out_in_silence(tmp_path, monkeypatch):
    q, poses = poses_of(load_robot("er3a_c60"))
    path = write(tmp_path, "mcap", [f"joint_{k}" for k in range(6)], q, poses)
    monkeypatch.setattr("er3a.confirmation.bag.MOST_MESSAGES", 2 * len(q) - 1)
    with pytest.raises(InputError, match="more than 23 joint states, poses and transforms"):
        recorded_lines(path)
