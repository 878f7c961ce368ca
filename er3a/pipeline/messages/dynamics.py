"""What the dynamics page and recording say beside the verdict."""

from __future__ import annotations

import er3a.pipeline.messages.planning  # noqa: F401
from er3a.dynamics.margins import Binding
from er3a.dynamics.plausibility import (
    AboutOrigin,
    CentreOutside,
    ImpossibleInertia,
    InertiaWithoutMass,
    MissingLink,
    PointMass,
    SumOffWeight,
    UnlikelyDensity,
    UnlikelyInertia,
)
from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import say, sentence, word
from er3a.robots.masses import NoBody

FIGURES = {
    "paths": N_("Paths computed"),
    "mass": N_("Mass of the links"),
    "peak_torque": N_("Greatest torque on a path"),
    "holding_torque": N_("Greatest holding torque found"),
    "energy": N_("Greatest energy of a path"),
    "utilisation": N_("Highest utilisation of a limit"),
    "power_balance": N_("Power balance, greatest error"),
}
BINDING: dict[Binding, str] = {"peak": N_("peak"), "rms": N_("RMS"), "speed": N_("speed")}
WHY: dict[NoBody, str] = {
    "not_finite": N_("contains something that is not a number"),
    "negative_mass": N_("its mass is below 0"),
    "negative_moment": N_("a principal moment is below 0"),
    "triangle": N_("a principal moment exceeds the sum of the other two"),
}


@say.register
def _(found: ImpossibleInertia) -> str:
    why = word("dynamics.why", WHY, found.why)
    return sentence(found.code, "link {link}: no body can have this inertia ({why})", link=found.link, why=why)


@say.register
def _(found: MissingLink) -> str:
    if found.singular:
        return sentence(
            found.code,
            "link {link}: no mass, inertia or rotor is given; its joint's torque counts as 0, and accelerations under "
            "given torques (forward dynamics) have no value",
            link=found.link,
        )
    return sentence(found.code, "link {link}: no mass is given; it counts as massless", link=found.link)


@say.register
def _(found: PointMass) -> str:
    return sentence(found.code, "link {link}: mass without inertia", link=found.link)


@say.register
def _(found: InertiaWithoutMass) -> str:
    return sentence(found.code, "link {link}: inertia without mass; it is used as given", link=found.link)


@say.register
def _(found: CentreOutside) -> str:
    return sentence(
        found.code,
        "link {link}: the centre of mass is {far:.0f} mm outside the link's shape; check its frame and unit",
        link=found.link,
        far=found.outside_mm,
    )


@say.register
def _(found: UnlikelyDensity) -> str:
    return sentence(
        found.code,
        "link {link}: {mass:.4g} kg in the link's shape make {density:.3g} kg/m³; check g against kg",
        link=found.link,
        mass=found.mass_kg,
        density=found.density_kg_m3,
    )


@say.register
def _(found: UnlikelyInertia) -> str:
    return sentence(
        found.code,
        "link {link}: the radius of gyration is {own:.3g} mm, that of the link's shape {shape:.3g} mm; check the "
        "unit of the inertia (kg m²)",
        link=found.link,
        own=found.gyration_mm,
        shape=found.shape_mm,
    )


@say.register
def _(found: AboutOrigin) -> str:
    return sentence(
        found.code,
        "link {link}: the inertia looks as if it were about the frame's origin, not the centre of mass: "
        "{given:.3g} kg m² given, {rest:.3g} if so, {shape:.3g} by the link's shape",
        link=found.link,
        given=found.given_kg_m2,
        rest=found.about_centre_kg_m2,
        shape=found.shape_kg_m2,
    )


@say.register
def _(found: SumOffWeight) -> str:
    return sentence(
        found.code,
        "the links' masses add to {sum:.4g} kg, and the manufacturer states {weight:.4g} kg",
        sum=found.sum_kg,
        weight=found.weight_kg,
    )
