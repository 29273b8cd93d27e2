"""Behaviours that missions are made of, and the base class to write your own."""
