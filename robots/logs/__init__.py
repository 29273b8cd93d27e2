"""Readers of logs that other programs have recorded: CARMEN logs and ROS bags."""
