"""Navigation: planning, path following, progress checks, recoveries and the robot facade."""
