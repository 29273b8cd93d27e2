"""Description of a robot, and limits and kinematics of each kind of drive."""
