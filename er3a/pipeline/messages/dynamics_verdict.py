"""The dynamics stage's verdict as a sentence, and the words that it shares with the page."""

from __future__ import annotations

from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import Plural, joined, say, say_as, sentence, texts, word
from er3a.pipeline.stages.dynamics.model import (
    AllWithin,
    Compared,
    DataOpen,
    Marginal,
    Need,
    NoData,
    NoLimits,
    Quantity,
    Use,
)

QUANTITIES: dict[Quantity, str] = {
    "peak": N_("peak torque"),
    "rms": N_("RMS torque"),
    "holding": N_("holding torque"),
    "payload": N_("payload"),
    "moment": N_("wrist moment"),
    "inertia": N_("wrist inertia"),
}
NEEDS: dict[Need, str] = {
    "masses": N_("mass, centre of mass and inertia of the links"),
    "peak": N_("peak torques of the drives"),
    "rated": N_("rated torques of the drives"),
    "armature": N_("rotor inertias and gear ratios"),
    "friction": N_("friction of the joints"),
    "wrist_moment": N_("allowed moments at the wrist"),
    "wrist_inertia": N_("allowed inertias at the wrist"),
    "payload": N_("rated payload"),
    "load": N_("mass, centre and inertia of tool and payload"),
}


TEXTS = texts(
    {
        "dynamics.use#path": (
            "{what} at J{joint} on {path}: {asked:.3g} {unit} of {allowed:.3g} {unit} ({percent:.0f} %)"
        ),
        "dynamics.use#value": "{what} {asked:.3g} {unit} of {allowed:.3g} {unit} ({percent:.0f} %)",
        "dynamics.use#joint": "{what} at J{joint}: {asked:.3g} {unit} of {allowed:.3g} {unit} ({percent:.0f} %)",
        "dynamics.no_data": "No data: torques need masses. Needed: {needs}.",
        "dynamics.no_limits#path": (
            "No drive's limits are known, so the motors can't be judged. The greatest torque is {torque:.3g} ± "
            "{tolerance:.2g} {unit}, at J{joint} on path {path}."
        ),
        "dynamics.no_limits#holding": (
            "No drive's limits are known, so the motors can't be judged. The greatest holding torque is {torque:.3g} "
            "± {tolerance:.2g} {unit}, at J{joint}."
        ),
        "dynamics.fits": "Fits: every quantity with a known limit is within it; highest utilisation: {use}.",
        "dynamics.unlimited": "Unknown, wholly or in part: {what}.",
        "dynamics.marginal": (
            "Marginal: within the limits, but masses are too uncertain or doubtful to rely on it; highest "
            "utilisation: {use}."
        ),
        "dynamics.overload": Plural(
            "count",
            "Overload: {beyond} of {count} comparison is beyond its limit; worst: {use}.",
            "Overload: {beyond} of {count} comparisons are beyond their limits; worst: {use}.",
        ),
        "dynamics.massless": Plural(
            "count",
            "Link {links} has no mass in the file and counts as massless.",
            "Links {links} have no mass in the file and count as massless.",
        ),
        "dynamics.doubts": Plural(
            "count", "{count} finding casts doubt on the masses.", "{count} findings cast doubt on the masses."
        ),
        "dynamics.inferred": "Masses are inferred: the results are orders of magnitude only.",
        "dynamics.unknown#joints": "{what}: J{numbers}",
        "dynamics.unknown#links": "{what}: link {numbers}",
    }
)


def need_word(need: Need) -> str:
    """What is asked for."""
    return word("dynamics.need", NEEDS, need)


def quantity_word(quantity: Quantity) -> str:
    """What is compared."""
    return word("dynamics.quantity", QUANTITIES, quantity)


def use_text(use: Use) -> str:
    """What is asked for and allowed, where."""
    parts = {
        "what": quantity_word(use.quantity),
        "asked": use.asked,
        "allowed": use.allowed,
        "unit": use.unit,
        "percent": 100 * use.ratio,
        "joint": use.joint,
        "path": use.path,
    }
    if use.joint is None:
        return sentence("dynamics.use#value", **parts)
    if use.path is None:
        return sentence("dynamics.use#joint", **parts)
    return sentence("dynamics.use#path", **parts)


@say.register
def _(found: NoData) -> str:
    needs: list[Need] = [each.what for each in found.needs if each.what in ("masses", "peak", "load")]
    return say_as(found, needs=joined(map(need_word, needs), ", "))


@say.register
def _(found: NoLimits) -> str:
    parts = {"joint": found.joint, "torque": found.torque, "tolerance": found.tolerance, "unit": found.unit}
    if found.path:
        greatest = say_as(found, "path", path=found.path, **parts)
    else:
        greatest = say_as(found, "holding", **parts)
    return joined([greatest, *_reservations(found)], " ")


@say.register
def _(found: Compared) -> str:
    tightest = use_text(found.tightest)
    if isinstance(found, AllWithin):
        told = sentence("dynamics.fits", use=tightest)
    elif isinstance(found, Marginal):
        told = sentence("dynamics.marginal", use=tightest)
    else:
        told = sentence("dynamics.overload", count=found.compared, beyond=found.beyond, use=tightest)
    open_ = ""
    if found.unlimited:
        what = joined(map(need_word, found.unlimited), ", ")
        open_ = sentence("dynamics.unlimited", what=what)
    return joined([told, open_, *_reservations(found)], " ")


def _reservations(found: Compared | NoLimits) -> list[str]:
    missing = ", ".join(map(str, found.missing_links))
    return [
        sentence("dynamics.massless", count=len(found.missing_links), links=missing) if missing else "",
        sentence("dynamics.doubts", count=found.doubts) if found.doubts else "",
        sentence("dynamics.inferred") if found.inferred else "",
    ]


@say.register
def _(found: DataOpen) -> str:
    if not found.numbers:
        return need_word(found.what)
    parts = {"what": need_word(found.what), "numbers": ", ".join(map(str, found.numbers))}
    if found.what == "masses":
        return sentence("dynamics.unknown#links", **parts)
    return sentence("dynamics.unknown#joints", **parts)
