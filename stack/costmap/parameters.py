"""Settings of a costmap and its usual layers, apart from kernels so that reading them is cheap."""

from __future__ import annotations

from dataclasses import dataclass

from stack.errors import ParameterError
from stack.parameters import parameter


@dataclass(frozen=True)
class InflationParameters:
    """How obstacles are spread.

    With a 0.22 m robot the defaults leave cost 100 of 252 in the middle of a 0.9 m door: easily
    passable, yet wider ways and the middle of a corridor are preferred.
    """

    inflation_radius: float = parameter(
        0.55, "m", at_least=0.0, at_most=5.0, help="obstacles cost something up to this far away"
    )
    cost_scaling: float = parameter(
        4.0, above=0.0, at_most=100.0, help="how fast the cost falls with distance, per metre"
    )
    turning_cost: float = parameter(
        0.0, at_least=0.0, at_most=250.0,
        help="cost, at least, where the robot cannot turn on the spot; 0 takes no notice of that",
    )  # fmt: skip


@dataclass(frozen=True)
class ObstacleParameters:
    """How what the lidar sees is remembered."""

    obstacle_range: float = parameter(
        2.5, "m", above=0.0, help="returns nearer than this mark obstacles"
    )
    clearing_range: float = parameter(
        3.0, "m", above=0.0, help="beams clear what they pass up to here"
    )
    decay: float = parameter(
        60.0, "s", at_least=0.0, help="unseen for this long a sensed obstacle fades; 0 is never"
    )
    persistence: float = parameter(
        0.0, "s", at_least=0.0, help="no beam clears what was marked less than this long ago"
    )

    def __post_init__(self) -> None:
        if self.clearing_range < self.obstacle_range:
            raise ParameterError(
                "clearing_range",
                f"{self.clearing_range:g} m is less than obstacle_range "
                f"{self.obstacle_range:g} m: what is marked beyond could not be cleared",
                f"use at least {self.obstacle_range:g} m",
            )


@dataclass(frozen=True)
class CostmapParameters(ObstacleParameters, InflationParameters):
    """Settings of a costmap. Names and meanings follow Nav2's costmap_2d.

    A layer takes those of its own parameters that are also here from here, unless its entry in the
    list of layers says otherwise.
    """

    resolution: float = parameter(
        0.05, "m", at_least=0.01, at_most=1.0, help="side of a rolling window's cells"
    )
    map_resolution: float = parameter(
        0.025, "m", at_least=0.01, at_most=1.0,
        help="side of the global costmap's cells when the map is the world's own",
    )  # fmt: skip
    denoise: bool = parameter(
        False, help="ignore single sensed cells; off because table legs are single cells, too"
    )
