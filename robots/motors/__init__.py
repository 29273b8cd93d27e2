"""Robots with motors of their own: a body over the fast loop (stack/fast_loop), its odometry."""
