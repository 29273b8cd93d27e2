"""Runs for other people and programs: packed, exported, opened in viewers."""
