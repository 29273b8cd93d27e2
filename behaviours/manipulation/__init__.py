"""Moving an arm and its gripper; finding, picking and placing blocks."""
