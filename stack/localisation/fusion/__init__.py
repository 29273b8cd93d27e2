"""Odometry: sources chosen by name, fused into odom -> base with its error."""
