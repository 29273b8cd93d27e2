"""Finding, telling and checking the robot's pose."""
