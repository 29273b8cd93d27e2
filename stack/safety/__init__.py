"""The last stages before the wheels: collision monitor, velocity smoother, emergency stop."""
