"""Planning on a route graph: lanes, one-way lanes, closures and speed limits."""
