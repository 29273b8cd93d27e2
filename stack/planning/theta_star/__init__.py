"""Any-angle planning on a costmap."""
