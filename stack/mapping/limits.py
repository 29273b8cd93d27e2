"""Largest maps and worlds that are accepted, with the reasons; docs/worlds.md lists them for users.

Memory was measured as the peak of a process.
"""

MAX_SIDE = 8192
"""Pixels along each side of a map image."""

MAX_CELLS = MAX_SIDE * MAX_SIDE
"""Cells of a map. Memory per cell: at most 47 bytes while an image is read, 54 for the localiser,
22 for the global costmap and at most 20 for a plan, not all at once: about 5 GB for the largest
map. Building the parts takes about 5 s for 80 million cells."""

LEAST_RESOLUTION = 0.01
"""Metres, of the cells of maps and costmaps. The cells that one scan changes grow with its square:
at 1 cm and a range of 10 m they are up to four million, at 1 mm four hundred million."""

MAX_UNEXPLORED = 4096 * 4096
"""Cells of the grid of a mission without a map. It is rebuilt while the robot drives, whenever it
grows: every step of growth costs as much as building a costmap of its size."""

FARTHEST = 1000.0
"""Metres: largest coordinate or length in a world."""

MAX_ITEMS = 5000
"""Items and wall points of a world file. With 4000 boxes a run is less than half as fast."""

MAX_SHAPES = 20_000
"""Shapes of an imported world: a Gazebo file, or the boxes that cover a map's occupied cells.
Programs write them, from finer geometry than people do."""
