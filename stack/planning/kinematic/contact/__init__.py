"""Contact of a footprint with a costmap, at a pose and along poses."""
