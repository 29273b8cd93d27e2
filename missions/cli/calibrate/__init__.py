"""`treepilot calibrate`: cameras, odometry and the mounts of lidars and cameras."""
