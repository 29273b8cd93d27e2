"""Regulated pure pursuit: follows the arc through a point ahead on the path."""
