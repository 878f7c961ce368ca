"""What the page on the article says of each of its sentences, in the article's order."""

from __future__ import annotations

from dataclasses import dataclass

from er3a.pipeline.language import N_, words


@dataclass(frozen=True)
class Item:
    """A thing that the article says, and that its own table answers.

    Attributes
    ----------
    code, section : what it is, and its section of the article
    title, says, finds : what the article says, and what er3a computes, with fields of
        :class:`er3a.pipeline.article.article_numbers.ArticleNumbers`
    why : what is shown unless both agree
    """

    code: str
    section: str
    title: str
    says: str
    finds: str
    why: str = ""


ITEMS = (
    Item(
        "zero_pose",
        "2.2",
        N_("Hand check: the zero pose"),
        N_("With all joints at 0 the upper arm should be vertical and the forearm horizontal."),
        N_(
            "Upper arm and forearm from the vertical, and height of the tool: as printed {p_upper_arm_deg:.0f}°, "
            "{p_forearm_deg:.0f}°, {p_tool_z:.0f} mm; with offset 2 = −90° {c_upper_arm_deg:.0f}°, "
            "{c_forearm_deg:.0f}°, {c_tool_z:.0f} mm."
        ),
        N_(
            "The table fails the article's own check. One entry repairs it: offset 2 = {fault_deg:.0f}° takes the "
            "zero pose from {missed_before_mm:.1f} mm off to {missed_after_mm} mm."
        ),
    ),
    Item(
        "offset",
        "3.1",
        N_("Joint offsets"),
        N_(
            "An offset is for a mechanical zero that differs from the table's; here they are assumed to agree, so"
            " all are 0."
        ),
        N_(
            "Statements of the article that the table meets: {p_statements_met} of {p_statements} with all offsets 0,"
            " {c_statements_met} of {c_statements} with offset 2 = −90°."
        ),
        N_("By the article's own zero pose offset 2 is not 0."),
    ),
    Item(
        "plot",
        "3.2",
        N_("Plot at the zero pose"),
        N_("The arm is plotted at zero in a window from z = 0 to 1.5 m."),
        N_("As printed the tool stands at z = {p_tool_z:.0f} mm, with offset 2 = −90° at {c_tool_z:.0f} mm."),
        N_("The window hides the tool: the table is not the arm described."),
    ),
    Item(
        "unreachable",
        "4.2",
        N_("Why a target fails"),
        N_("A failure may mean a target out of reach, a singularity, limits, or a poor guess."),
        N_(
            "Here it is the table. Branches within the limits: as printed {p_within_limits} of {p_solutions}, with "
            "offset 2 = −90° {c_within_limits} of {c_solutions}, of the real arm {r_within_limits} of {r_solutions}."
        ),
        N_("The article looks for the cause in target, guess and limits, not in the table."),
    ),
    Item(
        "void",
        "5.1",
        N_("The void"),
        N_("The workspace is a hollow shell; a region near and below the base can't be reached."),
        N_(
            "The largest void: as printed {p_void} L with its centre at z = {p_void_z} mm, with offset 2 = −90° "
            "{c_void} L at z = {c_void_z} mm."
        ),
        N_(
            "The printed table's void lies above the base. The offset that the text asks for leaves only one about "
            "the shoulder."
        ),
    ),
    Item(
        "line_singular",
        "5.2",
        N_("Where the line is singular"),
        N_("A straight line may cross singular regions; the example is played without a remark."),
        N_(
            "Singular at t = {p_crossings} s as printed, at t = {c_crossings} s with offset 2 = −90°. No joint speed "
            "jumps: at most {p_line_speed}°/s."
        ),
        N_(
            "The line is singular at its start and once more. This does no harm here: it asks for no motion in the "
            "lost direction."
        ),
    ),
    Item(
        "key_poses",
        "6.1",
        N_("Key poses against the manual"),
        N_("Compare key poses with the manual; small errors are allowed."),
        N_(
            "No official manual was found. Independent checks that pass: as printed {p_checks_met} of {p_checks}, "
            "with offset 2 = −90° {c_checks_met} of {c_checks}, of the real arm's table {r_checks_met} of {r_checks}."
            " At worst the printed table's tool is {off_anywhere_mm:.0f} mm off."
        ),
        N_(
            "The lengths are another robot's: the ER3A-C60 reaches {r_reach_mm:.0f} mm from axis 1, not "
            "{p_reach_mm:.0f} mm."
        ),
    ),
    Item(
        "round_trip",
        "6.1",
        N_("Round trip"),
        N_("Joints to pose and back must give the joints again."),
        N_("Over {round_trips} random poses the joints come back within {round_trip_deg}°."),
    ),
    Item(
        "hole",
        "6.2",
        N_("A hole in the cloud"),
        N_("A hole in the middle means wrong limits, or a direction turned round, of joints 2 and 3."),
        N_("As printed it has {p_void} L; offset 2 = −90° leaves {c_void} L of it."),
        N_("Offsets belong on the list; and a wider limit hides the fault as well."),
    ),
)

AGREEMENT = words(
    {
        "agrees": "agrees",
        "differs": "differs",
        "in_part": "in part",
        "not_examined": "not examined",
    }
)
