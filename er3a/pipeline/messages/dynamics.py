"""The verdict of the dynamics stage, and what its page and recording say of masses."""

from __future__ import annotations

import re
from operator import itemgetter
from typing import Any

import numpy as np

import er3a.pipeline.messages.planning  # noqa: F401
from er3a.dynamics.margins import Binding
from er3a.finding import Finding
from er3a.pipeline.language import own_title, tr, with_unit, words
from er3a.pipeline.messages.numbers import at_least
from er3a.pipeline.messages.say import WORDS, bracketed, joined, say_as, says, sentence, texts, word
from er3a.pipeline.messages.scope import ASSUMED, names_in_words
from er3a.pipeline.results import Summary
from er3a.pipeline.stages.dynamics import model
from er3a.robots.masses import NoBody
from er3a.robots.robot import Robot

QUANTITIES: dict[model.Quantity, str] = words(
    {
        "peak": "peak torque",
        "rms": "RMS torque",
        "holding": "holding torque",
        "payload": "payload",
        "moment": "wrist moment",
        "inertia": "wrist inertia",
    }
)
LOAD_PARTS = words(
    {
        "tool": "mass of the tool",
        "carried": "mass of what the tool carries",
        "load_centre": "centre of mass of tool or payload",
        "load_inertia": "inertia of tool or payload",
    }
)
GUESSED = words(
    {
        "drives_guess": "the drives' limits, which the robot's file guesses",
        "wrist_guess": "the wrist's limits, which the robot's file guesses",
        "load_guess": "the mass of tool or payload, which the study guesses",
    }
)
UNKNOWN = (
    *("link_masses", "peak_torques", "rated_torques", "rotor_inertias", "friction"),
    *("wrist_moments", "wrist_inertias", "rated_payload", "load"),
)
names_in_words("load", "dynamics.load_part", LOAD_PARTS | GUESSED)
KEY_FIGURES = words(
    {
        "paths": "Paths that count",
        "mass": "Mass of the links",
        "peak_torque": "Greatest torque on a path that the model does not rule out",
        "holding_torque": "Greatest holding torque found",
        "energy": "Greatest energy of a path that the model does not rule out",
        "utilisation": "Highest utilisation of a limit",
    }
)
BINDING: dict[Binding, str] = words({"peak": "peak", "rms": "RMS", "speed": "speed"})
WHY: dict[NoBody, str] = words(
    {
        "not_finite": "contains something that is not a number",
        "negative_mass": "its mass is below 0",
        "negative_moment": "a principal moment is below 0",
        "triangle": "a principal moment exceeds the sum of the other two",
    }
)


TEXTS = texts(
    {
        "dynamics.use": "{what}: {asked:.3g} of {allowed:.3g} {unit} ({ratio:.0%})",
        "dynamics.no_data": "Torques need data: mass, centre of mass and inertia of the links.",
        "dynamics.no_limits": (
            "Motors not judged: no drive's limits known. Greatest torque: {torques:; }. What is not known comes on "
            "top: don't choose motors by it.{rest}"
        ),
        "dynamics.torque": "{torque:.3g} ± {tolerance:.2g} {unit} (J{joint}, {path:dynamics.path})",
        "dynamics.fits": "Within all stated limits; highest utilisation: {tightest}.{rest}",
        "dynamics.marginal": (
            "Within the stated limits[, but masses are uncertain{masses:?}][{masses:!}{unknown:?}, but {first}]; "
            "highest utilisation: {tightest}.[ Not examined: {unknown}. Enter payload and tool_load in the study, "
            "drives and wrist_load in the robot's file.]{rest}"
        ),
        "dynamics.overload": "Overload: {beyond} of {compared} comparisons beyond limits; worst: {tightest}.{rest}",
        "dynamics.rest": (
            "[Paths that may not be run, not counted: "
            "{not_run:, }.][ Links without mass in the file, counted as massless: {missing_links:, }.][ "
            "Doubts about the masses: {doubts:2; }.][ Grade of the masses: {grade:data}; torques are as uncertain.]"
        ),
        "missing_link": "link {link}: no mass given; {singular:dynamics.massless}",
        "point_mass": "link {link}: mass without inertia",
        "inertia_without_mass": "link {link}: inertia without mass, used as given",
        "centre_outside": "link {link}: centre of mass {outside_mm:.0f} mm outside its shape; check frame and unit",
        "unlikely_density": (
            "link {link}: {mass_kg:.4g} kg in its shape make {density_kg_m3:.3g} kg/m³; check g against kg"
        ),
        "unlikely_inertia": (
            "link {link}: radius of gyration {gyration_mm:.3g} mm, of its shape {shape_mm:.3g} mm; check the "
            "inertia's unit (kg m²)"
        ),
        "about_origin": (
            "link {link}: inertia about the frame's origin? Given {given_kg_m2:.3g} kg m²; about the centre "
            "{about_centre_kg_m2:.3g}, by its shape {shape_kg_m2:.3g}"
        ),
        "sum_off_weight": "links' masses: {sum_kg:.4g} kg; the manufacturer's weight: {weight_kg:.4g} kg",
        "payload": (
            "[At most {kg} kg, limited by torques: {by:, }.][ It rests on guesses: {guesses:; }.][{unknown:?} "
            "Quantities not known: {unknown}.][{none:?} No document of the maker gives the payload.][ {rated}]"
        ),
        "payload.rated": "Rated payload: {kg:.3g} kg ({source:payload.source}); {doubt:payload.doubt}.",
        "impossible_inertia": "link {link}: no body can have this inertia ({why:dynamics.why})",
    }
)
WORDS.update(
    words(
        {
            "dynamics.why": WHY,
            "dynamics.path": {None: "holding still"},
            "dynamics.massless": {
                False: "it counts as massless",
                True: "its joint's torque counts as 0, and forward dynamics has no value",
            },
            "payload.source": {"": "the robot's file"},
            "payload.doubt": {
                "official": "don't rely on it alone",
                "official_alone": "wrist moments and inertias unknown: don't rely on it alone",
                "claim": "nothing confirms it: don't rely on it",
            },
        }
    )
)


def _least(summary: Summary | None) -> tuple[str, list[str]] | None:
    """The least payload that the paths, and holding still in the worst pose, allow, and what limits it; None where
    none has a bound."""
    if not isinstance(summary, model.DynamicsSummary):
        return None
    named = [(path.payload, path.name) for path in summary.paths if path.counts]
    named += [(summary.held_payload, word("dynamics.path", WORDS["dynamics.path"], None))]
    bounds = [(most.value, most, name) for most, name in named if most and most.value is not None]
    if not bounds:
        return None
    value, most, path = min(bounds, key=itemgetter(0))
    by = word("dynamics.binding", BINDING, most.by) if most.by else ""
    return at_least(value, "kg"), [*([bracketed(f"J{most.joint}", by)] if most.joint else []), path]


def payload_key(summary: Summary | None, robot: Robot) -> tuple[str, str]:
    """What the arm can carry at its flange, as a figure, and what it is.

    Parameters
    ----------
    summary : the stage's; None where it was not computed

    Returns
    -------
    value, meaning : in the page's language
    """
    if least := _least(summary):
        return with_unit(f"≤ {least[0]}", "kg"), tr(
            "upper bound of payload, by {limits}", limits=joined(least[1], ", ")
        )
    wrist = robot.masses.wrist
    if wrist is not None and np.isfinite(wrist.payload):
        return with_unit(f"{wrist.payload:.3g}", "kg"), tr("rated at the flange, not examined")
    return tr("mount nothing"), tr("payload unknown")


def payload_text(summary: Summary | None, robot: Robot) -> str:
    """What the arm can carry: the least of what its paths allow, what limits it and how much is not known, or that it
    is unknown, and what its maker rates it.

    ``summary`` is the stage's; None where it was not computed.
    """
    least = _least(summary)
    open_ = summary.assumed if isinstance(summary, model.DynamicsSummary) else ()
    missing = [each for each in open_ if each.reason in UNKNOWN and each.names != ("load_guess",)]
    official = _rated(robot, official=True)
    kg, by = least or (None, ())
    parts: dict[str, Any] = {"kg": kg, "by": by, "guesses": _guesses(summary) if least else ()}
    parts |= {"unknown": len(missing), "none": not (least or official)}
    return sentence("payload", rated=official or _rated(robot), **parts)


def _guesses(summary: Summary | None) -> list[str]:
    """On which guesses the torques and their limits rest."""
    masses = getattr(summary, "masses", None)
    found = [tr("the masses of the links")] if masses and masses.grade == "inferred" else []
    named = [(each.reason, *each.names) for each in summary.assumed] if summary else []
    return found + [tr(GUESSED[each]) for each in GUESSED if any(each in names for names in named)]


def _rated(robot: Robot, *, official: bool = False) -> str:
    """The payload that the robot's file gives; ``official``: what its maker's own document gives, else nothing."""
    wrist, source = robot.masses.wrist, robot.sources.get("wrist_load")
    if wrist is None or not np.isfinite(wrist.payload):
        return ""
    if source is None or source.grade != "official":
        return "" if official else sentence("payload.rated", kg=wrist.payload, source="", doubt="claim")
    document, *_ = re.split("[;；]", own_title(source.source))
    doubt = "official" if len(wrist.moment) and len(wrist.inertia) else "official_alone"
    return sentence("payload.rated", kg=wrist.payload, source=document, doubt=doubt)


def quantity_word(quantity: model.Quantity) -> str:
    """What is compared."""
    return word("dynamics.quantity", QUANTITIES, quantity)


def use_text(use: model.Use | Finding) -> str:
    """What is asked for and allowed, where."""
    joint = f"J{use.joint}" if use.joint else ""
    what = joined([quantity_word(use.quantity), joint, use.path or ""], ", ")
    parts = {"asked": use.asked, "allowed": use.allowed, "unit": use.unit, "ratio": use.asked / use.allowed}
    return sentence("dynamics.use", what=what, **parts)


says("dynamics.use")(use_text)


@says("dynamics.no_limits", "dynamics.fits", "dynamics.marginal", "dynamics.overload")
def _(found: Finding) -> str:
    rest = sentence("dynamics.rest", **{"not_run": (), **found.params})
    masses = bool(found.params.get("unsettled") or found.doubts or found.grade == "inferred")
    unknown = [tr(ASSUMED[each]) for each in found.params.get("unknown", ())]
    first = unknown[-1] if unknown else ""  # of the load, where the study leaves that open
    return say_as(found, masses=masses, unknown=joined(unknown, "; "), first=first, rest=f" {rest}" if rest else "")
