"""Odometry fusion, Monte-Carlo localisation and dead reckoning."""
