"""What the camera tells: fiducial markers and the poses they imply."""
