"""Programs of which something is not looked at: it is named, and no program passes for it.

Poses and joints that are expected are those of the manuals' definitions, worked out here with rotation matrices.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from er3a.collision.along import clearance
from er3a.collision.bodies import Bodies
from er3a.collision.scene import Mesh, Plane, Scene, Sphere
from er3a.errors import InputError
from er3a.files.scene_file import load_scene
from er3a.geometry.transforms import transform
from er3a.kinematics.forward import forward
from er3a.pipeline.messages.programs import remedy_at, say
from er3a.program_check.check_program import CheckOptions, check_program
from er3a.programs.csv_program import write_csv
from er3a.programs.execution import RunLimits
from er3a.programs.instructions import JointTarget, NamedFrame, UnresolvedTarget, numbers_of
from er3a.programs.languages import files_of
from testing.arms import palletiser
from testing.program_texts import (
    FAR,
    FAR_TEXT,
    FRAMES,
    HOME,
    HOME_TEXT,
    NEAR,
    NEAR_TEXT,
    ROBOT,
    axes,
    check,
    codes,
    krl,
    motions,
    text_of,
    written,
)


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


def test_a_secondary_program_is_not_the_program(tmp_path):
    text = f"sec s():\n  set_digital_out(1, True)\nend\ndef a():\n  movej({NEAR_TEXT})\nend\n"
    assert codes(check(tmp_path, text)) == {}


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
        (last, "caution"),
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


def test_a_tool_is_in_doubt_behind_the_start_of_a_thread_that_sets_it(tmp_path):
    text = (
        "thread T():\n  set_tcp(p[0,0,0.2,0,0,0])\nend\n"
        f"set_tcp(p[0,0,0,0,0,0])\nmovej({HOME_TEXT})\nrun T()\nmovej({NEAR_TEXT})\n"
        f"movel({text_of(forward(ROBOT, HOME))})\n"
    )
    assert codes(check(tmp_path, text))["frames_in_doubt"] == [8]


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
        (7, "caution"),
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
    assert codes(found)["may_move"] == [2]
    assert "moves_beside" not in codes(found)  # which says that its motions were checked
    assert [(each.place.line, each.what) for each in found.not_examined][:1] == [(2, "instruction")]
    assert found.level == "caution"


def test_what_an_interrupt_sets_is_followed_on_both_sides(tmp_path):
    body = f"hit=FALSE\nINTERRUPT DECL 5 WHEN $IN[2] DO note( )\nIF hit THEN\nPTP {{A1 500}}\nENDIF\nPTP {axes(NEAR)}"
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL BOOL hit=FALSE\nENDDAT\n")
    found = check(tmp_path, krl(body, "DEF note( )\nhit=TRUE\nEND\n"), "a.src")
    assert codes(found)["above_limit"] == [5]


@pytest.mark.parametrize(
    ("start", "more"),
    [
        ("INTERRUPT DECL 4 WHEN $IN[1] DO count(I)", "DEF count(K:OUT)\nINT K\nK=K+1\nEND\n"),
        ("TRIGGER WHEN DISTANCE=1 DELAY=0 DO count(I) PRIO=-1", "DEF count(K)\nINT K\nK=K+1\nEND\n"),
        ("INTERRUPT DECL 4 WHEN $IN[1] DO count(A[])", "DEF count(K[]:OUT)\nINT K[]\nK[1]=30\nEND\n"),
        (
            "outer(I)",
            "DEF outer(N:OUT)\nINT N\nINTERRUPT DECL 4 WHEN $IN[1] DO count(N)\nINTERRUPT ON 4\nEND\n"
            "DEF count(K:OUT)\nINT K\nK=K+1\nEND\n",
        ),
        ("ANIN ON I=1.0*$ANIN[1]\nI=3\nA[1]=3", ""),
    ],
)
@pytest.mark.parametrize("of_data", [True, False])
def test_what_an_interrupt_or_trigger_gets_by_reference_and_changes_has_no_value(tmp_path, start, more, of_data):
    declared = "DECL INT I=3\nDECL INT A[2]\nA[1]=3\n"
    (tmp_path / "a.dat").write_text(f"DEFDAT a\n{declared if of_data else ''}ENDDAT\n")
    own = "" if of_data else "DECL INT I,A[2]\nI=3\nA[1]=3\n"
    axis = "A[1]" if "A[]" in start else "I"
    body = f"{own}PTP {axes(HOME)}\n{start}\nWAIT SEC 1\nPTP {{A1 {axis}}}"
    assert isinstance(motions(tmp_path, krl(body, more), "a.src")[-1].target, UnresolvedTarget)


def test_a_routines_own_variable_is_not_that_of_its_name_that_an_interrupt_changes(tmp_path):
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL INT I=1\nENDDAT\n")
    more = "DEF count(K:OUT)\nINT K\nK=K+1\nEND\nDEF sub( )\nINT I\nFOR I=1 TO 2\nPTP {A1 I}\nENDFOR\nEND\n"
    body = f"PTP {axes(HOME)}\nINTERRUPT DECL 4 WHEN $IN[1] DO count(I)\nsub( )"
    found = motions(tmp_path, krl(body, more), "a.src")[1:]
    np.testing.assert_allclose([np.degrees(each.target.joints[0]) for each in found], [1, 2])


def test_what_an_interrupt_only_reads_keeps_its_value(tmp_path):
    more = "DEF show(K)\nINT K\n$OUT[1]=K>2\nEND\n"
    body = f"DECL INT I\nI=3\nPTP {axes(HOME)}\nINTERRUPT DECL 4 WHEN $IN[1] DO show(I)\nPTP {{A1 I}}"
    assert isinstance(motions(tmp_path, krl(body, more), "a.src")[-1].target, JointTarget)


@pytest.mark.parametrize("own", ["DECL INT I\n", ""])
def test_an_interrupt_gets_the_value_of_the_time_at_which_it_comes(tmp_path, own):
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL INT I=1\nENDDAT\n")
    body = f"{own}I=1\nINTERRUPT DECL 4 WHEN $IN[1] DO go(I,5)\nPTP {axes(HOME)}\nI=3"
    more = "DEF go(K:IN,N:IN)\nINT K,N\nPTP {A1 N,A2 -10,A3 -10,A4 0,A5 -70,A6 0}\nPTP {A1 K}\nEND\n"
    found = motions(tmp_path, krl(body, more), "a.src")
    assert sum(isinstance(each.target, UnresolvedTarget) for each in found) == 1


def test_an_interrupt_that_sets_a_frame_is_named_and_leaves_the_programs_own_frames(tmp_path):
    body = f"{FRAMES}INTERRUPT DECL 4 WHEN $IN[1] DO shift( )\nPTP {axes(NEAR)}\nLIN_REL {{Z 5}}"
    found = check(tmp_path, krl(body, "DEF shift( )\n$BASE={X 0,Y 0,Z 10,A 0,B 0,C 0}\nEND\n"), "a.src")
    assert codes(found) == {"moves_beside": [4], "speed_not_given": [5, 6], "frames_in_doubt": [6]}
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


@pytest.mark.parametrize("line", ["x = l.pop() + 1", "if l.pop() > 5:\n  x = 1\nend", "textmsg(l.pop())"])
def test_a_list_that_a_method_within_an_expression_changes_is_not_the_old_one(tmp_path, line):
    text = f"l = [1,2,3]\n{line}\nif length(l) == 3:\n  movej({NEAR_TEXT})\nend\nmovej({HOME_TEXT})\n"
    assert "both_sides_checked" in codes(check(tmp_path, text))


@pytest.mark.parametrize(
    ("condition", "both"),
    [
        (f"get_actual_joint_positions() == {HOME_TEXT}", True),
        (f"get_actual_joint_positions() == {NEAR_TEXT}", False),
        (f"get_target_joint_positions() == {HOME_TEXT}", False),
        ("[read_input_float_register(0), 1] == [2, 1]", True),
        ("[read_input_float_register(0), 1] == [2, 3]", False),
        ("[1, 2] == [1, 2, 3]", False),
        ("[True] == [1]", True),
        ("True == 1", True),
        ("1 == 1.0", False),
        (f"get_inverse_kin(get_actual_tool_flange_pose()) == {HOME_TEXT}", True),
    ],
)
def test_lists_are_equal_only_as_far_as_their_parts_are_known_to_be(tmp_path, condition, both):
    text = f"movej({HOME_TEXT})\nif not {condition}:\n  movej({NEAR_TEXT})\nend\nmovej({HOME_TEXT})\n"
    assert ("both_sides_checked" in codes(check(tmp_path, text))) == both


@pytest.mark.parametrize("settings", ["a=1, v=0.1, v=0.5", "v=0.1, v=x", "r=0, v=0.1, r=0.1"])
def test_what_is_given_twice_by_name_is_not_understood(tmp_path, settings):
    found = check(tmp_path, f"x = 0.5\nmovej({HOME_TEXT}, {settings})\nmovej({NEAR_TEXT})\n")
    assert codes(found)["may_move"] == [2]


# what touches first is named first


TABLE = Scene("table", (Plane("table", np.array([0.0, 0.0, 1.0]), 0.25),))


def test_pairs_of_bodies_are_named_in_the_order_in_which_they_touch(tmp_path):
    down = np.radians([0.0, -123.0, 56.0, 0.0, -70.0, 0.0])
    found = check(tmp_path, f"movej({text_of_joints(down)})\n", measures=True, scene=TABLE)
    (collision,) = (each for each in found.findings if each.finding.code == "motion_collides")
    (motion,) = found.motions.values()
    bodies = Bodies(ROBOT.replace(tool=motion.placed.arm.tool), TABLE)
    t = np.linspace(0, motion.way.law.duration, 4001)
    distances = np.array([bodies.distances(q, np.arange(len(bodies.pairs))) for q in motion.way.joints(t)])
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


def test_what_a_trigger_sets_may_come_after_a_later_line(tmp_path):
    body = f"DECL INT N\nTRIGGER WHEN DISTANCE=1 DELAY=0 DO N=40\nPTP {axes(NEAR)}\nN=5\nPTP {{A1 N}}"
    assert "target_not_given" in codes(check(tmp_path, krl(body), "a.src"))


def test_a_variable_that_an_interrupt_sets_itself_is_named(tmp_path):
    body = f"DECL INT hit\nINTERRUPT DECL 4 WHEN $IN[1] DO hit=3\nPTP {axes(NEAR)}"
    assert codes(check(tmp_path, f"DEF a( )\n{body}\nEND\n", "a.src"))["program_not_understood"] == [3]


def test_a_variable_of_a_nested_function_is_not_global_however_the_program_begins(tmp_path):
    inner = "def inner():\ny = 3\nend\n"
    text = f"def main():\ndef outer():\ny = 0\n{inner}inner()\nmovej([y, 0, 0, 0, -1, 0])\nend\nouter()\nend\n"
    assert codes(check(tmp_path, text))["program_not_understood"] == [5]
    shared = f"def main():\ny = 0\n{inner}inner()\nend\n"
    assert "program_not_understood" not in codes(check(tmp_path, shared))


def changed(lines):
    """A URScript that goes on with these after a joint move in line 2."""
    return "\n  ".join(["def a():", "movej([0, 0, 0, 0, -1, 0])", *lines]) + "\nend\n"


@pytest.mark.parametrize(
    "lines",
    [
        ["p = get_actual_tcp_pose()", "p[6] = p[2] + 0.03", "movel(p)"],
        ["q = get_actual_joint_positions()", "q[6] = 0.3", "movej(q)"],
        ["q = get_actual_joint_positions()", "q[-1] = 0.3", "movej(q)"],
        ["q = get_actual_joint_positions()", "q[0.6] = 0.3", "movej(q)"],
        ["x = [0.1, 0.7]", "movej([x[0.9], 0, 0, 0, -1, 0])"],
    ],
)
def test_a_list_whose_changed_element_is_not_settled_is_no_target(tmp_path, lines):
    checked = check(tmp_path, changed(lines), "a.script")
    assert [(each.line, each.level) for each in checked.verdicts if each.line == 2 + len(lines)] == [
        (2 + len(lines), "fail")
    ]
    assert "target_not_given" in {each.finding.code for each in checked.findings}


def test_an_element_of_a_variable_p_is_no_pose_of_one_number(tmp_path):
    """As in programs that run: a pose has six numbers."""
    lines = ["p = get_actual_tcp_pose()", "p[2] = p[2] + 0.03", "movel(p)", "movel(p[0.3, 0.1])"]
    checked = check(tmp_path, changed(lines), "a.script")
    first, raised, _ = (each.instruction for each in checked.execution.steps)
    moved = raised.target.pose[:3, 3] - forward(ROBOT, first.target.joints)[:3, 3]
    assert moved == pytest.approx([0, 0, 0.03])
    assert [(each.line, each.level) for each in checked.verdicts][-1] == (6, "fail")


@pytest.mark.parametrize("line", ["get_target() = 0.3", "[0.1, 0.2] = 0.3", "p[0.3, 0.1, 0.4, 0, 3, 0] = 0.3"])
def test_an_assignment_to_no_variable_is_named(tmp_path, line):
    checked = check(tmp_path, changed([line, "movej([0.1, 0, 0, 0, -1, 0])"]), "a.script")
    assert checked.level == "caution"
    assert 3 in {each.place.line for each in checked.findings if each.level == "caution"}


# What an instruction that is not understood may have set


RAPID_MOVE = "MoveAbsJ [[10,-15,-5,5,-60,10],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;"
LINE = "LIN {X 560,Y 0,Z 500,A 0,B 90,C 0}"
ZERO = "{X 0,Y 0,Z 0,A 0,B 0,C 0}"


@pytest.mark.parametrize(
    ("between", "lines"),
    [
        ("MSGNOTIFY(1)", []),
        ("elsewhere()", [6]),
        ("IF elsewhere() THEN\nENDIF", [7]),
        (f"elsewhere()\n$TOOL={ZERO}", [7]),
        (f"elsewhere()\n$TOOL={ZERO}\n$BASE={ZERO}", []),
        ("elsewhere()\nBAS(#TOOL,0)\nBAS(#BASE,0)", []),
        (f"elsewhere()\n$TOOL={ZERO}\n$BASE.Z=0", [8]),
        (f"elsewhere()\n$TOOL={ZERO}\n$BASE=$BASE:{ZERO}", [8]),
        ("$ACT_TOOL=2", [6]),
        (f"$ACT_TOOL=2\n$TOOL={ZERO}", []),
        (f"$CORR_T={ZERO}", [6]),
        ("$TCP_IPO=FALSE", [6]),
        ("$TCP_IPO=FALSE\n$TCP_IPO=TRUE", []),
        ("$FILTER=4", []),
        ("$LOAD_A3={M 8.0}", []),
        ("$ACT_EX_AX=-1", []),
        ("$ACT_EX_AX=2", [6]),
        ("$JOINT_OFFSET[1]=0", []),
        ("$JOINT_OFFSET[1]=5", [6]),
        (f"{LINE}\nFOR I=1 TO 2\n{LINE}\nelsewhere()\nENDFOR\nBAS(#TOOL,0)\nBAS(#BASE,0)", [6]),
    ],
)
def test_poses_after_what_may_have_set_tool_or_base_are_no_pass(tmp_path, between, lines):
    """The routine is elsewhere; a motion to joint angles rests on no frame."""
    found = check(tmp_path, krl(f"{FRAMES}{between}\nPTP {axes(NEAR)}\n{LINE}"), "a.src")
    assert sorted(set(codes(found).get("frames_in_doubt", []))) == lines


def test_a_tool_of_urscript_is_in_doubt_after_an_unknown_function_until_it_is_set(tmp_path):
    moves = f"movej({NEAR_TEXT})\nmovel(p[0.5,0,0.4,0,3.14,0])\n"
    tool = "set_tcp(p[0,0,0.1,0,0,0])\n"
    assert codes(check(tmp_path, f"{tool}elsewhere()\n{moves}"))["frames_in_doubt"] == [4]
    assert "frames_in_doubt" not in codes(check(tmp_path, f"elsewhere()\n{tool}{moves}"))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.src", krl(f"{FRAMES}elsewhere()\nPTP {axes(NEAR)}")),
        ("a.src", krl(f"{FRAMES}$ACT_TOOL=2\nPTP {axes(NEAR)}")),
        ("a.script", f"\n\n\nelsewhere()\nmovej({NEAR_TEXT})\n"),
        ("a.mod", f"MODULE a\nPROC main()\n\nSingArea \\Wrist;\n{RAPID_MOVE}\nENDPROC\nENDMODULE\n"),
    ],
)
def test_what_an_instruction_does_that_is_not_understood_or_simulated_is_listed(tmp_path, name, text):
    found = check(tmp_path, text, name)
    assert (4, "instruction") in [(each.place.line, each.what) for each in found.not_examined]
    assert len(found.verdicts) == 1


@pytest.mark.parametrize(
    ("file", "given", "code"),
    [
        ("a.script", "movej([0.1,0,0,0,0,0], v=read_input_float_register(1))", "speed_not_given"),
        ("a.script", "movej([0.1,0,0,0,0,0], t=read_input_float_register(1))", "speed_not_given"),
        ("a.script", "movej([0.1,0,0,0,0,0], v=0)", "speed_not_given"),
        ("a.script", "movej([0.1,0,0,0,0,0], a=read_input_float_register(1))", "acceleration_not_known"),
        ("a.src", "BAS(#VEL_PTP,$ANIN[1])", "speed_not_given"),
        ("a.src", "$VEL_AXIS[3]=$ANIN[1]", "speed_not_given"),
        ("a.src", "$VEL_AXIS[3]=150", "more_than_full_speed"),
        ("a.src", "$ACC_AXIS[3]=$ANIN[1]", "acceleration_not_known"),
        ("a.mod", "v200\\V:=GInput(gi1)", "speed_not_given"),
        ("a.mod", "v200\\T:=GInput(gi1)", "speed_not_given"),
        ("a.mod", "vUnheardOf", "speed_not_given"),
    ],
)
def test_a_speed_or_an_acceleration_that_is_given_and_not_known_is_a_caution(tmp_path, file, given, code):
    none = "[9E9,9E9,9E9,9E9,9E9,9E9]"
    text = {
        "a.script": f"def p():\n  {given}\nend\n",
        "a.src": krl(f"{given}\nPTP {axes(NEAR)}"),
        "a.mod": f"MODULE a\nPROC main()\nMoveAbsJ [[5,0,0,0,20,0],{none}],{given},fine,tool0;\nENDPROC\nENDMODULE\n",
    }[file]
    found = check(tmp_path, text, file)
    assert [each.level for each in found.findings if each.finding.code == code] == ["caution"]


def test_a_column_of_a_table_that_nobody_reads_is_named(tmp_path):
    found = check(tmp_path, "t_s,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,gripper\n0,0,0,0,0,20,0,1\n", "a.csv")
    assert [
        (each.level, each.finding.text) for each in found.findings if each.finding.code == "program_not_understood"
    ] == [("caution", "the column gripper")]


@pytest.mark.parametrize("scene", [None, "table_and_post"])
def test_an_arm_that_only_stands_is_examined_where_it_stands(tmp_path, scene):
    """A program of one move to where the arm is already, inside the post."""
    inside = np.radians([70, -24.84, -21.5, 0, -43.65, 25])
    options = {"start": inside, "measures": True} | (
        {"scene": load_scene(f"data/scenes/{scene}.yaml")} if scene else {}
    )
    found = check(tmp_path, krl(f"PTP {axes(inside)}"), "a.src", **options)
    hits = [each.finding for each in found.findings if each.finding.code == "motion_collides"]
    assert bool(hits) == bool(scene)
    for hit in hits:
        assert {each.pair.names: each.at_target for each in hit.touches} == {
            ("link_4", "post"): True,
            ("link_6", "post"): True,
        }
        moved = check(tmp_path, krl(f"PTP {axes(inside)}"), "a.src", **options | {"start": inside * [0, 1, 1, 1, 1, 1]})
        (coming,) = [each.finding for each in moved.findings if each.finding.code == "motion_collides"]
        deepest = [max(each.depth_mm for each in found.touches) for found in (hit, coming)]
        assert 20 < deepest[0] <= deepest[1] + 0.1


@pytest.mark.parametrize("target", [[0, 0, 0, 0, -112, 0], [0, 0, 0, 0, -30, 0]])
def test_a_start_beyond_the_limits_is_named(tmp_path, target):
    start = np.radians([0, 0, 0, 0, -112, 0])
    found = check(tmp_path, krl(f"PTP {axes(np.radians(target))}"), "a.src", start=start)
    assert codes(found)["below_limit"] == [2]
    assert found.level == "fail"


@pytest.mark.parametrize(("margin", "level"), [(0.0, "fail"), (0.004, "fail"), (0.03, "caution")])
def test_an_overlap_by_less_than_a_shape_is_larger_than_its_mesh_is_no_contact_for_sure(tmp_path, margin, level):
    """A block whose mesh comes within 20 mm of the arm, or, with other margins, 5 mm into it."""
    q = np.zeros((1, 6))
    corners = np.array([(x, y, z) for x in (0, 0.2) for y in (-0.1, 0.1) for z in (-0.1, 0.1)])

    def block(x: float, margin: float) -> Scene:
        return Scene("block", (Mesh("block", transform(np.array([x, 0, 0.6]), np.zeros(3)), (corners,), margin),))

    near = brentq(lambda x: clearance(ROBOT, q, block(x, 0.0)).distance[0] - 1e-3, 0.0, 3.0)
    scene = block(near + (0.019 if level == "caution" else -0.006), margin)
    found = check(tmp_path, krl("PTP {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}"), "a.src", start=q[0], scene=scene, measures=True)
    ((said, hit),) = [(each.level, each.finding) for each in found.findings if each.finding.code == "motion_collides"]
    assert said == level
    touches = [each for each in hit.touches if "block" in each.pair.names]
    assert {each.enlarged_mm for each in touches} == {1000 * margin}
    assert ("larger than the meshes" in say(hit)) == bool(margin)


# What a branch that moves nothing holds


SLOW = "$VEL.CP=0.1\n$ACC.CP=0.2\n$VEL_AXIS[1]=10\n"
DOWN = "A 0,B 180,C 0"
AT_START = f"{FRAMES}{SLOW}PTP {axes(HOME)}\n"


@pytest.mark.parametrize(
    ("inside", "more", "code"),
    [
        ("$CORR_T={X 0,Y 0,Z 50,A 0,B 0,C 0}", "", "program_not_understood"),
        ("$ROBROOT={X 0,Y 0,Z 50,A 0,B 0,C 0}", "", "program_not_understood"),
        ("$ACT_TOOL=3", "", "program_not_understood"),
        ("$ORI_TYPE=#JOINT", "", "program_not_understood"),
        ("shift( )", "DEF shift( )\n$CORR_T={X 0,Y 0,Z 50,A 0,B 0,C 0}\nEND\n", "program_not_understood"),
        ("INTERRUPT DECL 5 WHEN $IN[2] DO elsewhere( )", "", "may_move"),
        ("TRIGGER WHEN DISTANCE=0 DELAY=0 DO elsewhere( ) PRIO=-1", "", "may_move"),
        (
            "INTERRUPT DECL 5 WHEN $IN[2] DO lift( )",
            "DEF lift( )\n$BASE={X 0,Y 0,Z 100,A 0,B 0,C 0}\nEND\n",
            "moves_beside",
        ),
        (
            "INTERRUPT DECL 5 WHEN $IN[2] DO lift( )",
            "DEF lift( )\n$CORR_T={X 0,Y 0,Z 100,A 0,B 0,C 0}\nEND\n",
            "moves_beside",
        ),
    ],
)
@pytest.mark.parametrize("branch", [True, False])
def test_what_is_named_by_itself_is_named_in_a_branch_that_moves_nothing(tmp_path, inside, more, code, branch):
    placed = f"IF $IN[1] THEN\n{inside}\nENDIF" if branch else inside
    found = check(tmp_path, krl(f"{AT_START}{placed}\nLIN {{X 400,Y 0,Z 300,{DOWN}}}", more), "a.src")
    assert code in codes(found)
    assert found.level == "caution"


def test_a_thread_or_trap_that_nobody_knows_is_named_in_a_branch_that_moves_nothing(tmp_path):
    text = (
        f"def a():\n  movej({HOME_TEXT})\n  if get_digital_in(1):\n    run flee()\n  end\n  movej({NEAR_TEXT})\nend\n"
    )
    assert codes(check(tmp_path, text))["may_move"] == [4]
    joints = "[[0,-10,-10,0,-70,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    text = f"MODULE a\nVAR intnum i;\nPROC main()\nMoveAbsJ {joints},v50,fine,tool0;\nIF di1=1 THEN\n"
    text += f"CONNECT i WITH flee;\nENDIF\nMoveAbsJ {joints},v50,fine,tool0;\nENDPROC\nENDMODULE\n"
    assert codes(check(tmp_path, text, "a.mod"))["may_move"] == [6]


def test_an_output_and_a_wait_in_a_branch_are_still_passed_by(tmp_path):
    inside = "$OUT[1]=TRUE\nWAIT SEC 1\n$OV_PRO=50\nINTERRUPT DECL 5 WHEN $IN[2] DO light( )"
    body = f"{AT_START}IF $IN[1] THEN\n{inside}\nENDIF\nPTP {axes(NEAR)}"
    found = check(tmp_path, krl(body, "DEF light( )\n$OUT[3]=TRUE\nEND\n"), "a.src")
    assert found.level in ("pass", "note")
    assert len(found.execution.endings) == 1


def test_ways_that_differ_in_how_the_tool_turns_are_followed_apart(tmp_path):
    line = f"LIN {{X 400,Y 0,Z 300,{DOWN}}}"
    sides = f"IF $IN[1] THEN\n{line}\n$ORI_TYPE=#CONSTANT\nELSE\n{line}\n$ORI_TYPE=#VAR\nENDIF"
    body = f"{AT_START}{sides}\nLIN {{X 400,Y 50,Z 300,A 30,B 180,C 0}}"
    lines = [each.target.pose for each in motions(tmp_path, krl(body), "a.src") if each.kind == "line"]
    turns = [round(numbers_of(pose, "kuka")[3]) % 180 for pose in lines if pose[1, 3] > 0.01]
    assert sorted(turns) == [0, 30]


def test_ways_that_differ_in_data_read_by_number_are_followed_apart(tmp_path):
    sides = "IF $IN[1] THEN\nBASE_DATA[1]={X 0,Y 0,Z 100,A 0,B 0,C 0}\n$OUT[1]=TRUE\nENDIF"
    body = f"BASE_DATA[1]=$NULLFRAME\n{AT_START}{sides}\nBAS(#BASE,1)\nLIN {{X 400,Y 0,Z 300,{DOWN}}}"
    found = [each.base.pose[2, 3] for each in motions(tmp_path, krl(body), "a.src") if each.kind == "line"]
    assert sorted(found) == [0.0, 0.1]


# Values that change by themselves, and what holds for one motion


@pytest.mark.parametrize(
    ("before", "asked"),
    [
        ("$TIMER[1]=0\n$TIMER_STOP[1]=FALSE", "$TIMER[1]>100"),
        ("$FLAG[1]=FALSE\n$CYCFLAG[1]=$FLAG[1]\n$FLAG[1]=TRUE", "$CYCFLAG[1]"),
        ("$OV_PRO=50", "$OV_PRO>60"),
    ],
)
def test_what_runs_on_has_no_value_after_it_is_set(tmp_path, before, asked):
    body = f"REAL X\nX=5\n{before}\nPTP {axes(HOME)}\nIF {asked} THEN\nX=60\nENDIF\nPTP {{A1 X}}"
    found = [np.degrees(each.target.joints[0]) for each in motions(tmp_path, krl(body), "a.src")]
    np.testing.assert_allclose(sorted(found), [0, 5, 60])


@pytest.mark.parametrize("again", ["", "X=0\n"])
def test_a_variable_that_an_input_sets_again_and_again_has_no_value(tmp_path, again):
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL REAL X=0\nENDDAT\n")
    body = f"SIGNAL S1 $ANIN[1]\nANIN ON X=20*S1+0\n{again}PTP {axes(HOME)}\nPTP {{A1 X}}"
    assert isinstance(motions(tmp_path, krl(body), "a.src")[-1].target, UnresolvedTarget)


def test_the_time_of_a_part_of_a_spline_is_named(tmp_path):
    parts = f"TIME_BLOCK START\nSLIN {{X 400,Y 100,Z 300,{DOWN}}}\nTIME_BLOCK PART=100\nTIME_BLOCK END=0.05"
    body = f"{AT_START}LIN {{X 400,Y 0,Z 300,{DOWN}}}\nSPLINE\n{parts}\nENDSPLINE"
    found = codes(check(tmp_path, krl(body), "a.src"))
    assert found["program_not_understood"] == [13]


def test_a_setting_of_one_motion_is_undone_after_it(tmp_path):
    first, turned = f"{{X 400,Y 0,Z 300,{DOWN}}}", "{X 400,Y 50,Z 300,A 30,B 180,C 0}"
    body = f"{AT_START}LIN {first}\nSLIN {turned} WITH $ORI_TYPE=#CONSTANT\nLIN {turned}"
    *_, kept, then = motions(tmp_path, krl(body), "a.src")
    np.testing.assert_allclose(then.target.pose[:3, :3], transform(np.zeros(3), np.radians([0, 180, 30]))[:3, :3])
    assert np.abs(kept.target.pose - then.target.pose).max() > 0.1


def test_a_doubt_that_one_motion_does_without_comes_back_after_it(tmp_path):
    line = f"{{X 400,Y 0,Z 300,{DOWN}}}"
    body = f"{AT_START}unknown( )\nSLIN {line} WITH $TOOL=$NULLFRAME, $BASE=$NULLFRAME\nLIN {line}"
    *_, own, then = motions(tmp_path, krl(body), "a.src")
    assert (own.doubt, bool(then.doubt)) == ("", True)


@pytest.mark.parametrize("kind", ["#JOINT", "#IGNORE", "#CONSTANT", "#VAR"])
@pytest.mark.parametrize("by_data", [True, False])
def test_how_one_motion_turns_the_tool_is_followed_or_named(tmp_path, kind, by_data):
    data = f"{{VEL 0.1,ACC 100,APO_DIST 0,APO_FAC 50,ORI_TYP {kind}}}"
    setting = "$ORI_TYPE=SORI_TYP(L1)" if by_data else f"$ORI_TYPE={kind}"
    (tmp_path / "a.dat").write_text(f"DEFDAT a\nDECL LDAT L1={data}\nENDDAT\n")
    body = f"{AT_START}LIN {{X 400,Y 0,Z 300,{DOWN}}}\nSLIN {{X 400,Y 50,Z 300,A 30,B 180,C 0}} WITH {setting}"
    found = check(tmp_path, krl(body), "a.src")
    assert ("turn_not_followed" in codes(found)) == (kind in ("#JOINT", "#IGNORE"))
    (*_, last) = (step.instruction for step in found.execution.steps)
    before = transform(np.zeros(3), np.radians([0, 180, 0]))[:3, :3]
    assert (np.abs(last.target.pose[:3, :3] - before).max() < 1e-9) == (kind == "#CONSTANT")


@pytest.mark.parametrize("setting", ["$CIRC_TYPE=#PATH", "$CIRC_TYPE=SCIRC_TYP(L1)"])
def test_an_arc_that_turns_along_its_path_is_named(tmp_path, setting):
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL LDAT L1={VEL 0.1,ACC 100,CIRC_TYP #PATH}\nENDDAT\n")
    arc = f"SCIRC {{X 410,Y 10,Z 300,{DOWN}}},{{X 400,Y 20,Z 300,{DOWN}}} WITH {setting}"
    body = f"{AT_START}LIN {{X 400,Y 0,Z 300,{DOWN}}}\n{arc}"
    assert codes(check(tmp_path, krl(body), "a.src"))["turn_not_followed"] == [9]


@pytest.mark.parametrize(
    ("setting", "lines"),
    [
        ("$ORI_TYPE=#JOINT", [11, 12]),
        ("$CIRC_TYPE=#PATH", [12]),
        ("$ORI_TYPE=LDAT_ACT.ORI_TYP", [11, 12]),
        ("LDAT_ACT={VEL 0.1,ACC 100,APO_DIST 0,APO_FAC 50,ORI_TYP #JOINT}\nBAS(#CP_DAT)", [12, 13]),
    ],
)
def test_how_the_tool_turns_leaves_no_doubt_about_frames_and_counts_where_it_matters(tmp_path, setting, lines):
    """Each motion that it concerns is named, and among what was not examined, and a joint motion is none of them."""
    moves = f"LIN {{X 400,Y 0,Z 300,{DOWN}}}\nCIRC {{X 410,Y 10,Z 300,{DOWN}}},{{X 400,Y 20,Z 300,{DOWN}}}"
    found = check(tmp_path, krl(f"{AT_START}{setting}\nPTP {axes(HOME)}\n{moves}\nPTP {axes(NEAR)}"), "a.src")
    assert codes(found)["turn_not_followed"] == [each - 1 for each in lines]
    assert "frames_in_doubt" not in codes(found)
    assert {each - 1 for each in lines} <= {each.place.line for each in found.not_examined}


@pytest.mark.parametrize("name", ["$POS_INT", "$AXIS_INT"])
def test_where_an_interrupt_came_is_not_where_the_arm_is(tmp_path, name):
    body = f"INTERRUPT DECL 5 WHEN $IN[1] DO hit( )\n{AT_START}PTP {axes(NEAR)}\nPTP {name}"
    found = check(tmp_path, krl(body, "DEF hit( )\n$OUT[1]=TRUE\nEND\n"), "a.src")
    assert "target_not_given" in codes(found)


def test_the_way_back_to_where_an_interrupt_came_is_a_way_that_is_not_known(tmp_path):
    more = f"DEF hit( )\nLIN $POS_INT\nPTP {axes(NEAR)}\nEND\n"
    found = check(tmp_path, krl(f"INTERRUPT DECL 5 WHEN $IN[1] DO hit( )\n{AT_START}PTP {axes(NEAR)}", more), "a.src")
    assert found.level == "caution"
    assert "moves_beside" in codes(found)


@pytest.mark.parametrize("start", ["INTERRUPT DECL 5 WHEN $IN[1] DO", "TRIGGER WHEN DISTANCE=0 DELAY=0 DO"])
@pytest.mark.parametrize(
    ("sets", "names", "doubted"),
    [
        ("$BASE={X 0,Y 50,Z 0,A 0,B 0,C 0}", "$BASE", [5]),
        ("$TOOL=$NULLFRAME\n$VEL.CP=1.9", "$TOOL, $VEL", [5]),
        ("$VEL.CP=1.9", "$VEL", []),
    ],
)
def test_a_routine_that_only_sets_what_motions_use_is_named_with_that(tmp_path, start, sets, names, doubted):
    found = check(tmp_path, krl(f"{AT_START}{start} hit( )\n{LINE}", f"DEF hit( )\n{sets}\nEND\n"), "a.src")
    (beside,) = (each for each in found.findings if each.finding.code == "moves_beside")
    assert (beside.finding.kind, beside.finding.names, beside.level) == ("sets", names, "caution")
    lines = [each.place.line for each in found.findings if each.finding.code == "frames_in_doubt"]
    assert lines == [beside.place.line + 1] * bool(doubted)


# One variable under two names


@pytest.mark.parametrize(
    ("inside", "after"),
    [("P=40\nPTP {A1 G}", ""), ("G=40", "PTP {A1 G}"), ("deeper( )\nPTP {A1 P}", ""), ("Q=40\nPTP {A1 P}", "")],
)
def test_a_variable_that_is_changed_under_another_name_has_no_value(tmp_path, inside, after):
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL REAL G=0\nENDDAT\n")
    more = f"DEF sub(P:OUT,Q:OUT)\nREAL P,Q\n{inside}\nEND\nDEF deeper( )\nG=40\nEND\n"
    body = f"PTP {axes(HOME)}\nsub(G,G)\n{after}" if "Q" in inside else f"REAL U\nPTP {axes(HOME)}\nsub(G,U)\n{after}"
    assert isinstance(motions(tmp_path, krl(body, more), "a.src")[-1].target, UnresolvedTarget)


def test_a_variable_that_is_given_twice_may_have_the_name_of_a_parameter(tmp_path):
    more = "DEF sub(P:OUT,Q:OUT)\nREAL P,Q\nQ=40\nPTP {A1 P}\nEND\n"
    found = motions(tmp_path, krl(f"REAL P\nP=0\nPTP {axes(HOME)}\nsub(P,P)\nPTP {{A1 P}}", more), "a.src")
    assert all(isinstance(each.target, UnresolvedTarget) for each in found[1:])


def test_a_variable_that_is_only_read_under_two_names_keeps_its_value(tmp_path):
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL REAL G=30\nENDDAT\n")
    more = "DEF sub(P)\nREAL P,Q\nQ=P+G\nPTP {A1 Q}\nEND\nDEF other(P)\nREAL P\nP=P+1\nEND\n"
    body = f"REAL U\nU=0\nPTP {axes(HOME)}\nsub(G)\nother(U)\nother(G)\nPTP {{A1 G,A2 -10}}"
    found = [np.degrees(each.target.joints[0]) for each in motions(tmp_path, krl(body, more), "a.src")]
    np.testing.assert_allclose(found, [0, 60, 31])


def test_an_element_given_by_reference_is_the_one_that_was_meant_at_the_call(tmp_path):
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL INT I=1\nDECL REAL V[2]\nV[1]=-10\nV[2]=-10\nENDDAT\n")
    more = "DEF sub(P:OUT)\nREAL P\nI=2\nP=40\nEND\n"
    (found,) = motions(tmp_path, krl("sub(V[I])\nPTP {A1 V[1],A2 -10,A3 V[2],A4 0,A5 -70,A6 0}", more), "a.src")
    np.testing.assert_allclose(np.degrees(found.target.joints), [40, -10, -10, 0, -70, 0])


OF_LISTS = (
    "DEF put(Q[]:OUT,N:IN)\nREAL Q[]\nINT N\nQ[N]=44\nEND\n"
    "DEF both(Q[])\nREAL Q[],R[3]\nput(Q[],2)\nQ[2]=Q[2]+1\nR[2]=70\nEND\n"
    "DEFFCT REAL total(W[]:OUT,N:IN)\nREAL W[]\nINT N,K\nREAL S\nS=0\n"
    "FOR K=1 TO N\nS=S+W[K]\nENDFOR\nRETURN(S)\nENDFCT\n"
    "DEF twice(Q[])\nREAL Q[]\nQ[2]=44\nPTP {A1 A[2],A2 A[1]}\nEND\n"
)


@pytest.mark.parametrize("local", [True, False])
@pytest.mark.parametrize(
    ("body", "angles"),
    [
        ("put(A[],2)\nPTP {A1 A[2],A2 A[1]}", (44, -7)),
        ("put(A[],1)\nPTP {A1 A[2],A2 B[2]}", (5, -30)),
        ("PTP {A1 total(A[],2),A2 A[1]}", (-2, -7)),
        ("both(A[])\nPTP {A1 A[2],A2 A[1]}", (45, -7)),
    ],
)
def test_a_list_that_a_routine_gets_keeps_its_elements_but_for_those_that_are_set(tmp_path, local, body, angles):
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL REAL A[3]\nDECL REAL B[3]\nENDDAT\n")
    body = f"{'REAL A[3],B[3]' * local}\nA[1]=-7\nA[2]=5\nB[2]=-30\n{body}"
    (found,) = motions(tmp_path, krl(body, OF_LISTS), "a.src")
    np.testing.assert_allclose(np.degrees(found.target.joints[:2]), angles, atol=1e-6)


def test_a_list_with_two_names_that_is_changed_by_one_of_them_has_no_known_elements(tmp_path):
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL REAL A[3]\nA[1]=-7\nA[2]=5\nENDDAT\n")
    (found,) = motions(tmp_path, krl("twice(A[])", OF_LISTS), "a.src")
    assert isinstance(found.target, UnresolvedTarget)


def test_a_list_given_to_a_routine_that_is_not_known_has_no_known_elements(tmp_path):
    body = "REAL A[3]\nA[2]=5\nput(A[])\nPTP {A1 A[2]}"
    found = motions(tmp_path, krl(body, 'DEF put(Q[])\nREAL Q[]\nSREAD(S[],ST,OFS,"%f",Q[2])\nEND\n'), "a.src")
    assert isinstance(found[0].target, UnresolvedTarget)


def test_an_element_that_a_routines_own_list_never_got_is_not_that_of_the_data(tmp_path):
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL REAL A[3]\nA[2]=5\nENDDAT\n")
    (found,) = motions(tmp_path, krl("sub( )", "DEF sub( )\nREAL A[3]\nPTP {A1 A[2]}\nEND\n"), "a.src")
    assert isinstance(found.target, UnresolvedTarget)


@pytest.mark.parametrize(
    "start",
    ["INTERRUPT DECL 4 WHEN $IN[1]==TRUE DO put(%s)", "TRIGGER WHEN DISTANCE=1 DELAY=0 DO put(%s)", "setup(%s)"],
)
@pytest.mark.parametrize(("given", "element"), [("I", ""), ("A[2]", ""), ("A[]", "[2]")])
@pytest.mark.parametrize("used", ["I", "A[2]", "J"])
def test_what_an_interrupt_gets_by_reference_has_no_value_also_if_it_is_local(tmp_path, start, given, element, used):
    """Also where a routine starts the interrupt with what it got by reference itself."""
    head = f"Q{'[]' * bool(element)}"
    more = f"DEF put({head}:OUT)\nREAL {head}\nQ{element}=44\nEND\n"
    more += f"DEF setup({head}:OUT)\nREAL {head}\nINTERRUPT DECL 4 WHEN $IN[1] DO put({head})\nWAIT SEC 1\nEND\n"
    body = f"REAL I,J,A[3]\nI=5\nJ=5\nA[2]=5\n{start % given}\nPTP {axes(HOME)}\nPTP {{A1 {used}}}"
    found = motions(tmp_path, krl(body, more), "a.src")
    assert isinstance(found[-1].target, UnresolvedTarget) == (given[0] == used[0])


@pytest.mark.parametrize("kind", ["INOUT", "VAR", "PERS"])
def test_a_variable_of_rapid_under_two_names_has_no_value(tmp_path, kind):
    at = "[[g,-10,-10,0,-70,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    text = f"MODULE a\nPERS num g:=0;\nPROC main()\nsub g;\nENDPROC\nPROC sub({kind} num p)\np:=40;\n"
    text += f"MoveAbsJ {at},v50,fine,tool0;\nENDPROC\nENDMODULE\n"
    (found,) = motions(tmp_path, text, "a.mod")
    assert isinstance(found.target, UnresolvedTarget)


def test_data_that_a_procedure_gets_and_names_too_keep_their_value(tmp_path):
    pose = "[[400,0,300],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    data = "PERS tooldata t:=[TRUE,[[0,0,50],[1,0,0,0]],[1,[0,0,10],[1,0,0,0],0,0,0]];"
    text = f"MODULE a\n{data}\nPROC main()\nsub t;\nENDPROC\nPROC sub(PERS tooldata p)\n"
    text += f"MoveL {pose},v50,fine,p;\nMoveL {pose},v50,fine,t;\nENDPROC\nENDMODULE\n"
    assert [each.tool.pose[2, 3] for each in motions(tmp_path, text, "a.mod")] == [0.05, 0.05]


def test_a_stop_within_a_blend_leaves_the_position_unknown(tmp_path):
    lines = "  movel(p[0.4,0,0.3,3.14159265,0,0], a=0.2, v=0.1{})\n  stopl(2)\n"
    text = (
        f"def a():\n  set_tcp(p[0,0,0,0,0,0])\n  movej({HOME_TEXT}, v=0.5)\n{lines}  movej({NEAR_TEXT}, v=0.5)\nend\n"
    )
    assert codes(check(tmp_path, text.format(", r=0.005")))["may_move"] == [5]
    assert not {"may_move", "way_not_known"} & codes(check(tmp_path, text.format(""))).keys()


# Corners


CORNER = {
    "a.src": (
        krl(
            f"{FRAMES}{SLOW}$APO.CDIS=95\nPTP {{A1 -22.9183118,A2 -10,A3 -10,A4 0,A5 -70,A6 0}}\n"
            "LIN {X 400,Y -200,Z 350,A 0,B 0,C 180}\nLIN {X 400,Y 0,Z 350,A 0,B 0,C 180} C_DIS\n%s\n"
            "LIN {X 400,Y 0,Z 150,A 0,B 0,C 180}"
        )
    ),
    "a.script": (
        "def a():\n  set_tcp(p[0,0,0,0,0,0])\n  movej([-0.4,-0.17453293,-0.17453293,0,-1.22173048,0], v=0.5)\n"
        "  movel(p[0.4,-0.2,0.35,3.14159265,0,0], v=0.1)\n  movel(p[0.4,0,0.35,3.14159265,0,0], v=0.1, r=0.095)\n"
        "  %s\n  movel(p[0.4,0,0.15,3.14159265,0,0], v=0.1)\nend\n"
    ),
    "a.mod": (
        "MODULE a\nVAR zonedata zz:=[FALSE,95,95,95,10,95,10];\nPROC main()\nConfL\\Off;\n"
        "MoveAbsJ [[-22.9183118,-10,-10,0,-70,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;\n"
        "MoveL [[400,-200,350],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;\n"
        "MoveL [[400,0,350],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,zz,tool0;\n%s\n"
        "MoveL [[400,0,150],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;\nENDPROC\nENDMODULE\n"
    ),
    "a.pgm": (
        "MJOINT(POINTJ(-22.9183118,-10,-10,0,-70,0),v10perc,fine,tool0);\n"
        "MLIN(POINTC(400,-200,350,0,0,180),v50,fine,tool0);\nMLIN(POINTC(400,0,350,0,0,180),v50,z95,tool0);\n%s\n"
        "MLIN(POINTC(400,0,150,0,0,180),v50,fine,tool0);\n"
    ),
}
"""Round whose corner a small ball stands within the zone: a stop passes it."""


def ball() -> Scene:
    """In the corner's zone, off its lines."""
    at = np.eye(4)
    at[:3, 3] = [0.4, -0.07, 0.28]
    return Scene("ball", (Sphere("ball", at, 0.005),))


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "between", "rounded"),
    [
        *(("a.src", each, True) for each in ("", "CONTINUE\nWAIT FOR $IN[1]", "LIN_REL {X 0} C_DIS")),
        *(
            ("a.src", each, False)
            for each in ("WAIT SEC 0", "WAIT FOR $IN[1]", "HALT", "CONTINUE\n;on\n$OUT[1]=TRUE\nWAIT SEC 0")
        ),
        *(("a.script", each, True) for each in ("", "sleep(0.01)")),
        *(("a.mod", each, True) for each in ("WaitTime 0.1;", "WaitDI di1,1;", "WaitUntil b;", "Break;")),
        *(("a.mod", each, False) for each in ("WaitTime\\InPos,0.1;", "WaitRob\\ZeroSpeed;", "Stop;")),
        *(("a.pgm", each, True) for each in ("", "DWELL(0.1);", "WAIT(io.DIn[1]);")),
    ],
)
def test_a_corner_is_looked_at_unless_the_arm_surely_stops_there(tmp_path, name, between, rounded):
    found = check(tmp_path, CORNER[name] % between, name, scene=ball(), measures=True)
    assert ("zone_collides" in codes(found)) == rounded
    assert "motion_collides" not in codes(found)


@pytest.mark.long
def test_all_of_a_joint_move_within_a_zones_distance_is_looked_at(tmp_path):
    """The elbow comes out straight: the tool hardly moves at the end, so the zone is a quarter of the move."""
    at = np.eye(4)
    at[:3, 3] = [0.3595, 0.0468, 0.5475]
    scene = Scene("ball", (Sphere("ball", at, 0.002),))
    joints = ["{A1 0,A2 0,A3 -43,A4 0,A5 0,A6 0}", "{A1 0,A2 -70,A3 77,A4 0,A5 0,A6 0} C_DIS"]
    joints.append("{A1 80,A2 -70,A3 77,A4 0,A5 0,A6 0}")
    body = f"{FRAMES}{SLOW}$APO.CDIS=50\n" + "\n".join(f"PTP {each}" for each in joints)
    start = np.radians([0, 0, -43, 0, 0, 0])
    found = check(tmp_path, krl(body), "a.src", scene=scene, measures=True, start=start)
    assert codes(found)["zone_collides"] == [9]


@pytest.mark.long
@pytest.mark.parametrize(("share", "told"), [(40, False), (100, True)])
def test_a_corner_of_joint_moves_ends_by_the_share_of_the_next_one(tmp_path, share, told):
    """The ball stands where the corner comes by if the next move gives half of itself, not a fifth."""
    at = np.eye(4)
    at[:3, 3] = [0.253, 0.237, 0.489]
    begin, corner, end = "{A1 -60,A2 -10,A3 -10,A5 -70}", "{A1 60}", "{A2 30,A3 -60}"
    body = f"{FRAMES}{SLOW}$APO.CPTP=40\nPTP {begin}\nPTP {corner} C_PTP\n$APO.CPTP={share}\nPTP {end}"
    options = {"scene": Scene("ball", (Sphere("ball", at, 0.005),)), "measures": True}
    found = check(tmp_path, krl(body), "a.src", start=np.radians([-60, -10, -10, 0, -70, 0]), **options)
    assert ("zone_collides" in codes(found)) == told


@pytest.mark.parametrize(
    ("words", "distance", "told"),
    [("C_PTP", "", True), ("C_PTP", "$APO.CDIS=5\n", False), ("C_PTP C_VEL", "$APO.CDIS=5\n", True)],
)
def test_how_much_of_a_line_a_corner_after_a_joint_move_takes_is_known_or_told(tmp_path, words, distance, told):
    body = f"{AT_START}$APO.CPTP=10\n{distance}PTP {{X 400,Y 0,Z 300,{DOWN}}} {words}\nLIN {{X 400,Y 50,Z 300,{DOWN}}}"
    assert ("zone_without_size" in codes(check(tmp_path, krl(body), "a.src"))) == told


def test_a_wait_after_a_stop_is_no_corner(tmp_path):
    text = (CORNER["a.pgm"] % "DWELL(0.1);").replace("z95", "fine")
    found = check(tmp_path, text, "a.pgm")
    assert not {code for code in codes(found) if code.startswith("zone")}


def test_the_zone_at_the_end_of_a_spline_is_its_last_motions(tmp_path):
    line = f"SLIN {{X 400,Y 50,Z 300,{DOWN}}}"
    body = f"{AT_START}$APO.CDIS=20\nSPLINE\n{line}\nENDSPLINE C_SPL\nLIN {{X 400,Y 50,Z 250,{DOWN}}}"
    found = motions(tmp_path, krl(body), "a.src")
    assert [(each.zone.kind, each.zone.value) for each in found] == [("fine", 0.0), ("distance", 0.02), ("fine", 0.0)]


# Ways that join, and loops


JOINED = f"LIN {{X 400,Y 0,Z 300,{DOWN}}}"
SIDES = [f"PTP {axes(HOME)}\n{JOINED}", f"PTP {{A1 0,A2 -10,A3 -10,A4 -180,A5 70,A6 -180}}\n{JOINED}"]


@pytest.mark.parametrize("order", [1, -1])
def test_a_way_that_joins_with_other_joints_is_checked_on(tmp_path, order):
    first, second = SIDES[::order]
    line = "LIN {X 300,Y 300,Z 300,A 90,B 180,C 0}"
    alone = check(tmp_path, krl(f"{FRAMES}{SLOW}{SIDES[1]}\n{line}"), "a.src")
    assert codes(alone)["below_limit"] == [9]
    both = f"{FRAMES}{SLOW}IF $IN[1] THEN\n{first}\nELSE\n{second}\nENDIF\n{line}"
    found = check(tmp_path, krl(both), "a.src")
    assert found.level == "fail"
    assert codes(found)["below_limit"] == [14]


@pytest.mark.long
def test_the_corner_where_ways_join_is_looked_at(tmp_path):
    near, far = "LIN {X 400,Y -200,Z 350,A 0,B 0,C 180}", "LIN {X 400,Y 0,Z 450,A 0,B 0,C 180}"
    text = CORNER["a.src"] % ""
    corner = next(line for line in text.splitlines() if line.endswith("C_DIS"))
    sides = f"IF $IN[1] THEN\n{far}\n{corner}\nELSE\n{near}\n{corner}\nENDIF"
    text = text.replace(f"{near}\n{corner}\n", f"{sides}\n")
    found = check(tmp_path, text, "a.src", scene=ball(), measures=True)
    assert codes(found)["zone_collides"] == [14]


@pytest.mark.long
def test_the_corner_of_a_loop_that_begins_with_an_output_is_looked_at(tmp_path):
    points = ["LIN {X 400,Y 0,Z 150,A 0,B 0,C 180}", "LIN {X 400,Y -200,Z 350,A 0,B 0,C 180}"]
    corner = "LIN {X 400,Y 0,Z 350,A 0,B 0,C 180}"
    body = f"{FRAMES}{SLOW}$APO.CDIS=95\nPTP {{A1 -22.9183118,A2 -10,A3 -10,A4 0,A5 -70,A6 0}}\n{points[1]}\n"
    body += f"IF $IN[1] THEN\n{corner}\nENDIF\n{corner}\nLOOP\n$OUT[1]=TRUE\n{points[0]}\n{corner}\n{points[1]}\n"
    found = check(tmp_path, krl(f"{body}{corner} C_DIS\nENDLOOP"), "a.src", scene=ball(), measures=True)
    assert codes(found)["zone_collides"] == [19]


def test_the_worst_of_what_rounds_find_at_an_instruction_leads(tmp_path):
    body = f"FOR I=1 TO 2\nPTP {axes(HOME)}\nPTP {axes(NEAR)}\n$VEL_AXIS[1]=$ANIN[1]\nENDFOR"
    found = check(tmp_path, krl(body), "a.src")
    assert found.level == "caution"
    assert {each.level for each in found.findings if each.finding.code == "speed_not_given"} == {"caution"}


# Types


@pytest.mark.parametrize(
    ("body", "more", "wanted"),
    [
        ("FRAME F\nF={X 401,Y 0,Z 300,A 0,B 180,C 0}\nREAL X\nX=F.X/2\nPTP {A1 X}", "", 200.5),
        ("AXIS Q\nQ={A1 5}\nQ.A1=Q.A1/2\nPTP Q", "", 2.5),
        ("AXIS Q\nQ={A1 0}\nQ.A1=5\nQ.A1=Q.A1/2\nPTP Q", "", 2.5),
        ("INT N\nN=2\nREAL X\nX=5/N\nPTP {A1 X}", "", 2.0),
        ("REAL X\nother( )\nX=12.7\nPTP {A1 X}", "DEF other( )\nINT X\nX=1\nEND\n", 12.7),
        ("turn(5)", "DEF turn(R:IN)\nREAL R\nR=R/2\nPTP {A1 R}\nEND\n", 2.5),
        ("turn(12.7)", "DEF turn(N:IN)\nINT N\nPTP {A1 N}\nEND\n", 13.0),
        ("REAL X\nX=half(5)/2\nPTP {A1 X}", "DEFFCT REAL half(N:IN)\nINT N\nRETURN N\nENDFCT\n", 2.5),
    ],
)
def test_numbers_are_of_the_type_that_is_declared(tmp_path, body, more, wanted):
    found = motions(tmp_path, krl(f"PTP {axes(HOME)}\n{body}", more), "a.src")[-1]
    assert np.degrees(found.target.joints[0]) == pytest.approx(wanted)


# What RAPID's handlers, traps and functions change


AT_P = "[[400,0,300],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"


def rapid(body: str, more: str = "", data: str = "") -> str:
    """A module whose main begins at home."""
    head = f"MODULE a\nCONST robtarget p:={AT_P};\nVAR num n:=1;\nVAR bool b;\n{data}PROC main()\n"
    home = "MoveAbsJ [[0,-10,-10,0,-70,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;\nConfL\\Off;\n"
    return f"{head}{home}{body}\nENDPROC\n{more}ENDMODULE\n"


@pytest.mark.parametrize(
    "line",
    [
        "WaitAI ai1\\GT,5\\MaxTime:=4\\ValueAtTimeout:=n;",
        'sub1 StrToVal("40",n);',
        'WHILE StrToVal("40",n) DO\nn:=1;\nENDWHILE',
        'TEST StrToVal("40",n)\nCASE TRUE:\nSetDO do1,1;\nENDTEST',
        'IF StrToVal("40",n) SetDO do1,1;',
        'b:=StrToVal("40",n);',
        "BitSet n,5;",
        "BitClear n,5;",
    ],
)
def test_what_an_instruction_or_function_may_change_has_no_value(tmp_path, line):
    more = "PROC sub1(bool c)\nENDPROC\n"
    found = motions(tmp_path, rapid(f"{line}\nMoveL Offs(p,0,n,0),v100,fine,tool0;", more), "a.mod")
    assert isinstance(found[-1].target, UnresolvedTarget)


@pytest.mark.parametrize("local", [True, False])
def test_what_a_handler_sets_has_no_value(tmp_path, local):
    handler = "ERROR\nIF ERRNO=ERR_WAIT_MAXTIME THEN\noff:=-400;\nRETRY;\nENDIF"
    data = "VAR num off:=0;\n"
    lines = "WaitDI di1,1\\MaxTime:=2;\nMoveL Offs(p,0,0,off),v100,fine,tool0;\nMoveL Offs(p,0,n,0),v100,fine,tool0;\n"
    text = rapid(lines + handler, data="" if local else data)
    text = text.replace("PROC main()\n", f"PROC main()\n{data}") if local else text
    _, off, kept = motions(tmp_path, text, "a.mod")
    assert isinstance(off.target, UnresolvedTarget)
    assert not isinstance(kept.target, UnresolvedTarget)


@pytest.mark.parametrize(
    ("own", "caller", "leaves"),
    [
        ("ERROR\nIF ERRNO=ERR_WAIT_MAXTIME RETURN;\n", "", True),
        ('ERROR\nTPWrite "late";\n', "", True),
        ("ERROR\nTRYNEXT;\n", "", False),
        ("ERROR\nRETRY;\n", "", False),
        ("", "ERROR\nTRYNEXT;", True),
        ("", "", False),
    ],
)
def test_a_routine_that_an_error_ends_is_followed(tmp_path, own, caller, leaves):
    sub = "PROC sub1()\nMoveL p,v100,fine,tool0;\nWaitDI di1,1\\MaxTime:=2;\nMoveL Offs(p,0,0,100),v100,fine,tool0;\n"
    text = rapid(f"sub1;\nMoveL Offs(p,0,50,0),v100,fine,tool0;\n{caller}", f"{sub}{own}ENDPROC\n")
    found = check(tmp_path, text, "a.mod")
    assert (sum(not each.again for each in found.execution.endings) > 1) == leaves
    lines = [each for each in found.motions.values() if each.kind == "line"]
    assert len({tuple(np.round(np.append(each.start, each.end), 6)) for each in lines}) == 3 + leaves


@pytest.mark.parametrize(
    ("head", "call"),
    [
        ("\\INOUT num y", "sub1\\y:=n;"),
        ("\\VAR num y", "sub1\\y:=n;"),
        ("\\INOUT bool z|INOUT num y", "sub1\\y:=n;"),
        ("\\INOUT num y", "outer\\y:=n;"),
        ("\\INOUT num y", "IF ask(\\y:=n) SetDO do1,1;"),
    ],
)
def test_what_a_routine_sets_by_an_optional_argument_is_the_callers(tmp_path, head, call):
    sets = "IF Present(y) y:=40;"
    more = f"PROC sub1({head})\n{sets}\nENDPROC\nPROC outer(\\INOUT num y)\nsub1\\y?y;\nENDPROC\n"
    more += f"FUNC bool ask(\\INOUT num y)\n{sets}\nRETURN TRUE;\nENDFUNC\n"
    last = motions(tmp_path, rapid(f"{call}\nMoveL Offs(p,0,n,0),v100,fine,tool0;", more), "a.mod")[-1]
    assert last.target.pose[1, 3] == pytest.approx(0.04)


def test_what_a_trap_sets_by_an_optional_argument_has_no_value(tmp_path):
    more = "TRAP t1\nput\\y:=n;\nENDTRAP\nPROC put(\\INOUT num y)\ny:=40;\nENDPROC\n"
    body = "CONNECT i1 WITH t1;\nISignalDI di1,1,i1;\nMoveL Offs(p,0,n,0),v100,fine,tool0;"
    found = motions(tmp_path, rapid(body, more, "VAR intnum i1;\n"), "a.mod")
    assert isinstance(found[-1].target, UnresolvedTarget)


def test_an_optional_argument_and_a_variable_of_the_routine_are_two_names_of_one(tmp_path):
    more = "PROC sub1(\\INOUT num y)\ny:=40;\nMoveL Offs(p,0,n,0),v100,fine,tool0;\nENDPROC\n"
    assert isinstance(motions(tmp_path, rapid("sub1\\y:=n;", more), "a.mod")[-1].target, UnresolvedTarget)


def test_arguments_by_place_pass_over_optional_parameters(tmp_path):
    sub = "PROC sub1(\\num y,num x)\nIF Present(y) THEN\nn:=y;\nELSE\nn:=7;\nENDIF\n"
    sub += "MoveL Offs(p,x,n,0),v100,fine,tool0;\nENDPROC\n"
    _, with_y, without = motions(tmp_path, rapid("sub1\\y:=20,30;\nsub1 40;", sub), "a.mod")
    np.testing.assert_allclose(1000 * with_y.target.pose[:2, 3], [430, 20])
    np.testing.assert_allclose(1000 * without.target.pose[:2, 3], [440, 7])


OTHER_POINT = "[[400,0,500],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"


@pytest.mark.parametrize(
    ("lines", "z"),
    [
        (f"there:={OTHER_POINT};\nthere.trans.z:=350;", 350),
        ("there.trans:=[400,0,500];\nthere.trans.z:=there.trans.z-150;", 350),
        (f"there:=cell.place;\ncell.place:={OTHER_POINT};\ncell.place.trans.z:=350;\nthere:=cell.place;", 350),
    ],
)
def test_a_part_of_data_of_another_module_is_set_after_the_whole(tmp_path, lines, z):
    """Its type stands in the module that declares it; the type of a record may be the main module's."""
    shelf = f"MODULE shelf\nPERS robtarget there:={AT_P};\nPERS spot cell:=[1,{AT_P}];\nENDMODULE\n"
    (tmp_path / "shelf.mod").write_text(shelf)
    data = "RECORD spot\nnum count;\nrobtarget place;\nENDRECORD\n"
    (*_, last) = motions(tmp_path, rapid(f"{lines}\nMoveL there,v100,fine,tool0;", data=data), "a.mod")
    assert 1000 * last.target.pose[2, 3] == pytest.approx(z)


def test_the_type_of_data_may_stand_in_a_module_that_gives_nothing_else(tmp_path):
    (tmp_path / "kinds.mod").write_text("MODULE kinds\nRECORD spot\nrobtarget place;\nENDRECORD\nENDMODULE\n")
    data = f"VAR spot cell:=[{AT_P}];\n"
    (*_, last) = motions(tmp_path, rapid("MoveL cell.place,v100,fine,tool0;", data=data), "a.mod")
    assert 1000 * last.target.pose[2, 3] == pytest.approx(300)


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ("WHILE n<3 AND counted()<5 DO\nSetDO do1,1;\nENDWHILE", True),
        ("MoveL Offs(p,n,outer(),0),v100,fine,tool0;", True),
        ("n:=n+counted();", True),
        ("n:=counted()+n;", False),
        ("n:=counted();", False),
        ("list{n}:=counted();", True),
        ("n:=n+plain();", False),
        ("n:=n+plain()+counted();", True),
    ],
)
def test_a_variable_that_is_read_before_a_function_changes_it_is_named(tmp_path, line, named):
    """Functions are carried out before the line that holds them."""
    more = "FUNC num counted()\nIncr n;\nRETURN n;\nENDFUNC\nFUNC num outer()\nRETURN counted();\nENDFUNC\n"
    more += "FUNC num plain()\nVAR num n:=2;\nn:=3;\nRETURN n;\nENDFUNC\n"
    found = codes(check(tmp_path, rapid(line, more, "VAR num list{3};\n"), "a.mod"))
    assert found.get("program_not_simulated", []) == ([9] if named else [])


@pytest.mark.parametrize(
    ("quotient", "y"),
    [("9 DIV 2", 4), ("(-8) DIV 2", -4), ("(-9) DIV 2", None), ("9.5 DIV 2", None), ("9 MOD 2.5", None)],
)
def test_a_quotient_that_no_source_settles_has_no_value(tmp_path, quotient, y):
    """Basic Characteristics RAPID, 5-26: operands that are not whole are illegal; of negative ones it says nothing."""
    (*_, last) = motions(tmp_path, rapid(f"MoveL Offs(p,0,{quotient},0),v100,fine,tool0;"), "a.mod")
    known = None if isinstance(last.target, UnresolvedTarget) else round(1000 * last.target.pose[1, 3])
    assert known == y


def test_data_may_be_made_of_constants_of_any_module(tmp_path):
    text = "MODULE shelf\nCONST num lower:=higher-50;\nCONST num higher:=above;\nPERS pos s:=[1,lower,1];\nENDMODULE\n"
    (tmp_path / "shelf.mod").write_text(text)
    body = "MoveL Offs(p,0,s.y,0),v100,fine,tool0;"
    (*_, last) = motions(tmp_path, rapid(body, data="CONST num above:=80;\n"), "a.mod")
    assert 1000 * last.target.pose[1, 3] == pytest.approx(30)


@pytest.mark.parametrize(
    ("condition", "sides"),
    [
        ("p.trans=[400,0,300]", {1}),
        ("p.trans<>[400,0,300]", {2}),
        ("p.trans=[400,0,301]", {2}),
        ("3*[0.1,0.2,0.3]=[0.3,0.6,0.9]", {1, 2}),
        ("q=[400,0,300]", {1, 2}),
        ("q=[401,0,300]", {2}),
    ],
)
def test_positions_are_compared_by_their_parts(tmp_path, condition, sides):
    """Named or not; within what rounding may make of them, or where one is not known, both sides are followed."""
    body = f"q:=[400,0,GInput(gi1)];\nIF {condition} THEN\nn:=1;\nELSE\nn:=2;\nENDIF\n"
    _, *found = motions(tmp_path, rapid(f"{body}MoveL Offs(p,0,n,0),v100,fine,tool0;", data="VAR pos q;\n"), "a.mod")
    assert {round(1000 * each.target.pose[1, 3]) for each in found} == sides


def test_what_a_test_asks_is_worked_out_once(tmp_path):
    more = "FUNC num counted()\nIncr n;\nRETURN n;\nENDFUNC\n"
    body = "TEST counted()\nCASE 1:\nn:=10;\nCASE 2:\nn:=20;\nCASE 3:\nn:=30;\nENDTEST\n"
    (*_, last) = motions(tmp_path, rapid(f"{body}MoveL Offs(p,0,n,0),v100,fine,tool0;", more), "a.mod")
    assert 1000 * last.target.pose[1, 3] == pytest.approx(20)


def test_a_function_that_says_which_element_is_set_is_carried_out(tmp_path):
    more = "FUNC num counted()\nIncr n;\nRETURN n;\nENDFUNC\n"
    body = "list{counted()}:=30;\nMoveL Offs(p,n,list{2},0),v100,fine,tool0;"
    found = motions(tmp_path, rapid(body, more, "VAR num list{3};\n"), "a.mod")
    np.testing.assert_allclose(1000 * found[-1].target.pose[:2, 3], [402, 30])


@pytest.mark.parametrize(
    "call",
    [
        "Round(12.3\\Dec:=n)",
        "Trunc(12.3\\Dec:=n)",
        "Dim(list,n)",
        'StrLen(StrPart("abc",0,1))',
        'StrLen(StrPart("abc",3,2))',
    ],
)
def test_a_function_of_what_is_not_known_has_no_value(tmp_path, call):
    body = f"n:=GInput(gi1);\nMoveL Offs(p,0,{call},0),v100,fine,tool0;"
    (*_, last) = motions(tmp_path, rapid(body, data="VAR num list{2,3};\n"), "a.mod")
    assert isinstance(last.target, UnresolvedTarget)


@pytest.mark.parametrize(
    "line",
    [
        *(f"{word} MoveL Offs(p,0,0,-200),v100,fine,tool0;" for word in ("Stop", "Break", "GOTO there")),
        "CONNECT i1 WITH t1 MoveL Offs(p,0,0,-200),v100,fine,tool0;",
        "MoveL p,v100,fine,tool0,wobj0;",
        "MoveL p,v100,fine,tool0\\WObj:=wobj0,wobj0;",
    ],
)
def test_what_follows_an_instruction_that_takes_no_more_is_not_dropped(tmp_path, line):
    more, data = "TRAP t1\nENDTRAP\n", "VAR intnum i1;\n"
    found = check(tmp_path, rapid(f"{line}\nthere:\nMoveL p,v100,fine,tool0;", more, data), "a.mod")
    assert {"may_move", "target_not_given"} & codes(found).keys()


@pytest.mark.parametrize("line", ["Stop\\NoRegain;", "Stop\\AllMoveTasks;", "Stop;", "Break;"])
def test_a_stop_with_its_switches_is_understood(tmp_path, line):
    assert "may_move" not in codes(check(tmp_path, rapid(f"{line}\nMoveL p,v100,fine,tool0;"), "a.mod"))


@pytest.mark.parametrize(
    ("line", "kept"),
    [
        ("q.trans.z:=100 @ 3;", False),
        ("list{1}:=5 $;", False),
        ('SetDataVal "n",50;', False),
        ("SetupCyclicBool n,di1=1;", False),
        ("RMQSendWait slot,sent,message,n;", False),
        ("b:=ReadDir(folder,n);", False),
        ("b:=UIListView(\\Result:=n,items);", False),
        ("m:=5 $;", True),
    ],
)
def test_what_a_line_may_set_that_is_not_understood_has_no_value(tmp_path, line, kept):
    data = f"VAR robtarget q:={AT_P};\nVAR num list{{2}};\nVAR num m;\n"
    body = f"{line}\nMoveL Offs(q,0,n,list{{1}}),v100,fine,tool0;"
    (*_, last) = motions(tmp_path, rapid(body, data=data), "a.mod")
    assert isinstance(last.target, UnresolvedTarget) != kept


def test_external_axes_that_are_not_known_as_a_whole_are_named(tmp_path):
    more = "FUNC extjoint where()\nVAR robtarget q;\nq:=CRobT();\nRETURN q.extax;\nENDFUNC\n"
    body = "MoveL Offs(p,0,9,0),v100,z10,tool0;\nq:=p;\nq.extax:=where();\nMoveL q,v100,fine,tool0;"
    (*_, last) = motions(tmp_path, rapid(body, more, "VAR robtarget q;\n"), "a.mod")
    assert [name for name, _ in last.target.external] == ["extax"]


def test_data_in_the_first_line_of_a_module_count(tmp_path):
    text = rapid("MoveL Offs(p,0,first,0),v100,fine,tool0;").replace("MODULE a\n", "MODULE a VAR num first:=30; ")
    (*_, last) = motions(tmp_path, text, "a.mod")
    assert 1000 * last.target.pose[1, 3] == pytest.approx(30)


def test_a_list_of_lists_is_one_as_a_parameter_too(tmp_path):
    more = "PROC lower(INOUT robtarget q{*,*},num z)\nq{1,2}.trans.z:=z;\nENDPROC\n"
    body = '%"low"+s% q,350;\nMoveL q{1,2},v100,fine,tool0;'
    data = f'VAR string s:="er";\nVAR robtarget q{{1,2}}:=[[{AT_P},{AT_P}]];\n'
    (*_, last) = motions(tmp_path, rapid(body, more, data), "a.mod")
    assert 1000 * last.target.pose[2, 3] == pytest.approx(350)


@pytest.mark.parametrize(("file", "named"), [("shelf.mod", False), ("other.mod", True), ("", True)])
def test_a_module_that_is_loaded_and_was_not_read_is_named(tmp_path, file, named):
    (tmp_path / "shelf.mod").write_text("MODULE shelf\nPROC go()\nMoveL p,v100,fine,tool0;\nENDPROC\nENDMODULE\n")
    given = f'"HOME:/parts/{file}"' if file else "s"
    body = f'Load \\Dynamic,{given};\n%"go"%;'
    found = codes(check(tmp_path, rapid(body, data="VAR string s;\n"), "a.mod"))
    assert ("program_not_simulated" in found) == named


def test_what_is_not_understood_in_a_handler_is_named(tmp_path):
    body = "MoveL p,v100,fine,tool0;\nERROR\nArcL p,v100,seam1,weave1,z10,tool0;\nb:=5 @;\nEXIT;"
    found = codes(check(tmp_path, rapid(body), "a.mod"))
    assert found["never_reached"] == [10, 11]
    assert found["program_not_understood"] == [11]


@pytest.mark.parametrize(
    ("place", "name", "lines"),
    [
        ("Rob2", "Rob1", "n2:=600;"),
        ("T_COM", "T_ROB1", "put n2;"),
        ("", "", "n2:=600;"),
    ],
)
def test_persistent_data_are_set_by_tasks_in_other_places(tmp_path, place, name, lines):
    """In folders with names of robots, by reference, and by a module beside it with a main that moves nothing."""
    for each in {place, name}:
        (tmp_path / each).mkdir(exist_ok=True)
    put = "PROC put(PERS num x)\nx:=600;\nENDPROC\n"
    text = f"MODULE cell\nPERS num n2:=0;\nPROC main()\n{lines}\nENDPROC\n{put}ENDMODULE\n"
    (tmp_path / place / "cell.mod").write_text(text)
    text = rapid("MoveL Offs(p,0,n2,0),v100,fine,tool0;", data="PERS num n2:=0;\n")
    assert isinstance(motions(tmp_path / name, text, "a.mod")[-1].target, UnresolvedTarget)
    assert files_of(tmp_path / name / "a.mod")[-1].name == "cell.mod"


def handled(handler: str, sub: str = "SetDO do1,1;", own: str = "") -> str:
    """A module whose main calls sub1; with the handler of main and sub1's own."""
    more = f"PROC sub1()\n{sub}\n{own}ENDPROC\nPROC note1()\nIncr k;\nENDPROC\nFUNC bool set1(INOUT num x)\nx:=40;\n"
    more += "RETURN TRUE;\nENDFUNC\nTRAP t1\nn:=40;\nENDTRAP\n"
    data = "VAR num k;\nVAR intnum i1;\n"
    return rapid(f"sub1;\nMoveL Offs(p,0,n,0),v100,fine,tool0;\n{handler}", more, data)


NO_CALL = "MoveL p,v100,fine,tool0;\n"


@pytest.mark.parametrize(
    "handler",
    [
        "TRYNEXT;",
        "RETURN;",
        "ExitCycle;",
        'TPWrite "late";',
        "IF ERRNO=ERR_WAIT_MAXTIME RETRY;",
        "IF ERRNO=ERR_WAIT_MAXTIME THEN\nRETRY;\nELSE\nStop;\nn:=5;\nENDIF",
        "RETRY;",  # of sub1, which begins again where the arm is
    ],
)
def test_a_handler_after_which_the_program_goes_on_is_named(tmp_path, handler):
    found = check(tmp_path, handled(f"ERROR\n{handler}"), "a.mod")
    named = [(each.level, each.place.line) for each in found.findings if each.finding.code == "errors_not_followed"]
    assert named == [("caution", 12)]
    assert [each.place.line for each in found.not_examined if each.what == "course"] == [12]


@pytest.mark.parametrize(
    ("handler", "named"),
    [
        ("RETRY;", False),
        ('TPWrite "again";\nWaitTime 1;\nResetRetryCount;\nRETRY;', False),
        ("SetDO do1,0;\nIF ERRNO=5 THEN\nRETRY;\nELSE\nRAISE;\nENDIF", False),
        ("n:=5;\nRETRY;", True),
        ("Incr k;\nIF k<3 RETRY;\nEXIT;", True),
        ("note1;\nRETRY;", True),
        ("IF set1(n) RETRY;\nEXIT;", True),
        ("VelSet 50,500;\nRETRY;", True),
        ("SetSysData tool0;\nRETRY;", True),
        ("Mystery;\nRETRY;", True),
        ("CONNECT i1 WITH t1;\nRETRY;", True),
        ("MoveL p,v100,fine,tool0;\nRETRY;", True),
        ("StartMoveRetry;", True),
    ],
)
def test_a_handler_that_repeats_what_failed_is_named_where_it_does_more(tmp_path, handler, named):
    text = handled(f"ERROR\n{handler}").replace("\nsub1;\n", f"\n{NO_CALL}")
    assert ("errors_not_followed" in codes(check(tmp_path, text, "a.mod"))) == named


@pytest.mark.parametrize(
    "handler",
    ["EXIT;", "n:=5;\nEXIT;", 'TPWrite "late";\nStop;', "RAISE;", "IF ERRNO=5 THEN\nStop;\nELSE\nEXIT;\nENDIF"],
)
def test_a_handler_that_ends_the_program_is_not_named(tmp_path, handler):
    found = codes(check(tmp_path, handled("", own=f"ERROR\n{handler}\n"), "a.mod"))
    assert "errors_not_followed" not in found


@pytest.mark.parametrize("own", ["", "ERROR\nRAISE;\n"])
def test_a_handler_that_passes_an_error_on_is_named_where_a_caller_goes_on(tmp_path, own):
    found = codes(check(tmp_path, handled("ERROR\nTRYNEXT;", own=own), "a.mod"))
    assert found["errors_not_followed"] == [12, *[17][: len(own)]]


def test_a_handler_of_a_routine_that_nothing_calls_is_not_named(tmp_path):
    text = handled("", own="ERROR\nTRYNEXT;\n").replace("\nsub1;\n", "\n")
    assert "errors_not_followed" not in codes(check(tmp_path, text, "a.mod"))


@pytest.mark.parametrize("handler", ["note1;\nRETRY;", "note1;\nTPErase;\nTRYNEXT;", "Mystery;\nRETRY;"])
def test_what_a_handler_calls_changes_no_more_than_that_changes(tmp_path, handler):
    found = check(tmp_path, handled("", own=f"ERROR\n{handler}\n"), "a.mod")
    assert found.level == "caution"
    assert set(codes(found)) & {"target_not_given", "frame_not_given", "load_not_examined"} == set()


@pytest.mark.parametrize("handler", ["IF set1(n) TRYNEXT;", "b:=set1(n);\nTRYNEXT;", 'b:=StrToVal("40",n);\nTRYNEXT;'])
def test_what_a_function_sets_in_a_handler_has_no_value(tmp_path, handler):
    found = motions(tmp_path, handled("", own=f"ERROR\n{handler}\n"), "a.mod")
    assert isinstance(found[-1].target, UnresolvedTarget)


def test_the_position_is_not_known_where_a_handler_sets_the_active_tool(tmp_path):
    body = "MoveL p,v100,fine,tool0;\nsub1;\nq:=CRobT();\nMoveL q,v100,fine,tool0;"
    more = "PROC sub1()\nWaitDI di1,1\\MaxTime:=2;\nERROR\nSetSysData tool1;\nTRYNEXT;\nENDPROC\n"
    found = motions(tmp_path, rapid(body, more, f"VAR robtarget q;\nPERS tooldata tool1:={ONE_TOOL};\n"), "a.mod")
    assert isinstance(found[-1].target, UnresolvedTarget)


@pytest.mark.parametrize("word", ["ExitCycle", "RAISE my_err"])
def test_a_trap_that_ends_the_cycle_or_the_routine_is_named(tmp_path, word):
    more = f"TRAP t1\n{word};\nENDTRAP\n"
    body = "CONNECT i1 WITH t1;\nISignalDI di1,1,i1;\nMoveL p,v100,fine,tool0;"
    found = check(tmp_path, rapid(body, more, "VAR intnum i1;\n"), "a.mod")
    assert codes(found)["moves_beside"] == [9]
    assert codes(found)["may_move"] == [14]


def test_a_position_that_is_read_after_continue_is_not_known(tmp_path):
    line = f"{AT_START}$APO.CDIS=20\nLIN {{X 400,Y 0,Z 300,{DOWN}}} C_DIS\n%sF=$POS_ACT\nLIN F"
    ahead, stopped = (motions(tmp_path, krl(f"FRAME F\n{line % each}"), "a.src")[-1] for each in ("CONTINUE\n", ""))
    assert isinstance(ahead.target, UnresolvedTarget)
    assert not isinstance(stopped.target, UnresolvedTarget)


@pytest.mark.parametrize(("before", "ways"), [("CONTINUE\n", {5.0, 9.0}), ("", {5.0})])
def test_what_asks_for_the_position_after_continue_is_not_decided(tmp_path, before, ways):
    ask = f"{AT_START}{before}IF $AXIS_ACT.A1<1 THEN\nPTP {{A1 5}}\nELSE\nPTP {{A1 9}}\nENDIF"
    found = motions(tmp_path, krl(f"PTP {axes(HOME)}\n{ask}"), "a.src")
    assert {round(float(np.degrees(each.target.joints[0])), 6) for each in found[-2:]} & {5.0, 9.0} == ways


ONE_TOOL = "[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,0],[1,0,0,0],0,0,0]]"
TOOLS = f"VAR num n;\nPERS tooldata tools{{2}}:=[{ONE_TOOL},{ONE_TOOL}];\n"
STEP = "MoveL [[300,50,200],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tools{n};"


@pytest.mark.parametrize(
    ("file", "text", "name"),
    [
        ("a.src", krl("INT n\n$BASE=$NULLFRAME\nn=$IN[3]\n$TOOL=TOOL_DATA[n]\nLIN_REL {Z 1}"), "TOOL_DATA[N]"),
        ("a.mod", f"MODULE a\n{TOOLS}PROC main()\nn:=GInput(gi1);\n{STEP}\nENDPROC\nENDMODULE\n", "tools[n]"),
    ],
)
def test_one_frame_given_for_every_index_is_a_caution(tmp_path, file, text, name):
    found = check(tmp_path, text, file, frames={name: np.eye(4)})
    said = [each for each in found.findings if each.finding.code == "frame_of_several"]
    assert [(each.level, each.finding.name, each.finding.frame) for each in said] == [("caution", name, "tool")]


@pytest.mark.parametrize(("name", "several"), [("TOOL_DATA[12]", False), ("wobj{1, 2}", False), ("tool (old)", False)])
def test_frames_with_numbers_are_one_each(name, several):
    assert NamedFrame(name).one_of_several is several


FAR_AWAY = "MoveL [[{x},0,400],[0,1,0,0],[0,0,0,0],[{track},9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;"


@pytest.mark.parametrize(("track", "level"), [("1500", "caution"), ("9E9", "fail")])
@pytest.mark.parametrize("reached", [True, False])
def test_reach_is_not_decided_where_external_axes_were_left_out(tmp_path, track, level, reached):
    line = FAR_AWAY.format(x=3000, track=track)
    near = "" if reached else f"{FAR_AWAY.format(x=400, track='9E9')}\n"
    text = f"MODULE a\nPROC main()\n{near}{line}\nENDPROC\nENDMODULE\n"
    found = check(tmp_path, text, "a.mod", **({} if reached else {"most_motions": 1}))
    said = {each.finding.code: each.level for each in found.findings}
    assert said.get("way_out_of_reach", said.get("target_out_of_reach")) == level


@pytest.mark.parametrize(
    ("moved_mm", "turned_deg", "said"), [(0.0, 0.0, None), (0.0, 2.0, (0.0, 2.0)), (30.0, 0.0, (30.0, 0.0))]
)
def test_a_table_whose_poses_are_another_arms_is_a_caution(tmp_path, moved_mm, turned_deg, said):
    joints = np.linspace(HOME, NEAR, 4)
    poses = np.linalg.inv(ROBOT.base) @ forward(ROBOT, joints)
    poses[2, 0, 3] += moved_mm / 1000
    poses[2, :3, :3] = Rotation.from_euler("z", turned_deg, degrees=True).as_matrix() @ poses[2, :3, :3]
    found = check(tmp_path, write_csv(np.arange(4.0), np.degrees(joints), poses), "a.csv")
    named = [each for each in found.findings if each.finding.code == "tool_stated_elsewhere"]
    if said is None:
        assert not named
    else:
        (one,) = named
        assert (one.level, one.place.line) == ("caution", 4)
        np.testing.assert_allclose((one.finding.moved_mm, one.finding.turned_deg), said, atol=1e-5)


def test_a_tables_pose_columns_that_are_not_all_there_are_named(tmp_path):
    table = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,yaw_deg\n0,-10,-10,0,-70,0,400,0\n"
    assert codes(check(tmp_path, table, "a.csv"))["program_not_understood"] == [1, 1]


@pytest.mark.parametrize("start", ["INTERRUPT DECL 5 WHEN $IN[1] DO", "TRIGGER WHEN DISTANCE=0 DELAY=0 DO"])
@pytest.mark.parametrize(("what", "changed"), [("st(N)", True), ("far( )", True), ("look(N)", False)])
def test_what_a_routine_beside_the_program_changes_by_reference_has_no_value(tmp_path, start, what, changed):
    (tmp_path / "a.dat").write_text("DEFDAT a\nDECL INT N=0\nENDDAT\n")
    more = "DEF st(X:OUT)\nINT X\nX=50\nEND\nDEF far( )\nst(N)\nEND\nDEF look(X:OUT)\nINT X\n$OUT[1]=X>3\nEND\n"
    found = motions(tmp_path, krl(f"{start} {what}\nPTP {axes(HOME)}\nPTP {{A1 N}}", more), "a.src")
    assert isinstance(found[-1].target, UnresolvedTarget) == changed


@pytest.mark.parametrize(
    ("motion", "named"),
    [
        ("PTP_REL {E1 100}", True),
        ("PTP_REL {A1 5,E1 0}", False),
        ("LIN_REL {X 10,E1 100}", True),
        ("LIN_REL {X 10,E1 100} #TOOL", True),
        ("PTP {A1 5,E1 $ANIN[1]}", True),
        (f"CIRC {{X 410,Y 10,Z 300,{DOWN},E1 50}},{{X 400,Y 20,Z 300,{DOWN}}}", True),
    ],
)
def test_external_axes_are_named_in_every_motion(tmp_path, motion, named):
    found = check(tmp_path, krl(f"{AT_START}LIN {{X 400,Y 0,Z 300,{DOWN}}}\n{motion}"), "a.src")
    assert ("external_axes_left_out" in codes(found)) == named


@pytest.mark.parametrize("value", ["[0,0,0.1,0,0,0]", '"x"', "1", "True", "p[0,0,read_input_float_register(0),0,0,0]"])
def test_a_tool_of_urscript_that_is_no_pose_is_not_the_flange(tmp_path, value):
    body = f"set_tcp(p[0,0,0.2,0,0,0])\nset_tcp({value})\nmovel(p[0.3,0,0.4,3.14,0,0], a=1.2, v=0.05)\n"
    found = check(tmp_path, body, "a.script")
    assert codes(found)["frame_not_given"] == [3]
    assert found.verdicts[-1].level == "fail"


def test_an_arc_whose_tool_turns_with_it_by_half_a_turn_or_more_is_not_examined(tmp_path):
    """The program is right: the manual has it. Of less than half a turn it is followed."""
    line = "set_tcp(p[0,0,0,0,0,0])\nmovel(p[0.4,0,0.4,3.14159,0,0])\nmovec(p[0.45,{y},0.4,3.14159,0,0],{end},mode=1)\n"
    short = check(tmp_path, line.format(y=0.02, end="p[0.5,0,0.4,3.14159,0,0]"), "a.script")
    assert "target_not_given" not in codes(short)
    found = check(tmp_path, line.format(y=0.15, end="p[0.5,0,0.4,3.14159,0,0]"), "a.script")
    (each,) = (each for each in found.findings if each.finding.code == "target_not_given")
    assert (each.level, each.finding.reason) == ("caution", "turns_with_arc")
    assert [each.place.line for each in found.not_examined if each.what == "motion"] == [3]
    assert remedy_at(each) == "Write the arc as several of less than half a turn each."


def test_how_a_spline_of_joint_moves_bends_is_not_examined(tmp_path):
    body = (
        "PTP_SPLINE\nSPTP {A1 5,A2 -10,A3 -10,A4 0,A5 -70,A6 0}\nSPTP {A1 9,A2 -20,A3 -10,A4 0,A5 -70,A6 0}\nENDSPLINE"
    )
    found = check(tmp_path, krl(f"{body}\nSPTP {{A1 5,A2 -10,A3 -10,A4 0,A5 -70,A6 0}}"), "a.src")
    lines = codes(found)["spline_as_line"]
    assert len(lines) == 2
    assert [each.level for each in found.verdicts][-3:] == ["caution", "caution", "note"]  # of the speed


@pytest.mark.parametrize(
    ("body", "named"), [("movej({near})", True), ("set_tcp(p[0,0,0.1,0,0,0])", True), ("x=1", False)]
)
@pytest.mark.parametrize("word", ["or", "and"])
def test_a_call_behind_and_or_or_that_does_more_than_compute_is_named(tmp_path, body, named, word):
    """Here both sides are always worked out; no manual says whether a controller does, where one side decides."""
    text = f"def lift():\n  {body.format(near=NEAR_TEXT)}\n  return True\nend\nif True {word} lift():\n  y=1\nend\n"
    found = codes(check(tmp_path, f"{text}movej({FAR_TEXT})\n", "a.script"))
    assert found.get("program_not_simulated", []) == ([5] if named else [])


FROM_ABOVE = "MoveL Offs(p,0,{y},0),v100,{zone},tool0;\n"


@pytest.mark.parametrize(
    ("given", "named"), [("z1\\Z:=5", False), ("z1\\Z:=GInput(gi1)", True), ("z1\\Z:=n", True), ("own", True)]
)
def test_a_zone_whose_size_only_the_cell_knows_is_named(tmp_path, given, named):
    body = f"n:=GInput(gi1);\nown:=z10;\nown.finep:=TestDI(di1);\n{FROM_ABOVE.format(y=0, zone=given)}"
    found = codes(
        check(tmp_path, rapid(body + FROM_ABOVE.format(y=50, zone="fine"), data="VAR zonedata own;\n"), "a.mod")
    )
    assert ("zone_without_size" in found) == named


@pytest.mark.parametrize(("on", "named"), [("TRUE", False), ("FALSE", False), ("TestDI(di1)", True)])
def test_a_limit_that_only_the_cell_knows_to_be_set_is_named(tmp_path, on, named):
    line = f"PathAccLim {on}\\AccMax:=0.5,TRUE\\DecelMax:=3;\nMoveL p,v100,fine,tool0;"
    found = check(tmp_path, rapid(line), "a.mod")
    assert ("program_not_understood" in codes(found)) == named
    (motion,) = (each.placed.motion for each in found.motions.values() if each.kind == "line")
    limit = None if motion.acceleration is None else motion.acceleration.value
    assert limit == {"TRUE": 0.5, "FALSE": 3.0}.get(on)


def test_joints_of_a_point_are_known_where_its_error_is_asked_for(tmp_path):
    body = "j:=CalcJointT(p,tool0\\ErrorNumber:=e);\nMoveAbsJ j,v100,fine,tool0;"
    found = check(tmp_path, rapid(body, data="VAR jointtarget j;\nVAR errnum e;\n"), "a.mod")
    assert "target_not_given" not in codes(found)


def test_persistent_data_whose_value_another_task_gives_have_none(tmp_path):
    found = motions(tmp_path, rapid("MoveL Offs(p,0,q,0),v100,fine,tool0;", data="PERS num q;\n"), "a.mod")
    assert isinstance(found[-1].target, UnresolvedTarget)


@pytest.mark.parametrize(
    ("line", "data", "own", "known"),
    [
        ("n2:=600;", "PERS num n2;", "PERS num n2:=0;\n", False),
        ("Incr n2;", "PERS num n2:=0;", "PERS num n2:=0;\n", False),
        ("IF n2=1 SetDO do1,1;", "PERS num n2:=0;", "PERS num n2:=0;\n", True),
        ("n2:=600;", "VAR num n2;", "PERS num n2:=0;\n", True),
        ("n2:=600;", "TASK PERS num n2:=0;", "PERS num n2:=0;\n", True),
        ("n2:=600;", "PERS num n2;", "VAR num n2:=0;\n", True),
    ],
)
def test_persistent_data_that_another_task_sets_have_no_value(tmp_path, line, data, own, known):
    folders = [tmp_path / "RAPID" / task / "PROGMOD" for task in ("TASK1", "TASK2")]
    for folder in folders:
        folder.mkdir(parents=True)
    (folders[1] / "cell.mod").write_text(f"MODULE cell\n{data}\nPROC main()\n{line}\nENDPROC\nENDMODULE\n")
    last = motions(folders[0], rapid("MoveL Offs(p,0,n2,0),v100,fine,tool0;", data=own), "a.mod")[-1]
    assert isinstance(last.target, UnresolvedTarget) != known
    assert files_of(folders[0] / "a.mod") == (folders[0] / "a.mod", folders[1] / "cell.mod")


def test_a_call_by_a_name_that_is_known_is_not_told_as_never_reached(tmp_path):
    more = "PROC goFar()\nMoveL Offs(p,0,50,0),v100,fine,tool0;\nENDPROC\n"
    body = 's:="Far";\n%"go"+s%;\nMoveL p,v100,fine,tool0;'
    found = codes(check(tmp_path, rapid(body, more, "VAR string s;\n"), "a.mod"))
    assert "never_reached" not in found


def test_options_that_a_caller_did_not_give_are_as_if_they_were_not_there(tmp_path):
    more = "PROC go(\\num z,\\num v,\\switch i)\nMoveL p,v100\\V?v,z10\\Z?z\\Inpos?i,tool0;\nENDPROC\n"
    found = motions(tmp_path, rapid("go;", more), "a.mod")[-1]
    assert (found.zone.value, found.speed.value) == (pytest.approx(0.01), pytest.approx(0.1))


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("q.robconf.cf6:=GInput(gi1);", "configuration_not_read"),
        ("q.robconf:=confs{GInput(gi1)};", "configuration_not_read"),
        ("own.robhold:=TestDI(di1);", "frame_not_given"),
        ("object.robhold:=TestDI(di1);", "frame_not_given"),
        ("own.tload.mass:=GInput(gi1);", "load_not_examined"),
    ],
)
def test_a_part_of_data_that_only_the_cell_knows_is_named(tmp_path, line, code):
    data = "VAR robtarget q;\nVAR tooldata own;\nVAR wobjdata object;\nVAR confdata confs{2};\n"
    data += f"CONST tooldata tool1:={ONE_TOOL};\n"
    body = f"q:=p;\nown:=tool1;\nobject:=wobj0;\nConfJ\\On;\n{line}\nMoveJ q,v100,fine,own\\WObj:=object;"
    found = check(tmp_path, rapid(body, data=data), "a.mod")
    assert [each.finding.code for each in found.findings if each.level != "note" and each.finding.code == code] == [
        code
    ]


SHIPPED = (
    "DEFDAT $CONFIG\nINT $EDIT_MODE=1\nINT $ACT_GROUP='B0001'\nSTRUC RECIPE REAL HEIGHT,FRAME OFFSET\n"
    "DECL RECIPE $RECIPE={HEIGHT 5.0}\nDECL LOAD LOAD_A1_DATA={M -1.0,CM {X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}}\n"
    "DECL INT COMPL_GROUP='B1111'\nDECL FRAME TOOL_DATA[16]\nDECL FRAME BASE_DATA[32]\n"
    "TOOL_DATA[2]={X 0,Y 0,Z 50,A 0,B 0,C 0}\nBASE_DATA[3]={X 50,Y 0,Z 0,A 0,B 0,C 0}\nENDDAT\n"
)
BASICS = (
    "DEF BAS(WHAT:IN,NUMBER:IN)\nDECL BAS_COMMAND WHAT\nREAL NUMBER\nINT N\nN=NUMBER\nSWITCH WHAT\nCASE #INITMOV\n"
    "$FILTER=$DEF_FLT_PTP\n$LOAD_A1.M=0\n$LOAD_A1.CM={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n$LOAD_A2.M=LOAD_A1_DATA.M\n"
    "$LOAD_A2.CM=LOAD_A1_DATA.CM\n$LOAD_A3.M=$DEF_LA3_M\n$LOAD_A3.J=$DEF_LA3_J\n$ACT_GROUP=COMPL_GROUP\n"
    "CASE #TOOL\nT(N)\nCASE #BASE\nB(N)\nENDSWITCH\nEND\n"
    "DEF T(N:IN)\nINT N\nIF N<=0 THEN\n$TOOL=$NULLFRAME\nELSE\nIF TOOL_CORR_ON THEN\n$TOOL=TOOL_DATA[N]:TOOL_CORR\n"
    "ELSE\n$TOOL=TOOL_DATA[N]\nENDIF\nENDIF\nIF $ADAP_ACC<>#NONE THEN\n$LOAD.M=-1\nENDIF\n$ACT_TOOL=N\nEND\n"
    "DEF B(N:IN)\nINT N\n$BASE=BASE_DATA[N]\n$JERK=1\n$JERK=1\n$JERK=1\n$ACT_BASE=N\n$ACT_EX_AX=-1\nEND\n"
    "GLOBAL DEFFCT FRAME STOOL2(F:IN)\nDECL FDAT F\n$ACT_TOOL=F.TOOL_NO\n$ACT_BASE=F.BASE_NO\n"
    "RETURN TOOL_DATA[F.TOOL_NO]\nENDFCT\n"
)


def test_what_a_controllers_own_modules_and_data_set_is_no_doubt_about_tool_and_base(tmp_path):
    """As an archive has it whose programs are as they should be."""
    (tmp_path / "$config.dat").write_text(SHIPPED)
    (tmp_path / "bas.src").write_text(BASICS)
    body = f"BAS(#INITMOV,0)\nTOOL_CORR_ON=FALSE\nBAS(#TOOL,2)\nBAS(#BASE,3)\n$RECIPE.HEIGHT=7\nPTP {axes(NEAR)}"
    found = check(tmp_path, krl(f"{body}\n{LINE}\nPTP {{A1 $RECIPE.HEIGHT}}"), "a.src")
    assert not {"program_not_understood", "frames_in_doubt", "may_move", "target_not_given"} & codes(found).keys()
    line = motions(tmp_path, krl(f"{body}\n{LINE}"), "a.src")[-1]
    assert (line.tool.pose[2, 3], line.base.pose[0, 3]) == (0.05, 0.05)


@pytest.mark.parametrize("line", ["$ACT_TOOL=2", "$LOAD_A1.M=5", "$LOAD_A3=LOAD_A3_DATA", "$FILTER=16", "$CORR_T.X=5"])
def test_what_else_such_variables_are_set_to_is_named(tmp_path, line):
    (tmp_path / "$config.dat").write_text(SHIPPED)
    found = codes(check(tmp_path, krl(f"{FRAMES}{line}\nPTP {axes(NEAR)}\n{LINE}"), "a.src"))
    assert found["program_not_understood"] == [4]
    assert ("frames_in_doubt" in found) == (line.startswith(("$ACT", "$CORR")))


@pytest.mark.parametrize(
    "call", ["FindPart n;", "b:=FindPart(n);", '%"FindPart"% n;', "GetPart n;", "FindPart\\Into:=n;"]
)
def test_what_a_routine_that_no_file_holds_gets_by_reference_has_no_known_value(tmp_path, call):
    found = check(tmp_path, rapid(f"{call}\nMoveJ p,v50,fine,tool0;\nMoveL Offs(p,0,n,0),v50,fine,tool0;"), "a.mod")
    (missed,) = (each for each in found.findings if each.finding.code == "target_not_given")
    assert (missed.level, missed.finding.reason) == ("caution", "perhaps_changed")
    assert [each.level for each in found.verdicts][2] == "caution"
    assert any(each.place.line == missed.place.line and each.what == "motion" for each in found.not_examined)
    constant = check(tmp_path, rapid("FindPart p;\nMoveJ p,v50,fine,tool0;"), "a.mod")
    assert "target_not_given" not in codes(constant)
    same_name = "PROC other(num n)\nCONST num n:=1;\nENDPROC\n"  # of a parameter of another routine
    again = check(tmp_path, rapid(f"{call}\nMoveJ Offs(p,0,n,0),v50,fine,tool0;", same_name), "a.mod")
    assert "target_not_given" in codes(again)
    set_anew = check(tmp_path, rapid(f"{call}\nn:=5;\nMoveJ Offs(p,0,n,0),v50,fine,tool0;"), "a.mod")
    assert "target_not_given" not in codes(set_anew)


def test_both_sides_follow_what_such_a_routine_may_have_changed(tmp_path):
    asked = "AskPLC n;\nIF n=2 THEN\nMoveJ p,v50,fine,tool0;\nENDIF"
    assert "both_sides_checked" in codes(check(tmp_path, rapid(asked), "a.mod"))


def test_a_tool_that_such_a_routine_is_given_is_in_doubt_where_it_is_used(tmp_path):
    data = "PERS tooldata tG:=[TRUE,[[0,0,50],[1,0,0,0]],[1,[0,0,20],[1,0,0,0],0,0,0]];\n"
    body = "MeasureTool tG;\nMoveJ p,v50,fine,tool0;\nMoveJ p,v50,fine,tG;"
    found = check(tmp_path, rapid(body, data=data), "a.mod")
    (doubt,) = (each for each in found.findings if each.finding.code == "frames_in_doubt")
    assert doubt.place.line == max(each.place.line for each in found.verdicts)


def test_a_relative_motion_from_where_the_arm_is_not_known_to_stand_is_no_fail(tmp_path):
    found = check(tmp_path, f"DEF a( )\n{FRAMES}LIN_REL {{Z 10}}\nEND\n", "a.src", start=None)
    (missed,) = (each for each in found.findings if each.finding.code == "target_not_given")
    assert (missed.level, missed.finding.reason) == ("caution", "position_unknown")
    wrong = check(tmp_path, f"DEF a( )\nREAL X\n{FRAMES}LIN_REL {{Z X}}\nEND\n", "a.src", start=None)
    assert wrong.level == "fail"  # the program itself does not say how far


def test_a_tool0_of_rpl_that_is_not_mapped_is_a_caution(tmp_path):
    text = 'MLIN(POINTC(328.5,132.1,505.8,-0.2,-11.5,-166.5,"CFG0",0,0,0), v100, fine, tool0);'
    found = check(tmp_path, text, "a.pgm")
    assert [each.level for each in found.findings if each.finding.code == "frame_taken_as_flange"] == ["caution"]
    given = check(tmp_path, text, "a.pgm", frames={"tool0": np.eye(4)})
    assert "frame_taken_as_flange" not in codes(given)


def test_the_sign_of_a_position_may_be_turned(tmp_path):
    body = "c:=-d;\nMoveJ Offs(p,c.x,-c.y,-(c.z+1)),v50,fine,tool0;"
    data = "VAR pos c;\nVAR pos d:=[10,20,30];\n"
    plain = motions(tmp_path, rapid("MoveJ Offs(p,-10,20,29),v50,fine,tool0;", data=data), "a.mod")[-1]
    turned = motions(tmp_path, rapid(body, data=data), "a.mod")[-1]
    np.testing.assert_allclose(turned.target.pose, plain.target.pose)


@pytest.mark.parametrize("line", ["INTERRUPT ON 21", "INTERRUPT ON", "INTERRUPT ENABLE 21"])
def test_an_interrupt_that_no_file_declares_is_named_where_it_is_switched_on(tmp_path, line):
    found = check(tmp_path, krl(f"{FRAMES}{line}\nPTP {axes(NEAR)}"), "a.src")
    assert codes(found)["program_not_simulated"] == [4]
    assert [(each.place.line, each.what) for each in found.not_examined] == [(4, "instruction")]
    own = "INTERRUPT DECL 21 WHEN $STOPMESS==TRUE DO IR_STOPM ( )"
    assert "program_not_simulated" not in codes(check(tmp_path, krl(f"{own}\n{line}\nPTP {axes(NEAR)}"), "a.src"))


@pytest.mark.parametrize(
    "line",
    [
        *("IWatch i1;", "ISignalDI di1,1,i1;", "ITimer 5,i1;", "TriggInt t,5,i1;", "IPers n,i1;"),
        "TriggL p,v50,t,fine,tool0;",
    ],
)
def test_an_interrupt_or_trigger_that_no_module_sets_up_is_named(tmp_path, line):
    data = "VAR intnum i1;\nVAR triggdata t;\n"
    found = check(tmp_path, rapid(f"{line}\nMoveJ p,v50,fine,tool0;", data=data), "a.mod")
    assert "program_not_simulated" in codes(found)
    ready = "CONNECT i1 WITH tr1;\nTriggIO t,5\\DOp:=do1,1;\n"
    more = 'TRAP tr1\nTPWrite "a";\nENDTRAP\n'
    known = check(tmp_path, rapid(f"{ready}{line}\nMoveJ p,v50,fine,tool0;", more, data), "a.mod")
    assert "program_not_simulated" not in codes(known)


@pytest.mark.parametrize(
    ("start", "later"),
    [
        ("INTERRUPT DECL 3 WHEN $IN[1]==TRUE DO FOO(H)", ""),
        ("INTERRUPT DECL 3 WHEN $IN[1]==TRUE DO FOO(H)", "H=10\n"),  # the interrupt may come after this, too
        ("INTERRUPT DECL 3 WHEN $IN[1]==TRUE DO FOO(1,H)", ""),
        ("TRIGGER WHEN DISTANCE=0 DELAY=0 DO FOO(H) PRIO=-1", ""),
    ],
)
@pytest.mark.parametrize("local", [True, False])
def test_what_an_unknown_routine_beside_the_program_gets_by_reference_is_in_doubt(tmp_path, start, later, local):
    (tmp_path / "a.dat").write_text(f"DEFDAT a\n{'' if local else 'DECL REAL H=5'}\nENDDAT\n")
    declared = "DECL REAL H\n" if local else ""
    body = f"{declared}H=5\n{start}\n{later}PTP {axes(HOME)}\nPTP {{A1 H}}"
    found = check(tmp_path, krl(body), "a.src")
    (missed,) = (each for each in found.findings if each.finding.code == "target_not_given")
    assert (missed.level, missed.finding.reason) == ("caution", "perhaps_changed")
    assert start in say(missed.finding)
    assert "motion" in [each.what for each in found.not_examined]


def test_of_a_known_routine_beside_the_program_an_input_stays_known(tmp_path):
    more = "DEF FOO(X:IN)\nREAL X\n$OUT[1]=X>3\nEND\n"
    body = f"DECL REAL H\nH=5\nINTERRUPT DECL 3 WHEN $IN[1]==TRUE DO FOO(H)\nPTP {axes(HOME)}\nPTP {{A1 H}}"
    assert "target_not_given" not in codes(check(tmp_path, krl(body, more), "a.src"))


@pytest.mark.parametrize("fits", [False, True])
def test_what_a_call_by_an_unknown_name_gets_by_reference_is_in_doubt(tmp_path, fits):
    call = '%"take_"+NumToStr(GInput(gi1),0)% n;'
    more = "PROC take_1(num i)\nENDPROC\n" if fits else ""
    body = f"n:=20;\n{call}\nMoveJ p,v50,fine,tool0;\nMoveJ Offs(p,0,n,0),v50,fine,tool0;"
    found = check(tmp_path, rapid(body, more), "a.mod")
    (missed,) = (each for each in found.findings if each.finding.code == "target_not_given")
    assert (missed.level, missed.finding.reason) == ("caution", "perhaps_changed")
    assert call.removesuffix(";") in say(missed.finding)
    assert [each.place.line for each in found.not_examined if each.what == "motion"] == [missed.place.line]


def test_a_point_that_a_controller_may_skip_where_blends_overlap_is_named(tmp_path):
    points = (((0.38, 0.16), 0), ((0.4, 0.16), 0.015), ((0.4, 0.14), 0.015), ((0.38, 0.14), 0))
    lines = "".join(f"  movel(p[{x},{y},0.32,0,{np.pi},0],v=0.1,r={r})\n" for (x, y), r in points)
    found = check(tmp_path, f"def a():\n  set_tcp(p[0,0,0,0,0,0])\n{lines}end\n")
    skipped = [each for each in found.findings if each.finding.code == "zone_too_large"]
    assert [(each.level, each.place.line) for each in skipped] == [("caution", 4), ("caution", 5)]
    assert "skip the point: the way without it was not followed" in say(skipped[0].finding)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.src", "DEF a(N:IN)\nINT I,N\nFOR I=1 TO N\nPTP {A1 1}\nPTP {A1 2}\nENDFOR\nEND\n"),
        ("a.src", "DEF a( )\nINT I\nFOR I=1 TO $IN[1]\nPTP {A1 I}\nPTP {A1 2}\nENDFOR\nEND\n"),
        ("a.pgm", "(* *)\n\nFOR i := 1 TO n DO\nMJOINT(POINTJ(0,-10,-10,0,-70,i),v5perc,fine,tool0);\nEND_FOR;\n"),
    ],
)
def test_that_the_number_of_a_loops_rounds_is_not_known_and_was_cut_is_named(tmp_path, name, text):
    found = check(tmp_path, text, name, limits=RunLimits(ways=20))
    (cut,) = (each for each in found.findings if each.finding.code == "not_followed_to_end")
    assert (cut.level, cut.place.line, cut.finding.kind) == ("caution", 3, "rounds")
    assert "how often this loop goes round is known on the cell alone" in say(cut.finding)
    assert (3, "course") in [(each.place.line, each.what) for each in found.not_examined]


@pytest.mark.parametrize(
    "line",
    ['b:=StrToVal("5",n);', 'n:=StrMatch("Robotics",1,"bo");', "b:=StrToVal(NumToStr(2.5,1),n);"],
)
def test_what_follows_from_the_text_of_rapid_by_a_function_that_is_not_evaluated_is_a_caution(tmp_path, line):
    found = check(tmp_path, rapid(f"{line}\nMoveJ Offs(p,n,0,0),v50,fine,tool0;"), "a.mod")
    (missed,) = (each for each in found.findings if each.finding.code == "target_not_given")
    assert (missed.level, missed.finding.reason) == ("caution", "not_evaluated")
    assert "kept_to_next_start" not in codes(found)
    outside = check(tmp_path, rapid("b:=StrToVal(ReadStr(f),n);\nMoveJ Offs(p,n,0,0),v50,fine,tool0;"), "a.mod")
    assert [each.level for each in outside.findings if each.finding.code == "target_not_given"] == ["fail"]


@pytest.mark.parametrize(
    ("computed", "value"),
    [
        ("BitAnd(12,10)", 8),
        ("BitOr(12,10)", 14),
        ("BitXOr(12,10)", 6),
        ("BitNeg(250)", 5),
        ("BitLSh(129,1)", 2),
        ("BitRSh(129,1)", 64),
    ],
)
def test_bits_of_rapid_are_those_of_bytes(tmp_path, computed, value):
    there, here = (
        motions(tmp_path, rapid(f"MoveJ Offs(p,{each},0,0),v50,fine,tool0;"), "a.mod")[-1] for each in (computed, value)
    )
    assert np.array_equal(there.target.pose, here.target.pose)


@pytest.mark.parametrize(
    "line",
    [
        'movej([0, to_num(str_cat("-0", ".2")), -0.2, 0, -1.2, 0])',
        "movej([0, -binary_list_to_integer([True]), -0.2, 0, -1.2, 0])",
        "movej([0, -0.2, -0.2, 0, -1.2, 0] + [0.1, 0, 0, 0, 0, 0])",
    ],
)
def test_what_follows_from_the_text_of_urscript_by_what_is_not_evaluated_is_a_caution(tmp_path, line):
    found = check(tmp_path, f"def a():\n  {line}\nend\n", "a.script")
    (missed,) = (each for each in found.findings if each.finding.code == "target_not_given")
    assert (missed.level, missed.finding.reason) == ("caution", "not_evaluated")
    read = check(tmp_path, "def a():\n  movej([0, to_num(socket_read_string()), -0.2, 0, -1.2, 0])\nend\n", "a.script")
    assert [each.level for each in read.findings if each.finding.code == "target_not_given"] == ["fail"]


@pytest.mark.parametrize("grade", ["official", "inferred"])
def test_a_collision_of_assumed_shapes_says_so(tmp_path, grade):
    robot = ROBOT.replace(sources={**ROBOT.sources, "envelopes": replace(ROBOT.sources["envelopes"], grade=grade)})
    down = written(tmp_path, f"movej({text_of_joints(np.radians([0.0, -123.0, 56.0, 0.0, -70.0, 0.0]))})\n", "a.script")
    found = check_program(down, robot, CheckOptions(start=HOME, scene=TABLE))
    said = [say(each.finding) for each in found.findings if each.finding.code == "motion_collides"]
    assert said
    assert all(("of assumed shapes" in each) == (grade == "inferred") for each in said)
