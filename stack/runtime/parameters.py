"""Parameters of the step loop, in a module that imports none of its parts."""

from __future__ import annotations

from dataclasses import dataclass

from stack.errors import ParameterError
from stack.parameters import parameter


@dataclass(frozen=True)
class LoopParameters:
    """Rates and memory of the step loop. The rate of the tree must divide the control rate."""

    control_rate: float = parameter(
        20.0, "Hz", at_least=10.0, at_most=200.0, public=True,
        help="control steps per second: sense, estimate, navigate, limit and drive",
    )  # fmt: skip
    tree_rate: float = parameter(
        10.0, "Hz", above=0.0, public=True, help="ticks of the behaviour tree"
    )
    pose_history: float = parameter(
        10.0, "s", at_least=1.0,
        help="how long poses are kept, for measurements that arrive late",
    )  # fmt: skip

    def __post_init__(self) -> None:
        steps = self.control_rate / self.tree_rate
        if steps < 1 or abs(steps - round(steps)) > 1e-9:
            raise ParameterError(
                "tree_rate",
                f"{self.tree_rate:g} Hz does not divide control_rate {self.control_rate:g} Hz",
                "choose a rate that does, such as 20, 10 or 5 Hz for 20 Hz",
            )

    @property
    def period(self) -> float:
        """Length of a control step, seconds."""
        return 1.0 / self.control_rate

    @property
    def steps_per_tick(self) -> int:
        """Number of control steps between two ticks of the tree."""
        return round(self.control_rate / self.tree_rate)
