"""The language server: findings, hover, go-to-definition and completion over LSP (pygls)."""

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
from missions.editor.words import Word, end_of_value, under_way, word_at
from missions.execution.resources import load_robot, load_world
from stack.documents import Finding, Mark

_SORTS = {
    "keyword": lsp.CompletionItemKind.Keyword, "behaviour": lsp.CompletionItemKind.Function,
    "port": lsp.CompletionItemKind.Field, "value": lsp.CompletionItemKind.Value,
    "name": lsp.CompletionItemKind.Variable, "tree": lsp.CompletionItemKind.Module,
    "file": lsp.CompletionItemKind.File,
}  # fmt: skip


@dataclass(frozen=True)
class Asked:
    """A word that an editor asks about."""

    document: TextDocument
    reading: Reading
    item: Item
    word: Word


class MissionServer(LanguageServer):
    """Keeps, of each open file, its last state that could be parsed."""

    def __init__(self) -> None:
        try:
            number = version("treepilot")
        except PackageNotFoundError:
            number = "0"
        super().__init__("treepilot", number)
        self._parsed: dict[str, Reading] = {}

    def check(self, uri: str) -> None:
        """Tell the editor what is wrong with a file, as it has it."""
        document = self.workspace.get_text_document(uri)
        path = _path(document)
        found = findings_in(document.source, path)
        diagnostics = [_diagnostic(document, path, finding) for finding in found]
        self.text_document_publish_diagnostics(
            lsp.PublishDiagnosticsParams(uri, diagnostics, document.version)
        )

    def forget(self, uri: str) -> None:
        """A file was closed."""
        self._parsed.pop(uri, None)
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, []))

    def reading(self, document: TextDocument) -> Reading | None:
        """What the words of a file mean, or meant when it could last be parsed."""
        found = read(document.source, _path(document))
        if found is not None:
            self._parsed[document.uri] = found
        return self._parsed.get(document.uri)

    def asked(self, uri: str, position: lsp.Position) -> Asked | None:
        """The word that is asked about."""
        document = self.workspace.get_text_document(uri)
        line, column = _position(document, position)
        reading = self.reading(document)
        word = word_at(_line(document, line), column)
        item = reading.at(line, column) if reading else None
        if reading is None or word is None or item is None:
            return None
        return Asked(document, reading, item, word)

    def completion(self, uri: str, position: lsp.Position) -> list[lsp.CompletionItem]:
        """What may be written at a position."""
        document = self.workspace.get_text_document(uri)
        if file_kind(document.source) not in (FileKind.MISSION, FileKind.TREES):
            return []
        line, column = _position(document, position)
        text = _line(document, line)
        word = under_way(text, column)
        found = read_at_cursor(document.source, _path(document), line, word.column)
        if found is None:
            return []
        reading = self._parsed.get(document.uri, found.reading) if found.cut else found.reading
        alone = text[: word.column - 1].strip(" -") == ""
        has_colon = text[column - 1 :].lstrip().startswith(":")
        replaced = _range(document, line, word.column, column)
        return [
            _completion(candidate, replaced, has_colon)
            for candidate in candidates(reading, found.item, alone=alone)
        ]


def make_server() -> MissionServer:
    """A server with its features, not yet started."""
    server = MissionServer()
    server.feature(lsp.TEXT_DOCUMENT_DID_OPEN)(opened)
    server.feature(lsp.TEXT_DOCUMENT_DID_CHANGE)(changed)
    server.feature(lsp.TEXT_DOCUMENT_DID_SAVE)(saved)
    server.feature(lsp.TEXT_DOCUMENT_DID_CLOSE)(closed)
    server.feature(lsp.TEXT_DOCUMENT_HOVER)(hover)
    server.feature(lsp.TEXT_DOCUMENT_DEFINITION)(go_to_definition)
    options = lsp.CompletionOptions(trigger_characters=["$", ".", " "])
    server.feature(lsp.TEXT_DOCUMENT_COMPLETION, options)(complete)
    return server


def opened(ls: MissionServer, params: lsp.DidOpenTextDocumentParams) -> None:
    """A file was opened."""
    _look_again()
    ls.check(params.text_document.uri)


def changed(ls: MissionServer, params: lsp.DidChangeTextDocumentParams) -> None:
    """A file was changed and not yet saved."""
    ls.check(params.text_document.uri)


def saved(ls: MissionServer, params: lsp.DidSaveTextDocumentParams) -> None:
    """A file was saved; others may refer to it."""
    _look_again()
    for uri in list(ls.workspace.text_documents):
        ls.check(uri)


def closed(ls: MissionServer, params: lsp.DidCloseTextDocumentParams) -> None:
    """A file was closed."""
    ls.forget(params.text_document.uri)


def hover(ls: MissionServer, params: lsp.HoverParams) -> lsp.Hover | None:
    """What the word under the pointer means."""
    asked = ls.asked(params.text_document.uri, params.position)
    text = explanation(asked.reading, asked.item, asked.word.text) if asked else ""
    if asked is None or not text:
        return None
    line = params.position.line + 1
    content = lsp.MarkupContent(lsp.MarkupKind.Markdown, text)
    return lsp.Hover(content, _range(asked.document, line, asked.word.column, asked.word.end))


def go_to_definition(ls: MissionServer, params: lsp.DefinitionParams) -> lsp.Location | None:
    """Where the word under the cursor is defined."""
    asked = ls.asked(params.text_document.uri, params.position)
    mark = definition(asked.reading, asked.item, asked.word.text) if asked else None
    return _location(ls, mark) if mark else None


def complete(ls: MissionServer, params: lsp.CompletionParams) -> list[lsp.CompletionItem]:
    """What may be written at the cursor."""
    return ls.completion(params.text_document.uri, params.position)


def _look_again() -> None:
    """Forget worlds and robots: their files may have changed."""
    load_world.cache_clear()
    load_robot.cache_clear()


def _path(document: TextDocument) -> Path:
    return Path(to_fs_path(document.uri) or document.uri)


def _line(document: TextDocument, line: int) -> str:
    lines = document.lines
    return lines[line - 1].rstrip("\r\n") if line <= len(lines) else ""


def _position(document: TextDocument, position: lsp.Position) -> tuple[int, int]:
    """Line and column counted from 1, in characters."""
    found = document.position_codec.position_from_client_units(document.lines, position)
    return found.line + 1, found.character + 1


def _range(document: TextDocument, line: int, first: int, end: int) -> lsp.Range:
    """Columns of a line, counted from 1 in characters, in the client's units."""
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
    """A finding where it is; one of another file where this one names that file."""
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
    """Where a file names another: by its file name, or by its stem as of shipped ones."""
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
    return lsp.CompletionItem(
        label=candidate.label, kind=_SORTS[candidate.sort], detail=candidate.detail or None,
        documentation=lsp.MarkupContent(lsp.MarkupKind.Markdown, candidate.text)
        if candidate.text else None,
        text_edit=lsp.TextEdit(replaced, text), filter_text=candidate.label,
    )  # fmt: skip
