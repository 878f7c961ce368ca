"""The robot model: ``robot`` (D-H rows, joint direction and offset, limits, speeds, base and tool), its ``masses``,
``joint_limits`` and ``whole_turns``; ``usable`` says what can't be computed with.
"""
