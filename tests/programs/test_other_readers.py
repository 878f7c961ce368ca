"""URScript, RPL as text and XML, CSV: what their programs mean."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.programs.instructions import (
    ArmMotion,
    Aside,
    Decision,
    JointTarget,
    Output,
    Pause,
    PoseTarget,
    Remark,
    Unknown,
    UnresolvedTarget,
)
from er3a.programs.languages import execute, read_program
from er3a.robots.robot import Robot

XPL = """<?xml version="1.0" encoding="utf-8"?>
<Xpl-source><XplEnvironment>
<VarDeclarations><VarGlobal>
<Var><Name>PH</Name><Type>POINTC</Type><InitValue>(383.85,5.71,497.03,95.47975,-88.191791,83.84831,2,0,0,-1)</InitValue></Var>
<Var><Name>Src</Name><Type>POINTC</Type><Array>[1..9]</Array></Var>
<Var><Name>x</Name><Type>LREAL</Type><InitValue>98</InitValue></Var>
</VarGlobal></VarDeclarations>
<Pous><Pou><Name>Main</Name><Type>Program</Type><Body>
<mjoint><target>PH</target><speed>v1000</speed><zone>fine</zone><tool>tool0</tool></mjoint>
<mjoint disable="true"><target>S1</target><speed>v500</speed><zone>fine</zone><tool>tool0</tool></mjoint>
<set><dest>Src[1]</dest><expr>OFFSET(PH,x/2,0,0)</expr></set>
<for><var>i</var><from>1</from><to>2</to><pouref>1</pouref></for>
<if><cond>x</cond></if>
</Body>
<Pou><Name>1</Name><Body><call><subroutine><name>STAND</name><args><arg>Src[i]</arg></args></subroutine></call>
<call><subroutine><name>tcpip.sockopen</name><args><arg /></args></subroutine></call></Body></Pou>
</Pou>
<Pou><Name>STAND</Name><Type>Subroutine</Type><VarDeclarations><VarInterface>
<Var><Name>st</Name><Type>POINTC</Type><Attrib>In</Attrib></Var></VarInterface></VarDeclarations><Body>
<mlin><target>OFFSET(st,0,0,100)</target><speed>v1000</speed><zone>z50</zone><tool>tool2</tool></mlin>
<set><dest>io.DOut[8]</dest><expr>true</expr></set><wait><condition>!io.DIn[8]</condition></wait>
</Body></Pou>
</Pous></XplEnvironment></Xpl-source>"""


def run(folder, name, text, **given):
    """A program's instructions with their places."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return execute(read_program(path), **given)


def said(execution):
    """All instructions."""
    return [step.instruction for step in execution.steps]


def test_an_xpl_program_is_read_by_its_elements(tmp_path):
    execution = run(tmp_path, "A.XPL", XPL)
    found = said(execution)
    first, second, third = (each for each in found if isinstance(each, ArmMotion))
    assert first.target.configuration == (("cfg", 2.0), ("t1", 0.0), ("t2", 0.0), ("t3", -1.0))
    assert (first.speed.value, first.speed.unit, first.tool.name) == (1.0, "m/s", "tool0")
    np.testing.assert_allclose(second.target.pose[:3, 3] * 1000, [383.85 + 49, 5.71, 597.03])
    assert third.target.reason == "undefined"
    assert (second.zone.value, second.tool.name) == (0.05, "tool2")
    assert Remark("disabled: MJOINT(S1, v500, fine, tool0)") in found
    assert Output("io.DOut[8]", "TRUE") in found
    assert Pause(condition="!io.DIn[8]") in found
    assert Aside("tcpip.sockopen()") in found
    assert any(isinstance(each, Unknown) and each.text.startswith("<if> x") for each in found)
    step = next(step for step in execution.steps if isinstance(step.instruction, ArmMotion) and step.calls)
    assert step.place.element == "STAND/mlin[1]"
    assert [place.element for place in step.calls] == ["Main/for[1]/1/call[1]"]


def test_a_pick_and_the_lift_above_it_agree_in_orientation(tmp_path):
    sister = Robot(
        name="sister",
        title="sister arm",
        convention="standard",
        a=np.array([0.03, 0.34, 0.035, 0, 0, 0]),
        alpha=np.radians([-90, 0, -90, 90, -90, 0]),
        d=np.array([0.375, 0, 0, 0.35, 0, 0.0815]),
        direction=np.array([1, -1, -1, 1, -1, 1]),
        offset=np.radians([0, -90, 0, 0, 0, 0]),
        lower=np.full(6, -4.0),
        upper=np.full(6, 4.0),
    )
    point = 'POINTC(372.73,303.88,163.12,-136.984851,85.601401,-170.217208,"CFG2",0,0,0)'
    text = f"""MJOINT({point}, v100perc, fine, tool0);
MJOINT(POINTJ(40.78,-40.98,-33.12,8.05,69.91,-2.95), v100perc, fine, tool0);
"""
    pick, lift = (each.target for each in said(run(tmp_path, "pick.pgm", text)))
    assert isinstance(pick, PoseTarget)
    tool0 = np.diag([-1.0, -1.0, 1.0, 1.0])  # frame 6 turned by 180 deg about z
    turned = pick.pose[:3, :3].T @ (forward(sister, lift.joints) @ tool0)[:3, :3]
    assert np.degrees(np.linalg.norm(Rotation.from_matrix(turned).as_rotvec())) < 0.01


def test_rpl_text(tmp_path):
    text = """(* first
line *)
FOR i := 1 TO 3 BY 2 DO
  MLIN(OFFSET(P1, 10*i, 0, 0), v500, z30, tool1, wobj2);
END_FOR;
IF i = 5 THEN MJOINT(POINTJ(1,0,0,0,0,0), v50perc, fine, tool0); ELSE DWELL(9); END_IF;
MJOINT(*, v500, fine, tool0);
CASE i OF
  1,2: DWELL(1);
  5: DWELL(2);
END_CASE;
REPEAT i := i - 1; UNTIL i <= 0 END_REPEAT;
WAIT(NOT io.DIn[3]);
jump(3);
"""
    (tmp_path / "a.var").write_text("Module Var POINTC P1 := (100,0,300,0,180,0,2,0,0,0)\nRoutine   Var   DINT   i\n")
    execution = run(tmp_path, "a.pgm", text)
    found = said(execution)
    lines = [each for each in found if isinstance(each, ArmMotion)]
    np.testing.assert_allclose([each.target.pose[0, 3] for each in lines[:2]], [0.11, 0.13])
    assert (lines[0].base.name, lines[0].zone.value) == ("wobj2", 0.03)
    assert isinstance(lines[2].target, JointTarget)
    assert lines[3].target.text == "*"
    assert [each for each in found if isinstance(each, Pause)] == [Pause(2.0), Pause(condition="NOT io.DIn[3]")]
    assert found[-1] == Unknown("jump(3)")
    assert [step.place.line for step in execution.steps][:2] == [1, 4]


def test_urscript_as_the_pendant_saves_it(tmp_path):
    text = """def job():
  set_tcp(p[0.0,0.0,0.1,0.0,0.0,0.0])
  set_payload(1.2)
  count = 0.0
  thread Counter():
    while (True):
      count = count + 1.0
      sync()
    end
  end
  run Counter()
  global way_p=p[-.1439,-.4356,.2020,0,3.1415,0]
  global way_q=[-1.60,-1.72,-2.20,-0.80,1.59,-0.03]
  def pick(height=0.1, n=2):
    i = 0
    while i < n:
      movel(pose_trans(way_p, p[0,0,-height*i,0,0,0]), a=1.2, v=0.25, r=0.01)
      i = i + 1
    end
    return True
  end
  while (True):
    $ 3 "MoveJ"
    movej(get_inverse_kin(way_p, qnear=way_q), a=1.4, v=1.05)
    movej([0, -1.57,
           1.57, 0, 1.57, 0], t=2) # two lines
    ok = pick(0.05, n=3)
    if ok and count < 3:
      set_standard_digital_out(0, True)
    end
    if not ok:
      halt
    end
    movec(p[0.1,0.2,0.3,0,0,0], p[0.1,0.3,0.3,0,0,0], 1.2, 0.25, 0.01)
    speedl([0,0,0.1,0,0,0], 0.5, 1)
    sleep(0.5)
  end
end
"""
    execution = run(tmp_path, "job.script", text)
    assert execution.complete
    found = said(execution)
    near, joints, *lines = [each for each in found if isinstance(each, ArmMotion)][:6]
    np.testing.assert_allclose(near.target.near, [-1.60, -1.72, -2.20, -0.80, 1.59, -0.03])
    assert (joints.speed.value, joints.speed.unit) == (2.0, "s")
    np.testing.assert_allclose([each.target.pose[2, 3] for each in lines[:3]], [0.2020, 0.2520, 0.3020], atol=1e-5)
    assert lines[3].kind == "arc"
    assert lines[3].tool.pose[2, 3] == pytest.approx(0.1)
    assert Aside("run Counter()") in found  # it moves nothing
    assert {each.taken for each in found if isinstance(each, Decision) and "count" in each.condition} == {True, False}
    assert Unknown("speedl([0,0,0.1,0,0,0], 0.5, 1)", may_move=False) in found


def test_what_threads_set_and_where_they_move_the_arm(tmp_path):
    text = """def job():
  global full = False
  thread Watch():
    while (True):
      global full=get_standard_digital_in(1)
      sync()
    end
  end
  thread Away():
    movel(p[0.1,0.2,0.3,0,0,0])
  end
  run Watch()
  movej([0,0,0,0,0,0])
  if (full):
    movej([1,0,0,0,0,0])
  end
  away = run Away()
  join away
  movej(get_actual_joint_positions())
end
"""
    found = said(run(tmp_path, "job.script", text))
    turned = [each.target.joints[0] for each in found if isinstance(each, ArmMotion) and hasattr(each.target, "joints")]
    assert turned == [0, 1]
    assert {Aside("run Watch()"), Unknown("away = run Away()", may_move=False)} <= {*found}
    assert isinstance(found[-1].target, UnresolvedTarget)


def test_statements_outside_of_a_routine_are_the_program(tmp_path):
    execution = run(tmp_path, "a.script", "def go(x):\n  movej([x,0,0,0,0,0])\nend\ngo(0.5)\ngo(x=0.25)\n")
    assert [step.instruction.target.joints[0] for step in execution.steps] == [0.5, 0.25]
    assert [[place.line for place in step.calls] for step in execution.steps] == [[4], [5]]


def test_a_changed_solution_or_element_is_not_taken_for_the_old_one(tmp_path):
    text = "p1 = p[0.3,0,0.3,3.14,0,0]\nq = get_inverse_kin(p1)\nq[5] = q[5] + 0.5\nmovej(q)\n"
    text += "l = [0,0,0,0,0,0]\nl[read_input_integer_register(0)] = 1\nmovej(l)\n"
    text += "l = [1,0,0,0,0,0]\nl[1] = 2\nmovej(l)\n"
    (tmp_path / "a.script").write_text(text)
    solved, unclear, known = execute(read_program(tmp_path / "a.script")).listing().motions
    assert isinstance(solved.target, UnresolvedTarget)
    assert isinstance(unclear.target, UnresolvedTarget)
    np.testing.assert_array_equal(known.target.joints, [1, 2, 0, 0, 0, 0])
    body = "XP[1]={X 300,Y 0,Z 300,A 0,B 0,C 180}\nXP[$IN_NR]={X 400,Y 0,Z 300,A 0,B 0,C 180}\nLIN XP[1]\n"
    (tmp_path / "a.src").write_text(f"DEF a( )\n{body}END\n")
    (motion,) = execute(read_program(tmp_path / "a.src")).listing().motions
    assert isinstance(motion.target, UnresolvedTarget)


@pytest.mark.parametrize("read", ["get_forward_kin()", "get_actual_tcp_pose()"])
def test_where_the_tool_is_after_a_pose_is_that_pose(tmp_path, read):
    text = f"set_tcp(p[0,0,0.1,0,0,0])\nmovel(p[0.4,0,0.4,0,3.1,0])\nmovel(pose_trans({read}, p[0,0,0.02,0,0,0]))\n"
    first, second = run(tmp_path, "a.script", text).listing().motions
    assert second.target.pose == pytest.approx(first.target.pose @ transform([0, 0, 0.02], np.zeros(3)))


@pytest.mark.parametrize(
    "text",
    [
        "x = [[0.0, 0.2], [0.1, 0.3]]\nmovej([x[1][0],0,0,0,0,0])\nmovej([x[0][1],0,0,0,0,0])",
        "if True:\n movej([0.1,0,0,0,0,0]);\nend;\nmovej([0.2,0,0,0,0,0])",
    ],
)
def test_semicolons_and_matrices(tmp_path, text):
    execution = run(tmp_path, "a.script", text + "\n")
    assert [each.target.joints[0] for each in execution.listing().motions] == [0.1, 0.2]
    assert not [step for step in execution.steps if isinstance(step.instruction, Unknown)]


@pytest.mark.parametrize("text", ["movej([0.1,0,0,0,0,0]) fast", "if x is y:\n movej([0.1,0,0,0,0,0])\nend", "x = 3 4"])
def test_one_statement_a_line(tmp_path, text):
    steps = run(tmp_path, "a.script", text + "\n").steps
    assert any(isinstance(step.instruction, (Unknown, Decision)) for step in steps)


def test_structures_and_lists_of_urscript(tmp_path):
    (tmp_path / "a.script").write_text(
        "def a():\n"
        "  part = struct(height = 0.02, pick = p[0.3,0,0.3,0,1.57,0])\n"
        "  q = [[0,0,0,0,0,0], [0.1,0,0,0,-1,0]][1]\n"
        "  movel(part.pick)\n"
        "  movej(q)\n"
        "  movej([q[0], q[1], 0, 0, [1, -1][1], 0])\n"
        "end\n"
    )
    execution = execute(read_program(tmp_path / "a.script"))
    line, first, second = execution.listing().motions
    np.testing.assert_allclose(line.target.pose[:3, 3], [0.3, 0, 0.3])
    np.testing.assert_allclose(first.target.joints, [0.1, 0, 0, 0, -1, 0])
    np.testing.assert_allclose(second.target.joints, first.target.joints)
    assert [step for step in execution.steps if isinstance(step.instruction, Unknown)] == []
