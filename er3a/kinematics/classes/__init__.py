"""Inverse kinematics of further classes of arms, on plain arrays: constant links and joint axes along z.

``class_solvers`` names the classes and has the solver of each; ``chain_solvers`` finds the class of a chain
(``CLOSED_FORMS``). Closed forms: ``parallel_axes`` with ``four_bar``, ``scara``, ``arm_angle``. By elimination:
``six_revolute`` (``hidden_joint``, then ``loop_rows`` and ``polish``), ``slide_and_wrist`` and ``two_slides``.
``self_motion`` traces the self-motions of any of them.
"""
