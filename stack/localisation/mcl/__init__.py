"""Monte-Carlo localisation: the estimator, and how it finds the pose again after it was wrong."""
