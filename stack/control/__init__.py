"""Controllers: from a path to velocity commands."""
