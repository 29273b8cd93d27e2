"""A series of edits in the language server: checks and processor time."""

import asyncio
from time import process_time
from typing import Any

from lsprotocol import types as lsp
from pygls.workspace import Workspace

from missions.editor.server import MissionServer, changed, make_server

URI = "file:///nowhere/typed.yaml"


def edit_series(text: str, edits: int) -> dict[str, Any]:
    """Open a mission and type a comment, one letter per edit, faster than the server's pause.

    Returns:
        The number of checks after the first edit, the versions whose findings were published, and
        the processor time from the first edit to the last findings, seconds.
    """
    server = make_server()
    published: list[lsp.PublishDiagnosticsParams] = []
    server.text_document_publish_diagnostics = published.append
    server.protocol._workspace = Workspace(None)
    server.workspace.put_text_document(lsp.TextDocumentItem(URI, "yaml", 0, text))
    server.check(URI)
    published.clear()
    server.checks = 0
    began = process_time()
    asyncio.run(_type(server, text, edits, published))
    return {
        "checks": server.checks, "published": [item.version for item in published],
        "processor s": process_time() - began,
    }  # fmt: skip


async def _type(server: MissionServer, text: str, edits: int, published: list[Any]) -> None:
    for version in range(1, edits + 1):
        known = lsp.VersionedTextDocumentIdentifier(version, URI)
        change = lsp.TextDocumentContentChangeWholeDocument(f"{text}# {'x' * version}\n")
        server.workspace.update_text_document(known, change)
        await changed(server, lsp.DidChangeTextDocumentParams(known, [change]))
    while not published:
        await asyncio.sleep(0.01)
