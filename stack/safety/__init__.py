"""Safety stage: collision monitor, safety zones, velocity smoother, emergency stop."""
