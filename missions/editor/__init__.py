"""For editors: JSON Schemas and a language server, made from what is installed.

Nothing here decides what a mission may say; it repeats what the reader and the declarations know.
"""
