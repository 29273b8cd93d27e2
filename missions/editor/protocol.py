"""Conversion of positions, findings and candidates to the types of LSP."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from lsprotocol import types as lsp
from pygls.lsp.server import LanguageServer
from pygls.uris import from_fs_path, to_fs_path
from pygls.workspace import TextDocument

from missions.editor.completion import Candidate
from missions.editor.document import Reading
from missions.editor.rename import renamed_uses, users_of
from missions.editor.symbols import Entry
from missions.inspection.drafting.fixes import end_of_value
from missions.language.expressions.scope import Symbol
from missions.language.step import Tree
from stack.documents import Finding, Mark

_COMPLETION_KINDS = {
    "keyword": lsp.CompletionItemKind.Keyword, "behaviour": lsp.CompletionItemKind.Function,
    "port": lsp.CompletionItemKind.Field, "value": lsp.CompletionItemKind.Value,
    "name": lsp.CompletionItemKind.Variable, "tree": lsp.CompletionItemKind.Module,
    "file": lsp.CompletionItemKind.File, "function": lsp.CompletionItemKind.Function,
}  # fmt: skip


def path_of(document: TextDocument) -> Path:
    """Return the path of a document's file."""
    return Path(to_fs_path(document.uri) or document.uri)


def line_of(document: TextDocument, line: int) -> str:
    """Return a line without its end, counted from 1."""
    lines = document.lines
    return lines[line - 1].rstrip("\r\n") if line <= len(lines) else ""


def position_in(document: TextDocument, position: lsp.Position) -> tuple[int, int]:
    """Return line and column, counted from 1 in characters."""
    if position.line >= len(document.lines):  # the empty line after the last line break
        return position.line + 1, 1
    found = document.position_codec.position_from_client_units(document.lines, position)
    return found.line + 1, found.character + 1


def range_in(document: TextDocument, line: int, first: int, end: int) -> lsp.Range:
    """Convert columns of a line, counted from 1 in characters, to the client's units."""
    start, stop = (lsp.Position(line - 1, column - 1) for column in (first, end))
    if line > len(document.lines):
        return lsp.Range(start, stop)
    codec = document.position_codec
    return codec.range_to_client_units(document.lines, lsp.Range(start, stop))


def location_of(server: LanguageServer, mark: Mark) -> lsp.Location | None:
    """Return the location of a value in any file."""
    uri = from_fs_path(str(Path(mark.file).resolve()))
    if uri is None:
        return None
    document = server.workspace.get_text_document(uri)
    end = end_of_value(line_of(document, mark.line), mark.column)
    return lsp.Location(uri, range_in(document, mark.line, mark.column, end))


def diagnostic_of(document: TextDocument, path: Path, finding: Finding) -> lsp.Diagnostic:
    """Return a diagnostic; a finding in another file is shown where this file names that file."""
    sentence = f"{finding.sentence}\n{finding.hint}" if finding.hint else finding.sentence
    mark = finding.mark
    if mark.file != str(path):
        sentence = f"{mark}: {sentence}"
        mark = _mention(document.lines, Path(mark.file), path)
    warning = finding.severity != "error"
    severity = lsp.DiagnosticSeverity.Warning if warning else lsp.DiagnosticSeverity.Error
    end = end_of_value(line_of(document, mark.line), mark.column)
    return lsp.Diagnostic(
        range_in(document, mark.line, mark.column, end), sentence, severity,
        finding.code, source="treepilot",
    )  # fmt: skip


def _mention(lines: Iterable[str], other: Path, path: Path) -> Mark:
    """Return the position at which a file names another, by file name or by stem."""
    for names in ((other.name,), (other.stem, other.parent.name)):
        for number, line in enumerate(lines, 1):
            found = [line.find(name) for name in names if name and name in line.split("#")[0]]
            if found:
                return Mark(str(path), number, found[0] + 1)
    return Mark(str(path))


def completion_of(candidate: Candidate, replaced: lsp.Range, has_colon: bool) -> lsp.CompletionItem:
    """Return a candidate as an item that replaces the typed word."""
    text = candidate.label
    if candidate.key and not has_colon:
        text += f": {candidate.value}"
    text += candidate.after
    return lsp.CompletionItem(
        label=candidate.label, kind=_COMPLETION_KINDS[candidate.kind],
        detail=candidate.detail or None,
        documentation=lsp.MarkupContent(lsp.MarkupKind.Markdown, candidate.text)
        if candidate.text else None,
        text_edit=lsp.TextEdit(replaced, text), filter_text=candidate.label,
    )  # fmt: skip


_SYMBOL_KINDS = {
    "section": lsp.SymbolKind.Namespace, "name": lsp.SymbolKind.Variable,
    "tree": lsp.SymbolKind.Function, "event": lsp.SymbolKind.Event,
    "node": lsp.SymbolKind.Method, "test": lsp.SymbolKind.Object,
}  # fmt: skip


def symbols_of(document: TextDocument, entries: Iterable[Entry]) -> list[lsp.DocumentSymbol]:
    """Return the outline of a file with ranges."""
    found = []
    for entry in entries:
        key, last = entry.key.mark, entry.last.mark
        end = end_of_value(line_of(document, key.line), key.column)
        name = range_in(document, key.line, key.column, end)
        final = end_of_value(line_of(document, last.line), last.column)
        stop = range_in(document, last.line, last.column, final).end
        found.append(
            lsp.DocumentSymbol(
                name=entry.name or "…",
                kind=_SYMBOL_KINDS[entry.kind],
                selection_range=name,
                range=lsp.Range(name.start, max(stop, name.end, key=_order)),
                detail=entry.detail or None,
                children=symbols_of(document, entry.children),
            )
        )
    return found


def _order(position: lsp.Position) -> tuple[int, int]:
    return position.line, position.character


def edits_of(
    server: LanguageServer, reading: Reading, name: Symbol | Tree, new: str
) -> lsp.WorkspaceEdit:
    """Return the edits that rename a name in this file, in those it includes and their users.

    Raises:
        InputError: the new name is invalid or collides with another, or a file is not saved.
    """
    documents = server.workspace.text_documents
    texts = {Path(to_fs_path(uri) or uri).resolve(): it.source for uri, it in documents.items()}
    edits: dict[str, dict[tuple[int, int], lsp.TextEdit]] = {}
    for each in (reading, *users_of(Path(name.mark.file), reading, texts)):
        for use in renamed_uses(each, name, new, texts):
            uri = from_fs_path(str(Path(use.mark.file).resolve())) or ""
            document = server.workspace.get_text_document(uri)
            end = use.mark.column + use.length
            where = range_in(document, use.mark.line, use.mark.column, end)
            place = (use.mark.line, use.mark.column)
            edits.setdefault(uri, {})[place] = lsp.TextEdit(where, new)
    return lsp.WorkspaceEdit(changes={uri: list(each.values()) for uri, each in edits.items()})
