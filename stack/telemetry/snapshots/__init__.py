"""Every state of a run that a viewer could have seen, in snapshots.mcap: written and read again."""
