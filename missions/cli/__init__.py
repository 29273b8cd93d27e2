"""The `treepilot` command: one module per command, each with its printer."""
