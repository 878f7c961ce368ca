"""er3a: can this kinematic model of an industrial robot be trusted, and what can the robot do?

The public names below are imported on first use, so importing er3a loads only the parts that are needed.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from er3a.collision.along import clearance as clearance
    from er3a.comparison.compare import Comparison as Comparison
    from er3a.comparison.compare import compare as compare
    from er3a.confirmation.confirm import Confirmation as Confirmation
    from er3a.confirmation.confirm import confirm as confirm
    from er3a.dynamics.torques import gravity as gravity
    from er3a.dynamics.torques import mass_matrix as mass_matrix
    from er3a.dynamics.torques import torques as torques
    from er3a.errors import Er3aError as Er3aError
    from er3a.errors import InputWarning as InputWarning
    from er3a.files.by_name import calibrate as calibrate
    from er3a.files.by_name import diagnose as diagnose
    from er3a.files.by_name import evidence as evidence
    from er3a.files.by_name import load_calibration as load_calibration
    from er3a.files.by_name import load_measurements as load_measurements
    from er3a.files.hand_eye_file import load_hand_eye as load_hand_eye
    from er3a.files.reference_sets import load_references as load_references
    from er3a.files.robot_library import load_robot as load_robot
    from er3a.files.robot_library import read_table as read_table
    from er3a.files.scene_file import load_scene as load_scene
    from er3a.files.target_file import load_targets as load_targets
    from er3a.formats.urdf import export_urdf as export_urdf
    from er3a.formats.urdf import import_urdf as import_urdf
    from er3a.kinematics.batch import inverse_batch as inverse_batch
    from er3a.kinematics.forward import forward as forward
    from er3a.kinematics.forward import jacobian as jacobian
    from er3a.kinematics.inverse import inverse as inverse
    from er3a.kinematics.numerical import solve as solve
    from er3a.kinematics.singularity import conditioning as conditioning
    from er3a.pipeline.viewing.plot import plot as plot
    from er3a.planning.class_follow import follow as follow
    from er3a.planning.moves import line as line
    from er3a.planning.toolbox import ctraj as ctraj
    from er3a.planning.toolbox import jtraj as jtraj
    from er3a.planning.toolbox import pose as pose
    from er3a.planning.toolbox import quaternion as quaternion
    from er3a.planning.toolbox import rpy as rpy
    from er3a.planning.toolbox import zyz as zyz
    from er3a.program_check.check_program import CheckOptions as CheckOptions
    from er3a.program_check.check_program import check_program as check_program
    from er3a.programs.languages import execute as execute
    from er3a.programs.languages import read_program as read_program
    from er3a.programs.languages import write_program as write_program
    from er3a.programs.writing import WriteOptions as WriteOptions
    from er3a.robots.masses import Load as Load
    from er3a.robots.robot import Robot as Robot
    from er3a.robots.robot import to_modified as to_modified
    from er3a.robots.robot import to_standard as to_standard
    from er3a.selection.select import select as select
    from er3a.selection.select import select_sequence as select_sequence
    from er3a.vision.calibration_set import CalibrationSet as CalibrationSet
    from er3a.vision.hand_eye import calibrate_hand_eye as calibrate_hand_eye

from er3a.version import __version__ as __version__

_PUBLIC = {
    "load_robot": "er3a.files.robot_library",
    "read_table": "er3a.files.robot_library",
    "Robot": "er3a.robots.robot",
    "forward": "er3a.kinematics.forward",
    "jacobian": "er3a.kinematics.forward",
    "inverse": "er3a.kinematics.inverse",
    "inverse_batch": "er3a.kinematics.batch",
    "solve": "er3a.kinematics.numerical",
    "conditioning": "er3a.kinematics.singularity",
    "pose": "er3a.planning.toolbox",
    "rpy": "er3a.planning.toolbox",
    "zyz": "er3a.planning.toolbox",
    "quaternion": "er3a.planning.toolbox",
    "jtraj": "er3a.planning.toolbox",
    "ctraj": "er3a.planning.toolbox",
    "line": "er3a.planning.moves",
    "follow": "er3a.planning.class_follow",
    "plot": "er3a.pipeline.viewing.plot",
    "clearance": "er3a.collision.along",
    "select": "er3a.selection.select",
    "select_sequence": "er3a.selection.select",
    "torques": "er3a.dynamics.torques",
    "mass_matrix": "er3a.dynamics.torques",
    "gravity": "er3a.dynamics.torques",
    "Load": "er3a.robots.masses",
    "load_scene": "er3a.files.scene_file",
    "load_targets": "er3a.files.target_file",
    "diagnose": "er3a.files.by_name",
    "evidence": "er3a.files.by_name",
    "calibrate": "er3a.files.by_name",
    "load_measurements": "er3a.files.by_name",
    "load_calibration": "er3a.files.by_name",
    "load_references": "er3a.files.reference_sets",
    "load_hand_eye": "er3a.files.hand_eye_file",
    "CalibrationSet": "er3a.vision.calibration_set",
    "confirm": "er3a.confirmation.confirm",
    "Confirmation": "er3a.confirmation.confirm",
    "calibrate_hand_eye": "er3a.vision.hand_eye",
    "compare": "er3a.comparison.compare",
    "Comparison": "er3a.comparison.compare",
    "to_modified": "er3a.robots.robot",
    "to_standard": "er3a.robots.robot",
    "import_urdf": "er3a.formats.urdf",
    "export_urdf": "er3a.formats.urdf",
    "read_program": "er3a.programs.languages",
    "execute": "er3a.programs.languages",
    "check_program": "er3a.program_check.check_program",
    "CheckOptions": "er3a.program_check.check_program",
    "write_program": "er3a.programs.languages",
    "WriteOptions": "er3a.programs.writing",
    "Er3aError": "er3a.errors",
    "InputWarning": "er3a.errors",
}

__all__ = list(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'er3a' has no attribute '{name}'")
    try:
        found = getattr(import_module(_PUBLIC[name]), name)
    except ModuleNotFoundError as error:
        raise import_module("er3a.errors").with_extra(error) from None
    if not isinstance(found, type):
        found = import_module("er3a.public").checked(found)
    globals()[name] = found  # so that it is the same object from now on
    return found


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
