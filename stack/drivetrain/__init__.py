"""What a robot is and how it can move: description, limits, kinematics of each drive."""
