"""The dashboard on a recorded run: what plays it, the line of time below it, and its keys."""
