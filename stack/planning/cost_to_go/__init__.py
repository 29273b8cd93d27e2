"""Cost-to-go field: the cheapest cost from every cell to the goal, for a point robot."""
