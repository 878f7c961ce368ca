"""What the dynamics page and recording say beside the verdict."""

from __future__ import annotations

import er3a.pipeline.messages.planning  # noqa: F401
from er3a.dynamics.margins import Binding
from er3a.dynamics.plausibility import (
    ImpossibleInertia,
)
from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.say import by, say, say_as, texts, word
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


TEXTS = texts(
    {
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
        "impossible_inertia": "link {link}: no body can have this inertia ({why})",
    }
)


@say.register
def _(found: ImpossibleInertia) -> str:
    why = word("dynamics.why", WHY, found.why)
    return say_as(found, why=why)
