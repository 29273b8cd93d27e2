"""Where to drive in a map that is not complete: frontiers, and lanes that cover an area."""
