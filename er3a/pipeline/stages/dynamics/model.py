"""What the dynamics stage computes.

Torques are those that the drives give, in the manufacturer's signs: N m for revolute joints, N for prismatic ones
(``unit``). Times count from a path's start.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, get_args

from er3a.by_value import frozen
from er3a.dynamics.margins import Binding, WristQuantity
from er3a.finding import Finding
from er3a.numerics.arrays import Reals
from er3a.pipeline.language import N_
from er3a.pipeline.results import Results, Summary
from er3a.pipeline.scope import OF_MOTIONS
from er3a.pipeline.tables import Table, Texts, column, per_joint
from er3a.planning.names import PathVerdict
from er3a.robots.robot import Grade

Unit = Literal["N m", "N"]
"""Of the torque of a joint that turns, and of one that slides."""
TORQUE, FORCE = get_args(Unit)
EITHER = N_("N m or N")
PARTS = ("gravity", "inertia", "velocity", "friction", "tool")
Quantity = Literal["peak", "rms", "holding"] | WristQuantity
LoadPart = Literal["tool", "carried", "load_centre", "load_inertia", "load_guess"]


@frozen
class Use:
    """What is asked for against what is allowed, in one unit.

    Attributes
    ----------
    joint : from 1; None for the payload
    path : None where it does not depend on one
    upper : what is asked for at most, by the tolerances of masses
    """

    quantity: Quantity
    joint: int | None
    path: str | None
    asked: float
    upper: float
    allowed: float
    unit: str

    @property
    def ratio(self) -> float:
        """Utilisation: above 1 is too much."""
        return self.asked / self.allowed


"""What was compared with limits: ``dynamics.fits`` (all is within, tolerances included), ``dynamics.marginal`` (all is
within what is known: not with the tolerances of the masses, or not all was examined), ``dynamics.overload``.
``compared`` with limits and ``beyond`` them; ``tightest`` is what is nearest to its limit, or farthest beyond it
(:class:`Use`). ``unsettled``: what is within its limit, and not with the tolerances of the masses. ``unknown``:
what the files leave open, wholly or in part; torques and limits that rest on it were not examined. ``not_run``:
paths that are to be run, and may not be: they count for nothing. Without any limit ``dynamics.no_limits``: the
largest torque on a path that counts, and the one at rest where that is larger. All have ``missing_links`` without
mass, which count as massless, the ``doubts`` on masses besides, and the ``grade`` of the masses, where no
document or scale gives them, else None."""


@frozen
class LinkEntry:
    """The mass of a link as it was used; centre in the frame that moves with the link's joint. None: unknown."""

    link: int
    mass_kg: float | None
    centre_mm: tuple[float, ...]
    estimated: bool


@frozen
class TolerancesUsed:
    """By how much masses and centres are taken to be off; ``assumed`` by the grade where the file says nothing."""

    grade: Grade
    mass_percent: float
    centre_mm: float
    assumed: bool


@frozen
class MassesUsed:
    """Links, and what hangs on the flange (None: nothing); ``density_kg_m3`` of guessed ones."""

    grade: Grade
    source: str
    density_kg_m3: float | None
    links: tuple[LinkEntry, ...]
    load_kg: float | None
    load_centre_mm: tuple[float, ...]
    load_grade: Grade | None
    tolerances: TolerancesUsed


@frozen
class HoldingTorque:
    """The maximum torque found that a joint holds at rest within the limits, the pose where it does, and what all
    joints hold there."""

    joint: int
    torque: float
    tolerance: float
    unit: Unit
    q: tuple[float, ...]
    all_there: tuple[float, ...]


def shared_unit(units: Iterable[Unit]) -> str:
    """The unit of the torques of several joints, for a heading.

    Parameters
    ----------
    units : of each joint

    Returns
    -------
    unit : ``N m`` or ``N`` if all have it, else ``N m or N``
    """
    found = set(units)
    return found.pop() if len(found) == 1 else EITHER


NOTHING_HELD = 1e-9
"""N m or N: less than that is rounding."""


def hardest_held(holding: tuple[HoldingTorque, ...]) -> HoldingTorque:
    """The joint that holds most at rest.

    Parameters
    ----------
    holding : at least one

    Returns
    -------
    held : one that turns if any has something to hold, because N and N m don't compare
    """
    return max(holding, key=lambda held: (held.unit == TORQUE and abs(held.torque) > NOTHING_HELD, abs(held.torque)))


@frozen
class JointLoad:
    """What a path asks of a drive.

    Attributes
    ----------
    tolerance : by which the torque may be above the peak at any time; rms_tolerance : of the RMS torque
    gravity, inertia, velocity, friction, tool : largest of each part
    power_w, braking_w : largest given and taken back
    """

    joint: int
    unit: Unit
    peak: float
    tolerance: float
    peak_at_s: float
    rms: float
    rms_tolerance: float
    gravity: float
    inertia: float
    velocity: float
    friction: float
    tool: float
    power_w: float
    braking_w: float
    work_j: float
    recovered_j: float


@frozen
class BindingLimit:
    """The largest value under the limits, and what binds; None where nothing does.

    ``t_s`` is None for the RMS torque, which is one of the whole path.
    """

    value: float | None
    by: Binding | None
    joint: int | None
    t_s: float | None


@frozen
class WristMoment:
    """The largest moment that the load makes about a wrist axis along a path, with accelerations and what the
    surroundings do to the tool; ``tolerance``: by which it may be above that at any time."""

    joint: int
    moment_n_m: float
    tolerance: float
    t_s: float


@frozen
class PathLoad:
    """A path's loads.

    Attributes
    ----------
    outcomes : of the trajectory stage's checks: the verdict and whatever else makes it a fail, in order of time
    counts : whether it may be run; motors, limits and key figures rest on such paths alone
    complete : whether the arm can follow it all along; nothing else is known of one that it can't
    payload, speed_scale : None where no torque limit is known
    """

    name: str
    title: str
    outcomes: tuple[PathVerdict, ...]
    counts: bool
    complete: bool
    duration_s: float
    joints: tuple[JointLoad, ...]
    wrist: tuple[WristMoment, ...]
    payload: BindingLimit | None
    speed_scale: BindingLimit | None

    @property
    def hardest(self) -> JointLoad:
        """The joint with the largest peak; one that turns if there is any, because N and N m don't compare."""
        return max(self.joints, key=lambda load: (load.unit == TORQUE, load.peak))


@frozen
class MotorNeed:
    """What each drive must give over all paths that may be run, and at rest in the worst pose.

    Attributes
    ----------
    speed : deg/s, mm/s if the joint is prismatic
    inertia_high : largest, of the load that the joint moves along the paths, kg m^2 (kg); without rotor
    inertia_ratio : of the largest to the rotor's at the joint
    motor_rpm, motor_torque : at the motor, where the gear ratio is known
    """

    joint: int
    unit: Unit
    peak: float
    rms: float
    holding: float
    speed: float
    power_w: float
    inertia_high: float
    inertia_ratio: float | None
    motor_rpm: float | None
    motor_torque: float | None
    peak_limit: float | None
    rated_limit: float | None


class DynamicsSummary(Summary):
    """Head, masses, paths, drives and wrist.

    Without obstacles paths count that may not be run, which asks no less of the motors: so that can still be a pass.

    Attributes
    ----------
    masses : None where there are none
    payload_centre_mm, payload_gyration_mm : of the payload whose largest mass is asked for
    held_payload : the largest that the drives hold still in each pose, by search; None where no limit is known
    uses : all that was compared with a limit, the tightest first
    """

    needs = ("torque", "limits", *OF_MOTIONS)

    gravity_m_s2: float
    masses: MassesUsed | None
    findings: tuple[Finding, ...]
    payload_centre_mm: tuple[float, ...]
    payload_gyration_mm: float
    held_payload: BindingLimit | None
    paths: tuple[PathLoad, ...]
    holding: tuple[HoldingTorque, ...]
    motors: tuple[MotorNeed, ...]
    uses: tuple[Use, ...]


class TorqueRows(Table):
    """Torques along the paths that the arm can follow, N m (N for prismatic joints)."""

    path: Texts = column("name of the path")
    t_s: Reals = column("time since the path's start", heading=N_("time"))
    q: Reals = per_joint("joint value", "deg or mm")
    torque: Reals = per_joint("torque of the drive", EITHER, heading=N_("drive torque"))
    tolerance: Reals = per_joint("by which it may be off", EITHER)
    gravity: Reals = per_joint("part against gravity", EITHER)
    inertia: Reals = per_joint("part of accelerations, rotors included", EITHER)
    velocity: Reals = per_joint("centrifugal and Coriolis part", EITHER)
    friction: Reals = per_joint("part against friction, as far as known", EITHER)
    tool: Reals = per_joint("part against forces at the tool", EITHER)
    power_w: Reals = per_joint("power of the drive", heading=N_("drive power"))


class DynamicsResults(Results):
    """Summary and tables of the stage."""

    summary: DynamicsSummary
    torques: TorqueRows


RESULTS = DynamicsResults
