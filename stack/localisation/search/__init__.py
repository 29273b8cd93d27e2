"""Search of a map for the poses that explain scans, and the choice between them."""
