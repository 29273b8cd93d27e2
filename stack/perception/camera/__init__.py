"""Camera calibration from pictures of a ChArUco board."""
