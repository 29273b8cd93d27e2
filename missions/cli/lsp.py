"""`treepilot lsp`: the language server for mission files."""

from __future__ import annotations


def lsp() -> None:
    """A language server for mission files, on standard input and output (docs/editors.md)."""
    from missions.editor.serving import serve

    serve()
