"""URDF and xacro files: reading, checks, the tree of links, and the URDF for the simulation."""
