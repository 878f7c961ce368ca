"""What each verdict of the small study leaves out: a subject that is no longer listed is missed here."""

from __future__ import annotations

import json

import pytest

pytestmark = pytest.mark.long

BODIES = "scene_shapes carried joined_pairs"
REAL_ARM = f"{BODIES} base_contacts bare_links"
RATES = "own_accelerations jerk"
REFERENCES = "references table_entries more_faults round_trips reach_starts the_arm_itself"
DRIVES = (
    "link_masses peak_torques rated_torques rotor_inertias friction wrist_limits load torque_peaks program_torques "
    "drive_behaviour mounting"
)
CAMERA = (
    f"{REAL_ARM} {RATES} real_camera pose_intrinsics joint_zeros small_joint_zeros detections gripped_parts "
    "shallow_overlaps tool torques"
)
PLACES = (
    "joint_vectors undecided_volume colliding_reach tool_directions lost_cells sampled_places between_places placed_box"
    " tool"
)
FREE_SPACE = "joint_vectors lost_cells unjoined_cells within_cells targets path_stretches tool shallow_overlaps"
PROGRAMS = "program_again controller_language controller_ramps torques shallow_overlaps"
PATHS = "ways_between tool torques shallow_overlaps"
SOLUTIONS = "round_trips ways_between tool"

LISTED = {
    ("er3a_c60", "validation"): REFERENCES,
    ("er3a_c60", "workspace"): f"{REAL_ARM} {PLACES}",
    ("er3a_c60", "inverse"): f"{REAL_ARM} {SOLUTIONS}",
    ("er3a_c60", "collision"): f"{REAL_ARM} {FREE_SPACE}",
    ("er3a_c60", "trajectory"): f"{REAL_ARM} {RATES} {PATHS} own_speeds",
    ("er3a_c60", "programs"): f"{REAL_ARM} {RATES} {PROGRAMS} own_speeds program_lines program_starts",
    ("er3a_c60", "dynamics"): f"{DRIVES} paths_not_run",
    ("er3a_c60", "vision"): f"{CAMERA} own_speeds left_out_samples",
    ("er3_600", "validation"): f"{REFERENCES} conflicting_references",
    ("er3_600", "workspace"): f"{REAL_ARM} {PLACES} own_values",
    ("er3_600", "inverse"): f"{REAL_ARM} {SOLUTIONS} own_values",
    ("er3_600", "collision"): f"{REAL_ARM} {FREE_SPACE} own_values",
    ("er3_600", "trajectory"): f"{REAL_ARM} {RATES} {PATHS} own_values",
    ("er3_600", "programs"): f"{REAL_ARM} {RATES} {PROGRAMS} own_values",
    ("er3_600", "dynamics"): f"{DRIVES} own_values",
    ("er3_600", "vision"): f"{CAMERA} own_values",
    ("er3a_c60_article", "validation"): f"{REFERENCES} near_singular_poses",
    ("er3a_c60_article", "workspace"): f"scene_shapes carried joined_pairs {PLACES} allowed_pairs",
}


@pytest.mark.parametrize(("robot", "stage"), LISTED)
def test_each_verdict_lists_what_it_left_out(small_study, robot, stage):
    found = json.loads((small_study.folder / f"results/{robot}/{stage}/summary.json").read_text(encoding="utf-8"))
    assert sorted(each["subject"] for each in found["not_examined"]) == sorted(LISTED[robot, stage].split())


def test_every_stage_of_the_study_is_in_this_table(small_study):
    made = {path.parts[-3:-1] for path in small_study.folder.glob("results/*/*/summary.json")}
    assert made == set(LISTED)
