"""Singularity avoidance: one module per strategy, each one function of a path with singular segments."""
