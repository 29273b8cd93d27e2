"""Runs for Foxglove, and for other readers of its schemas: MCAP files and a live server."""
