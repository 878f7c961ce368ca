"""Numbers have 32 bits on controllers that say so: where that decides, both ways are followed.

What the controller computes is worked out here with numpy's single precision.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from er3a.programs import syntax
from er3a.programs.evaluation import Cell, ProgramMemory
from er3a.programs.instructions import Decision, JointTarget
from er3a.programs.krl.dialect import KrlDialect
from er3a.programs.languages import read_program
from er3a.programs.machine import execute
from testing.program_texts import krl, motions

EMPTY = syntax.Program("krl", "a", None, {}, "A")
SIGNS = {"+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide}
numbers = st.floats(-1000, 1000).map(lambda x: round(x, 3))


def turns(folder, body: str) -> set[float]:
    """Where joint 1 may go, deg."""
    found = motions(folder, krl(body), "a.src")
    return {
        round(float(np.degrees(each.target.joints[0])), 6) for each in found if isinstance(each.target, JointTarget)
    }


def test_a_loop_over_tenths_is_followed_with_either_number_of_rounds(tmp_path):
    rounds, sum_ = 0, np.float32(0)
    while sum_ < np.float32(1):
        rounds, sum_ = rounds + 1, sum_ + np.float32(0.1)
    body = "REAL R\nINT N\nR=0.0\nN=0\nWHILE R<1.0\nR=R+0.1\nN=N+1\nENDWHILE\nPTP {A1 N}"
    assert rounds in turns(tmp_path, body)  # 10; in double precision 11
    exact = body.replace("0.1", "0.125")
    assert turns(tmp_path, exact) == {8.0}  # eighths are exact in both: one way only


@pytest.mark.parametrize(
    ("condition", "both"),
    [
        ("R==16777217.0", True),  # R=16777216.0+1.0, which single precision has as 16777216
        ("R>16777000.0", False),
        ("0.1==0.1", False),
        ("0.5+0.25==0.75", False),
        ("0.1+0.2==0.3", True),
        ("3*0.1<0.31", False),
        ("SIN(180)==0.0", True),
    ],
)
def test_a_comparison_is_open_where_rounding_decides_it(tmp_path, condition, both):
    body = f"REAL R\nR=16777216.0+1.0\nIF {condition} THEN\nPTP {{A1 5}}\nELSE\nPTP {{A1 9}}\nENDIF"
    assert (turns(tmp_path, body) >= {5.0, 9.0}) == both


@pytest.mark.parametrize("expression", ["ABS(-S)==1.0", "SQRT(S)==1.0", "SIN(90.0*S)<1.0", "ATAN2(S,1.0)==45.0"])
def test_a_function_passes_on_how_far_off_its_argument_may_be(tmp_path, expression):
    """S is 1 in double precision; in single precision 0.7 + 0.2 + 0.1 may be another number."""
    body = f"REAL S\nS=0.1+0.2+0.7\nIF {expression} THEN\nPTP {{A1 5}}\nELSE\nPTP {{A1 9}}\nENDIF"
    assert turns(tmp_path, body) >= {5.0, 9.0}
    assert (
        len(turns(tmp_path, body.replace("0.1+0.2+0.7", "0.25+0.25+0.5").replace("ATAN2(S,1.0)==45.0", "S==1.0"))) == 1
    )


def test_whole_numbers_have_32_bits(tmp_path):
    assert turns(tmp_path, "INT N\nN='HFFFFFFFF'\nPTP {A1 N}") == {-1.0}
    over = "INT N\nN=2147483647\nN=N+1\nIF N>0 THEN\nPTP {A1 5}\nELSE\nPTP {A1 9}\nENDIF"
    assert turns(tmp_path, over) == {5.0, 9.0}


@given(st.lists(st.tuples(st.sampled_from(sorted(SIGNS)), numbers), min_size=1, max_size=8), numbers)
def test_what_single_precision_computes_is_within_what_is_kept_of_it(steps, first):
    memory = ProgramMemory(KrlDialect(EMPTY), Cell())
    own, kept = np.float32(first), syntax.Constant(first)
    for sign, number in steps:
        with np.errstate(all="ignore"):
            own = SIGNS[sign](own, np.float32(number))
        kept = syntax.Constant(memory.value(syntax.Binary(sign, kept, syntax.Constant(number))))
        if not np.isfinite(own) or isinstance(kept.value, syntax.Unclear):
            return
    for other in (float(own), float(np.nextafter(own, np.float32(np.inf)))):
        said = memory.value(syntax.Binary("==", kept, syntax.Constant(other)))
        assert isinstance(said, syntax.Unclear) or said == (other == float(own))
    below = memory.value(syntax.Binary("<", kept, syntax.Constant(first)))
    assert isinstance(below, syntax.Unclear) or below == bool(own < np.float32(first))


def test_numbers_of_rapid_have_32_bits_too(tmp_path):
    file = tmp_path / "a.mod"
    file.write_text(
        "MODULE a\nPROC main()\nVAR num r:=0;\nVAR num n:=0;\nWHILE r<1 DO\nr:=r+0.1;\nn:=n+1;\nENDWHILE\n"
        "MoveAbsJ [[n,0,0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;\nENDPROC\nENDMODULE\n"
    )
    found = [each.instruction for each in execute(read_program(file)).steps if hasattr(each.instruction, "target")]
    assert {round(float(np.degrees(each.target.joints[0]))) for each in found} >= {10, 11}


@pytest.mark.parametrize(
    ("body", "rounds"),
    [
        ("x = 0\nn = 0\nwhile x < 1.0:\n x = x + 0.1\n n = n + 1\nend", {10, 11}),
        ("x = 0\nn = 0\nwhile x < 1.0:\n x = x + 0.125\n n = n + 1\nend", {8}),
        ("n = 0\nif sqrt(2) * sqrt(2) == 2:\n n = 1\nend", {0, 1}),
        ("x = [3, 4]\nn = x[floor(0.3 * 4)]", {4}),
        ("n = 0\nif abs(-2) == 2:\n n = 1\nend", {1}),
        ("n = floor(7 / 3) + ceil(0.3 / 0.2)", {4}),
        ("n = 0.75 % 0.5 * 4", {1}),
        ("n = floor((0.1 + 0.3) % 0.3 * 10 + 0.5)", {1}),
        ("n = floor((0.1 + 0.2) ^ 2 * 100 + 0.5)", {9}),
    ],
)
def test_numbers_of_urscript_have_32_bits(tmp_path, body, rounds):
    found = motions(tmp_path, f"{body}\nmovej([n * 0.0625, 0, 0, 0, 0, 0])\n", "a.script")
    assert {float(each.target.joints[0] / 0.0625) for each in found} == rounds


@pytest.mark.parametrize("number", ["floor(0.3 / 0.1)", "ceil(0.1 + 0.2 + 0.7)", "(0.1 + 0.2) % 0.1"])
def test_what_rounding_makes_another_number_has_no_value(tmp_path, number):
    (found,) = motions(tmp_path, f"n = {number}\nmovej([n * 0.0625, 0, 0, 0, 0, 0])\n", "a.script")
    assert found.target.reason == "not_understood"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.script", "n = 2147483647\nn = n + 1\nif n > 0:\n movej([0.1, 0, 0, 0, 0, 0])\nend\n"),
        (
            "a.pgm",
            "n := 2147483647;\nn := n + 1;\nIF n > 0 THEN\nMJOINT(POINTJ(3,0,0,0,0,0),v50perc,fine,tool0);\nEND_IF;\n",
        ),
    ],
)
def test_a_whole_number_beyond_32_bits_is_not_known(tmp_path, name, text):
    if name == "a.pgm":
        (tmp_path / "a.var").write_text("n : DINT\n")
    (tmp_path / name).write_text(text)
    steps = execute(read_program(tmp_path / name)).steps
    assert any(isinstance(step.instruction, Decision) for step in steps)
