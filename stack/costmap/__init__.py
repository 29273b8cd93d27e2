"""Costmaps: what each place costs to drive through."""
