"""Meetings with people: standoffs, and giving way."""
