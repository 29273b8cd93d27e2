"""Global planners and path smoothers."""
