"""Navigation: planning, path following, recoveries, and what behaviours ask of the robot."""
