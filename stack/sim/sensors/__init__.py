"""Simulated sensors: lidar, sonar, IMU, wheel odometry, camera."""
