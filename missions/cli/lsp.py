"""`treepilot lsp`: the language server, for editors."""


def lsp() -> None:
    """Run the language server for mission files on stdin/stdout.

    docs/editors.md says how to configure an editor.
    """
    from missions.editor.serving import serve

    serve()
