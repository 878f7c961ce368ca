"""``rerun-importer-er3a``: called by Rerun's viewer, so that ``rerun arm.yaml`` shows the arm.

When it opens a file, the viewer calls every program on the path whose name begins with ``rerun-importer-`` [1]_. It
passes the file and the ids of the recording, and reads a recording from standard output. Exit code 66 means "not my
file type".

References
----------
.. [1] Rerun's documentation, "Open any file", on external importers.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from er3a.errors import Er3aError
from er3a.files.robot_library import load_robot
from er3a.files.yaml_file import read_yaml

NOT_MINE = 66
SECONDS = 4.0  # that each joint takes over its range and back
SAMPLES = 80


def main(words: Sequence[str] | None = None) -> int:
    """Write a recording of a robot file's arm, each joint going over its range, to standard output."""
    parser = argparse.ArgumentParser(prog="rerun-importer-er3a", description="Draws a robot file for Rerun's viewer.")
    parser.add_argument("file", type=Path)
    parser.add_argument("--recording-id")
    parser.add_argument("--application-id", "--opened-application-id")
    asked, _ = parser.parse_known_args(words)  # of later viewers
    try:
        if not _is_robot_file(asked.file):
            return NOT_MINE
        robot = load_robot(asked.file)
    except Er3aError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    import rerun as rr

    from er3a.pipeline.viewing.arm import arm_view, log_arm, send_motion

    home = np.clip(0.0, robot.lower, robot.upper)
    shares = np.concatenate([np.linspace(0, 1, SAMPLES), np.linspace(1, 0, SAMPLES)])
    q = np.tile(home, (robot.joints, 2 * SAMPLES, 1))
    for joint in range(robot.joints):
        q[joint, :, joint] = robot.lower[joint] + shares * (robot.upper - robot.lower)[joint]
    with rr.RecordingStream(asked.application_id or robot.name, recording_id=asked.recording_id) as stream:
        stream.stdout()
        stream.send_recording_name(robot.title)
        stream.send_blueprint(rr.blueprint.Blueprint(arm_view(robot, robot.name)))
        stream.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        log_arm(stream, robot, home)
        times = np.linspace(0, SECONDS * robot.joints, q.shape[0] * q.shape[1])
        send_motion(stream, robot, times, q.reshape(-1, robot.joints))
    return 0


def _is_robot_file(file: Path) -> bool:
    return file.suffix in (".yaml", ".yml") and read_yaml(file).get("kind") == "robot"


if __name__ == "__main__":
    sys.exit(main())
