"""The robot model: ``robot`` (D-H rows, joint direction and offset, limits, speeds, base and tool), its ``masses``,
``joint_limits`` and ``whole_turns``; ``usable`` checks whether a robot can be computed with.
"""
