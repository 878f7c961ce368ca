"""What fills a URDF's fields and is no data: named first, and nothing rests on it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from er3a.formats.urdf import import_urdf

ROD = '<collision><origin xyz="0 0 0.15"/><geometry><box size="0.1 0.1 0.3"/></geometry></collision>'


def written(
    folder: Path, mass="{k}.5", centre="0 0 0.15", about_origin=False, effort="{k}00", limit=2.0, inertia=None
) -> Path:
    """An arm of four joints, each link a rod of 0.3 m along z; ``{k}`` is the number of joint or link."""
    text = '<robot name="r"><link name="l0"/>'
    for k in range(1, 5):
        across = float(mass.format(k=k)) * (0.1 / 12 + (0.15**2 if about_origin else 0))
        along = float(mass.format(k=k)) * 0.02 / 12
        across, along = inertia or (across, along)
        moments = f'<inertia ixx="{across}" iyy="{across}" izz="{along}" ixy="0" ixz="0" iyz="0"/>'
        body = f'<inertial><origin xyz="{centre}"/><mass value="{mass.format(k=k)}"/>{moments}</inertial>'
        text += f'<link name="l{k}">{ROD}{body}</link><joint name="j{k}" type="revolute"><parent link="l{k - 1}"/>'
        text += f'<child link="l{k}"/><origin xyz="0 0 0.3" rpy="0 0 0"/><axis xyz="{k % 2} {1 - k % 2} 0"/>'
        text += f'<limit lower="{-limit}" upper="{limit}" velocity="2" effort="{effort.format(k=k)}"/></joint>'
    path = folder / "arm.urdf"
    path.write_text(text + "</robot>")
    return path


def test_what_may_be_meant_is_kept(tmp_path):
    imported = import_urdf(written(tmp_path))
    assert len(imported.robot.masses.links) == 4
    assert imported.robot.masses.drives.peak.tolist() == [100, 200, 300, 400]
    assert imported.robot.sources["limits"].grade == "export"


@pytest.mark.parametrize(
    "given",
    [{"mass": "1"}, {"centre": "0 0 1.4"}, {"centre": "0 0 0"}, {"about_origin": True}, {"inertia": (1, 1)}],
    ids=["one mass for all", "centres far outside", "no centres", "moments about the origin", "one inertia for all"],
)
def test_masses_that_are_none_are_left_out(tmp_path, given):
    imported = import_urdf(written(tmp_path, **given))
    assert not imported.robot.masses.links
    assert "inertia" not in imported.robot.sources
    assert "no torque is judged" in imported.notes[0]


def test_a_flange_with_the_mass_that_each_link_has_hides_no_placeholder(tmp_path):
    path = written(tmp_path, mass="0.1")
    body = '<inertial><mass value="0.1"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>'
    ends = f'<link name="f">{body}</link><joint name="m" type="fixed"><parent link="l4"/><child link="f"/></joint>'
    path.write_text(path.read_text().replace("</robot>", f"{ends}</robot>"))
    imported = import_urdf(path)
    assert not imported.robot.masses.links
    assert "all links have the mass 0.1 kg" in imported.notes[0]


@pytest.mark.parametrize("effort", ["300", "1000", "{k}000", "0"])
def test_efforts_that_are_none_are_unknown(tmp_path, effort):
    robot = import_urdf(written(tmp_path, effort=effort)).robot
    assert robot.masses.drives is None
    assert len(robot.masses.links) == 4


@pytest.mark.parametrize(("effort", "kept"), [("6{k}", False), ("7{k}", True)])
def test_efforts_that_cannot_hold_the_links_themselves_are_none(tmp_path, effort, kept):
    # Links of 1.5 to 4.5 kg, centres 0.15 to 1.05 m from joint 1 when level: 85.3 N m, four fifths of it 68.3.
    imported = import_urdf(written(tmp_path, effort=effort))
    assert (imported.robot.masses.drives is not None) == kept
    assert any("effort" in note for note in imported.notes) != kept


def test_one_mass_for_all_links_that_move_is_seen_whatever_the_base_weighs(tmp_path):
    path = written(tmp_path, mass="1")
    base = '<link name="l0"><inertial><mass value="5"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>'
    path.write_text(path.read_text().replace('<link name="l0"/>', base))
    assert not import_urdf(path).robot.masses.links


@pytest.mark.parametrize(("damping", "kept"), [("1", False), ("{k}", True), ("0", True)])
def test_one_friction_for_all_joints_is_none(tmp_path, damping, kept):
    path = written(tmp_path)
    text = path.read_text()
    for k in range(1, 5):
        dynamics = f'<dynamics damping="{damping.format(k=k)}" friction="{damping.format(k=k)}"/>'
        text = text.replace(f'effort="{k}00"/>', f'effort="{k}00"/>{dynamics}')
    path.write_text(text)
    imported = import_urdf(path)
    drives = imported.robot.masses.drives
    assert np.isfinite(drives.peak).all()
    assert np.isfinite([drives.coulomb, drives.viscous]).any() == kept
    assert any("friction" in note for note in imported.notes) != kept


def test_half_turns_everywhere_are_limits_that_someone_assumed(tmp_path):
    imported = import_urdf(written(tmp_path, limit=math.pi))
    assert imported.robot.sources["limits"].grade == "inferred"
    assert np.allclose(imported.robot.upper, math.pi, atol=1e-6)
