"""The physics engine: its interface, and the shapes of a world."""
