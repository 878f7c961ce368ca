"""Cameras beside and on the arm: hand-eye calibration with intervals, bad samples, next views, errors, grasps."""
