"""Maps: their files, SLAM, exploration, and the passages of a map."""
