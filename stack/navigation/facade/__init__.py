"""Robot facade for behaviours: its interfaces, its parts and its members by topic."""
