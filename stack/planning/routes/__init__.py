"""Planning over a graph of routes instead of free space: lanes, one-ways, closures and speeds."""
