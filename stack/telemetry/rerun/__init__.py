"""Recording for the viewer of rerun."""
