"""Behaviours that drive nothing: waiting, checking, failing, messages, blackboard keys."""
