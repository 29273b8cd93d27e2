"""Dictionaries of ArUco markers."""

from __future__ import annotations


def marker_dictionaries() -> dict[str, int]:
    """OpenCV's number of each dictionary by its name, e.g. DICT_4X4_50; sorted by name."""
    import cv2

    found = vars(cv2.aruco).items()
    return dict(sorted((name, number) for name, number in found if name.startswith("DICT_")))
