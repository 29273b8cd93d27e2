"""The physics engine: its interface, its settings, and the shapes of a world."""
