"""Columns of ``solutions.parquet``: one row per solution of each target, turns included."""

JOINT_COLUMNS = [f"q{joint}_deg" for joint in range(1, 7)]
TURN_COLUMNS = [f"turn{joint}" for joint in range(1, 7)]
COLUMNS = [
    "target",
    "branch",  # 4 * shoulder + 2 * elbow + wrist
    "label",  # the branch in words
    *JOINT_COLUMNS,
    *TURN_COLUMNS,  # full turns added to the angle in (-180, 180]
    "within_limits",
    "reason",  # empty, or which limits are left and by how much
    "beyond",  # the same in short: "J2 17.7 above, J3 27.1 below" (deg)
    "collision",  # empty, or what overlaps by how much, for rows within the limits
    "rank",  # 1 is the chosen one; 0 for refused rows
    "first_of_branch",  # the branch's best row by the rule
    "position_residual_mm",
    "orientation_residual_deg",
    "manipulability",  # of the Jacobian with lengths divided by the wrist's reach
    "singular",  # wrist, elbow, shoulder: those of the singularities that the arm stands on, to 1e-6 rad or m
    "limit_margin_deg",  # least distance of a joint from its limits
    "greatest_move_deg",
    "distance_deg",  # root of the summed squares of the joint moves
]
