"""Import of Nav2 parameter files: equivalent parameters are imported, the others are listed."""
