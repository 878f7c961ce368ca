"""What the page on the article says of each of its sentences, in the article's order."""

from __future__ import annotations

from dataclasses import dataclass

from er3a.pipeline.language import N_


@dataclass(frozen=True)
class Item:
    """A thing that the article says or does.

    Attributes
    ----------
    code, section : what it is, and where in the article it stands
    how : what does it in er3a, as written in Python or a terminal; empty where nothing does
    title, says, finds : what the article says, and what er3a computes, with fields of
        :class:`er3a.pipeline.article.article_numbers.ArticleNumbers`
    why : what is shown unless both agree
    """

    code: str
    section: str
    how: str
    title: str
    says: str
    finds: str
    why: str | None = None


ITEMS = (
    Item(
        "payload",
        "1",
        "er3a.gravity(robot, q, er3a.Load(6))",
        N_("Payload"),
        N_("The arm is introduced as a desktop arm for 6 kg."),
        N_("No document states a payload of the ER3A-C60; nothing else on this page rests on 6 kg."),
        N_("No source was found for it. The manual of its successor, the ER3-600, says 3 kg."),
    ),
    Item(
        "toolbox",
        "2.1",
        "",
        N_("Robotics Toolbox"),
        N_("MATLAB's Robotics Toolbox is used, version 10 or 11 recommended."),
        N_("It was not run here: er3a does each step by itself."),
        N_(
            "It needs MATLAB; the newest public release is 10. er3a's tests compare with its Python port by the same "
            "author."
        ),
    ),
    Item(
        "definitions",
        "2.2",
        "er3a.to_modified(robot)",
        N_("The four D-H parameters"),
        N_("The parameters are called standard, and a and α are defined from axis Z(i) to axis Z(i+1) along X(i)."),
        N_(
            "Entered as modified row by row, joint 1 alone moves the tool {literal_rise_mm:.0f} mm up and down; "
            "entered as standard, {circle_error_mm} mm."
        ),
        N_("These are the definitions of modified D-H (Craig), for which a and α move one row down."),
    ),
    Item(
        "convention",
        "2.2",
        'er3a.load_robot("table.csv", convention="modified")',
        N_("Standard or modified"),
        N_("Manuals use either convention; find out which."),
        N_(
            "Every robot file names its convention, `er3a new DIR --dh table.csv --convention modified` reads the "
            "other one, and the diagnosis tries it."
        ),
    ),
    Item(
        "zero_pose",
        "2.2",
        "er3a.forward(robot, q, frame=2)",
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
        "circle",
        "2.2",
        "er3a.forward(robot, q)",
        N_("Hand check: joint 1 alone"),
        N_("Joint 1 alone must move the tool on a circle."),
        N_("It does: radius {circle_mm:.2f} mm, {circle_error_mm} mm from a circle over the whole range."),
    ),
    Item(
        "units",
        "3.1",
        'er3a.diagnose(robot, "er3a_c60_article")',
        N_("Units"),
        N_(
            "Millimetres and degrees must become metres and radians; forgetting it is the commonest error (also "
            "in 6.2)."
        ),
        N_(
            "er3a's files are in mm and degrees, Python is in m and rad; `er3a.forward` warns of degrees given as"
            " radians."
        ),
    ),
    Item(
        "links",
        "3.1",
        "er3a.Robot.from_dh(a, alpha, d, lower=..., upper=..., offset=..., base=..., tool=...)",
        N_("Links, limits, base and tool"),
        N_("Six links with their limits make the robot; base and tool are transforms that place it."),
        N_("The same table, limits, base and tool are read here; the foot of this page names the files."),
    ),
    Item(
        "offset",
        "3.1",
        "robot.replace(offset=...)",
        N_("Joint offsets"),
        N_(
            "An offset is for a mechanical zero that differs from the table's; here they are assumed to agree, so"
            " all are 0."
        ),
        N_(
            "Statements of the article that the table meets: {p_statements_met} of {p_statements} with all offsets 0,"
            " {c_statements_met} of {c_statements} with offset 2 = −90°. The validation page lists them."
        ),
        N_("By the article's own zero pose offset 2 is not 0."),
    ),
    Item(
        "plot",
        "3.2",
        "er3a.plot(robot, q, window=(-1.5, 1.5, -1.5, 1.5, 0, 1.5))",
        N_("Plot at the zero pose"),
        N_("The arm is plotted at zero in a window from z = 0 to 1.5 m."),
        N_(
            "As printed the tool stands at z = {p_tool_z:.0f} mm, with offset 2 = −90° at {c_tool_z:.0f} mm; the "
            "figure of the zero pose shows the window."
        ),
        N_("The window hides the tool: the table is not the arm described."),
    ),
    Item(
        "teach",
        "3.2",
        "er3a teach ROBOT",
        N_("Teach panel"),
        N_("Sliders move the joints and the arm follows, to feel each joint and to try the limits."),
        N_("The teach panel does that in a browser, with limits, singularities and all solutions of the pose shown."),
    ),
    Item(
        "wrist",
        "3.2",
        "er3a.conditioning(robot, q)",
        N_("Joint 5 near 0"),
        N_(
            "With axes 4 and 6 nearly in line, joints 4 and 6 are said to turn the tool violently, or hardly to "
            "move it (again "
            "in 6.2)."
        ),
        N_(
            "One degree of joint 4 turns the tool by {wrist_turn_deg:.3f}°, there as everywhere. At joint 5 = 1° a "
            "turn of the tool needs {wrist_gain:.1f} times its own speed of the joints."
        ),
        N_(
            "The second is right of the tool's position, the first of no pose: what grows is the joint speed that a "
            "turn of the tool needs."
        ),
    ),
    Item(
        "fkine",
        "4.1",
        "er3a.forward(robot, q)",
        N_("Forward kinematics"),
        N_("The pose of q = [0, π/4, −π/6, 0, π/3, 0] is computed."),
        N_(
            "As printed: ({p_example}) mm. With offset 2 = −90°: ({c_example}) mm. The article gives no numbers "
            "to compare."
        ),
    ),
    Item(
        "rpy",
        "4.1",
        "er3a.rpy(T), er3a.zyz(T), er3a.quaternion(T)",
        N_("Roll, pitch, yaw, Euler angles, quaternion"),
        N_("Orientation is read as roll-pitch-yaw (ZYX), as ZYZ Euler angles or as a quaternion."),
        N_(
            "Roll, pitch, yaw of the example as printed: {p_example_rpy}°. `er3a.zyz` and `er3a.quaternion` give "
            "the others."
        ),
    ),
    Item(
        "same_as_teach",
        "4.1",
        "er3a teach er3a_c60_article",
        N_("The same in the teach panel"),
        N_("The computed position must agree with what the teach panel shows."),
        N_("The panel of this table computes by itself; at these joint values it shows ({p_example}) mm as well."),
    ),
    Item(
        "target",
        "4.2",
        "T = er3a.pose([0.5, 0.2, 0.7], np.radians([0, 90, 0]))",
        N_("The target"),
        N_("The target is (0.5, 0.2, 0.7) m with roll, pitch, yaw 0°, 90°, 0°."),
        N_(
            "At a pitch of 90° roll and yaw are one turn: 0°, 90°, 0° and 30°, 90°, 30° are the same pose, "
            "{same_pose_deg}° apart."
        ),
        N_(
            "The example lies on the singularity of roll-pitch-yaw. It harms no solver, but angles read back may "
            "differ."
        ),
    ),
    Item(
        "ikine",
        "4.2",
        "er3a.solve(robot, T, q0, respect_limits=False)",
        N_("ikine and the limits"),
        N_("The code's comment and 3.1 say that ikine considers the limits; the text says that it does not."),
        N_(
            "Iteration without limits reaches the target with joint {free_joint} {free_beyond_deg:.0f}° beyond "
            "its limit."
        ),
        N_(
            "The text is right. In the Toolbox's release 10 ikine has one output: the printed line, which asks for "
            "two, would end in an error."
        ),
    ),
    Item(
        "mask",
        "4.2",
        "er3a.solve(robot, T, q0, mask=[1, 1, 1, 1, 1, 0])",
        N_("Mask and start guess"),
        N_("A mask chooses the degrees of freedom, and the start guess decides which solution is found."),
        N_("Both are arguments of `er3a.solve`; `er3a.inverse` needs no start guess."),
    ),
    Item(
        "ikcon",
        "4.2",
        "er3a.solve(robot, T, q0)",
        N_("ikcon"),
        N_("ikcon is recommended because it respects the limits; its second output is taken as an exit flag."),
        N_(
            "As printed {p_within_limits} of {p_solutions} branches are within the limits, so nothing that respects "
            "them solves the target."
        ),
        N_(
            "By the Toolbox's documentation the second output is the remaining error: a failure looks like success to"
            " code that tests it for being above 0."
        ),
    ),
    Item(
        "unreachable",
        "4.2",
        "er3a.inverse(robot, T)",
        N_("Why a target fails"),
        N_("A failure may mean a target out of reach, a singularity, limits, or a poor guess."),
        N_(
            "Here it is the table. Branches within the limits: as printed {p_within_limits} of {p_solutions}, with "
            "offset 2 = −90° {c_within_limits} of {c_solutions}, of the real arm {r_within_limits} of {r_solutions}."
        ),
        N_("The article looks for the cause in target, guess and limits, not in the table."),
    ),
    Item(
        "eight",
        "4.2",
        "er3a.inverse(robot, T)",
        N_("Up to eight solutions"),
        N_("A wrist-partitioned arm has up to 8 solutions, in closed form."),
        N_(
            "{p_solutions} branches are found in closed form; forward kinematics misses the target by "
            "{residual_mm} mm at most."
        ),
    ),
    Item(
        "choice",
        "4.2",
        'er3a.select(robot, solutions, {"nearest": 1, "limits": 2}, q_ref=q)',
        N_("Which solution to take"),
        N_("Take the nearest, one far from singularities, or one clear of obstacles."),
        N_("`er3a.select` ranks by these rules and mixes of them; the inverse page of each table shows it."),
    ),
    Item(
        "cloud",
        "5.1",
        "er3a.forward(robot, q)",
        N_("Point cloud"),
        N_("10 000 random joint vectors within the limits are drawn as a cloud."),
        N_("The workspace page draws the cloud, and proves a volume of {p_volume} m³."),
    ),
    Item(
        "void",
        "5.1",
        "",
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
        "jtraj",
        "5.2",
        "er3a.jtraj(q0, q1, t)",
        N_("Joint move"),
        N_("A quintic in joint space takes 5 s with 50 samples; angle, velocity and acceleration are plotted."),
        N_(
            "Greatest velocity {move_speed_deg_s:.2f}°/s. The curve is the same for any table; the trajectory "
            "page draws it."
        ),
    ),
    Item(
        "animation",
        "5.2",
        "er3a.plot(robot, q_t)",
        N_("Animation with trail"),
        N_("Both motions are animated with the tool's trail."),
        N_(
            "The player on this page shows both, of both tables side by side; the trajectory pages and recordings"
            " show them too."
        ),
    ),
    Item(
        "ctraj",
        "5.2",
        "er3a.follow(robot, er3a.line(T0, T1, 5.0, ramp=1/3), t).joints(t)",
        N_("Straight line"),
        N_("50 poses on a straight line are solved one after the other with ikcon, each from the last."),
        N_(
            "er3a follows the whole line in ctraj's own time law (trapezoid of speed, ramps of a third). Verdicts: "
            "{p_line} as printed, {c_line} with offset 2 = −90°."
        ),
    ),
    Item(
        "line_singular",
        "5.2",
        "",
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
        "condition",
        "5.2",
        "er3a.conditioning(robot, q)",
        N_("Manipulability and condition number"),
        N_("The condition number is named as an example of manipulability (again in 6.2)."),
        N_(
            "For {ranked_apart_percent:.0f} % of pairs of random poses the measures disagree on which is nearer to a "
            "singularity."
        ),
        N_(
            "Manipulability is the product of the singular values and falls to 0; the condition number is the largest"
            " by the smallest and grows without bound."
        ),
    ),
    Item(
        "avoidance",
        "5.2",
        "",
        N_("What to do about it"),
        N_("Stop, go round in joint space, warn the operator, or bend the line by a via point (6.2)."),
        N_(
            "All are compared on the trajectory page. On the article's line these work: {ways_usable}. Recommended: "
            "{way_chosen}."
        ),
    ),
    Item(
        "key_poses",
        "6.1",
        'er3a.load_references("er3a_c60")',
        N_("Key poses against the manual"),
        N_("Compare key poses with the manual; small errors are allowed."),
        N_(
            "No official manual was found. Independent checks that pass: as printed {p_checks_met} of {p_checks}, "
            "with offset 2 = −90° {c_checks_met} of {c_checks}, of the real arm's table {r_checks_met} of {r_checks}."
            " At worst the printed table's tool is {off_anywhere_mm:.0f} mm off, {off_aligned_mm:.0f} mm once "
            "aligned."
        ),
        N_(
            "The lengths are another robot's: the ER3A-C60 reaches {r_reach_mm:.0f} mm from axis 1, not "
            "{p_reach_mm:.0f} mm."
        ),
    ),
    Item(
        "boundary",
        "6.1",
        'er3a.load_references("er3_600")',
        N_("Workspace drawing"),
        N_("Compare the cloud with the manual's drawing."),
        N_(
            "No drawing of this arm was found. Its tool gets {r_reach_mm:.0f} mm from axis 1, as printed "
            "{p_reach_mm:.0f} mm. `make run` compares the ER3-600 with its drawing: reports/er3_600/validation.html."
        ),
        N_("The reach of the printed table is not that of the arm."),
    ),
    Item(
        "round_trip",
        "6.1",
        "er3a.inverse(robot, er3a.forward(robot, q))",
        N_("Round trip"),
        N_("Joints to pose and back must give the joints again."),
        N_("Over {round_trips} random poses the joints come back within {round_trip_deg}°."),
    ),
    Item(
        "hole",
        "6.2",
        "",
        N_("A hole in the cloud"),
        N_("A hole in the middle means wrong limits, or a direction turned round, of joints 2 and 3."),
        N_(
            "As printed it has {p_void} L; offset 2 = −90° leaves {c_void} L of it. The workspace page names the "
            "single changes that take it away."
        ),
        N_("Offsets belong on the list; and a wider limit hides the fault as well."),
    ),
    Item(
        "poor_solver",
        "6.2",
        "er3a.solve(robot, T, q0)",
        N_("Inverse kinematics fails often"),
        N_("Try other guesses, tilt the target a little, look at the limits."),
        N_("No guess helps where no branch is within the limits; the inverse page says so, and why, for every target."),
    ),
    Item(
        "collision",
        "6.3",
        'er3a.clearance(robot, q_t, er3a.load_scene("data/scenes/wall_and_low_floor.yaml")).distance',
        N_("Collisions"),
        N_("Links as cylinders and boxes, checked along the path."),
        N_("The trajectory pages give the clearance along the article's paths."),
    ),
    Item(
        "programs",
        "6.3",
        "er3a program write data/paths/er3a_c60_article.yaml --robot er3a_c60_article "
        "--language krl --only article_joint",
        N_("CSV and robot programs"),
        N_("Trajectories are written as CSV or as controller programs (.src, .script)."),
        N_(
            "The command writes the joint move as KRL, with other words as CSV or URScript. No page hands it out, "
            "because evidence contradicts the table."
        ),
    ),
    Item(
        "vision",
        "6.3",
        'er3a.calibrate_hand_eye(er3a.load_hand_eye("data/vision/fixed_camera.yaml", robot))',
        N_("Camera"),
        N_("A calibrated camera gives a part's pose in the base frame, and inverse kinematics the joints to grasp it."),
        N_("A simulated camera in front of the real arm stands in for one."),
        N_("No real camera took part: what it sees is simulated."),
    ),
    Item(
        "dynamics",
        "6.3",
        "er3a.torques(robot, q, qd, qdd)",
        N_("Dynamics"),
        N_("With masses, centres and inertias, torques or forward dynamics can be computed, to choose motors."),
        N_(
            "Torques of the real arm are computed from masses in its file. Forward dynamics is "
            "`er3a.dynamics.torques.accelerations`."
        ),
        N_(
            "No drive's limits are known, and the masses are neither measured nor given by the manufacturer: no motor"
            " can be chosen."
        ),
    ),
    Item(
        "toolset",
        "6.3",
        "er3a new cell --dh table.csv",
        N_("The next robot"),
        N_("Wrap it all up, so that the next robot takes less time."),
        N_("`er3a new` makes such a study of any table or URDF."),
    ),
)

SECTIONS = {
    "1": N_("Project"),
    "2.1": N_("Tools"),
    "2.2": N_("Kinematics and D-H parameters"),
    "3.1": N_("The model"),
    "3.2": N_("Seeing it"),
    "4.1": N_("Forward kinematics"),
    "4.2": N_("Inverse kinematics"),
    "5.1": N_("Workspace"),
    "5.2": N_("Trajectories"),
    "6.1": N_("Checking the model"),
    "6.2": N_("Symptoms and causes"),
    "6.3": N_("Further uses"),
}
AGREEMENT = {
    "agrees": N_("agrees"),
    "differs": N_("differs"),
    "in_part": N_("in part"),
    "not_examined": N_("not examined"),
    "done": N_("can be done"),
}
