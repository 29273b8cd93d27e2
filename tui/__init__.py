"""The terminal dashboard: a client of telemetry."""
