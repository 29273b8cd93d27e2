"""The robot as a MAVLink vehicle: telemetry, commands, modes, plans and parameters of a rover."""
