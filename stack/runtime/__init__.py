"""The step loop: stages, commands, snapshots, stage times."""
