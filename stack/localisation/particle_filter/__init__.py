"""Particle filter with several hypotheses: motion and sensor models, markers, least covariance."""
