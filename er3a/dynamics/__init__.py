"""What the motors feel: torques, powers and holding loads of an arm whose masses are known.

``arm_model`` is the one place that calls Pinocchio; ``torques`` of motions and at rest, ``torque_timing`` (the
shortest time under them), ``margins`` (of payload and speed, and the wrist's), ``pose_bound`` (over all poses),
``plausibility`` (whether masses can be right).
"""
