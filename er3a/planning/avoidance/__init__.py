"""Singularity avoidance: ``avoidance`` finds the segment of a path that is singular, ``strategies`` has each strategy,
a function from such a segment to a motion or to why there is none, and compares them.
"""
