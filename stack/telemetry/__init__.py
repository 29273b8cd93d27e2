"""Telemetry: events and snapshots of the engine, commands to it, and the sinks and server."""
