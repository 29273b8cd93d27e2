"""Learning: missions as environments of Gymnasium. `treepilot.gym` is the public face."""
