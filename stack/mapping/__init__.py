"""Maps: occupancy grids from worlds and from ROS map files."""
