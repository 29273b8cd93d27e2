"""Generated buildings for SLAM: plans, drives through them without physics, and the score."""
