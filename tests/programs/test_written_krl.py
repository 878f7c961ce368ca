"""What is written in KRL keeps to the language: lines, brackets, commas, names."""

from __future__ import annotations

import re

import numpy as np
import pytest

from er3a.programs.instructions import ArmMotion, JointTarget, Listing, Pause
from er3a.programs.languages import execute, read_program, write_program
from er3a.programs.writing import WriteOptions
from tests.programs.test_round_trips import ROBOT, listing_of, tool_path


def test_each_line_is_one_that_the_language_has():
    q, command = tool_path()
    text = write_program(listing_of(command, ROBOT, q, "2 weld seam!").listing, "krl", WriteOptions(ROBOT)).files[
        ".src"
    ]
    number, name = r"-?\d+\.\d+", r"[A-Z][A-Z0-9]*"
    position = rf"\{{(?:FRAME: )?{name} {number}(?:,{name} {number})*\}}"
    known = [
        r"&\w+ \w+",
        r"DEF p2_weld_seam\( \)",
        r"END",
        r"; .*",
        r"BAS\(#\w+,\d+(?:\.\d+)?\)",
        rf"\$[A-Z.]+=(?:{number}|\$NULLFRAME|{position})",
        rf"(?:PTP|LIN) {position}(?: C_\w+)?",
        rf"CIRC {position}, {position}",
    ]
    lines = text.rstrip("\n").split("\n")
    assert [line for line in lines if not any(re.fullmatch(each, line) for each in known)] == []
    assert text.isascii()
    first = next(line for line in lines if line.startswith(("PTP", "LIN", "CIRC")))
    assert first.startswith("PTP {A1 ")


def test_waits_and_loops():
    listing = Listing("waits", (Pause(0.5), Pause(), Pause(condition="$IN[3]")), repeats_from=1, language="krl")
    lines = write_program(listing, "krl").files[".src"].split("\n")
    assert lines[4:] == ["WAIT SEC 0.5", "LOOP", "HALT", "WAIT FOR $IN[3]", "ENDLOOP", "END", ""]


@pytest.mark.parametrize("name", ["loop", "End", "LIN", "movej", "halt"])
@pytest.mark.parametrize("language", ["krl", "urscript", "rpl", "xpl"])
def test_no_program_is_named_by_a_word_of_its_language(name, language, tmp_path):
    listing = Listing(name, (ArmMotion("joint", JointTarget(np.zeros(6))),))
    written = write_program(listing, language)
    assert written.name == f"p{name}"
    for suffix, text in written.files.items():
        (tmp_path / f"{written.name}{suffix}").write_text(text)
    path = tmp_path / f"{written.name}{next(iter(written.files))}"
    assert len(execute(read_program(path)).motions) == 1
