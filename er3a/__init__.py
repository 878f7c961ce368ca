"""er3a: can this kinematic model of a six-axis robot be trusted, and what can the robot do?

The names below are imported on first use, so that one part of the package does not depend on all others.
"""

from importlib import import_module
from typing import Any

_PUBLIC = {
    "load_robot": "er3a.files.robot_library",
    "Robot": "er3a.robots.robot",
    "forward": "er3a.kinematics.forward",
    "jacobian": "er3a.kinematics.forward",
    "inverse": "er3a.kinematics.inverse",
    "inverse_batch": "er3a.kinematics.batch",
    "solve": "er3a.kinematics.numerical",
    "select": "er3a.selection.select",
    "select_sequence": "er3a.selection.sequence",
    "load_scene": "er3a.files.scene_file",
    "load_targets": "er3a.files.target_file",
    "diagnose": "er3a.files.by_name",
    "calibrate": "er3a.files.by_name",
    "load_measurements": "er3a.files.measurements",
    "load_references": "er3a.files.reference_sets",
    "to_modified": "er3a.robots.conventions",
    "to_standard": "er3a.robots.conventions",
    "import_urdf": "er3a.formats.urdf",
    "export_urdf": "er3a.formats.urdf",
    "Er3aError": "er3a.errors",
}

__all__ = list(_PUBLIC)
__version__ = "0.1.0"


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'er3a' has no attribute '{name}'")
    return getattr(import_module(_PUBLIC[name]), name)
