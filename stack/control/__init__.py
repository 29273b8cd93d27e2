"""Controllers: compute velocity commands that follow a path."""
