"""Rules for URDFs: each is broken once in a sound file, and named at its line with the command's exit code."""

from __future__ import annotations

import json
import re

import pytest
from typer.testing import CliRunner

from er3a.formats.urdf_lint import lint
from er3a.pipeline.cli import app


def urdf() -> str:
    """A sound arm of three joints, each with a mass, a shape and its own effort."""
    inertial = '<inertial><mass value="{k}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    shape = '<geometry><box size="0.1 0.1 0.3"/></geometry>'
    links = [
        f'<link name="l{k}">{inertial}<visual>{shape}</visual>\n<collision>{shape}</collision></link>'
        for k in (1, 2, 3)
    ]
    joints = [
        f'<joint name="j{k}" type="revolute"><parent link="l{k - 1}"/><child link="l{k}"/>\n'
        f'<origin xyz="0 0 0.3" rpy="0 0 0"/>\n<axis xyz="0 1 0"/>\n'
        f'<limit lower="-2" upper="2.5" velocity="3" effort="{100 - k}"/></joint>'
        for k in (1, 2, 3)
    ]
    body = "\n".join(line.replace("{k}", str(k)) for k, line in enumerate(links, 1))
    return "\n".join(['<robot name="made">', '<link name="l0"/>', body, *joints, "</robot>"])


BREAKS = {
    "urdf_lengths": ('xyz="0 0 0.3" rpy', 'xyz="0 0 30" rpy'),
    "urdf_angles": ('rpy="0 0 0"', 'rpy="0 0 90"'),
    "urdf_limits_reversed": ('lower="-2" upper="2.5"', 'lower="2.5" upper="-2"'),
    "urdf_inertia": ('ixx="1"', 'ixx="9"'),
    "urdf_axis": ('<axis xyz="0 1 0"/>', '<axis xyz="0 2 0"/>'),
    "urdf_no_limits": ('lower="-2" upper="2.5" ', ""),
    "urdf_no_velocity": ('velocity="3"', 'velocity="0"'),
    "urdf_no_effort": ('effort="98"', 'effort="0"'),
    "urdf_no_mass": ('<mass value="2"/>', '<mass value="0"/>'),
    "urdf_no_collision": (re.compile("<collision>.*?</collision>"), ""),
    "urdf_mesh_missing": (re.compile('(?<=<collision><geometry>)<box size="[^"]*"/>'), '<mesh filename="none.stl"/>'),
}  # fmt: skip
WRONG = ("urdf_lengths", "urdf_angles", "urdf_limits_reversed", "urdf_inertia")


@pytest.mark.filterwarnings("ignore::er3a.InputWarning")
@pytest.mark.parametrize("code", BREAKS)
def test_a_rule_that_is_broken_is_named_at_its_line_and_no_other(tmp_path, code):
    old, new = BREAKS[code]
    sound, path = urdf(), tmp_path / "arm.urdf"
    path.write_text(sound)
    assert lint(path) == ()
    if isinstance(old, str):
        line, broken = sound[: sound.index(old)].count("\n") + 1, sound.replace(old, new, 1)
    else:
        line, broken = sound[: old.search(sound).start()].count("\n") + 1, old.sub(new, sound)
    path.write_text(broken)
    ((found, place),) = lint(path)
    assert found.code == code
    assert 0 <= line - place.line <= 3  # the element begins there or a little above
    done = CliRunner().invoke(app, ["check", str(path), "--sarif", str(tmp_path / "found.sarif")])
    assert done.exit_code == int(code in WRONG)
    results = json.loads((tmp_path / "found.sarif").read_text())["runs"][0]["results"]
    (result,) = (each for each in results if each["level"] != "note")
    region = result["locations"][0]["physicalLocation"]["region"]
    assert (result["ruleId"], region["startLine"]) == (code, place.line)


def test_rules_are_looked_at_beside_what_looks_like_xacro(tmp_path):
    """As a plugin's ``$(find package)``, which many URDFs have."""
    plugin = "<gazebo><parameters>$(find pkg)/control.yaml</parameters></gazebo></robot>"
    broken = urdf().replace('effort="98"', 'effort="0"', 1)
    (path := tmp_path / "arm.urdf").write_text(broken.replace("</robot>", plugin))
    assert [found.code for found, _ in lint(path)] == ["urdf_no_effort"]


@pytest.mark.parametrize("effort", [99, 100])
def test_placeholders_are_notes_in_json_and_sarif_too(tmp_path, effort):
    """All efforts alike, or not."""
    (path := tmp_path / "arm.urdf").write_text(
        re.sub('effort="9[89]"', f'effort="{effort}"', urdf()).replace('"97"', '"99"')
    )
    done = CliRunner().invoke(app, ["check", str(path), "--json", "--sarif", str(tmp_path / "found.sarif")])
    named = json.loads(done.stdout)[0]["rules"]
    results = json.loads((tmp_path / "found.sarif").read_text())["runs"][0]["results"]
    texts = [each["message"]["text"] for each in results if (each["ruleId"], each["level"]) == ("input_note", "note")]
    assert [each["text"] for each in named] == texts
    assert any("effort 99" in text for text in texts) == (effort == 99)


def test_a_check_without_a_file_is_that_of_the_study_in_the_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(app, ["check"]).exit_code == 2
    assert CliRunner().invoke(app, ["new", ".", "--robot", "er3_600"]).exit_code == 0
    done = CliRunner().invoke(app, ["check"])
    assert (done.exit_code, done.output) == (0, ".: a study, in order\n")
