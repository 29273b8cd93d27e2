"""What a policy observes and how it acts: the same for training and for driving."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from stack.errors import ParameterError
from stack.parameters import parameter, suggestion

RANGES, GOAL, POSE, PATH, REMAINING, VELOCITY, COMMAND, IMAGE = (
    "ranges", "goal", "pose", "path", "remaining", "velocity", "command", "image",
)  # fmt: skip
NAMES = (RANGES, GOAL, POSE, PATH, REMAINING, VELOCITY, COMMAND, IMAGE)
"""What can be observed."""

VELOCITIES, NORMALISED = "velocity", "normalised"


@dataclass(frozen=True)
class PolicyParameters:
    """Observations and actions of a policy."""

    observations: tuple[str, ...] = parameter(
        (RANGES, GOAL, VELOCITY), one_of=NAMES, public=True,
        help="what the policy observes, in the order of a flat input",
    )  # fmt: skip
    actions: str = parameter(
        VELOCITIES, one_of=(VELOCITIES, NORMALISED), public=True,
        help="what it decides: a velocity in m/s and rad/s, or one from -1 to 1 between the "
        "robot's limits",
    )  # fmt: skip
    repeat: int = parameter(
        1, at_least=1, at_most=100, public=True, help="control steps for which a decision holds"
    )
    sectors: int = parameter(
        36, at_least=3, at_most=720, public=True, help="of `ranges`, around the robot"
    )
    sight: float = parameter(
        5.0, "m", above=0.0, at_most=100.0, public=True, help="largest value of `ranges`"
    )
    reach: float = parameter(
        10.0, "m", above=0.0, at_most=1000.0, public=True,
        help="largest distance in `goal`, `pose`, `path` and `remaining`",
    )  # fmt: skip
    path_points: int = parameter(
        5, at_least=1, at_most=100, public=True, help="number of points of `path`"
    )
    path_spacing: float = parameter(
        0.4, "m", above=0.0, at_most=10.0, public=True, help="between two points of `path`"
    )
    image_width: int = parameter(
        0, at_least=0, at_most=2048,
        help="columns of `image`, which is scaled to it; 0: those of the camera",
    )  # fmt: skip

    def __post_init__(self) -> None:
        object.__setattr__(self, "observations", tuple(self.observations))
        if not self.observations:
            raise ParameterError("observations", "a policy observes nothing", f"e.g. [{GOAL}]")
        for name in self.observations:
            if name not in NAMES:  # given in Python; a file's are checked before
                raise ParameterError(
                    "observations", f"there is no observation {name!r}", suggestion(name, NAMES)
                )
        if len({*self.observations}) < len(self.observations):
            raise ParameterError("observations", "a name is listed twice", "remove one of them")


@dataclass(frozen=True)
class OnnxPolicyParameters(PolicyParameters):
    """Parameters of `OnnxPolicy`."""

    file: str = parameter("", public=True, help="an ONNX file, relative to the mission")

    def located(self, folder: Path) -> OnnxPolicyParameters:
        """Return a copy whose file is resolved relative to a folder."""
        return replace(self, file=str(folder / Path(self.file).expanduser())) if self.file else self
