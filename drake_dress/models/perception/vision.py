"""OpenCV, which is an extra of the package and is imported when images are used."""

from __future__ import annotations

from types import ModuleType


def opencv() -> ModuleType:
    """Returns OpenCV.

    Raises:
        ModuleNotFoundError: it is not installed.
    """
    import cv2

    return cv2
