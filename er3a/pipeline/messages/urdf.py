"""What a rule for URDFs says: what is wrong, and what to write."""

from __future__ import annotations

from er3a.finding import Finding

MOST_NAMES = 6
RULES = {
    "urdf_lengths": "{names}: more than 5 m; a URDF's lengths are in metres",
    "urdf_angles": "{names}: more than a turn of an origin, or ten of a limit; a URDF's angles are in radians",
    "urdf_limits_reversed": "{names}: the lower limit is above the upper; swap them",
    "urdf_inertia": "{names}: no body has this inertia; give it about the centre of mass, in kg m2",
    "urdf_mesh_unusable": "{names}",
    "urdf_axis": "{names}: the axis' length is not 1",
    "urdf_no_limits": "{names}: no lower and upper limit",
    "urdf_no_velocity": "{names}: no velocity above 0, so its speed counts as unknown",
    "urdf_no_effort": "{names}: no effort above 0, so no torque is held against it",
    "urdf_no_mass": "{names}: drawn, and without a mass",
    "urdf_no_collision": "{names}: drawn, and without a shape for collisions",
    "urdf_mesh_missing": "{names}: this mesh was not found; keep its package in a folder above the file",
}
"""By code, at most 25 words."""


def rule_text(found: Finding) -> str:
    """The text of a rule that a file breaks.

    Parameters
    ----------
    found : of :func:`er3a.formats.urdf_lint.lint`
    """
    names = ", ".join(found.names[:MOST_NAMES])
    more = len(found.names) - MOST_NAMES
    return RULES[found.code].format(names=f"{names} and {more} more" if more > 0 else names)
