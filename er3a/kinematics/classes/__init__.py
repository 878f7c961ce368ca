"""Inverse kinematics of further classes of arms, on plain arrays: constant links and joint axes along z."""
