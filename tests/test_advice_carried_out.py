"""Each text that advises something names the test that carries it out, or stands among those that no test can."""

from __future__ import annotations

import importlib
import pkgutil
import re
from pathlib import Path

from babel.messages.pofile import read_po

from er3a.pipeline import messages
from er3a.pipeline.messages import say
from er3a.pipeline.messages.planning import STRATEGIES
from er3a.pipeline.messages.programs import LATER, NOT_FOLLOWED, REMEDIES, SINGULAR

for module in pkgutil.iter_modules(messages.__path__):
    importlib.import_module(f"{messages.__name__}.{module.name}")

ADVISES = re.compile(
    r"(?:^|[:;,.)] |\bor |\band )(?:add|allow|ask|begin|check|convert|correct|end|give|go|import|invert|jog|lead|leave|"
    r"lower|make|map|measure|mount|move|put|raise|read|remove|rotate|run|set|shift|spread|start|take|teach|tilt|time|"
    r"turn|use|write)\b "
    r"(?!\()",
    re.IGNORECASE,
)
MARKS = re.compile(r"[\[\]]|\{\w+:[?!]\}")  # of optional parts
OF_PROGRAMS = "test_a_program_that_is_mended_as_advised_passes"
OF_SETS = "test_a_set_that_is_mended_as_advised_gives_the_camera_and_no_warning"
AT_PLACES = "test_the_clearance_of_a_place_is_that_of_the_nearest_arm_on_its_lattice"
MEASURED = "test_the_proposed_measurement_contradicts_another_arm"
CARRIED_OUT = {
    **dict.fromkeys(REMEDIES, OF_PROGRAMS),
    "later_out_of_reach": "test_a_loop_that_drifts_is_mended_as_advised",
    **{f"singular.{kind}": OF_PROGRAMS for kind in ("wrist", "elbow", "shoulder")},
    **{f"not_followed.{reason}": OF_PROGRAMS for reason in NOT_FOLLOWED},
    "remedy.zone_too_large": OF_PROGRAMS,
    **dict.fromkeys(("remedy.limit", "remedy.jump"), OF_PROGRAMS),
    "remedy.end": "test_a_line_that_ends_where_advised_keeps_its_margin",
    **{f"remedy.{form}": OF_PROGRAMS for form in ("solid", "links")},
    "gap.units": "test_a_number_that_looks_like_another_unit_is_no_pass_where_it_is_read",
    "remedy.slower": "test_a_line_at_the_pace_advised_passes",
    "pairs_unexamined": "test_shapes_in_error_are_an_error_of_the_shapes",
    "zone_collides": "test_a_zone_that_allows_a_collision_is_a_caution",
    "load_above_payload": "test_a_load_is_named_once_and_one_above_the_payload_fails",
    **{f"strategy.{name}": "test_what_is_usable_ends_at_the_end_within_all_limits" for name in STRATEGIES},
    "strategy.stop": "test_stop_rests_on_the_path_before_the_region",
    "strategy.planned": "test_planned_motions_touch_nothing_and_keep_their_limits",
    "advice.slower": "test_the_slower_pace_that_is_advised_keeps_the_limits",
    "advice.clear_until": "test_a_path_that_ends_where_its_advice_says_keeps_the_margin",
    "advice.end": "test_a_path_that_ends_before_the_edge_of_the_reach_as_advised_is_safe",
    "advice.within_reach": "test_a_path_that_ends_before_the_edge_of_the_reach_as_advised_is_safe",
    "turn_tool": "test_a_target_moved_or_turned_as_advised_is_reached_with_margin",
    "shift_tool": "test_a_target_moved_or_turned_as_advised_is_reached_with_margin",
    "move_obstacle": "test_the_obstacle_is_to_be_moved_only_where_the_arm_alone_keeps_its_margins",
    "box.run_again": AT_PLACES,
    **{f"{code}": OF_SETS for code in ("board_scale", "little_motion", "few_samples", "no_rotation", "parallel_axes")},
    **dict.fromkeys(
        ("all_samples_equal", "moved_between", "not_converged", "focal_length", "principal_point"), OF_SETS
    ),
    "joint_zero": "test_a_joint_zero_that_is_off_is_named_and_one_that_no_sample_shows_is_not_examined",
    "measure_entry": MEASURED,
    "look_at_motion": "test_what_a_proposal_lets_see_is_what_the_arm_does_and_the_reversed_arm_does_not",
    "more_positions": "test_too_few_positions_ask_for_poses_that_settle_more",
    **dict.fromkeys(("collision.shapes_overlap", "why.overlaps"), "test_shapes_in_error_are_an_error_of_the_shapes"),
    "collision.base_in_solid": "test_a_scene_corrected_as_advised_leaves_the_base_free",
    "ambiguous_tilt": "test_a_board_seen_head_on_leaves_its_tilt_open_until_it_is_nearer_or_tilted",
    "other_convention": OF_SETS,
}
CARRIED_OUT |= dict.fromkeys(
    ("confirm.tool", "confirm.base", "confirm.factor", "confirm.rows"), "test_each_cause_alone_is_named_first"
)
CARRIED_OUT |= {
    "confirm.plan": "test_a_plan_is_safe_and_settles_more_than_chance",
    "zero_elsewhere": "test_the_corrected_file_that_a_page_advises_is_not_contradicted",
}
NOT_CARRIED_OUT = {  # a person looks at the controller, the cell or the file, or takes another picture
    *("clearance_not_proven", "program_not_understood", "singular.elbow", "singular.shoulder", "not_followed.too_far"),
    "program_nothing_moves",
    *("centre_outside", "unlikely_density", "unlikely_inertia", "unexplained_residuals"),
    *("no_correction_fits", "contradiction", "advice.no_part"),
    *("read_limit", "time_joint"),
    *("held_back_contradict", "held_back_elsewhere", "held_back_fitted"),
    *("why.coarse", "shapes_assumed"),
    *("validation.off", "validation.no_reference", "validation.defined_otherwise", "far_from_table"),
}
NO_ADVICE = {"below_limit", "trajectory.paths"}


MOVES_ARM_OR_PART = re.compile(
    r"(?:^|[:;,.)] |\bor |\band )(?:end|jog|leave|move|put|rotate|run|shift|tilt|turn)\b "
    r"(?:all|both|it|no|none|nothing|the|them|this|work)\b",
    re.IGNORECASE,
)
ON_PAGES = {  # texts without a key that are none of the remedies above: the first words
    *(
        "Never use this table",
        "Evidence contradicts this table",
        "Run no path or program on the arm",
    ),  # that forbid something
}


def advising() -> set[str]:
    """Keys of all texts that advise something."""
    found = {key for key in say._texts if ADVISES.search(" ".join(MARKS.sub(" ", say.english(key)).split()))}
    found |= {
        *REMEDIES,
        *(f"singular.{kind}" for kind in SINGULAR),
        *(f"not_followed.{reason}" for reason in NOT_FOLLOWED),
    }
    return (found | {f"strategy.{name}" for name in STRATEGIES}) - NO_ADVICE


def test_every_text_that_advises_something_has_a_test_that_carries_it_out():
    """A new advice has to be entered above, with the test that carries it out."""
    assert advising() <= CARRIED_OUT.keys() | NOT_CARRIED_OUT
    assert advising() >= NOT_CARRIED_OUT


def test_texts_of_pages_advise_no_move_that_no_test_carries_out():
    """What has no key is in the catalogue only. A new one has to be a remedy of programs, or stand above."""
    with (Path(messages.__path__[0]) / "locale/zh/LC_MESSAGES/er3a.po").open("rb") as file:
        texts = [each.id if isinstance(each.id, str) else each.id[0] for each in read_po(file) if each.context != "key"]
    found = {text for text in texts if MOVES_ARM_OR_PART.search(text)} - {*REMEDIES.values(), *SINGULAR.values()}
    found -= {*NOT_FOLLOWED.values(), LATER}  # test_a_loop_that_drifts_is_mended_as_advised
    assert [text for text in sorted(found) if not text.startswith(tuple(ON_PAGES))] == []
    assert [each for each in ON_PAGES if not any(text.startswith(each) for text in found)] == []


def test_the_tests_that_carry_advice_out_are_there():
    written = "\n".join(file.read_text(encoding="utf-8") for file in Path(__file__).parent.rglob("test_*.py"))
    named = {test for key, test in CARRIED_OUT.items() if key not in NOT_CARRIED_OUT}
    assert [test for test in named if f"def {test}(" not in written] == []


def test_each_program_that_is_mended_is_of_a_remedy_that_says_so():
    from tests.program_check.test_remedies import MENDED

    asked = {key for key, test in CARRIED_OUT.items() if test == OF_PROGRAMS} - NOT_CARRIED_OUT
    by_code = {key for key in asked if not key.startswith("remedy.")}
    assert by_code <= {*MENDED, *(code.partition(".")[0] for code in MENDED)}


def test_no_sentence_has_more_than_25_words():
    """A field counts as one word, and an optional part as a sentence of its own where it is one."""
    sentences = (part for text in say._texts.values() for part in re.split(r"(?<=\.)\]? |[\[\]]", text))
    assert [part for part in sentences if len(part.split()) > 25] == []
