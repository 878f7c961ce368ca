"""Sentences about the texts of programs: what was read, and what was written of a sequence."""

from __future__ import annotations

from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.say import Plural, say, say_as, texts
from er3a.programs import program_findings as text

TEXTS = texts(
    {
        "program_data_file_missing": "{file} is missing, which holds the program's points",
        "program_name_twice": "{name} is declared twice; the later one counts",
        "program_not_understood": "not understood: {text}",
        "program_form_inferred": "the structure of <{element}> is not documented; it was read like that of <while>",
        "program_other_encoding": "the file is not UTF-8; it was read as {encoding}",
        "program_nothing_moves": "no instruction moves the arm",
        "written_zones_dropped": Plural(
            "zones",
            "{count} zone has no equivalent in this language: the arm stops there",
            "{count} zones have no equivalent in this language: the arm stops there",
        ),
        "written_splines_as_lines": Plural(
            "points",
            "{count} point of splines written as a straight line",
            "{count} points of splines written as straight lines",
        ),
        "written_speeds_estimated": Plural(
            "motions",
            "{count} duration written as a speed: the controller's ramps decide the time",
            "{count} durations written as speeds: the controller's ramps decide the time",
        ),
        "written_speeds_cut": Plural(
            "motions",
            "{count} speed above the joints' limit written as that limit",
            "{count} speeds above the joints' limit written as that limit",
        ),
        "written_half_turns_split": Plural(
            "lines",
            "{count} line that turns the tool by 180 deg written in two halves, which fixes the sense",
            "{count} lines that turn the tool by 180 deg written in two halves, which fixes the sense",
        ),
        "written_targets_left_out": Plural(
            "motions",
            "{count} motion left out: its target is not known",
            "{count} motions left out: their targets are not known",
        ),
        "written_tool_not_given": "set this tool or base on the controller: {name}",
        "written_values_rounded": Plural(
            "values",
            "{count} speed or zone rounded down to the next that has a name",
            "{count} speeds or zones rounded down to the next that has a name",
        ),
        "written_not_translated": Plural(
            "instructions",
            "{count} instruction of the other language kept as a comment",
            "{count} instructions of the other language kept as comments",
        ),
        "written_arcs_split": Plural(
            "arcs",
            "{count} arc written as {lines} lines that stay within {deviation:g} mm of it",
            "{count} arcs written as {lines} lines that stay within {deviation:g} mm of them",
        ),
        "written_unsafe": "the path {path} is not safe: {verdict}",
    }
)


@say.register
def _(found: text.ArcsSplit) -> str:
    return say_as(found, deviation=found.deviation_m * 1000)


@say.register
def _(found: text.WrittenUnsafe) -> str:
    return say_as(found, verdict=outcome_word(found.verdict))
