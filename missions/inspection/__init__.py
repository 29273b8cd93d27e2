"""Answers about missions, components, places and finished runs, without running anything."""
