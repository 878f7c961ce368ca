"""Settings of a study that several stages read; those of one stage are in its ``entry.py``."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from er3a.collision.pairs import ASSUMED_MARGIN, PENETRATION_TOLERANCE
from er3a.files.robot_file import Text
from er3a.files.yaml_file import StrictModel
from er3a.planning.names import ACCELERATION_TIME, StrategyName
from er3a.programs.program_names import LanguageName
from er3a.robots.robot import MAX_JOINTS


class TrajectorySettings(StrictModel):
    """Where a path counts as near-singular, and how many points are checked between two samples.

    ``avoidance`` chooses the avoidance strategy, or compares all of them. Joints of unknown speed are taken to do
    ``assumed_speed_deg_s`` (those beyond its end the last of it), those that slide ``assumed_speed_mm_s``; all joints
    to reach full speed in ``acceleration_time_s``, unless their maximum accelerations are given
    (``acceleration_deg_s2``, one for each joint; mm of those that slide). ``jerk_deg_s3`` bounds the jerk likewise;
    left out, nothing does.
    ``scene`` holds the obstacles; no overlap with them deeper than ``penetration_tolerance_mm`` goes unnoticed between
    points. Where the shapes of the arm's links are inferred, claimed or guessed, a verdict within
    ``assumed_margin_mm`` of them is a caution. Safe paths are written as programs in the languages ``programs``; others
    only with ``write_unsafe``, with the reason in the file.
    """

    checks_per_sample: Annotated[int, Field(ge=1, le=1000)]
    near_wrist_deg: Annotated[float, Field(gt=0, le=90)]
    near_elbow_deg: Annotated[float, Field(gt=0, le=90)]
    near_shoulder_mm: Annotated[float, Field(gt=0, le=10_000)]
    avoidance: Literal["compare"] | StrategyName = "compare"
    assumed_speed_deg_s: Annotated[
        list[Annotated[float, Field(gt=0, le=10_000)]], Field(min_length=1, max_length=MAX_JOINTS)
    ] = [180, 180, 180, 360, 360, 360]
    assumed_speed_mm_s: Annotated[float, Field(gt=0, le=100_000)] = 500
    acceleration_time_s: Annotated[float, Field(gt=0, le=10)] = ACCELERATION_TIME
    acceleration_deg_s2: Annotated[list[Annotated[float, Field(gt=0, le=1e6)]], Field(min_length=1)] | None = None
    jerk_deg_s3: Annotated[list[Annotated[float, Field(gt=0, le=1e9)]], Field(min_length=1)] | None = None
    scene: Text | None = None
    penetration_tolerance_mm: Annotated[float, Field(ge=0.05, le=100)] = 1000 * PENETRATION_TOLERANCE
    assumed_margin_mm: Annotated[float, Field(ge=0, le=1000)] = 1000 * ASSUMED_MARGIN
    programs: list[LanguageName] = ["krl", "urscript", "rpl", "xpl", "csv"]
    write_unsafe: bool = False
