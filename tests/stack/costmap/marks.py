"""Where the sensor layers of a costmap have marks, whatever the layers above make of them."""

import numpy as np

from stack.costmap.obstacle_layer import ObstacleLayer
from stack.costmap.range_layer import RangeLayer


def sensed(costmap):
    """(rows, columns) bool: cells that a sensor has marked and not cleared."""
    layers = [x for x in costmap._layers.values() if isinstance(x, ObstacleLayer | RangeLayer)]
    return np.logical_or.reduce([layer.marked for layer in layers])
