"""Joint states and tool poses in a recording of ROS, as the rows of a table.

Recordings are ROS 1 bags, ROS 2 bags and MCAP files, read by rosbags (the extra ``rosbags``); ROS is not needed. Poses
are those of the controller: a topic of ``geometry_msgs/PoseStamped``, or the transform ``tool0_controller`` that
Universal Robots' driver publishes. Other transforms are computed from the model that is in question, and not read.
Definitions of messages that the file holds are not used, so that nothing of it is executed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from er3a.errors import InputError
from er3a.files.csv_file import Lines
from er3a.numerics.arrays import Reals

SUFFIXES = (".bag", ".mcap", ".db3")
MOST_MESSAGES = 500_000
NEAR_S = 0.02  # between a pose and the joint state that is taken for it
OF_DRIVER = "tool0_controller"
OF_POSE = ("x [m]", "y [m]", "z [m]", "qx", "qy", "qz", "qw")
NO_TOOL = re.compile(r"target|goal|desired|command|cmd|marker|camera")
EXTRA = "Install it: pip install 'er3a[rosbags]', or export both topics as CSV"
JOINTS, POSE, TREE = "sensor_msgs/msg/JointState", "geometry_msgs/msg/PoseStamped", "tf2_msgs/msg/TFMessage"
TYPES = {JOINTS: JOINTS, POSE: POSE, TREE: TREE, "tf/msg/tfMessage": TREE}


def is_recording(path: Path) -> bool:
    """Whether a path is named as a recording of ROS.

    Parameters
    ----------
    path : a file, or the folder of a ROS 2 bag, which holds ``metadata.yaml``
    """
    return path.suffix.lower() in SUFFIXES or (path / "metadata.yaml").is_file()


def recorded_lines(path: Path) -> Lines:
    """The joint values and poses of a recording, as rows below headings with units.

    Returns
    -------
    lines : a row for each pose that has a joint state within ``NEAR_S``, numbered from 1; joints by their names, in
        rad or m, their rates where all are known, the position in m and the quaternion

    Raises
    ------
    InputError
        if rosbags is not installed, the file can't be read, or it has no joint states, or not one pose of a tool
    """
    states: dict[str, tuple[list[float], list[list[float]]]] = {}
    poses: dict[str, list[list[float]]] = {}
    for count, (topic, seconds, message) in enumerate(_messages(path)):
        if count == MOST_MESSAGES:
            problem = f"more than {MOST_MESSAGES:,} joint states, poses and transforms"
            raise InputError(path, None, problem, "Record at fewer Hz, or cut it: a few stops are enough")
        if hasattr(message, "position"):
            for name, value, rate in zip(message.name, message.position, _rates(message)):
                times, values = states.setdefault(name, ([], []))
                times.append(seconds)
                values.append([float(value), float(rate)])
        elif hasattr(message, "pose"):
            poses.setdefault(topic, []).append([seconds, *_pose(message.pose.position, message.pose.orientation)])
        else:
            own = (each.transform for each in message.transforms if each.child_frame_id == OF_DRIVER)
            poses.setdefault(OF_DRIVER, []).extend([seconds, *_pose(each.translation, each.rotation)] for each in own)
    if not states:
        raise InputError(path, None, f"no message of {JOINTS}", "Record /joint_states with the controller's pose")
    names = sorted(states)
    rows = np.array(_of_tool(path, poses))
    at = [_nearest(np.array(states[name][0]), np.array(states[name][1]), rows[:, 0]) for name in names]
    columns = {f"{name} [rad]": found[:, 0] for name, found in zip(names, at)}
    columns |= {f"vel_{name}": found[:, 1] for name, found in zip(names, at) if np.isfinite(found[:, 1]).all()}
    columns |= dict(zip(OF_POSE, rows.T[1:]))
    table = np.column_stack([*columns.values()]).tolist()
    written = [["" if np.isnan(value) else repr(value) for value in row] for row in table]
    return [(0, [*columns]), *enumerate(written, 1)]


def _messages(path: Path) -> Iterator[tuple[str, float, Any]]:
    """Topic, time (s) and content of messages that say where joints or tool are."""
    try:
        from rosbags.rosbag1 import Reader as Reader1
        from rosbags.rosbag2 import Reader as Reader2
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(path, None, "a recording of ROS is read by rosbags, which is not installed", EXTRA) from None
    first = path.suffix.lower() == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE)
    read = store.deserialize_ros1 if first else store.deserialize_cdr
    try:
        with (Reader1 if first else Reader2)(path) as bag:
            wanted = [each for each in bag.connections if each.msgtype in TYPES]
            for connection, nanoseconds, raw in bag.messages(wanted) if wanted else ():
                yield connection.topic, nanoseconds * 1e-9, read(raw, TYPES[connection.msgtype])
    except Exception as error:  # of rosbags, of the database, of decompression: each has its own
        problem = f"can't be read as a recording of ROS ({str(error)[:120]})"
        raise InputError(path, None, problem, "Give a .bag, .mcap or .db3 file, or a ROS 2 bag's folder") from None


def _rates(message: Any) -> Reals:
    """Rates of a joint state, NaN where it has none."""
    whole = len(message.velocity) == len(message.position)
    return np.asarray(message.velocity if whole else np.full(len(message.position), np.nan))


def _pose(place: Any, turn: Any) -> list[float]:
    return [place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w]


def _of_tool(path: Path, poses: dict[str, list[list[float]]]) -> list[list[float]]:
    """The poses of the one topic that can be the tool's."""
    found = [topic for topic, rows in poses.items() if rows and not NO_TOOL.search(topic.lower())]
    if len(found) != 1:
        problem = f"{len(found)} topics give poses: {', '.join(found)}" if found else f"no {POSE}, nor {OF_DRIVER}"
        raise InputError(path, None, problem, "Record /joint_states with the one pose that the controller publishes")
    return poses[found[0]]


def _nearest(times: Reals, values: Reals, wanted: Reals) -> Reals:
    """Rows (N, 2) of values (M, 2) that are nearest in time, NaN where none is near."""
    after = np.clip(np.searchsorted(times, wanted), 1, max(len(times) - 1, 1))
    index = np.where(len(times) > 1, after - (wanted - times[after - 1] < times[after % len(times)] - wanted), 0)
    near = np.abs(times[index] - wanted) <= NEAR_S
    return np.where(near[:, None], values[index], np.nan)
