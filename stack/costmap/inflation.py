"""Inflation: costs around lethal cells, the last step of a costmap before layers that add costs."""

from __future__ import annotations

from math import exp, floor
from typing import Any

import numpy as np

from stack.costmap.layer import Box, Costs
from stack.costmap.parameters import InflationParameters
from stack.types import INSCRIBED_COST, LETHAL_COST, Footprint


def inflation_costs(
    parameters: InflationParameters, footprint: Footprint, resolution: float
) -> Costs:
    """Nav2's inflation costs, indexed by the squared distance in cells to the nearest lethal cell.

    cost(d) = 254 at d = 0, 253 for d <= r, else floor(252 · exp(-k (d - r))) with d in metres, r
    the inscribed radius and k the cost scaling. With a turning cost T the cost falls linearly from
    252 at r to T at the circumscribed radius R, and as T · exp(-k (d - R)) beyond. A long robot
    then avoids gaps in which it cannot turn, unless the detour is long.

    Returns:
        (n² + 1,) uint8 where n is the inflation radius in whole cells.
    """
    inscribed, turning = footprint.inscribed_radius, footprint.circumscribed_radius
    top = float(INSCRIBED_COST - 1)
    if parameters.turning_cost == 0.0 or turning - inscribed < 1e-9:
        turning, base = inscribed, top
    else:
        base = parameters.turning_cost
    reach = floor(max(parameters.inflation_radius, turning) / resolution + 1e-6)
    costs = np.zeros(reach * reach + 1, dtype=np.uint8)
    for squared in range(costs.size):
        distance = float(squared) ** 0.5 * resolution
        if distance <= inscribed + 1e-9:
            costs[squared] = INSCRIBED_COST
        elif distance < turning:
            share = (distance - inscribed) / (turning - inscribed)
            costs[squared] = int(top + share * (base - top))
        else:
            costs[squared] = int(base * exp(-parameters.cost_scaling * (distance - turning)))
    costs[0] = LETHAL_COST
    return costs


class Inflation:
    """Costs that decay with the distance to the nearest lethal cell.

    With the centre within the footprint's inscribed radius the robot collides at any heading (253).

    Attributes:
        reach: inflation radius in cells.
    """

    def __init__(self, parameters: InflationParameters, footprint: Footprint) -> None:
        from stack.costmap import kernels

        self._kernels: Any = kernels
        self._parameters, self._footprint = parameters, footprint
        self._resolution, self.reach = 0.0, 0
        self._costs: Costs = np.zeros(1, dtype=np.uint8)

    def configure(self, parameters: InflationParameters) -> None:
        """Apply new parameters."""
        self._parameters = parameters
        self._costs = inflation_costs(parameters, self._footprint, self._resolution)
        self.reach = round((self._costs.size - 1) ** 0.5)

    def set_resolution(self, resolution: float) -> None:
        """Set the side of the cells, metres."""
        if resolution != self._resolution:
            self._resolution = resolution
            self.configure(self._parameters)

    def spread(self, cells: Costs, base: Costs, box: Box) -> None:
        """Inflate a box of `base` into `cells` (both cover the whole costmap)."""
        self._kernels.inflate(cells, base, self._costs, self.reach, *box)
