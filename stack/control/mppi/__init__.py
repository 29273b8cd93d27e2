"""Model predictive path integral (MPPI) control."""
