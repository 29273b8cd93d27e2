"""Readers of the mission file: one module per part of the file, all findings in one pass."""
