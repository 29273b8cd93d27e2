"""Language server: findings, hover, go-to-definition and completion over LSP (pygls)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from lsprotocol import types as lsp
from pygls.lsp.server import LanguageServer
from pygls.uris import from_fs_path, to_fs_path
from pygls.workspace import TextDocument

from missions.editor.completion import Candidate, candidates
from missions.editor.document import FileKind, Reading, file_kind, findings_in, read, read_at_cursor
from missions.editor.hover import definition, explanation
from missions.editor.outline import Item
from missions.editor.words import Word, end_of_value, typed_word, word_at
from missions.execution.resources import load_robot, load_world
from stack.documents import Finding, Mark

_COMPLETION_KINDS = {
    "keyword": lsp.CompletionItemKind.Keyword, "behaviour": lsp.CompletionItemKind.Function,
    "port": lsp.CompletionItemKind.Field, "value": lsp.CompletionItemKind.Value,
    "name": lsp.CompletionItemKind.Variable, "tree": lsp.CompletionItemKind.Module,
    "file": lsp.CompletionItemKind.File, "function": lsp.CompletionItemKind.Function,
}  # fmt: skip


@dataclass(frozen=True)
class WordQuery:
    """The word at the position of a request."""

    document: TextDocument
    reading: Reading
    item: Item
    word: Word


class MissionServer(LanguageServer):
    """Language server that keeps the last parsed state of each open file."""

    def __init__(self) -> None:
        try:
            number = version("treepilot")
        except PackageNotFoundError:
            number = "0"
        super().__init__("treepilot", number)
        self._parsed: dict[str, Reading] = {}

    def check(self, uri: str) -> None:
        """Publish the findings of a file, as it is in the editor."""
        document = self.workspace.get_text_document(uri)
        path = _path(document)
        found = findings_in(document.source, path)
        diagnostics = [_diagnostic(document, path, finding) for finding in found]
        self.text_document_publish_diagnostics(
            lsp.PublishDiagnosticsParams(uri, diagnostics, document.version)
        )

    def forget(self, uri: str) -> None:
        """Drop the state and findings of a closed file."""
        self._parsed.pop(uri, None)
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, []))

    def reading(self, document: TextDocument) -> Reading | None:
        """Return the parsed file, or its last parsed state."""
        found = read(document.source, _path(document))
        if found is not None:
            self._parsed[document.uri] = found
        return self._parsed.get(document.uri)

    def query(self, uri: str, position: lsp.Position) -> WordQuery | None:
        """Return the word at a position; None if there is none."""
        document = self.workspace.get_text_document(uri)
        line, column = _position(document, position)
        reading = self.reading(document)
        word = word_at(_line(document, line), column)
        item = reading.at(line, column) if reading else None
        if reading is None or word is None or item is None:
            return None
        return WordQuery(document, reading, item, word)

    def completion(self, uri: str, position: lsp.Position) -> list[lsp.CompletionItem]:
        """Return the completions at a position."""
        document = self.workspace.get_text_document(uri)
        if file_kind(document.source) not in (FileKind.MISSION, FileKind.TREES):
            return []
        line, column = _position(document, position)
        text = _line(document, line)
        word = typed_word(text, column)
        found = read_at_cursor(document.source, _path(document), line, word.column)
        if found is None:
            return []
        reading = self._parsed.get(document.uri, found.reading) if found.cut else found.reading
        alone = text[: word.column - 1].strip(" -") == ""
        has_colon = text[column - 1 :].lstrip().startswith(":")
        replaced = _range(document, line, word.column, column)
        return [
            _completion(candidate, replaced, has_colon)
            for candidate in candidates(reading, found.item, alone=alone, typed=word.text)
        ]


def make_server() -> MissionServer:
    """Return a server with its features, not started."""
    server = MissionServer()
    server.feature(lsp.TEXT_DOCUMENT_DID_OPEN)(opened)
    server.feature(lsp.TEXT_DOCUMENT_DID_CHANGE)(changed)
    server.feature(lsp.TEXT_DOCUMENT_DID_SAVE)(saved)
    server.feature(lsp.TEXT_DOCUMENT_DID_CLOSE)(closed)
    server.feature(lsp.TEXT_DOCUMENT_HOVER)(hover)
    server.feature(lsp.TEXT_DOCUMENT_DEFINITION)(go_to_definition)
    options = lsp.CompletionOptions(trigger_characters=["$", ".", " ", "{"])
    server.feature(lsp.TEXT_DOCUMENT_COMPLETION, options)(complete)
    return server


def opened(ls: MissionServer, params: lsp.DidOpenTextDocumentParams) -> None:
    """Check a file that was opened."""
    _clear_caches()
    ls.check(params.text_document.uri)


def changed(ls: MissionServer, params: lsp.DidChangeTextDocumentParams) -> None:
    """Check a file that was changed in the editor."""
    ls.check(params.text_document.uri)


def saved(ls: MissionServer, params: lsp.DidSaveTextDocumentParams) -> None:
    """Check all open files after a save: others may refer to the saved file."""
    _clear_caches()
    for uri in list(ls.workspace.text_documents):
        ls.check(uri)


def closed(ls: MissionServer, params: lsp.DidCloseTextDocumentParams) -> None:
    """Forget a file that was closed."""
    ls.forget(params.text_document.uri)


def hover(ls: MissionServer, params: lsp.HoverParams) -> lsp.Hover | None:
    """Return the documentation of the word under the pointer."""
    query = ls.query(params.text_document.uri, params.position)
    text = explanation(query.reading, query.item, query.word.text) if query else ""
    if query is None or not text:
        return None
    line = params.position.line + 1
    content = lsp.MarkupContent(lsp.MarkupKind.Markdown, text)
    return lsp.Hover(content, _range(query.document, line, query.word.column, query.word.end))


def go_to_definition(ls: MissionServer, params: lsp.DefinitionParams) -> lsp.Location | None:
    """Return the definition of the word under the cursor."""
    query = ls.query(params.text_document.uri, params.position)
    mark = definition(query.reading, query.item, query.word.text) if query else None
    return _location(ls, mark) if mark else None


def complete(ls: MissionServer, params: lsp.CompletionParams) -> list[lsp.CompletionItem]:
    """Return the completions at the cursor."""
    return ls.completion(params.text_document.uri, params.position)


def _clear_caches() -> None:
    """Clear the caches of worlds and robots: their files may have changed."""
    load_world.cache_clear()
    load_robot.cache_clear()


def _path(document: TextDocument) -> Path:
    return Path(to_fs_path(document.uri) or document.uri)


def _line(document: TextDocument, line: int) -> str:
    lines = document.lines
    return lines[line - 1].rstrip("\r\n") if line <= len(lines) else ""


def _position(document: TextDocument, position: lsp.Position) -> tuple[int, int]:
    """Return line and column, counted from 1 in characters."""
    found = document.position_codec.position_from_client_units(document.lines, position)
    return found.line + 1, found.character + 1


def _range(document: TextDocument, line: int, first: int, end: int) -> lsp.Range:
    """Convert columns of a line, counted from 1 in characters, to the client's units."""
    start, stop = (lsp.Position(line - 1, column - 1) for column in (first, end))
    codec = document.position_codec
    return codec.range_to_client_units(document.lines, lsp.Range(start, stop))


def _location(server: MissionServer, mark: Mark) -> lsp.Location | None:
    uri = from_fs_path(str(Path(mark.file).resolve()))
    if uri is None:
        return None
    document = server.workspace.get_text_document(uri)
    end = end_of_value(_line(document, mark.line), mark.column)
    return lsp.Location(uri, _range(document, mark.line, mark.column, end))


def _diagnostic(document: TextDocument, path: Path, finding: Finding) -> lsp.Diagnostic:
    """Return a diagnostic; a finding in another file is shown where this file names that file."""
    sentence = f"{finding.sentence}\n{finding.hint}" if finding.hint else finding.sentence
    mark = finding.mark
    if mark.file != str(path):
        sentence = f"{mark}: {sentence}"
        mark = _mention(document.lines, Path(mark.file), path)
    warning = finding.severity != "error"
    severity = lsp.DiagnosticSeverity.Warning if warning else lsp.DiagnosticSeverity.Error
    end = end_of_value(_line(document, mark.line), mark.column)
    return lsp.Diagnostic(
        _range(document, mark.line, mark.column, end), sentence, severity,
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


def _completion(candidate: Candidate, replaced: lsp.Range, has_colon: bool) -> lsp.CompletionItem:
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
