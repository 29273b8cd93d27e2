"""What behaviours ask of the robot, by capability: the parts behind stack/robot."""
