"""Cameras beside and on the arm: hand-eye calibration with intervals, bad samples, next views, errors, grasps.

``calibration_set`` is what was recorded (by ``boards`` from images). ``hand_eye`` calibrates: starts by
``classic_methods``, refined by ``likelihood``; what contradicts samples is in
``vision_findings``, whether they are of two setups in ``setup_changes``, and whether the board or the camera's
intrinsics are others in ``distance_errors``. ``next_view`` and ``point_error`` say what to do with it, ``grasping``
with ``grasp_motion`` plans.
"""
