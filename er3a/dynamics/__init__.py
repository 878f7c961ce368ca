"""Dynamics: torques, powers and holding loads of an arm with known masses.

Only ``arm_model`` calls Pinocchio. ``torques``: of motions and at rest. ``margins``: of payload, speed and wrist.
``pose_bound``: bounds over all poses. ``plausibility``: of masses.
"""
