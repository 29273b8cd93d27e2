"""Odometry between scans: its error, its edges in the graph, and whether scans confirm it."""
