"""Places that a camera recognises."""

from __future__ import annotations

from dataclasses import dataclass

from stack.types.geometry import Pose2D


@dataclass(frozen=True, slots=True)
class PlaceSighting:
    """A pose from which one picture looks as the keyframes of the map do.

    Attributes:
        stamp: of the picture, seconds on the body's clock.
        pose: of the base at the picture's stamp, map frame.
        inliers: features of the picture that agree on the pose.
        error: root mean square reprojection error of these features, pixels.
        deviation: standard deviation of the position in its least certain direction, metres.
        similarity: of the picture and the most similar keyframe, in [-1, 1].
    """

    stamp: float
    pose: Pose2D
    inliers: int
    error: float
    deviation: float
    similarity: float
