"""Cameras: whether their pictures can be used."""
