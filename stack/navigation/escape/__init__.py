"""Escape: drives out of a tight spot by lidar, without a map, a costmap or a pose."""
