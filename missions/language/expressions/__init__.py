"""Expressions and values: tokens, grammar, types, and the names in scope."""
