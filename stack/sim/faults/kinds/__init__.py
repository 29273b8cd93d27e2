"""The kinds of faults: a module each, whose name is that of the kind. Nothing else lists them."""
