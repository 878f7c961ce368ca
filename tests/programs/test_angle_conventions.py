"""Positions as controllers write them, against an outsider's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.geometry.transforms import transform
from er3a.programs.instructions import Convention, numbers_of, pose_of
from er3a.programs.languages import execute, read_program

robomath = pytest.importorskip("robodk.robomath")
CONVENTIONS: tuple[Convention, ...] = ("kuka", "efort", "ur", "abb")


def poses(count: int = 300) -> list[np.ndarray]:
    """Random poses, and those whose middle angle is a right angle."""
    rng = np.random.default_rng(4)
    found = []
    for turn, xyz in zip(Rotation.random(count, random_state=rng).as_matrix(), rng.uniform(-1, 1, (count, 3))):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = turn, xyz
        found.append(T)
    for angles in ((0.3, math.pi / 2, -1.0), (0.0, -math.pi / 2, 2.0), (0.0, 0.0, 0.0), (math.pi, 0.0, 0.0)):
        found.append(transform(np.array([0.1, 0.2, 0.3]), np.array(angles)))
    return found


def as_outsider(T: np.ndarray) -> object:
    """A pose in mm."""
    rows = T.copy()
    rows[:3, 3] *= 1000
    return robomath.Mat(rows.tolist())


def as_pose(mat: object) -> np.ndarray:
    """An outsider's pose in m."""
    T = np.array([[mat[i, j] for j in range(4)] for i in range(4)])
    T[:3, 3] /= 1000
    return T


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_numbers_give_back_their_pose(convention):
    for T in poses():
        np.testing.assert_allclose(pose_of(numbers_of(T, convention), convention), T, atol=1e-9)


def test_kuka_as_an_outsider_reads_and_writes_it():
    for T in poses():
        np.testing.assert_allclose(as_pose(robomath.KUKA_2_Pose(list(numbers_of(T, "kuka")))), T, atol=1e-9)
        np.testing.assert_allclose(pose_of(robomath.Pose_2_KUKA(as_outsider(T)), "kuka"), T, atol=1e-9)


def test_ur_as_an_outsider_reads_and_writes_it():
    for T in poses(300)[:300]:
        numbers = numbers_of(T, "ur")
        in_mm = [*(1000 * value for value in numbers[:3]), *numbers[3:]]
        np.testing.assert_allclose(as_pose(robomath.UR_2_Pose(in_mm)), T, atol=1e-9)
        written = robomath.Pose_2_UR(as_outsider(T))
        back = [*(value / 1000 for value in written[:3]), *written[3:]]
        np.testing.assert_allclose(pose_of(back, "ur"), T, atol=1e-7)  # its rotation vector keeps no more digits


def test_abb_as_an_outsider_writes_it():
    for T in poses(300)[:300]:
        np.testing.assert_allclose(pose_of(robomath.Pose_2_ABB(as_outsider(T)), "abb"), T, atol=1e-7)
        quaternion = robomath.quaternion_2_pose(list(numbers_of(T, "abb")[3:]))
        np.testing.assert_allclose(as_pose(quaternion)[:3, :3], T[:3, :3], atol=1e-9)


def test_programs_in_the_form_of_an_outsiders_post_are_read_to_a_hundredth_of_a_millimetre(tmp_path):
    """The lines of RoboDK's post for ABB: mm to three digits, quaternions to eight, a comma before each option."""
    no_axes = "[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]"
    wanted, lines = poses(60), []
    for T in wanted:
        x, y, z, *turn = robomath.Pose_2_ABB(as_outsider(T))
        pose = f"[{x:.3f}, {y:.3f}, {z:.3f}],[{', '.join(f'{each:.8f}' for each in turn)}]"
        lines.append(f"        MoveL [{pose},[0,0,0,0],{no_axes}],rdkSpeed,z1,rdkTool,\\WObj:=rdkWObj;")
    head = """%%%
  VERSION:1
  LANGUAGE:ENGLISH
%%%

MODULE MOD_Prog

    LOCAL PERS tooldata rdkTool := [TRUE,[[0,0,0],[1,0,0,0]],[2,[0,0,15],[1,0,0,0],0,0,0.005]];
    LOCAL PERS wobjdata rdkWObj := [FALSE, TRUE, "", [[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
    VAR speeddata rdkSpeed := [250,500,5000,1000]; ! set default speed

    PROC Prog()
        ConfJ \\On;
        ConfL \\Off;
        rdkTool := [TRUE,[[0.000,0.000,200.000],[1.00000000,0.00000000,0.00000000,0.00000000]],[2,[0,0,15],[1,0,0,0],0,0,0.005]];
"""  # noqa: E501
    path = tmp_path / "Prog.mod"
    path.write_text(f"{head}{chr(10).join(lines)}\n    ENDPROC\n\nENDMODULE\n", encoding="utf-8")
    program = read_program(path)
    assert program.motions()
    found = execute(program).listing().motions
    for T, motion in zip(wanted, found, strict=True):
        np.testing.assert_allclose(motion.target.pose[:3, 3], T[:3, 3], atol=1e-5)  # m
        np.testing.assert_allclose(motion.target.pose[:3, :3], T[:3, :3], atol=1e-7)
        np.testing.assert_allclose(motion.tool.pose[:3, 3], [0, 0, 0.2])
        assert motion.tool.load.mass == 2.0
        assert motion.speed.value == 0.25
