"""What leaves the engine (events, snapshots) and what enters it (commands)."""
