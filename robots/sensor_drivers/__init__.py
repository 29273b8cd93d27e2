"""Drivers of sensors of real robots: `sensors` in robot.yaml, whatever body drives them."""
