"""Sensor data as costmaps receive it, and the marks in their sensor layers."""

import numpy as np

from stack.costmap.layer import LayerUpdate, Posed
from stack.costmap.layers.obstacle_layer import ObstacleLayer
from stack.costmap.layers.range_layer import RangeLayer


def seen(pose, scan, time, *, source="lidar", readings=(), tracks=None):
    """An update with at most one scan, taken at the pose."""
    scans = {} if scan is None else {source: Posed(scan, pose)}
    heard = tuple(Posed(reading, pose) for reading in readings)
    return LayerUpdate(pose, time, scans, heard, None if tracks is None else tuple(tracks))


def sensed(costmap):
    """(rows, columns) bool: cells that a sensor has marked and not cleared."""
    layers = [x for x in costmap._layers.values() if isinstance(x, ObstacleLayer | RangeLayer)]
    return np.logical_or.reduce([layer.marked for layer in layers])
