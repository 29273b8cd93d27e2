"""Driving out of a tight spot by what the lidar saw, without a map, a costmap or a pose."""
