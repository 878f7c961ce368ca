"""Programs that are broken, strange or long: one clear error with file and line, or a finding, within seconds."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from er3a.errors import InputError
from er3a.programs.execution import RunLimits
from er3a.programs.instructions import ArmMotion, Remark, Unknown, UnresolvedTarget
from er3a.programs.languages import execute, read_program
from tests.programs.test_examples import EXAMPLES
from tests.programs.test_other_readers import XPL

BOMB = '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;&a;">]><Xpl-source>&b;</Xpl-source>'
BODY = "<Name>1</Name><Body>"
LIMITS = RunLimits(operations=20_000, ways=50, rounds=20)


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("a.XPL", "MJOINT(POINTJ(0,0,0,0,0,0), v50perc, fine, tool0);", "alarm 4902"),
        ("a.XPL", BOMB, "document type or entities"),
        ("a.XPL", XPL.replace("<pouref>1<", "<pouref>9<"), "no <Pou> '9'"),
        (
            "a.XPL",
            XPL.replace("<Name>1</Name><Body>", "<Name>1</Name><Body><while><pouref>1</pouref></while>"),
            "itself",
        ),
        ("a.XPL", XPL[:-30], "not valid XML"),
        ("a.XPL", "<a>" * 200 + "</a>" * 200, "elements within each other"),
        ("a.XPL", "<robot/>", "top element is <robot>"),
        ("a.XPL", "<Xpl-source><XplEnvironment/></Xpl-source>", "no <Pou>"),
        ("a.pgm", "(* open", "a comment has no end"),
        ("a.pgm", 'x := "open;', "a text has no end"),
        ("a.pgm", "WHILE true DO DWELL(1);", "WHILE that begins here has no end"),
        ("a.pgm", "END_IF;", "none is open"),
        ("a.pgm", "DWELL(1); MJOINT(P1", "End each statement with ;"),
        ("a.script", "def a():\n  movej([0,0,0,0,0,0])\n", "a has no end"),
        ("a.script", "def a():\n  movej([0,0,0\nend\n", "bracket"),
        ("a.script", 'def a():\n  textmsg("open)\nend\n', "a text has no end"),
        ("a.script", "def a():\n  while (True):\nend\n", "has no end"),
        ("a.script", "end\n", "without a beginning"),
        ("a.csv", "t_s,q1_deg\n0,1\n", "a table of joint values is a path, not a program"),
        ("a.src", "", "is empty"),
        ("a.src", "DEF a( )\nFOR i=1 TO\nENDFOR\nEND\n", "line 2: this FOR can't be read"),
        ("a.src", "DEF a( )\nSWITCH i\nCASE {\nENDSWITCH\nEND\n", "line 3: this CASE can't be read"),
        ("a.txt", "hello\n", "not a known robot program"),
        ("a.dat", "DEFDAT A\nENDDAT\n", "Give its .src file"),
        ("a.pgf", "<Program>\n<Module>a.mod</Module>\n</Program>\n", "lists the modules of a program"),
    ],
)
def test_one_clear_error(name, text, told, tmp_path):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_program(path)
    assert told in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_no_text_or_is_not_there(tmp_path):
    path = tmp_path / "a.src"
    path.write_bytes(bytes(range(256)) * 10)
    with pytest.raises(InputError):
        read_program(path)
    with pytest.raises(InputError, match="no such file"):
        read_program(tmp_path / "none.src")
    with pytest.raises(InputError, match="not a file"):
        read_program(tmp_path)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "gbk"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_encodings_and_line_ends(encoding, end, tmp_path):
    text = f"DEF a( ){end}; 取料点 上方{end}PTP {{A1 1,A2 0,A3 0,A4 0,A5 0,A6 0}}{end}END{end}"
    (tmp_path / "a.src").write_bytes(text.encode(encoding))
    execution = execute(read_program(tmp_path / "a.src"))
    remark, motion = execution.steps
    assert remark.instruction == Remark("取料点 上方")
    assert motion.place.line == 3


def test_languages_are_told_by_what_the_file_holds(tmp_path):
    for name, language in (("pick_place.src", "krl"), ("pick_place.script", "urscript"), ("pick_place.pgm", "rpl")):
        path = tmp_path / "program.txt"
        path.write_bytes((EXAMPLES / name).read_bytes())
        assert read_program(path).language == language
    (tmp_path / "a.pgm").write_text(XPL)
    assert read_program(tmp_path / "a.pgm").language == "xpl"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.src", "DEF a( )\n$OUT[1]=TRUE\nEND\n"),
        ("a.script", "def a():\n  sleep(1)\nend\n"),
        ("a.pgm", "DWELL(1);\n"),
    ],
)
def test_no_motion_at_all_is_a_finding(name, text, tmp_path):
    (tmp_path / name).write_text(text)
    assert not read_program(tmp_path / name).motions()


def test_deep_nesting_and_long_expressions_end(tmp_path):
    deep = "(" * 500 + "1" + ")" * 500
    chain = "+".join(["1"] * 5000)
    (tmp_path / "a.src").write_text(f"DEF a( )\nX={deep}\nX={chain}\nPTP {{A1 1,A2 0,A3 0,A4 0,A5 0,A6 0}}\nEND\n")
    steps = execute(read_program(tmp_path / "a.src")).steps
    assert [each.place.line for each in steps if isinstance(each.instruction, Unknown)] == [2, 3]
    (tmp_path / "b.src").write_text("DEF b( )\n" + "LOOP\n" * 5000 + "ENDLOOP\n" * 5000 + "END\n")
    with pytest.raises(InputError, match="blocks within each other"):
        read_program(tmp_path / "b.src")


def test_many_branches_on_inputs_end_within_the_limits(tmp_path):
    body = "".join(f"IF $IN[{i}] THEN\nx[{i}]=1\nENDIF\n" for i in range(60))
    (tmp_path / "a.src").write_text(f"DEF a( )\n{body}PTP {{A1 x[1],A2 0,A3 0,A4 0,A5 0,A6 0}}\nEND\n")
    execution = execute(read_program(tmp_path / "a.src"))
    assert execution.complete
    (motion,) = {each.instruction.target for each in execution.steps if isinstance(each.instruction, ArmMotion)}
    assert isinstance(motion, UnresolvedTarget)


@pytest.mark.long
@pytest.mark.parametrize("name", ["a.src", "a.script", "a.pgm"])
def test_all_of_10_000_lines_are_read_and_run(name, tmp_path):
    count = 10_000
    lines = {
        "a.src": "LIN {X 1.5,Y 2.25,Z 300.125,A 0.0,B 90.0,C 0.0} C_DIS\n",
        "a.script": "  movel(p[0.5,0.25,0.3,0.0,1.0,0.0], a=1.2, v=0.25, r=0.001)\n",
        "a.pgm": 'MLIN(POINTC(1.5,1.0,2.0,3.0,4.0,5.0,"CFG2",0,0,0), v50perc, fine, tool0);\n',
    }[name]
    head, tail = {"a.src": ("DEF a( )\n", "END\n"), "a.script": ("def a():\n", "end\n"), "a.pgm": ("", "")}[name]
    (tmp_path / name).write_text(head + lines * count + tail)
    execution = execute(read_program(tmp_path / name))
    assert len(execution.motions) == count
    assert isinstance(execution.steps[-1].instruction, ArmMotion)


SEEDS = [path for path in sorted(EXAMPLES.iterdir()) if path.suffix in (".src", ".script", ".pgm", ".XPL")]
WORDS = ("END", "DEF", "LOOP", "(*", "1e999", "中", "\x00")
LETTERS = st.sampled_from([*"(){}[]\"';:,.=*#$-+/\\<>&!?0 9eE\n\r\tAzIF_", *WORDS])


def refused(path):
    """The error with which a program is refused; None if it is read, and then it can be run."""
    try:
        program = read_program(path)
    except InputError as error:
        return error
    assert len(execute(program, limits=LIMITS).endings) >= (program.entry in program.routines)
    return None


@pytest.mark.long
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_programs_are_read_or_refused_clearly(data, tmp_path):
    seed = data.draw(st.sampled_from(SEEDS))
    content = seed.read_text(encoding="utf-8")
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(content)))
        cut = data.draw(st.integers(0, 12))
        content = content[:at] + data.draw(LETTERS) + content[at + cut :]
    path = tmp_path / seed.name
    path.write_text(content, encoding="utf-8", newline="")
    error = refused(path)
    assert error is None or (error.file == str(path) and "\n" not in str(error))


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.binary(max_size=300), suffix=st.sampled_from([".src", ".script", ".pgm", ".XPL", ".csv", ".txt"]))
def test_any_bytes_are_read_or_refused_clearly(content, suffix, tmp_path):
    path = tmp_path / f"any{suffix}"
    path.write_bytes(content)
    error = refused(path)
    assert error is None or "\n" not in str(error)


@pytest.mark.timeout(20)  # a pattern that tries every way to split them takes hours
def test_numbers_of_many_digits_and_long_words_are_read_at_once(tmp_path):
    text = "movep(p[" + "9" * 200 + ",0.18,0.3 - x*0.01,3.1416,0,0], a=1.2, v=0.1)\n"
    (tmp_path / "a.script").write_text(text)
    (tmp_path / "a.src").write_text("DEF a( )\nPTP {A1 1} " + "C_A" * 40 + "!\nEND\n")
    assert read_program(tmp_path / "a.script").motions()
    assert any(isinstance(each.instruction, Unknown) for each in execute(read_program(tmp_path / "a.src")).steps)


def test_an_archive_is_to_be_unpacked(tmp_path):
    (tmp_path / "a.src").write_bytes(b"PK\x03\x04\x14\x00\x00\x00")
    with pytest.raises(InputError, match="is a ZIP archive"):
        read_program(tmp_path / "a.src")
