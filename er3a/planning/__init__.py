"""Paths in joint and Cartesian space, their time laws, and how an arm follows them.

- A path: ``commands`` describes it and builds ``moves`` or ``sequences`` of moves, timed by ``profiles``.
- Following it: ``follow`` (eight branches) or ``class_follow`` (other arms); ``tool_curve`` bounds what happens
  between the poses solved. Motions of joints are ``piecewise`` polynomials.
- Its faults, with their times: ``motion_faults``; where it is singular: ``singular_events``. The order of verdicts:
  ``names``.
- Its fastest timing: ``timing``. Motions around obstacles: ``way_around``; around singularities: ``avoidance``.
- ``toolbox``: functions with the names of the Robotics Toolbox.
"""
