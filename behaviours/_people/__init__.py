"""Whom `follow_person` follows: the choice among the tracks, and standing people."""
