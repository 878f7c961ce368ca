"""Sentences about the texts of programs: what was read, and what was written of a sequence."""

from __future__ import annotations

from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.say import counted, say, sentence
from er3a.programs import program_findings as text


@say.register
def _(found: text.DataFileMissing) -> str:
    return sentence(found.code, "{file} is missing, which holds the program's points", file=found.file)


@say.register
def _(found: text.NameTwice) -> str:
    return sentence(found.code, "{name} is declared twice; the later one counts", name=found.name)


@say.register
def _(found: text.NotUnderstood) -> str:
    return sentence(found.code, "not understood: {text}", text=found.text)


@say.register
def _(found: text.FormInferred) -> str:
    return sentence(
        found.code,
        "the structure of <{element}> is not documented; it was read like that of <while>",
        element=found.element,
    )


@say.register
def _(found: text.OtherEncoding) -> str:
    return sentence(found.code, "the file is not UTF-8; it was read as {encoding}", encoding=found.encoding)


@say.register
def _(found: text.NothingMoves) -> str:
    return sentence(found.code, "no instruction moves the arm")


@say.register
def _(found: text.ArcsSplit) -> str:
    return counted(
        found.code,
        "{count} arc written as {lines} lines that stay within {deviation:g} mm of it",
        "{count} arcs written as {lines} lines that stay within {deviation:g} mm of them",
        found.arcs,
        lines=found.lines,
        deviation=found.deviation_m * 1000,
    )


@say.register
def _(found: text.ZonesDropped) -> str:
    return counted(
        found.code,
        "{count} zone has no equivalent in this language: the arm stops there",
        "{count} zones have no equivalent in this language: the arm stops there",
        found.zones,
    )


@say.register
def _(found: text.SplinesAsLines) -> str:
    return counted(
        found.code,
        "{count} point of splines written as a straight line",
        "{count} points of splines written as straight lines",
        found.points,
    )


@say.register
def _(found: text.SpeedsEstimated) -> str:
    return counted(
        found.code,
        "{count} duration written as a speed: the controller's ramps decide the time",
        "{count} durations written as speeds: the controller's ramps decide the time",
        found.motions,
    )


@say.register
def _(found: text.SpeedsCut) -> str:
    return counted(
        found.code,
        "{count} speed above the joints' limit written as that limit",
        "{count} speeds above the joints' limit written as that limit",
        found.motions,
    )


@say.register
def _(found: text.HalfTurnsSplit) -> str:
    return counted(
        found.code,
        "{count} line that turns the tool by 180 deg written in two halves, which fixes the sense",
        "{count} lines that turn the tool by 180 deg written in two halves, which fixes the sense",
        found.lines,
    )


@say.register
def _(found: text.TargetsLeftOut) -> str:
    return counted(
        found.code,
        "{count} motion left out: its target is not known",
        "{count} motions left out: their targets are not known",
        found.motions,
    )


@say.register
def _(found: text.ToolNotGiven) -> str:
    return sentence(found.code, "set this tool or base on the controller: {name}", name=found.name)


@say.register
def _(found: text.ValuesRounded) -> str:
    return counted(
        found.code,
        "{count} speed or zone rounded down to the next that has a name",
        "{count} speeds or zones rounded down to the next that has a name",
        found.values,
    )


@say.register
def _(found: text.NotTranslated) -> str:
    return counted(
        found.code,
        "{count} instruction of the other language kept as a comment",
        "{count} instructions of the other language kept as comments",
        found.instructions,
    )


@say.register
def _(found: text.WrittenUnsafe) -> str:
    return sentence(
        found.code, "the path {name} is not safe: {verdict}", name=found.path, verdict=outcome_word(found.verdict)
    )
