"""Parameters of visual place recognition, in a module without heavy imports."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from stack.parameters import parameter


@dataclass(frozen=True)
class PlaceParameters:
    """Visual place recognition: keyframes that are recorded, and poses that are accepted."""

    record: bool = parameter(
        False, public=True,
        help="record keyframes while the robot knows its pose; takes pictures at new places",
    )  # fmt: skip
    keyframe_distance: float = parameter(
        0.8, "m", above=0.0, at_most=10.0, help="motion after which the next keyframe is taken"
    )
    keyframe_angle: float = parameter(
        0.6, "rad", above=0.0, at_most=3.14, help="turn after which the next keyframe is taken"
    )
    settling_time: float = parameter(
        3.0, "s", at_least=0.0, at_most=60.0,
        help="a keyframe is kept if the localisation stays good for so long after it",
    )  # fmt: skip
    candidates: int = parameter(
        8, at_least=1, at_most=50, help="keyframes with which a picture is compared in detail"
    )
    least_inliers: int = parameter(
        10, at_least=6, at_most=500, help="features that must agree on a pose"
    )
    largest_deviation: float = parameter(
        0.1, "m", above=0.0, at_most=2.0,
        help="poses with a larger standard deviation are not accepted",
    )  # fmt: skip
    descriptor: str = parameter(
        "", public=True,
        help="an ONNX file that describes a picture by a vector, relative to the mission; retrieves"
        " keyframes in place of VLAD; empty: no model",
    )  # fmt: skip
    descriptor_size: int = parameter(
        224, at_least=16, at_most=2048,
        help="side of the descriptor's input in pixels, where the file leaves it open",
    )  # fmt: skip
    descriptor_normalised: bool = parameter(
        True,
        help="whether its input is 0 to 1 less the mean of ImageNet, by its standard deviation;"
        " else 0 to 1",
    )

    def located(self, folder: Path) -> PlaceParameters:
        """Return a copy whose file is resolved relative to a folder."""
        if not self.descriptor:
            return self
        return replace(self, descriptor=str(folder / Path(self.descriptor).expanduser()))
