"""`treepilot calibrate`: intrinsics of a camera from pictures of a ChArUco board."""
