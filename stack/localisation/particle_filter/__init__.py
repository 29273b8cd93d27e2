"""Particle filter with modes: motion and sensor models, markers, least covariance."""
