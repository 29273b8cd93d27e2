"""What is done to a path after the search; chosen by name."""
