"""OpenCV, an optional extra: imported when it is first needed, with one clear error where it is missing or unfit."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from er3a.errors import Er3aError


@lru_cache(maxsize=1)
def opencv() -> Any:
    """The module ``cv2``, on one thread, so that equal images give equal numbers.

    Raises
    ------
    Er3aError
        saying what to install
    """
    try:
        import cv2
    except ImportError:
        raise Er3aError("images of boards need OpenCV: install er3a[vision]; sets of poses do without") from None
    if not hasattr(cv2, "aruco") or not hasattr(cv2.aruco, "CharucoDetector"):
        raise Er3aError(f"OpenCV {cv2.__version__} has no detector of ChArUco boards: install er3a[vision]")
    cv2.setNumThreads(1)
    return cv2
