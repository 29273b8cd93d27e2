"""Parameters of a costmap and its default layers, in a module that imports no kernels."""

from __future__ import annotations

from dataclasses import dataclass, replace

from stack.mapping.limits import LEAST_RESOLUTION
from stack.parameters import parameter


@dataclass(frozen=True)
class InflationParameters:
    """Parameters of the inflation.

    With a robot of 0.22 m radius the defaults give cost 100 of 252 in the middle of a 0.9 m door:
    the door is passable, and wider passages and the middle of a corridor are preferred.
    """

    inflation_radius: float = parameter(
        0.55, "m", at_least=0.0, at_most=5.0, public=True,
        help="distance up to which obstacles add cost",
    )  # fmt: skip
    cost_scaling: float = parameter(
        4.0, above=0.0, at_most=100.0, public=True,
        help="decay rate of the cost with distance, per metre",
    )  # fmt: skip
    turning_cost: float = parameter(
        0.0, at_least=0.0, at_most=250.0,
        help="minimum cost where the robot cannot turn in place; 0 turns this off",
    )  # fmt: skip


@dataclass(frozen=True)
class ObstacleParameters:
    """Parameters of the obstacle layer."""

    obstacle_range: float = parameter(
        2.5, "m", above=0.0, not_above="clearing_range", public=True,
        help="returns up to this distance mark obstacles",
    )  # fmt: skip
    clearing_range: float = parameter(
        3.0, "m", above=0.0, public=True,
        help="beams clear cells up to this distance; marks beyond it would stay",
    )  # fmt: skip
    decay: float = parameter(
        60.0, "s", at_least=0.0, public=True,
        help="an obstacle not seen for this long is removed; 0: never",
    )  # fmt: skip
    persistence: float = parameter(
        0.0, "s", at_least=0.0, help="beams do not clear marks younger than this"
    )


@dataclass(frozen=True)
class CostmapParameters(ObstacleParameters, InflationParameters):
    """Parameters of a costmap. Names and meanings follow Nav2's costmap_2d.

    Layers inherit the parameters of the same name from here; an entry in the list of layers
    overrides them.
    """

    resolution: float = parameter(
        0.05, "m", at_least=LEAST_RESOLUTION, at_most=1.0, public=True,
        help="side of a rolling window's cells",
    )  # fmt: skip
    map_resolution: float = parameter(
        0.025, "m", at_least=LEAST_RESOLUTION, at_most=1.0,
        help="side of the global costmap's cells when the map is drawn from the world file",
    )  # fmt: skip
    local_size: float = parameter(
        5.0, "m", at_least=1.0, at_most=50.0, public=True, help="side of the local costmap"
    )
    denoise: bool = parameter(
        False, help="ignore single sensed cells; off by default: table legs are single cells too"
    )
    local_inflation_radius: float | None = parameter(
        None, "m", at_least=0.0, at_most=5.0,
        help="inflation_radius of the local costmap; default: that of both",
    )  # fmt: skip
    local_cost_scaling: float | None = parameter(
        None, above=0.0, at_most=100.0,
        help="cost_scaling of the local costmap; default: that of both",
    )  # fmt: skip
    local_turning_cost: float | None = parameter(
        None, at_least=0.0, at_most=250.0,
        help="turning_cost of the local costmap; default: that of both",
    )  # fmt: skip

    def inflation(self, *, local: bool) -> InflationParameters:
        """Return the inflation of the local or of the global costmap."""
        own = {
            "inflation_radius": self.local_inflation_radius,
            "cost_scaling": self.local_cost_scaling,
            "turning_cost": self.local_turning_cost,
        }
        both = InflationParameters(self.inflation_radius, self.cost_scaling, self.turning_cost)
        chosen = {name: value for name, value in own.items() if local and value is not None}
        return replace(both, **chosen)
