"""Visual place recognition: keyframes of a map, their retrieval, and the pose of a picture."""
