"""Whole-screen sheets over the panes: health, plots and camera; the same for live and replay."""
