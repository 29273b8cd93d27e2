"""What it costs a point to get to a goal from anywhere around."""
