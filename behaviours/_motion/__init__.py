"""What behaviours that drive share: odometry since a stamp, standstill, ends of a drive, paths."""
