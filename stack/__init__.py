"""The navigation stack: how a robot moves, free of missions and screens."""
