"""Commands that run missions, steer running ones and keep their folders."""
