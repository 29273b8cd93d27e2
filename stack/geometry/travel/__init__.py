"""Shortest ways over the cells of a grid."""
