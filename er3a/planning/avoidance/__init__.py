"""Singularity avoidance: ``avoidance`` finds the singular segment of a path; ``strategies`` has the strategies and
compares them. Each is a function from such a segment to a motion, or to the reason why there is none.
"""
