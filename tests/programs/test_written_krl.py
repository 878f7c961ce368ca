"""What is written in KRL keeps to the language: lines, brackets, commas, names."""

from __future__ import annotations

import re

from er3a.programs.instructions import Listing, Pause
from er3a.programs.write_program import write_program
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
