"""Where am I: odometry fusion and Monte-Carlo localisation."""
