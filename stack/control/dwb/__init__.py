"""Dynamic window approach (DWB): samples velocities within the dynamic window."""
