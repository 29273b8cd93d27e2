"""Terminal dashboard: a client of telemetry."""
