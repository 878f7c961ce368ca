"""Paths in joint and Cartesian space, their time law, and how an arm follows them. Knows no stage.

- A path: ``commands`` says what is asked for and builds ``moves`` or ``sequences`` of them, timed by ``profiles``.
- Following it: ``follow`` (eight branches) or ``class_follow`` (other arms); ``tool_proof`` bounds what happens
  between the poses solved. Motions of joints are ``piecewise`` polynomials.
- What is wrong with it, and when: ``motion_faults``. The gravity of verdicts: ``names``.
- How fast it can be: ``timing``. Around what is in the way: ``way_around``; around singularities: ``avoidance``.
- ``toolbox``: names that users of the Robotics Toolbox know.
"""
