"""Readers of mission files: one module per section; all findings in one pass."""
