"""Editor support: JSON Schemas and a language server, derived from the installed behaviours.

The rules of the language are defined by the reader and the declarations, not here.
"""
