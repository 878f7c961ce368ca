"""A xacro file is a program by a stranger: it runs no code, and ends."""

from __future__ import annotations

import pytest

from er3a.errors import InputError
from er3a.formats import urdf_tree
from er3a.formats.urdf_tree import plain_urdf

ROBOT = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:property name="type" value="2"/>
<xacro:macro name="m" params="k"><link name="l${k}_${type * 2}"/></xacro:macro><xacro:m k="1"/>
<link name="CODE"/></robot>"""
OPENED = "().__class__.__base__.__subclasses__()"


@pytest.mark.long
@pytest.mark.parametrize(
    "expression",
    [
        f"${{(lambda: [c for c in {OPENED} if c.__name__ == '_wrap_close'][0].__init__.__globals__['system']('touch F'))()}}",  # noqa: E501
        f"${{[c for c in [1] for d in {OPENED}]}}",
        "$(eval open('F','w'))",
        "${[p.vars for p in [python]]}",
        "${python['vars'](python.type)}",
        "${[g.gi_frame.f_back for g in [(x for x in [1])]]}",
        "${[0] * 10**11}",
        "${9**9**9}",
        "${'x' * 10**8}",
        "${xacro.load_yaml('/etc/hostname')}",
        "${load_yaml('/etc/hostname')}",
    ],
)
def test_an_expression_reaches_no_code_and_no_end_of_the_machine(tmp_path, monkeypatch, expression):
    monkeypatch.setattr(urdf_tree, "EXPANDING_S", 3)
    file = tmp_path / "a.xacro"
    file.write_text(ROBOT.replace("CODE", expression.replace("F'", f"{tmp_path}/ran'")), encoding="utf-8")
    with pytest.raises(InputError, match=r"can't be expanded|is not expanded after"), plain_urdf(file):
        pass
    assert not (tmp_path / "ran").exists()


def test_arguments_that_a_file_may_need_are_named(tmp_path):
    file = tmp_path / "a.xacro"
    needed = '<xacro:arg default="" name="speeds"/><link name="${load_yaml(\'$(arg speeds)\')}"/>'
    file.write_text(ROBOT.replace('<link name="CODE"/>', needed), encoding="utf-8")
    with pytest.raises(InputError, match=r"NAME:=VALUE.*speeds"), plain_urdf(file):
        pass


def test_expressions_and_macros_are_expanded(tmp_path):
    file = tmp_path / "a.xacro"
    file.write_text(ROBOT.replace("CODE", "${python.len([1, 2])}"), encoding="utf-8")
    with plain_urdf(file) as plain:
        text = plain.read_text(encoding="utf-8")
    assert 'name="l1_4"' in text
    assert 'name="2"' in text


def test_a_file_as_makers_write_it_is_expanded(tmp_path):
    """Includes relative to the file, from a macro too; ``$(eval ...)`` over arguments; tags without a prefix."""
    (tmp_path / "part.xacro").write_text('<robot><property name="R" value="3"/></robot>', encoding="utf-8")
    file = tmp_path / "a.xacro"
    parts = (
        '<robot name="Maker 7" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="hand" default="false"/>',
        '<xacro:macro name="m" params="file"><xacro:include filename="${file}"/><link name="l${R}"/></xacro:macro>',
        '<xacro:m file="part.xacro"/>',
        '<xacro:if value="$(eval hand and True)"><link name="hand"/></xacro:if></robot>',
    )
    file.write_text("".join(parts), encoding="utf-8")
    for arguments, hand in (((), False), (("hand:=true",), True)):
        with plain_urdf(file, arguments) as plain:
            text = plain.read_text(encoding="utf-8")
            assert plain.name == "maker_7.urdf"
        assert 'name="l3"' in text
        assert ('name="hand"' in text) == hand
