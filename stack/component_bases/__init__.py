"""Base classes of the components of navigation, and what they get: import from stack.components."""
