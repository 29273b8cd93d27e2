"""Inspection of missions, components, worlds, maps and finished runs, without running anything."""
