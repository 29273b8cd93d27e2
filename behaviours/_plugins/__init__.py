"""How the catalogue reads plugins: folders, plain py_trees leaves, port types."""
