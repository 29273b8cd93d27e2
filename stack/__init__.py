"""The navigation stack: how a robot moves; independent of missions and dashboards."""
