"""Editor support: a language server.

The rules of the language are defined by the reader and the declarations, not here.
"""
