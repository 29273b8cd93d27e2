"""`treepilot diagnose`: the likely causes of what went wrong in a run, each with its evidence."""
