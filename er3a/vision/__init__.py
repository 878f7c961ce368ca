"""Cameras beside and on the arm: hand-eye calibration with intervals, bad samples, errors, grasps.

``calibration_set`` is what was recorded (by ``boards`` from images). ``hand_eye`` calibrates: starts by
``classic_methods``, refined by ``likelihood``; what contradicts samples is in
``vision_findings``, and what explains that in ``typical_causes``. ``point_error`` says
how far it is off, ``grasping`` with ``grasp_motion`` plans.
"""
