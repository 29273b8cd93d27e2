"""Theta*: any-angle planning on a costmap."""
