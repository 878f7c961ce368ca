"""Programs of which something is not looked at: it is named, and no program passes for it.

Poses and joints that are expected are those of the manuals' definitions, worked out here with rotation matrices.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er3a.collision.bodies import Bodies
from er3a.collision.scene import Plane, Scene
from er3a.errors import InputError
from er3a.files.robot_library import load_robot
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.programs.instructions import ArmMotion, JointTarget, Listing, PoseTarget, UnresolvedTarget, numbers_of
from er3a.programs.languages import read_program, write_program
from er3a.programs.machine import execute
from er3a.programs.writing import WriteOptions
from testing.arms import palletiser

ROBOT = load_robot("er3a_c60")
HOME = np.radians([0.0, -10.0, -10.0, 0.0, -70.0, 0.0])
NEAR = np.radians([10.0, -15.0, -5.0, 5.0, -60.0, 10.0])
FAR = np.radians([20.0, -5.0, -15.0, -5.0, -65.0, 20.0])
HOME_TEXT, NEAR_TEXT, FAR_TEXT = ("[" + ", ".join(f"{angle:.9f}" for angle in q) + "]" for q in (HOME, NEAR, FAR))


def text_of(pose) -> str:
    """A pose (4, 4) in m as URScript has it."""
    return "p[" + ", ".join(f"{each:.12f}" for each in numbers_of(pose, "ur")) + "]"


def written(folder: Path, text: str, name: str = "a.script"):
    """A program of this text, read."""
    (folder / name).write_text(text, encoding="utf-8")
    return read_program(folder / name)


def check(folder: Path, text: str, name: str = "a.script", **options):
    """The check of a program, from the home position."""
    given = {"start": HOME, "measures": False} | options
    return check_program(written(folder, text, name), ROBOT, CheckOptions(**given))


def codes(found) -> dict[str, list[int]]:
    """Lines of findings, by code."""
    lines: dict[str, list[int]] = {}
    for each in found.findings:
        lines.setdefault(each.finding.code, []).append(each.place.line)
    return lines


def motions(folder: Path, text: str, name: str = "a.script", **given):
    """Motions as they are carried out."""
    execution = execute(written(folder, text, name), ROBOT, **({"start": HOME} | given))
    return [step.instruction for step in execution.steps if isinstance(step.instruction, ArmMotion)]


def krl(body: str, more: str = "") -> str:
    """A KRL program with this body."""
    return f"DEF a( )\n{body}\nEND\n{more}"


def axes(q) -> str:
    """Joint angles in rad as a KRL axis position."""
    return "{" + ", ".join(f"A{i + 1} {np.degrees(angle):.6f}" for i, angle in enumerate(q)) + "}"


@pytest.mark.parametrize(
    ("line", "followed"),
    [
        *((f"{name}=1", True) for name in ("$OV_PRO", "$ADVANCE", "$TIMER[2]", "$FLAG[1]", "$VEL_AXIS[3]", "$OUT[4]")),
        *((f"{name}=1", False) for name in ("$TORQUE_AXIS", "$TECH[1].MODE", "$SINGUL_POS[1]", "$SOFTN_END[1]")),
        *((f"{name}={{X 100,Y 0,Z 0,A 0,B 0,C 0}}", False) for name in ("$CORR_T", "$ROBROOT", "$NEW_IN_KSS_9")),
        ("$TCP_IPO=TRUE", True),
        ("$TCP_IPO=FALSE", False),
        ('SET_SYSTEM_DATA("$ROBROOT", 1)', False),
    ],
)
def test_system_variables_that_may_shift_motions_are_no_pass(tmp_path, line, followed):
    """Whatever is not known to leave paths as they are; ``$CORR_T`` shifts the tool while it moves."""
    found = check(tmp_path, krl(f"$VEL_AXIS[1]=10\nPTP {axes(HOME)}\n{line}\nPTP {axes(NEAR)}"), "a.src")
    assert found.level in (("pass", "note") if followed else ("caution",))
    named = {code: lines for code, lines in codes(found).items() if code in ("program_not_understood", "may_move")}
    assert list(named.values()) == ([] if followed else [[4]])


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.src", f"DEF a( )\nb( )\nEND\nDEF b( )\nPTP {axes(FAR)}\nEND\nDEF b( )\nPTP {axes(NEAR)}\nEND\n"),
        (
            "a.script",
            f"def b():\n #\nend\n\ndef b():\n movej({NEAR_TEXT})\nend\ndef b():\n movej({FAR_TEXT})\nend\nb()\n",
        ),
        (
            "a.mod",
            "MODULE a\nPROC main()\nb;\nENDPROC\nPROC b()\nMoveAbsJ p,v50,fine,tool0;\nENDPROC\nPROC b()\n"
            "MoveAbsJ [[10,-15,-5,5,-60,10],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;\nENDPROC\nENDMODULE\n",
        ),
    ],
)
def test_motions_of_a_routine_that_another_of_its_name_replaces_are_named(tmp_path, name, text):
    found = check(tmp_path, text, name)
    assert codes(found)["program_name_twice"]
    replaced = 5 if name == "a.src" else 6
    assert [(each.place.line, each.what) for each in found.not_examined] == [(replaced, "motion")]


def test_real_numbers_are_rounded_to_whole_ones_as_usual(tmp_path):
    body = (
        "INT I\nDECL AXIS Q\nQ={A1 0,A2 0,A3 0,A4 0,A5 -50,A6 0}\nI=2.5\nQ.A1=I\nI=3.49\nQ.A2=-I\nI=-0.6\nQ.A3=I\nPTP Q"
    )
    (found,) = motions(tmp_path, krl(body), "a.src")
    np.testing.assert_allclose(np.degrees(found.target.joints), [3, -3, -1, 0, -50, 0])


def test_a_robot_that_a_program_places_elsewhere_is_named(tmp_path):
    body = f"$ROBROOT={{X 0,Y 0,Z 500,A 0,B 0,C 0}}\nPTP {axes(NEAR)}"
    assert codes(check(tmp_path, krl(body), "a.src"))["program_not_understood"] == [2]


# URScript: where a program begins


def test_a_nested_function_that_nobody_calls_is_not_the_program(tmp_path):
    text = f'def Main():\n  def unused(a="1"):\n    x = 1\n  end\n  movej({NEAR_TEXT})\n  movej([9,0,0,0,0,0])\nend\n'
    found = check(tmp_path, text)
    assert [verdict.level for verdict in found.verdicts] == ["pass", "fail"]
    assert found.level == "fail"


def test_the_first_of_several_routines_that_no_other_calls_is_the_program_and_the_others_are_named(tmp_path):
    text = f"def helper():\n  movej({NEAR_TEXT})\nend\ndef Main():\n  helper()\n  movej({FAR_TEXT})\nend\n"
    text += f"def spare():\n  movej({HOME_TEXT})\nend\n"
    found = check(tmp_path, text)
    assert codes(found) == {"never_reached": [9]}
    assert found.level == "caution"
    assert [(each.place.line, each.what) for each in found.not_examined] == [(9, "motion")]


def test_a_routine_that_calls_itself_can_be_the_program(tmp_path):
    found = check(tmp_path, f"def Main():\n  movej({NEAR_TEXT})\n  Main()\nend\n")
    assert "not_followed_to_end" in codes(found)
    assert found.level == "fail"


def test_declarations_before_a_routine_do_not_make_the_file_the_program(tmp_path):
    text = f'global v = 0.5\ntextmsg("x")\ndef Main():\n  movej({NEAR_TEXT}, v=v)\nend\n'
    assert [each.speed.value for each in motions(tmp_path, text)] == [0.5]


@pytest.mark.parametrize("end", ["", "      end\n"])
def test_a_block_whose_head_is_not_understood_is_named_line_by_line_and_reading_goes_on(tmp_path, end):
    block = f"    case 1:\n      movej([9,0,0,0,0,0])\n{end}    default:\n      n = 2\n{end}  end\n"
    text = f"def Main():\n  n = 1\n  movej({NEAR_TEXT})\n  switch mode:\n{block}  movej({FAR_TEXT})\n"
    found = check(tmp_path, f"{text}  if n == 1:\n    movej([9,0,0,0,0,0])\n  end\nend\n")
    last = text.count("\n")
    assert codes(found)["may_move"] == [*range(4, last)]
    assert codes(found)["way_not_known"] == [last]
    assert [(each.place.line, each.level) for each in found.verdicts] == [
        (3, "pass"),
        (last, "note"),
        (last + 2, "fail"),
    ]


@pytest.mark.parametrize(
    ("inner", "end"), [("if n == 2:\nm = 1\nend\n", "end"), ("case 1:\n", "end"), ("", "end;"), ("", "end:")]
)
def test_a_block_that_is_not_understood_ends_where_it_does_in_a_file_that_moves_nothing_in(tmp_path, inner, end):
    text = f"def Main():\nn = 1\nswitch mode:\n{inner}movej([9,0,0,0,0,0])\n{end}\nmovej({NEAR_TEXT})\nend\n"
    found = check(tmp_path, text)
    assert [each.place.line for each in found.verdicts] == [text.count("\n") - 1]


def test_a_block_that_is_not_understood_needs_an_end_and_names_may_begin_as_words_do(tmp_path):
    with pytest.raises(InputError, match=r"line 2.*no end"):
        check(tmp_path, f"movej({NEAR_TEXT})\nswitch mode:\n  movej({FAR_TEXT})\n")
    assert codes(check(tmp_path, f"elsewhere = 1 2\nmovej({NEAR_TEXT})\n"))["may_move"] == [1]


# threads and interrupts


def test_a_thread_that_moves_is_followed_and_named(tmp_path):
    text = f"def Main():\n  thread T():\n    movej({NEAR_TEXT})\n    movej([9,0,0,0,0,0])\n  end\n"
    text += f"  movej({FAR_TEXT})\n  h = run T()\n  join h\nend\n"
    found = check(tmp_path, text)
    assert [(verdict.place.line, verdict.level) for verdict in found.verdicts] == [
        (3, "pass"),
        (4, "fail"),
        (6, "pass"),
    ]
    assert codes(found)["moves_beside"] == [7]


def test_behind_the_start_of_a_thread_that_moves_the_place_is_not_known(tmp_path):
    text = f"def Main():\n  thread T():\n    movej({NEAR_TEXT})\n  end\n  run T()\n  movej({FAR_TEXT})\nend\n"
    found = check(tmp_path, text)
    assert codes(found) == {"moves_beside": [5], "way_not_known": [6]}
    assert found.level == "caution"


def test_a_thread_that_is_never_started_is_not_passed(tmp_path):
    found = check(tmp_path, f"def Main():\n  thread T():\n    movej({NEAR_TEXT})\n  end\n  movej({FAR_TEXT})\nend\n")
    assert codes(found) == {"never_reached": [3]}
    assert found.level == "caution"


def test_a_thread_that_only_counts_changes_no_motion(tmp_path):
    text = "def Main():\n  thread T():\n    while True:\n      n = n + 1\n      sync()\n    end\n  end\n  run T()\n"
    found = check(tmp_path, f"{text}  movej({NEAR_TEXT})\nend\n")
    assert codes(found) == {}
    assert found.level == "pass"


def test_an_unknown_thread_may_move(tmp_path):
    assert check(tmp_path, f"movej({NEAR_TEXT})\nrun flee()\n").level == "caution"


def test_what_the_program_changes_later_has_no_value_in_a_thread(tmp_path):
    text = (
        "global goal = [0,0,0,0,0,0]\nglobal fixed = [0.1,0,0,0,0,0]\nthread T():\n  movej(fixed)\n  movej(goal)\nend\n"
    )
    first, second = motions(tmp_path, f"{text}run T()\ngoal = [0.2,0,0,0,0,0]\n")
    assert isinstance(first.target, JointTarget)
    assert second.target.reason == "undefined"


@pytest.mark.parametrize("head", ["INTERRUPT DECL", "GLOBAL INTERRUPT DECL"])
def test_an_interrupt_that_moves_is_followed_and_named(tmp_path, head):
    body = f"{head} 4 WHEN $IN[1]==TRUE DO flee( )\nINTERRUPT ON 4\nPTP {axes(NEAR)}"
    more = f"DEF flee( )\nPTP {axes(FAR)}\nPTP {{A1 500}}\nEND\n"
    found = check(tmp_path, krl(body, more), "a.src")
    assert codes(found)["moves_beside"] == [2]
    assert [(verdict.place.line, verdict.level) for verdict in found.verdicts] == [
        (4, "note"),
        (7, "note"),
        (8, "fail"),
    ]


def test_an_interrupt_that_only_sets_signals_and_the_controllers_own_are_none(tmp_path):
    body = "GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )\nINTERRUPT DECL 4 WHEN $IN[1] DO lamp( )"
    found = check(tmp_path, krl(f"{body}\nPTP {axes(NEAR)}", "DEF lamp( )\n$OUT[1]=TRUE\nEND\n"), "a.src")
    assert set(codes(found)) <= {"speed_not_given"}


@pytest.mark.parametrize(
    "line",
    ["GLOBAL INTERRUPT DECL 5 WHEN $IN[2] DO far_away( )", "TRIGGER WHEN DISTANCE=0 DELAY=0 DO far_away( ) PRIO=-1"],
)
def test_an_interrupt_or_trigger_of_an_unknown_routine_is_named(tmp_path, line):
    found = check(tmp_path, krl(f"{line}\nPTP {axes(NEAR)}"), "a.src")
    assert codes(found)["moves_beside"] == [2]
    assert found.level == "caution"


def test_what_an_interrupt_sets_is_followed_on_both_sides(tmp_path):
    body = f"hit=FALSE\nINTERRUPT DECL 5 WHEN $IN[2] DO note( )\nIF hit THEN\nPTP {{A1 500}}\nENDIF\nPTP {axes(NEAR)}"
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL BOOL hit=FALSE\nENDDAT\n")
    found = check(tmp_path, krl(body, "DEF note( )\nhit=TRUE\nEND\n"), "a.src")
    assert codes(found)["above_limit"] == [5]


def test_an_interrupt_that_sets_a_frame_is_named_and_leaves_the_programs_own_frames(tmp_path):
    body = f"{FRAMES}INTERRUPT DECL 4 WHEN $IN[1] DO shift( )\nPTP {axes(NEAR)}\nLIN_REL {{Z 5}}"
    found = check(tmp_path, krl(body, "DEF shift( )\n$BASE={X 0,Y 0,Z 10,A 0,B 0,C 0}\nEND\n"), "a.src")
    assert codes(found) == {"moves_beside": [4], "speed_not_given": [5, 6]}
    assert found.level == "caution"


def test_the_arm_stands_anywhere_behind_resume(tmp_path):
    body = f"INTERRUPT DECL 5 WHEN $IN[2] DO stop( )\nPTP {axes(NEAR)}"
    found = check(tmp_path, krl(body, "DEF stop( )\nBRAKE\nRESUME\nEND\n"), "a.src")
    assert {"moves_beside", "may_move"} <= set(codes(found))


# functions


@pytest.mark.parametrize(
    "call",
    [
        "to_home()",
        "reset_arm()",
        "time_to_move(p[0,0,0,0,0,0])",
        "switch_tool()",
        "get_ready()",
        "set_down(1)",
        "is_it()",
    ],
)
@pytest.mark.parametrize("form", ["{}", "x = {}", "if {} > 1:\n  x = 1\nend", "textmsg({})", "sleep({})"])
def test_a_function_with_an_unknown_name_may_move_the_arm(tmp_path, call, form):
    found = check(tmp_path, f"movej({NEAR_TEXT})\n{form.format(call)}\nmovej({FAR_TEXT})\n")
    assert "may_move" in codes(found)
    assert found.level == "caution"


def test_known_functions_and_other_processes_are_harmless(tmp_path):
    text = 'rpc = rpc_factory("xmlrpc", "http://x")\na = rpc.hand(3)\nrpc.close()\nset_digital_out(1, True)\n'
    text += f'sync()\nsocket_open("a", 1)\nx = get_tcp_force()\nmovej({NEAR_TEXT})\ntextmsg("x", to_str(x))\n'
    assert codes(check(tmp_path, text)) == {}
    assert "may_move" in codes(check(tmp_path, f"arm.go_home()\nmovej({NEAR_TEXT})\n"))


def test_unknown_functions_of_krl_may_move_wherever_they_stand(tmp_path):
    for line in ("GO_HOME( )", "x=GO_HOME( )", "IF GO_HOME( ) THEN\nENDIF", "BAS(#SPECIAL,1)"):
        assert "may_move" in codes(check(tmp_path, krl(f"DECL INT x\n{line}\nPTP {axes(NEAR)}"), "a.src")), line


@pytest.mark.parametrize(
    "line",
    [
        "movej({q}, a=1, w=2)",
        "movej({q}, 1, 1, 0, 0, 7)",
        "movep({q}, t=2)",
        "movel({q}, q={q})",
        "x = get_forward_kin({q}, tcp=p[0,0,0,0,0,0], at=1)\nmovel(x)",
        "x = get_inverse_kin(p[0.3,0,0.4,3.1,0,0], far=1)\nmovej(x)",
        "x = pose_trans(p[0,0,0,0,0,0], p[0,0,0,0,0,0], 1)\nmovel(x)",
    ],
)
def test_a_call_with_an_argument_that_is_not_used_is_not_understood(tmp_path, line):
    found = check(tmp_path, line.format(q=NEAR_TEXT) + "\n")
    assert codes(found)["target_not_given"]
    assert found.level == "fail"


def test_a_routine_that_is_called_with_too_much_is_not_understood(tmp_path):
    found = check(tmp_path, f"def go(n):\n  movej({NEAR_TEXT})\nend\ngo(1, 2)\n")
    assert codes(found) == {"program_not_understood": [4]}


@pytest.mark.parametrize(
    "call", ["get_forward_kin(q={q})", "get_forward_kin({q})", "get_forward_kin(tcp={tcp}, q={q})"]
)
def test_forward_kinematics_by_place_and_by_name(tmp_path, call):
    tool = np.eye(4)
    tool[:3, :3], tool[:3, 3] = Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_matrix(), [0.01, 0.02, 0.1]
    (motion,) = motions(tmp_path, f"movel({call.format(q=NEAR_TEXT, tcp=text_of(tool))})\n")
    own = tool if "tcp" in call else ROBOT.tool
    wanted = forward(ROBOT.replace(base=np.eye(4), tool=own), NEAR)
    np.testing.assert_allclose(motion.target.pose, wanted, atol=1e-9)


@pytest.mark.parametrize("radius", ["", ", r=0", ", r=0.05", ", r=b"])
def test_where_the_arm_is_behind_a_blended_motion_is_not_known(tmp_path, radius):
    """Universal Robots, User Manual UR5/CB3 3.10, section 14.6: what follows is evaluated on entering the blend."""
    reads = ["q = get_actual_joint_positions()\nmovej(q)", "x = get_actual_tcp_pose()\nmovel(x)"]
    reads.append("x = get_forward_kin()\nmovel(x)")
    for read in reads:
        found = motions(tmp_path, f"b = socket_read_ascii_float(1)\nmovej({NEAR_TEXT}{radius})\n{read}\n")
        known = not isinstance(found[1].target, UnresolvedTarget)
        assert known == (radius in ("", ", r=0")), read
    way = f"movej({NEAR_TEXT}{radius})\nmovej({FAR_TEXT})\nmovej(get_actual_joint_positions())\n"
    np.testing.assert_allclose(motions(tmp_path, f"b = 0.1\n{way}")[2].target.joints, FAR, atol=1e-8)


def test_inverse_kinematics_with_a_tool_of_its_own(tmp_path):
    tool = np.eye(4)
    tool[2, 3] = 0.1
    pose = forward(ROBOT.replace(base=np.eye(4), tool=tool), NEAR)
    text = f"q = get_inverse_kin({text_of(pose)}, qnear={NEAR_TEXT}, tcp={text_of(tool)})\nmovej(q)\n"
    found = check(tmp_path, text)
    (motion,) = found.motions.values()
    np.testing.assert_allclose(motion.end, NEAR, atol=1e-6)


def test_inverse_kinematics_keeps_the_tool_that_was_set_then(tmp_path):
    tool = np.eye(4)
    tool[2, 3] = 0.1
    pose = forward(ROBOT.replace(base=np.eye(4), tool=tool), NEAR)
    text = f"set_tcp({text_of(tool)})\nq = get_inverse_kin({text_of(pose)}, {NEAR_TEXT})\n"
    text += "set_tcp(p[0,0,0.3,0,0,0])\nmovej(q)\n"
    (motion,) = check(tmp_path, text).motions.values()
    np.testing.assert_allclose(motion.end, NEAR, atol=1e-6)


def test_which_solution_was_nearest_before_another_motion_is_not_guessed(tmp_path):
    pose = forward(ROBOT.replace(base=np.eye(4)), NEAR)
    text = f"movel({text_of(pose)})\nq = get_inverse_kin({text_of(pose)})\nmovej({FAR_TEXT})\nmovej(q)\n"
    assert [each.target.reason for each in motions(tmp_path, text)[2:]] == ["position_unknown"]


# poses by the manual


def random_poses(count: int):
    rng = np.random.default_rng(4)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = Rotation.random(count, rng=rng).as_matrix()
    poses[:, :3, 3] = rng.uniform(-0.5, 0.5, (count, 3))
    return poses


def test_poses_are_added_as_the_manual_says(tmp_path):
    for a, b in random_poses(20).reshape(10, 2, 4, 4):
        (motion,) = motions(tmp_path, f"movel(pose_add({text_of(a)}, p_2={text_of(b)}))\n".replace("(p[", "(p_1=p[", 1))
        np.testing.assert_allclose(motion.target.pose[:3, 3], a[:3, 3] + b[:3, 3], atol=1e-9)
        np.testing.assert_allclose(motion.target.pose[:3, :3], a[:3, :3] @ b[:3, :3], atol=1e-9)


def test_a_difference_of_poses_has_a_value_only_where_the_manual_settles_it(tmp_path):
    text = "movel(pose_sub(p[.2,.5,.1,1.57,0,0], p[.2,.5,.6,1.57,0,0]))\n"
    text += "movel(pose_sub(p[.2,.5,.1,1.57,0,0], p[.2,.5,.6,0,0.4,0]))\nmovel(p[0.3,0,0.4,3.1,0,0] * 2)\n"
    same, other, doubled = (each.target for each in motions(tmp_path, text))
    np.testing.assert_allclose(same.pose, [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -0.5], [0, 0, 0, 1]], atol=1e-12)
    assert [other.reason, doubled.reason] == ["not_understood", "not_understood"]


def test_examples_of_the_manual(tmp_path):
    text = "movel(inv(p[.2,.5,.1,1.57,0,3.14]))\nmovel(pose_inv(p[.2,.5,.1,1.57,0,3.14]))\n"
    text += "movel(pose_trans(p[.2,.5,.1,1.57,0,0], p[.2,.5,.6,1.57,0,0]))\n"
    text += "movel(interpolate_pose(p[.2,.2,.4,0,0,0], p[.2,.2,.6,0,0,0], alpha=.5))\n"
    text += "n = norm(p[-.2,.2,-.2,-1.57,0,3.14])\nmovel(p[n,length([1,2,3]),0,0,0,0])\n"
    inverted, same, moved, middle, sizes = (numbers_of(each.target.pose, "ur") for each in motions(tmp_path, text))
    np.testing.assert_allclose(inverted, [0.19324, 0.41794, -0.29662, 1.23993, 0.0, 2.47985], atol=1e-5)
    assert same == inverted
    np.testing.assert_allclose(moved, [0.4, -0.0996, 0.60048, 3.14, 0, 0], atol=2e-5)
    np.testing.assert_allclose(middle, [0.2, 0.2, 0.5, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(sizes[:2], [3.52768, 3], atol=1e-5)


def test_an_arc_in_mode_1_turns_with_its_tangent(tmp_path):
    start, to, via = np.eye(4), np.eye(4), np.eye(4)
    start[:3, :3] = to[:3, :3] = via[:3, :3] = Rotation.from_rotvec([np.pi - 0.1, 0, 0]).as_matrix()
    start[:3, 3], via[:3, 3], to[:3, 3] = (
        [0.3, 0, 0.4],
        [0.3 + 0.1 * (1 - np.sqrt(0.5)), 0.1 * np.sqrt(0.5), 0.4],
        [0.4, 0.1, 0.4],
    )
    text = f"movel({text_of(start)})\nmovec({text_of(via)}, {text_of(to)}, mode={{}})\n"
    plain, turned, other = (motions(tmp_path, text.format(mode))[1].target for mode in ("0", "1", "2"))
    np.testing.assert_allclose(plain.pose, to, atol=1e-9)
    quarter = Rotation.from_rotvec([0, 0, -np.pi / 2]).as_matrix()
    np.testing.assert_allclose(turned.pose[:3, :3], quarter @ start[:3, :3], atol=1e-9)
    assert other.reason == "not_understood"


def test_what_a_statement_sets_that_is_not_understood_keeps_no_value(tmp_path):
    text = f"n = 0\nn = {{{{N}}}}\nif n == 0:\n  movej({NEAR_TEXT})\nelse:\n  movej([9,0,0,0,0,0])\nend\n"
    found = check(tmp_path, text)
    assert codes(found)["above_limit"] == [6]


def test_a_list_that_a_method_changes_is_not_the_old_one(tmp_path):
    text = "l = [0,0,0,0,0]\nl.append(0.1)\nmovej(l)\nl.pop()\nmovej(l)\n"
    grown, unclear = (each.target for each in motions(tmp_path, text))
    np.testing.assert_allclose(grown.joints, [0, 0, 0, 0, 0, 0.1])
    assert unclear.reason == "not_understood"


# KRL


def test_whole_numbers_are_joined_bit_by_bit(tmp_path):
    values = ("6 B_AND 3", "6 B_OR 3", "6 B_EXOR 3", "B_NOT 6")
    body = "DECL INT n\n" + "\n".join(f"n={value}\nPTP {{A1 (n)}}" for value in values)
    found = [np.degrees(each.target.joints[0]) for each in motions(tmp_path, krl(body), "a.src")]
    np.testing.assert_allclose(found, [2, 7, 5, -7])


CONFIG = """DEFDAT $CONFIG
DECL FRAME TOOL_DATA[16]
TOOL_DATA[1]={X 0.0,Y 0.0,Z 107.7,A 0.0,B 0.0,C 0.0}
DECL REAL DEF_VEL_CP=2.0
DECL REAL DEF_ACC_CP=2.3
DECL REAL DEF_APO_CDIS=1.5
ENDDAT
"""


def test_initmov_sets_what_the_controllers_own_module_sets(tmp_path):
    (tmp_path / "$config.dat").write_text(CONFIG)
    body = "$TOOL={X 0,Y 0,Z 50,A 0,B 0,C 0}\n$BASE={X 500,Y 0,Z 0,A 0,B 0,C 0}\n"
    body += f"BAS(#INITMOV,0)\nPTP {axes(NEAR)}\nLIN_REL {{Z 10}} C_DIS"
    joint, line = motions(tmp_path, krl(body), "a.src")
    assert (joint.speed.value, joint.acceleration.value) == (1.0, 1.0)
    assert (line.speed.value, line.acceleration.value, line.acceleration.unit) == (2.0, 2.3, "m/s2")
    assert (line.zone.kind, line.zone.value) == ("distance", 0.0015)
    assert line.tool.name == "TOOL_DATA[1]"
    np.testing.assert_allclose(line.tool.pose[:3, 3], [0, 0, 0.1077])
    np.testing.assert_allclose(line.base.pose, np.eye(4))


def test_behind_initmov_a_tool_that_nothing_gives_is_named(tmp_path):
    found = check(tmp_path, krl(f"BAS(#INITMOV,0)\nPTP {axes(NEAR)}\nLIN_REL {{Z 10}}"), "a.src")
    assert codes(found)["frame_not_given"] == [3, 4]
    assert found.level == "fail"


def test_ptp_dat_and_cp_dat_take_the_speeds_of_the_data(tmp_path):
    body = "PDAT_ACT={VEL 40.0,ACC 60.0,APO_DIST 150.0}\nBAS(#PTP_DAT)\nPTP " + axes(NEAR) + " C_PTP\n"
    body += "LDAT_ACT={VEL 0.3,ACC 50.0,APO_DIST 20.0}\nBAS(#CP_DAT)\nLIN_REL {Z 1} C_DIS"
    joint, line = motions(tmp_path, krl(body), "a.src")
    assert (joint.speed.value, joint.acceleration.value, joint.zone.value) == (0.4, 0.6, 1.0)
    assert (line.speed.value, line.acceleration.value, line.zone.value) == (0.3, 0.5, 0.02)


BASICS = """DEF BAS (COMMAND :IN,REAL_PAR :IN )
DECL BAS_COMMAND COMMAND
REAL REAL_PAR
SWITCH COMMAND
CASE #INITMOV
  $BASE={X 0,Y 0,Z 200,A 0,B 0,C 0}
  $TOOL=$NULLFRAME
CASE #VEL_PTP
  half(REAL_PAR)
ENDSWITCH
END
DEF half(percent :IN )
REAL percent
INT i
FOR i=1 TO $NUM_AX
  $VEL_AXIS[i]=percent/2
ENDFOR
END
"""


@pytest.mark.parametrize("place", ["KRC/R1/Program/bas.src", "KRC/R1/System/bas.src"])
def test_a_controllers_own_basics_are_read(tmp_path, place):
    folder = tmp_path / "KRC/R1/Program/cell"
    folder.mkdir(parents=True)
    if "Program" in place:
        place = "KRC/R1/Program/cell/bas.src"
    (tmp_path / place).parent.mkdir(exist_ok=True)
    (tmp_path / place).write_text(BASICS)
    text = krl(f"BAS(#INITMOV,0)\nBAS(#VEL_PTP,50)\nPTP {axes(NEAR)}\nLIN {{X 300}}")
    joint, line = motions(folder, text, "a.src")
    assert joint.speed.value == 0.25
    np.testing.assert_allclose(line.base.pose[:3, 3], [0, 0, 0.2])


def pose_text(q, more: str = "") -> str:
    """The tool's pose in the robot's base as a KRL position."""
    x, y, z, a, b, c = numbers_of(forward(ROBOT.replace(base=np.eye(4), tool=np.eye(4)), q), "kuka")
    return f"{{X {x:.6f},Y {y:.6f},Z {z:.6f},A {a:.6f},B {b:.6f},C {c:.6f}{more}}}"


FRAMES = "$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\n"


def test_a_status_without_a_turn_is_named(tmp_path):
    found = check(tmp_path, krl(f"{FRAMES}PTP {pose_text(NEAR, ',S 2')}"), "a.src")
    assert codes(found)["configuration_not_read"] == [4]
    assert found.level == "caution"


def test_a_first_target_with_several_solutions_from_nowhere_is_a_guess(tmp_path):
    text = krl(f"{FRAMES}PTP {pose_text(NEAR)}\nPTP {axes(FAR)}")
    bare = ROBOT.replace(base=np.eye(4), tool=np.eye(4))
    solutions = inverse(bare, forward(bare, NEAR))
    found = check(tmp_path, text, "a.src", start=None)
    (guessed,) = (each.finding for each in found.findings if each.finding.code == "configuration_guessed")
    assert guessed.solutions == int(solutions.within_limits.sum()) > 1
    assert "configuration_guessed" not in codes(check(tmp_path, text, "a.src"))
    assert ("way", 4) in {(each.what, each.place.line) for each in found.not_examined}


def test_the_orientation_is_kept_where_the_program_says_so(tmp_path):
    line = "LIN {X 300,Y 20,Z 400,A 10,B 80,C 0}"
    _, kept = motions(tmp_path, krl(f"{FRAMES}PTP {axes(NEAR)}\n$ORI_TYPE=#CONSTANT\n{line}"), "a.src")
    assert isinstance(kept.target, PoseTarget)
    bare = ROBOT.replace(base=np.eye(4), tool=np.eye(4))
    np.testing.assert_allclose(kept.target.pose[:3, :3], forward(bare, NEAR)[:3, :3], atol=1e-12)
    found = check(tmp_path, krl(f"{FRAMES}PTP {axes(NEAR)}\n$ORI_TYPE=#JOINT\nPTP {axes(FAR)}"), "a.src")
    assert codes(found)["program_not_understood"] == [5]


@pytest.mark.parametrize(("body", "missing"), [(f"PTP {axes(NEAR)}", False), ("PTP XHOME", False), ("PTP XP1", True)])
def test_a_missing_data_file_is_told_where_something_of_it_is_used(tmp_path, body, missing):
    found = check(tmp_path, krl(f"{body}\n$OUT[1]=TRUE"), "a.src")
    assert ("program_data_file_missing" in codes(found)) == missing


@pytest.mark.parametrize(
    ("text", "missing"),
    [("MJOINT(POINTJ(0,0,0,0,-70,0), v50perc, fine, tool0);", False), ("MJOINT(P1, v500, fine, tool0);", True)],
)
def test_a_missing_var_file_too(tmp_path, text, missing):
    assert ("program_data_file_missing" in codes(check(tmp_path, f"{text}\n", "a.pgm"))) == missing


@pytest.mark.parametrize("changed", ["tool0.z := 100;", "wobj0.x := 100;"])
def test_a_frame_that_a_program_of_rpl_changes_is_not_the_one_given(tmp_path, changed):
    moves = "MJOINT(POINTJ(0,0,0,0,-70,0), v50perc, fine, tool0);\nMLIN({}, v50, fine, tool0, wobj0);\n"
    moves = moves.format("POINTC(400,0,400,0,0,180)")
    assert "frame_not_given" not in codes(check(tmp_path, moves, "a.pgm"))
    assert codes(check(tmp_path, f"{changed}\n{moves}", "a.pgm"))["frame_not_given"][-1] == 3


@pytest.mark.parametrize(
    "changed",
    ["IF io.din1 THEN\nwobj0.x := 100;\nEND_IF;\n{0}", "{0}WHILE io.din1 DO\n{0}wobj0.x := 100;\nEND_WHILE;\n"],
)
def test_so_is_one_that_a_side_or_a_round_changes_for_motions_that_name_none(tmp_path, changed):
    start, line = (
        "MJOINT(POINTJ(0,0,0,0,-70,0), v50perc, fine, tool0);\n",
        "MLIN(POINTC(400,0,400,0,0,180), v50, fine, tool0);\n",
    )
    assert "frame_not_given" not in codes(check(tmp_path, start + line, "a.pgm"))
    assert "frame_not_given" in codes(check(tmp_path, start + changed.format(line), "a.pgm"))


def test_functions_of_rpl_whose_unit_no_source_tells_have_no_value(tmp_path):
    for angle, known in (("SIN(30)", False), ("ABS(-30)", True), ("SQRT(-30)", False)):
        (motion,) = motions(tmp_path, f"MJOINT(POINTJ({angle},0,0,0,-70,0), v50perc, fine, tool0);\n", "a.pgm")
        assert isinstance(motion.target, JointTarget) == known


@pytest.mark.parametrize(
    ("text", "name", "code"),
    [
        ("DEF a( )\nSPLINE\nSPL {A1 5,A2 -10,A3 -10,A4 0,A5 -70,A6 0}\nENDSPLINE\nEND\n", "a.src", "spline_as_line"),
        (2 * "MJOINT(POINTJ(5,-10,-10,0,-70,0), v10perc, wide, tool0);\n", "a.pgm", "zone_without_size"),
    ],
)
def test_a_way_whose_course_is_not_known_is_no_pass(tmp_path, text, name, code):
    """A spline bends, and a corner is cut as far as its zone says, wherever that leads."""
    found = check(tmp_path, text, name)
    assert code in codes(found)
    assert found.level == "caution"


def test_motions_with_more_targets_than_they_have_are_not_understood(tmp_path):
    for body in (f"PTP {axes(NEAR)}, {axes(FAR)}", f"{FRAMES}CIRC {pose_text(NEAR)}"):
        assert motions(tmp_path, krl(body), "a.src")[-1].target.reason == "not_understood"
    (motion,) = motions(tmp_path, "MJOINT(POINTJ(0,0,0,0,-70,0), v50perc, fine, tool0, wobj0, 3);\n", "a.pgm")
    assert motion.target.reason == "not_understood"


@pytest.mark.parametrize("note", ["grip", '"grip', '"grip"', 'the 2" pipe'])
def test_no_row_of_a_table_is_taken_for_the_rest_of_a_note(tmp_path, note):
    head = "t_s,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,note\n"
    out = np.where(np.arange(6) == 1, np.radians(-170), NEAR)
    rows = [f"{2 * k}," + ",".join(map(str, np.degrees(q))) for k, q in enumerate((HOME, NEAR, out, FAR))]
    found = check(tmp_path, head + f",{note}\n".join(rows) + ",\n", "a.csv")
    assert codes(found)["below_limit"] == [4]


ZEROS = "A 0,B 0,C 0"


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (["P={X 300,Y 0,Z 400,A 0,B 90,C 0}", "LIN P"], None),
        (["P={X 300,Y 0,Z 400,A 0,B 90,C 0}", "P={X 310}", "LIN P"], "undefined"),
        (["P.X=300", "P.Y=0", "P.Z=400", "LIN P"], None),  # the rest is where the arm stands
        (["P=?!", "P.X=300", "P.Y=0", "P.Z=400", "LIN P"], "undefined"),
        ([f"XP[1]={axes(NEAR)}", "XP[1]=?!", "PTP XP[1]"], "undefined"),
        ([f"LIN {{X 300,Y 0,Z 0,{ZEROS}}}:{{X 10,Y 0,Z 400}}"], "undefined"),
        ([f"LIN {{X 300,Y 0,Z 0,{ZEROS}}}:{{X 10,Y 0,Z 400,{ZEROS}}}"], None),
    ],
)
def test_what_a_position_leaves_out_is_no_zero(tmp_path, lines, reason):
    body = f"{FRAMES}DECL E6POS P\nPTP {axes(NEAR)}\n" + "\n".join(lines)
    assert getattr(motions(tmp_path, krl(body), "a.src")[-1].target, "reason", None) == reason


def test_a_position_that_leaves_out_a_turn_the_variable_had_does_not_say_which_solution_is_meant(tmp_path):
    body = f"{FRAMES}DECL E6POS P\nP={pose_text(NEAR, ',S 2,T 0')}\nP={pose_text(NEAR)}\nPTP P"
    assert "configuration_not_read" in codes(check(tmp_path, krl(body), "a.src"))
    listing = Listing("b", tuple(motions(tmp_path, krl(body), "a.src")), language="krl")
    again = write_program(listing, "krl", WriteOptions(ROBOT))  # with the joints that it found, or without the turns
    assert "left out" not in "".join(again.files.values())


@pytest.mark.parametrize(
    ("lines", "height"),
    [
        (["$BASE={X 0,Y 0,Z 100}"], None),
        (["$BASE.Z=100"], None),
        (["$BASE=BASE_DATA[1]"], 0.05),
        (["BASE_DATA[1].Z=BASE_DATA[1].Z+100", "$BASE=BASE_DATA[1]"], 0.15),
        (["$BASE=BASE_DATA[1]", "$BASE.Z=100"], 0.1),
        ([f"$BASE=BASE_DATA[1]:{{X 0,Y 0,Z 100,{ZEROS}}}"], 0.15),
        (["BASE_DATA[1]=SEEN", "$BASE=BASE_DATA[1]"], None),
        ([f"BASE_DATA[SEEN]={{X 0,Y 0,Z 9,{ZEROS}}}", "$BASE=BASE_DATA[1]"], None),
        (["BASE_DATA[1].Z=SEEN", "$BASE=BASE_DATA[1]"], None),
        (["$BASE=SEEN"], None),
        (["BASE_DATA[1]=?!", "$BASE=BASE_DATA[1]"], None),
        (["DECL FRAME BASE_DATA[16]", "$BASE=BASE_DATA[1]"], 0.05),
    ],
)
def test_a_frame_of_the_cell_is_what_the_program_makes_of_it_or_not_given(tmp_path, lines, height):
    cell = np.eye(4)
    cell[2, 3] = 0.05
    body = "$TOOL=$NULLFRAME\n" + "\n".join(lines) + f"\nPTP {axes(NEAR)}\nLIN {{X 300}}"
    found = check(tmp_path, krl(body), "a.src", frames={"BASE_DATA[1]": cell})
    missing = [each.finding.name for each in found.findings if each.finding.code == "frame_not_given"]
    assert bool(missing) == (height is None)
    if height is None:
        mapped = check(tmp_path, krl(body), "a.src", frames={"BASE_DATA[1]": cell, missing[-1]: cell})
        assert "frame_not_given" not in codes(mapped)
    else:
        (base,) = {each.placed.motion.base.pose[2, 3] for each in found.motions.values()}
        assert base == pytest.approx(height)


@pytest.mark.parametrize(
    ("angle", "degrees"), [("7/2", None), ("8/2", 4), ("7/2.0", 3.5), ("-6/4", None), ("-6 MOD 3", 0)]
)
def test_a_quotient_that_no_source_settles_has_no_value(tmp_path, angle, degrees):
    """No document of RPL tells whether two whole numbers have a whole quotient; programs write 100.0."""
    (found,) = motions(tmp_path, f"MJOINT(POINTJ({angle},0,0,0,-70,0), v50perc, fine, tool0);\n", "a.pgm")
    assert isinstance(found.target, UnresolvedTarget) == (degrees is None)
    if degrees is not None:
        assert np.degrees(found.target.joints[0]) == pytest.approx(degrees)


# what touches first is named first


TABLE = Scene("table", (Plane("table", np.array([0.0, 0.0, 1.0]), 0.25),))


def test_pairs_of_bodies_are_named_in_the_order_in_which_they_touch(tmp_path):
    down = np.radians([0.0, -123.0, 56.0, 0.0, -70.0, 0.0])
    found = check(tmp_path, f"movej({text_of_joints(down)})\n", measures=True, scene=TABLE)
    (collision,) = (each for each in found.findings if each.finding.code == "motion_collides")
    (motion,) = found.motions.values()
    bodies = Bodies(ROBOT.replace(tool=motion.placed.arm.tool), TABLE)
    t = np.linspace(0, motion.way.law.duration, 4001)
    distances = np.array([bodies.distances(bodies.ends(q), np.arange(len(bodies.pairs))) for q in motion.way.joints(t)])
    first = {}
    for k, pair in enumerate(bodies.pairs):
        if (distances[:, k] <= 0).any():
            begins = t[np.argmax(distances[:, k] <= 0)]
            first[pair] = min(first.get(pair, np.inf), begins)
    touches = collision.finding.touches
    assert len(touches) > 1
    assert [each.pair for each in touches] == sorted(first, key=first.__getitem__)
    np.testing.assert_allclose([each.t_s for each in touches], sorted(first.values()), atol=t[1])
    assert collision.moment == touches[0].t_s
    for touch in touches:
        deepest = min(distances[:, k].min() for k, pair in enumerate(bodies.pairs) if pair == touch.pair)
        assert touch.depth_mm == pytest.approx(-1000 * deepest, abs=2)


def text_of_joints(q) -> str:
    """Joint angles in rad as URScript has them."""
    return "[" + ", ".join(f"{angle:.9f}" for angle in q) + "]"


@pytest.mark.parametrize(
    ("text", "name", "lines"),
    [
        (
            f"movej({NEAR_TEXT})\nmode = 0\nif mode == 1:\n  force_mode(p[0,0,0,0,0,0])\n  x = go_home(3)\nend\n",
            "a.script",
            [4, 5],
        ),
        (f'def f():\n  speedj([1,0,0,0,0,0], 1)\nend\ntextmsg("x")\nmovej({NEAR_TEXT})\n', "a.script", [2]),
        (krl(f"PTP {axes(NEAR)}\nHALT_HERE=FALSE\nRETURN\nGO_HOME( )\nx=GO_FAR( )\n"), "a.src", [5, 6]),
    ],
)
def test_what_may_move_and_is_never_reached_is_named_and_does_not_pass(tmp_path, text, name, lines):
    found = check(tmp_path, text, name)
    assert set(lines) <= set(codes(found)["never_reached"])
    assert set(lines) <= {each.place.line for each in found.not_examined if each.what == "motion"}
    assert found.level in ("caution", "fail")


def test_what_is_harmless_and_never_reached_is_not_named(tmp_path):
    text = f"movej({NEAR_TEXT})\nmode = 0\nif mode == 1:\n  set_digital_out(1, True)\n  set_tcp(p[0,0,0,0,0,0])\nend\n"
    assert "never_reached" not in codes(check(tmp_path, text))
    hidden = krl(f"PTP {axes(NEAR)}\nRETURN\nBAS(#VEL_PTP,10)\n$OUT[1]=TRUE\nWAIT SEC 1\n")
    assert "never_reached" not in codes(check(tmp_path, hidden, "a.src"))


def test_a_line_of_a_coupled_arm_without_a_closed_form_is_named(tmp_path):
    program = written(tmp_path, krl("LIN {A1 10,A2 -60,A3 60,A4 10}"), "a.src")
    start = np.radians([0.0, -50, 50, 0])
    found = check_program(program, palletiser(), CheckOptions(start=start, measures=False))
    assert "line_not_checked" in codes(found)
    assert found.level == "caution"


XML = """<Xpl-source><XplEnvironment><VarDeclarations><VarGlobal>{declared}</VarGlobal></VarDeclarations><Pous><Pou>
<Name>Main</Name><Type>Program</Type><Body>{body}</Body>{more}</Pou></Pous></XplEnvironment>{behind}</Xpl-source>"""
JOINT = """<mjoint{as_}><target>{to}</target><speed>v20perc</speed><zone>fine</zone><tool>tool0</tool>{more}</mjoint>"""
MOVE, HOME_POINT = JOINT.format(as_="", to="POINTJ(0,-10,-10,0,-70,0)", more=""), "(0,-10,-10,0,-70,0)"
BELOW = f"<Pou><Name>1</Name><Body>{MOVE}</Body></Pou>"


def of_xml(body=MOVE, more="", behind="", declared=""):
    return XML.format(body=body, more=more, behind=behind, declared=declared)


@pytest.mark.parametrize(
    ("first", "second", "declared", "named"),
    [
        (["i"], ["I"], "", []),
        (["i", "I"], [], "", ["i, I"]),
        ([], ["I"], "i", ["i, I"]),
        (["i"], ["i"], "i", []),
    ],
)
def test_names_that_differ_by_capital_letters_are_compared_where_one_routine_sees_both(
    tmp_path, first, second, declared, named
):
    def variables(names):
        return "".join(f"<Var><Name>{name}</Name><Type>INT</Type><InitValue>1</InitValue></Var>" for name in names)

    local = "<VarDeclarations><VarLocal>{}</VarLocal></VarDeclarations>"
    main, other = (local.format(variables(names)) for names in (first, second))
    routine = f"</Pou><Pou><Name>Other</Name><Type>Subroutine</Type>{other}<Body>{MOVE}</Body>"
    program = written(tmp_path, of_xml(more=main + routine, declared=variables(declared)), "a.XPL")
    assert [each.text for each in program.findings if each.code == "program_not_understood"] == named


def with_part(part):
    return of_xml(MOVE.replace("</mjoint>", part + "</mjoint>"))


@pytest.mark.parametrize(
    "text",
    [
        of_xml(more=BELOW),  # a body that no loop names
        of_xml(f"{MOVE}<while><cond>io.DIn[1]</cond><pouref>1</pouref></while>", BELOW + BELOW),
        of_xml(f"{MOVE}<while><cond>io.DIn[1]</cond><pouref>1</pouref>{MOVE}</while>", BELOW),
        of_xml(f"{MOVE}<for><var>i</var><from>1</from><to>2</to><step>2</step><pouref>1</pouref></for>", BELOW),
        of_xml(more=MOVE),
        of_xml(behind=f"<XplEnvironment>{BELOW}</XplEnvironment>"),
        of_xml(f"{MOVE}MJOINT(POINTJ(0,0,0,0,0,0), v20perc, fine, tool0);"),
        with_part("<offset>OFFSET(0,0,-300)</offset>"),
        with_part("<target>POINTJ(0,0,0,0,0,0)</target>"),
        with_part("relative"),
        *(
            of_xml(JOINT.format(as_=each, to="POINTJ" + HOME_POINT, more=""))
            for each in (' disable="1"', ' rel="true"')
        ),
        of_xml().replace("<Body>", '<Body disable="true">'),
        of_xml(f"{MOVE}<wait><condition>io.DIn[1]</condition><timeout>5</timeout><label>L</label></wait>"),
        of_xml(f"{MOVE}<call><cond>x</cond><subroutine><name>Main</name></subroutine></call>"),
        of_xml(declared="<Var><Name>p</Name><Type>POINTJ</Type><Retain>file.dat</Retain></Var>"),
        of_xml(MOVE.replace("v20perc", "vmax")),
        of_xml(MOVE.replace("tool0", "")),
        of_xml(
            JOINT.format(as_="", to="p", more=""),
            declared=f"<Var><Name>p</Name><Type>POINTJ</Type><InitValue>{HOME_POINT[:-1]},99)</InitValue></Var>",
        ),
    ],
)
def test_what_is_not_read_of_the_controllers_xml_is_named(tmp_path, text):
    assert not {"program_not_understood", "may_move"} & set(codes(check(tmp_path, of_xml(), "a.XPL")))
    found = check(tmp_path, text, "a.XPL", frames={"tool0": np.eye(4)})
    named = {"program_not_understood", "may_move", "speed_not_given", "frame_not_given", "target_not_given"}
    assert {each.finding.code for each in found.findings if each.level in ("caution", "fail")} & named
    assert found.level in ("caution", "fail")


def test_what_is_switched_off_with_its_bodies_is_not_named(tmp_path):
    loop = '<while disable="true"><cond>io.DIn[1]</cond><pouref>1</pouref></while>'
    found = check(tmp_path, of_xml(MOVE + loop, BELOW), "a.XPL", frames={"tool0": np.eye(4)})
    assert codes(found) == codes(check(tmp_path, of_xml(), "a.XPL", frames={"tool0": np.eye(4)}))


@pytest.mark.parametrize(
    "line",
    [
        "io.MoveTo(near);",
        "log.run(near);",
        "sys.override := 500;",
        "near.q2 := -80;\nMJOINT(near, v20perc, fine, tool0);",
        "Near := home;\nMJOINT(near, v20perc, fine, tool0);",
        "MJOINT(POINTJ(-7 MOD 3,-10,-10,0,-70,0), v20perc, fine, tool0);",
        "MJOINT(POINTJ(\uff11,-10,-10,0,-70,0), v20perc, fine, tool0);",
        "fidbus.rw[3] := 0;\nIF fidbus.rw[3] = 1 THEN home.j1 := 500; END_IF;",
    ],
)
def test_what_no_source_tells_of_rpl_is_no_pass(tmp_path, line):
    points = f"Routine Var POINTJ {{}} := {HOME_POINT};\n"
    (tmp_path / "a.var").write_text(points.format("near") + points.format("home"), encoding="utf-8")
    text = "{}\nMJOINT(home, v20perc, fine, tool0);\n"
    plain, found = (check(tmp_path, text.format(each), "a.pgm", frames={"tool0": np.eye(4)}) for each in ("", line))
    worse = {"program_not_understood", "may_move", "target_not_given", "above_limit"}
    assert not worse & set(codes(plain))
    assert worse & set(codes(found))
    assert found.level in ("caution", "fail")


@pytest.mark.parametrize(("angle", "said", "same"), [(0, 0, True), (90, 90, True), (90, 0, False), (180, -90, False)])
def test_gravity_is_held_against_how_the_robot_file_mounts_the_arm(tmp_path, angle, said, same):
    base = np.eye(4)
    base[:3, :3] = Rotation.from_euler("x", angle, degrees=True).as_matrix()
    up = [0.0, *(9.82 * each for each in (float(np.sin(np.radians(said))), float(np.cos(np.radians(said)))))]
    program = written(tmp_path, f"set_gravity({up})\nmovej({NEAR_TEXT})\n")
    found = check_program(program, ROBOT.replace(base=base), CheckOptions(start=HOME, measures=False))
    assert codes(found) == ({} if same else {"program_not_understood": [1]})


@pytest.mark.parametrize("name", ["TOOL", "BASE"])
def test_a_number_of_a_tool_or_base_that_sets_no_frame_is_named(tmp_path, name):
    lines = f"$VEL_AXIS[1]=10\n$ACT_{name}=2\nPTP {axes(NEAR)}"
    assert codes(check(tmp_path, krl(lines), "a.src")).get("program_not_understood") == [3]
    far = f"${name}=$NULLFRAME\n" + "$OV_PRO=50\n" * 4 + lines
    assert "program_not_understood" in codes(check(tmp_path, krl(far), "a.src"))
    lines = lines.replace("PTP", f"${name}=$NULLFRAME\nPTP")
    assert "program_not_understood" not in codes(check(tmp_path, krl(lines), "a.src"))


def test_whether_a_nested_function_shares_a_variable_of_a_routine_that_the_file_calls_is_not_settled(tmp_path):
    """The manual: on the first level of a program variables are global; a file's own level is no routine's."""
    nested = f"def Main():\n  y = {NEAR_TEXT}\n  def other():\n    y = {FAR_TEXT}\n  end\n  other()\n  movej(y)\nend\n"
    found = check(tmp_path, nested + "Main()\n")
    assert codes(found) == {"program_not_understood": [4]}
    assert found.level == "caution"
    for settled in (nested, f"y = {HOME_TEXT}\n{nested}Main()\n", nested.replace("    y", "    local y") + "Main()\n"):
        assert codes(check(tmp_path, settled)) == {}
    (motion,) = motions(tmp_path, nested)
    np.testing.assert_allclose(motion.target.joints, FAR, atol=1e-8)


@pytest.mark.parametrize("lines", ["$TOOL=TOOL_DATA[1]\n$ACT_TOOL=2", "$BASE=$NULLFRAME\n$ACT_BASE=3"])
def test_a_number_beside_the_frame_of_another_is_named(tmp_path, lines):
    found = check(tmp_path, f"DEF a( )\n{FRAMES}{lines}\nPTP {axes(NEAR)}\nEND\n", "a.src")
    assert found.level == "caution"
    assert "program_not_understood" in codes(found)


@pytest.mark.parametrize("line", ["turn=500", "$TOOL={X 0,Y 0,Z 900,A 0,B 0,C 0}"])
def test_what_a_trigger_sets_is_not_known_after_it(tmp_path, line):
    body = f"DECL REAL turn\nturn=0\n{FRAMES}PTP {axes(NEAR)}\nTRIGGER WHEN DISTANCE=0 DELAY=0 DO {line}"
    body += "\nPTP_REL {A1 1}\nPTP_REL {A1 turn}\nLIN_REL {Z 1} #TOOL"
    found = check(tmp_path, f"DEF a( )\n{body}\nEND\n", "a.src")
    assert found.level == "fail"
    assert {"target_not_given", "frame_not_given"} & codes(found).keys()


def test_a_variable_that_an_interrupt_sets_itself_is_named(tmp_path):
    body = f"DECL INT hit\nINTERRUPT DECL 4 WHEN $IN[1] DO hit=3\nPTP {axes(NEAR)}"
    assert codes(check(tmp_path, f"DEF a( )\n{body}\nEND\n", "a.src"))["program_not_understood"] == [3]


def test_a_variable_of_a_nested_function_is_not_global_however_the_program_begins(tmp_path):
    inner = "def inner():\ny = 3\nend\n"
    text = f"def main():\ndef outer():\ny = 0\n{inner}inner()\nmovej([y, 0, 0, 0, -1, 0])\nend\nouter()\nend\n"
    assert codes(check(tmp_path, text))["program_not_understood"] == [5]
    shared = f"def main():\ny = 0\n{inner}inner()\nend\n"
    assert "program_not_understood" not in codes(check(tmp_path, shared))
