"""The step loop: commands, stages, snapshots, and the interfaces between its parts."""
