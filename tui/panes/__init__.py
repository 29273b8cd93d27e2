"""Panes of the dashboard, one in each file, and the words of the header and the banner."""
