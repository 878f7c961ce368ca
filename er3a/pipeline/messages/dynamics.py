"""The verdict of the dynamics stage, and what its page and recording say of masses."""

from __future__ import annotations

import re
from typing import get_args

import numpy as np

import er3a.pipeline.messages.planning  # noqa: F401
from er3a.dynamics.margins import Binding
from er3a.finding import Finding
from er3a.pipeline.language import N_, own_title
from er3a.pipeline.messages.numbers import at_least
from er3a.pipeline.messages.say import Plural, by, joined, say, say_as, says, sentence, texts, word
from er3a.pipeline.messages.scope import names_in_words
from er3a.pipeline.results import Summary
from er3a.pipeline.stages.dynamics import model
from er3a.robots.masses import NoBody
from er3a.robots.robot import Grade, Robot

QUANTITIES: dict[model.Quantity, str] = {
    "peak": N_("peak torque"),
    "rms": N_("RMS torque"),
    "holding": N_("holding torque"),
    "payload": N_("payload"),
    "moment": N_("wrist moment"),
    "inertia": N_("wrist inertia"),
}
NEEDS: dict[model.Need, str] = {
    "masses": N_("mass, centre of mass and inertia of the links"),
    "peak": N_("peak torques of the drives"),
    "rated": N_("rated torques of the drives"),
    "armature": N_("rotor inertias and gear ratios"),
    "friction": N_("friction of the joints"),
    "wrist_moment": N_("allowed moments at the wrist"),
    "wrist_inertia": N_("allowed inertias at the wrist"),
    "payload": N_("rated payload"),
    "load": N_("mass, centre and inertia of tool and payload"),
    "tool": N_("mass of the tool"),
    "carried": N_("mass of what the tool carries"),
    "load_centre": N_("centre of mass of tool or payload"),
    "load_inertia": N_("inertia of tool or payload"),
    "drives_guess": N_("the drives' limits, which the robot's file guesses"),
    "wrist_guess": N_("the wrist's limits, which the robot's file guesses"),
    "load_guess": N_("the mass of tool or payload, which the study guesses"),
}
names_in_words("load", "dynamics.need", NEEDS)
KEY_FIGURES = {
    "paths": N_("Paths that count"),
    "mass": N_("Mass of the links"),
    "peak_torque": N_("Greatest torque on a path that the model does not rule out"),
    "holding_torque": N_("Greatest holding torque found"),
    "energy": N_("Greatest energy of a path that the model does not rule out"),
    "utilisation": N_("Highest utilisation of a limit"),
    "power_balance": N_("Power balance, greatest error"),
}
GRADED: dict[Grade, str] = {
    "cad": N_("taken from a CAD model"),
    "export": N_("exported from a CAD model"),
    "claim": N_("claimed by others"),
}
BINDING: dict[Binding, str] = {"peak": N_("peak"), "rms": N_("RMS"), "speed": N_("speed")}
WHY: dict[NoBody, str] = {
    "not_finite": N_("contains something that is not a number"),
    "negative_mass": N_("its mass is below 0"),
    "negative_moment": N_("a principal moment is below 0"),
    "triangle": N_("a principal moment exceeds the sum of the other two"),
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
            "No drive's limits are known, so the motors can't be judged. On the paths that the model does not rule "
            "out the greatest torque is {torque:.3g} ± {tolerance:.2g} {unit}, at J{joint} on path {path}."
        ),
        "dynamics.no_limits#holding": (
            "No drive's limits are known, so the motors can't be judged. The greatest holding torque is {torque:.3g} "
            "± {tolerance:.2g} {unit}, at J{joint}."
        ),
        "dynamics.no_limits#at_rest": (
            "Holding still in the worst pose found takes {torque:.3g} ± {tolerance:.2g} {unit}, at J{joint}."
        ),
        "dynamics.fits": "Fits: every quantity with a stated limit is within it; highest utilisation: {use}.",
        "dynamics.unlimited": "Unknown, wholly or in part: {what}.",
        "dynamics.marginal": (
            "Marginal: within the limits, but masses are too uncertain or doubtful to rely on it; highest "
            "utilisation: {use}."
        ),
        "dynamics.marginal#open": (
            "Within the limits that are stated, but not everything was examined; highest utilisation: {use}."
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
        "dynamics.graded": (
            "The masses are {grade}, neither measured nor given by the manufacturer, so the torques are just as "
            "uncertain."
        ),
        "dynamics.not_run": Plural(
            "count",
            "{count} path may not be run as it is and counts for nothing: {names}.",
            "{count} paths may not be run as they are and count for nothing: {names}.",
        ),
        "dynamics.unknown#joints": "{what} (J{numbers})",
        "dynamics.unknown#links": "{what} (link {numbers})",
        "missing_link": by(
            "singular",
            false="link {link}: no mass is given; it counts as massless",
            true=(
                "link {link}: no mass, inertia or rotor is given; its joint's torque counts as 0, and accelerations "
                "under given torques (forward dynamics) have no value"
            ),
        ),
        "point_mass": "link {link}: mass without inertia",
        "inertia_without_mass": "link {link}: inertia without mass; it is used as given",
        "centre_outside": (
            "link {link}: the centre of mass is {outside_mm:.0f} mm outside the link's shape; check its frame and unit"
        ),
        "unlikely_density": (
            "link {link}: {mass_kg:.4g} kg in the link's shape make {density_kg_m3:.3g} kg/m³; check g against kg"
        ),
        "unlikely_inertia": (
            "link {link}: the radius of gyration is {gyration_mm:.3g} mm, that of the link's shape {shape_mm:.3g} mm; "
            "check the unit of the inertia (kg m²)"
        ),
        "about_origin": (
            "link {link}: the inertia looks as if it were about the frame's origin, not the centre of mass: "
            "{given_kg_m2:.3g} kg m² given, {about_centre_kg_m2:.3g} if so, {shape_kg_m2:.3g} by the link's shape"
        ),
        "sum_off_weight": "the links' masses add to {sum_kg:.4g} kg, and the manufacturer states {weight_kg:.4g} kg",
        "payload.bounded": (
            "At most {kg} kg on the paths that the model does not rule out, limited by torques on {path}."
        ),
        "payload.bounded#joint": (
            "At most {kg} kg, limited by the {by} torque of J{joint} on {path}, on the paths that the model does not "
            "rule out."
        ),
        "payload.partly": Plural(
            "count", "{count} quantity is not known and left out.", "{count} quantities are not known and left out."
        ),
        "payload.guessed": "It rests on guesses: {what}.",
        "payload.guessed_masses": "the masses of the links",
        "payload.left_out": "Left out, because not known: {what}.",
        "payload.unknown": Plural(
            "count",
            "Not known, for lack of {count} quantity: mount nothing until the manufacturer gives the rated payload.",
            "Not known, for lack of {count} quantities: mount nothing until the manufacturer gives the rated payload.",
        ),
        "payload.ask": "Ask for: {what}.",
        "payload.not_examined": (
            "Not examined in this study: mount nothing until the manufacturer gives the rated payload."
        ),
        "payload.not_examined#rated": "Not examined in this study.",
        "payload.unknown#rated": Plural(
            "count", "Not known, for lack of {count} quantity.", "Not known, for lack of {count} quantities."
        ),
        "payload.rated#official": "{source} gives a rated payload of {kg:.3g} kg; don't rely on it alone.",
        "payload.rated#official_alone": (
            "{source} gives a rated payload of {kg:.3g} kg; what moments and inertias the wrist allows is not given: "
            "don't rely on it alone."
        ),
        "payload.rated": (
            "The robot's file gives a rated payload of {kg:.3g} kg, which nothing confirms: don't rely on it."
        ),
        "impossible_inertia": "link {link}: no body can have this inertia ({why})",
    }
)


def payload_text(summary: Summary | None, robot: Robot) -> tuple[str, str]:
    """What the arm can carry: the least of what its paths allow, what limits it and how much is not known, or that it
    is unknown, and what its maker rates it; then what to ask for.

    ``summary`` is the stage's; None where it was not computed.
    """
    paths = summary.paths if isinstance(summary, model.DynamicsSummary) else ()
    bounds = [
        (path.payload.value, path) for path in paths if path.counts and path.payload and path.payload.value is not None
    ]
    open_of = getattr(summary, "unknown", ())
    missing = [say(each) for each in open_of if each.what not in get_args(model.Guess)]
    official = _rated(robot, official=True)
    if bounds:
        value, path = min(bounds, key=lambda bound: bound[0])
        by = word("dynamics.binding", BINDING, path.payload.by) if path.payload and path.payload.by else ""
        joint = path.payload.joint if path.payload else None
        form = "payload.bounded#joint" if by and joint else "payload.bounded"
        known = sentence(form, kg=at_least(value, "kg"), path=path.name, by=by, joint=joint)
        open_ = sentence("payload.partly", count=len(missing)) if missing else ""
        known = joined([known, _guesses(summary), open_], " ")
        rest = sentence("payload.left_out", what=joined(missing)) if missing else ""
    elif missing:
        known = sentence(f"payload.unknown{official and '#rated'}", count=len(missing))
        rest = sentence("payload.ask", what=joined(missing))
    else:
        known, rest = sentence(f"payload.not_examined{official and '#rated'}"), ""
    return joined([known, official or _rated(robot)], " "), rest


def _guesses(summary: Summary | None) -> str:
    """On which guesses the torques and their limits rest; empty where they rest on none."""
    masses = getattr(summary, "masses", None)
    found = [sentence("payload.guessed_masses")] if masses and masses.grade == "inferred" else []
    found += [say(each) for each in getattr(summary, "unknown", ()) if each.what in get_args(model.Guess)]
    return sentence("payload.guessed", what=joined(found)) if found else ""


def _rated(robot: Robot, *, official: bool = False) -> str:
    """The payload that the robot's file gives; ``official``: what its maker's own document gives, else nothing."""
    wrist, source = robot.masses.wrist, robot.sources.get("wrist_load")
    if wrist is None or not np.isfinite(wrist.payload):
        return ""
    if source is None or source.grade != "official":
        return "" if official else sentence("payload.rated", kg=wrist.payload)
    document, *_ = re.split("[;；]", own_title(source.source))
    form = "official" if len(wrist.moment) and len(wrist.inertia) else "official_alone"
    return sentence(f"payload.rated#{form}", source=document, kg=wrist.payload)


def need_word(need: model.Need) -> str:
    """What is asked for."""
    return word("dynamics.need", NEEDS, need)


def quantity_word(quantity: model.Quantity) -> str:
    """What is compared."""
    return word("dynamics.quantity", QUANTITIES, quantity)


def use_text(use: model.Use) -> str:
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


@says("dynamics.no_data")
def _(found: Finding) -> str:
    needs: list[model.Need] = [each.what for each in found.needs if each.what in ("masses", "peak", "load")]
    return say_as(found, needs=joined(map(need_word, needs), ", "))


@say.register
def _(found: model.NoLimits) -> str:
    parts = {"joint": found.joint, "torque": found.torque, "tolerance": found.tolerance, "unit": found.unit}
    greatest = say_as(found, "path" if found.path else "holding", **parts)
    held = say_as(found, "at_rest", **vars(found.held) | {"torque": abs(found.held.torque)}) if found.held else ""
    return joined([greatest, held, *_reservations(found)], " ")


@say.register
def _(found: model.Compared) -> str:
    tightest = use_text(found.tightest)
    if isinstance(found, model.AllWithin):
        verdict = sentence("dynamics.fits", use=tightest)
    elif isinstance(found, model.Marginal):
        masses = found.unsettled or found.doubts or found.grade == "inferred"
        verdict = sentence("dynamics.marginal" if masses else "dynamics.marginal#open", use=tightest)
    else:
        verdict = sentence("dynamics.overload", count=found.compared, beyond=found.beyond, use=tightest)
    open_ = not_run = ""
    if found.unknown:
        open_ = sentence("dynamics.unlimited", what=joined(map(need_word, found.unknown), ", "))
    if found.not_run:
        not_run = sentence("dynamics.not_run", count=len(found.not_run), names=joined(found.not_run, ", "))
    return joined([verdict, open_, not_run, *_reservations(found)], " ")


def _reservations(found: model.Compared | model.NoLimits) -> list[str]:
    missing = ", ".join(map(str, found.missing_links))
    return [
        sentence("dynamics.massless", count=len(found.missing_links), links=missing) if missing else "",
        sentence("dynamics.doubts", count=found.doubts) if found.doubts else "",
        _graded(found.grade),
    ]


def _graded(grade: Grade | None) -> str:
    if grade is None:
        return ""
    if grade == "inferred":
        return sentence("dynamics.inferred")
    return sentence("dynamics.graded", grade=word("dynamics.graded_as", GRADED, grade))


@says("dynamics.unknown")
def _(found: Finding) -> str:
    if not found.numbers:
        return need_word(found.what)
    parts = {"what": need_word(found.what), "numbers": ", ".join(map(str, found.numbers))}
    if found.what == "masses":
        return sentence("dynamics.unknown#links", **parts)
    return sentence("dynamics.unknown#joints", **parts)


@says("impossible_inertia")
def _(found: Finding) -> str:
    why = word("dynamics.why", WHY, found.why)
    return say_as(found, why=why)
