"""Import of Nav2's parameter files: what has an equivalent is taken over, the rest is listed."""
