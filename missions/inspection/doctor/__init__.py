"""`treepilot doctor`: what a robot can use of a world or map, and what its lidars see of it."""
