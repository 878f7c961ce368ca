"""The names of the vision stage's key figures, and the words of its page."""

from __future__ import annotations

from er3a.pipeline.messages.hand_eye import METHODS, direction_word, pose_words
from er3a.pipeline.messages.language import N_
from er3a.pipeline.messages.vision_verdict import say

__all__ = ["FIGURES", "METHODS", "direction_word", "pose_words", "say"]

FIGURES = {
    "samples_used": N_("samples used"),
    "position_half_width": N_("camera's position, largest half-width (95 %)"),
    "rotation_half_width": N_("camera's rotation, largest half-width (95 %)"),
    "objects_grasped": N_("objects that can be grasped"),
    "worst_error": N_("error at the worst grasp (95 %)"),
    "least_success": N_("least probability of success"),
}
