"""Language server of mission files over LSP (pygls): its state and its features."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version

from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException
from pygls.lsp.server import LanguageServer
from pygls.workspace import TextDocument

from missions.editor.completion import candidates, new_file
from missions.editor.document import Reading, diagnosed, is_new, read_at_cursor
from missions.editor.hover import definition, explanation
from missions.editor.protocol import (
    completion_of,
    diagnostic_of,
    edits_of,
    line_of,
    location_of,
    path_of,
    position_in,
    range_in,
    symbols_of,
)
from missions.editor.rename import renamed
from missions.editor.symbols import outline
from missions.editor.text_positions import TextWord, in_placeholder, typed_word, word_at
from missions.inspection.diagnosis import FileKind, file_kind
from missions.inspection.drafting.fixes import fix_of
from missions.language.reading.words import Word
from stack.documents import Finding
from stack.errors import InputError

DELAY, MAX_DELAY = 0.2, 10.0
"""Seconds from the last edit to the check of a file: default, and largest of the option."""


@dataclass(frozen=True)
class WordQuery:
    """The word at the position of a request.

    Attributes:
        word: the key or value.
        text: the part of it at the position.
    """

    document: TextDocument
    reading: Reading
    word: Word
    text: TextWord


class MissionServer(LanguageServer):
    """Language server that keeps the last reading of each open file.

    Attributes:
        delay: seconds from the last edit to the check of a file.
        checks: number of checks so far.
    """

    def __init__(self) -> None:
        try:
            number = version("treepilot")
        except PackageNotFoundError:
            number = "0"
        super().__init__("treepilot", number)
        self.delay, self.checks = DELAY, 0
        self._readings: dict[str, Reading] = {}
        self._checked: dict[str, tuple[str, tuple[Finding, ...]]] = {}
        self._waiting: dict[str, asyncio.TimerHandle] = {}

    def check_later(self, uri: str) -> None:
        """Check a file once no edit has come for a while."""
        self._cancel(uri)
        loop = asyncio.get_running_loop()
        self._waiting[uri] = loop.call_later(self.delay, self.check, uri)

    def check(self, uri: str) -> None:
        """Publish the findings of a file, as it is in the editor."""
        self._cancel(uri)
        document = self.workspace.get_text_document(uri)
        path = path_of(document)
        diagnostics = [diagnostic_of(document, path, item) for item in self.findings(document)]
        self.text_document_publish_diagnostics(
            lsp.PublishDiagnosticsParams(uri, diagnostics, document.version)
        )

    def findings(self, document: TextDocument) -> tuple[Finding, ...]:
        """Return the findings of the current text, which is read once."""
        known = self._checked.get(document.uri)
        if known is None or known[0] != document.source:
            self.checks += 1
            found, findings = diagnosed(document.source, path_of(document))
            if found is not None:
                self._readings[document.uri] = found
            self._checked[document.uri] = known = (document.source, findings)
        return known[1]

    def reading(self, document: TextDocument) -> Reading | None:
        """Return the reading of a file, or of its last text that could be parsed."""
        self.findings(document)
        return self._readings.get(document.uri)

    def forget(self, uri: str) -> None:
        """Drop the state and findings of a closed file."""
        self._cancel(uri)
        self._readings.pop(uri, None)
        self._checked.pop(uri, None)
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, []))

    def forget_findings(self) -> None:
        """Check all files again when they are asked for: another file was saved."""
        self._checked.clear()

    def _cancel(self, uri: str) -> None:
        waiting = self._waiting.pop(uri, None)
        if waiting is not None:
            waiting.cancel()

    def query(self, uri: str, position: lsp.Position) -> WordQuery | None:
        """Return the word at a position; None if there is none."""
        document = self.workspace.get_text_document(uri)
        line, column = position_in(document, position)
        reading = self.reading(document)
        text = word_at(line_of(document, line), column)
        word = reading.at(line, column) if reading else None
        if reading is None or text is None or word is None:
            return None
        return WordQuery(document, reading, word, text)

    def completion(self, uri: str, position: lsp.Position) -> list[lsp.CompletionItem]:
        """Return the completions at a position."""
        document = self.workspace.get_text_document(uri)
        path, source = path_of(document), document.source
        line, column = position_in(document, position)
        text = line_of(document, line)
        typed = typed_word(text, column)
        replaced = range_in(document, line, typed.column, column)
        has_colon = text[column - 1 :].lstrip().startswith(":")
        if file_kind(path, source) not in (FileKind.MISSION, FileKind.TREES) and not is_new(source):
            return []
        found = read_at_cursor(source, path, line, typed.column)
        if found is None:
            given = new_file() if typed.column == 1 and is_new(source) else []
            return [completion_of(candidate, replaced, has_colon) for candidate in given]
        reading = self._readings.get(document.uri, found.reading) if found.cut else found.reading
        before = text[: typed.column - 1]
        given = candidates(
            reading, found.word, alone=before.strip(" -") == "", typed=typed.text,
            inside_text=in_placeholder(before),
        )  # fmt: skip
        return [completion_of(candidate, replaced, has_colon) for candidate in given]


def make_server() -> MissionServer:
    """Return a server with its features, not started."""
    server = MissionServer()
    server.feature(lsp.INITIALIZE)(initialise)
    server.feature(lsp.TEXT_DOCUMENT_DID_OPEN)(opened)
    server.feature(lsp.TEXT_DOCUMENT_DID_CHANGE)(changed)
    server.feature(lsp.TEXT_DOCUMENT_DID_SAVE)(saved)
    server.feature(lsp.TEXT_DOCUMENT_DID_CLOSE)(closed)
    server.feature(lsp.TEXT_DOCUMENT_HOVER)(hover)
    server.feature(lsp.TEXT_DOCUMENT_DEFINITION)(go_to_definition)
    server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL)(document_symbols)
    server.feature(lsp.TEXT_DOCUMENT_PREPARE_RENAME)(prepare_rename)
    server.feature(lsp.TEXT_DOCUMENT_RENAME, lsp.RenameOptions(prepare_provider=True))(rename)
    fixes = lsp.CodeActionOptions(code_action_kinds=[lsp.CodeActionKind.QuickFix])
    server.feature(lsp.TEXT_DOCUMENT_CODE_ACTION, fixes)(quick_fixes)
    options = lsp.CompletionOptions(trigger_characters=["$", ".", " ", "{"])
    server.feature(lsp.TEXT_DOCUMENT_COMPLETION, options)(complete)
    return server


def initialise(ls: MissionServer, params: lsp.InitializeParams) -> None:
    """Read the client's options: `delay`, seconds from the last edit to the check."""
    options = params.initialization_options
    delay = options.get("delay") if isinstance(options, dict) else None
    if isinstance(delay, int | float) and 0.0 <= delay <= MAX_DELAY:
        ls.delay = float(delay)


def opened(ls: MissionServer, params: lsp.DidOpenTextDocumentParams) -> None:
    """Check a file that was opened."""
    ls.forget_findings()
    ls.check(params.text_document.uri)


async def changed(ls: MissionServer, params: lsp.DidChangeTextDocumentParams) -> None:
    """Check a file that was changed in the editor, after the last of a series of edits."""
    ls.check_later(params.text_document.uri)


def saved(ls: MissionServer, params: lsp.DidSaveTextDocumentParams) -> None:
    """Check all open files after a save: others may refer to the saved file."""
    ls.forget_findings()
    for uri in list(ls.workspace.text_documents):
        ls.check(uri)


def closed(ls: MissionServer, params: lsp.DidCloseTextDocumentParams) -> None:
    """Forget a file that was closed."""
    ls.forget(params.text_document.uri)


def hover(ls: MissionServer, params: lsp.HoverParams) -> lsp.Hover | None:
    """Return the documentation of the word under the pointer."""
    query = ls.query(params.text_document.uri, params.position)
    text = explanation(query.reading, query.word, query.text.text) if query else ""
    if query is None or not text:
        return None
    line = params.position.line + 1
    content = lsp.MarkupContent(lsp.MarkupKind.Markdown, text)
    return lsp.Hover(content, range_in(query.document, line, query.text.column, query.text.end))


def go_to_definition(ls: MissionServer, params: lsp.DefinitionParams) -> lsp.Location | None:
    """Return the definition of the word under the cursor."""
    query = ls.query(params.text_document.uri, params.position)
    mark = definition(query.reading, query.word, query.text.text) if query else None
    return location_of(ls, mark) if mark else None


def complete(ls: MissionServer, params: lsp.CompletionParams) -> list[lsp.CompletionItem]:
    """Return the completions at the cursor."""
    return ls.completion(params.text_document.uri, params.position)


REFUSED = -32803
"""Error code of LSP: the request is valid but cannot be carried out."""


def document_symbols(
    ls: MissionServer, params: lsp.DocumentSymbolParams
) -> list[lsp.DocumentSymbol]:
    """Return the outline of a file."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    reading = ls.reading(document)
    return symbols_of(document, outline(reading)) if reading else []


def quick_fixes(ls: MissionServer, params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
    """Return the fixes of the findings in a range."""
    uri = params.text_document.uri
    document = ls.workspace.get_text_document(uri)
    path, wanted = path_of(document), params.range
    actions = []
    for finding in ls.findings(document):
        shown = diagnostic_of(document, path, finding)
        fix = fix_of(finding, document.lines) if finding.mark.file == str(path) else None
        below = shown.range.end.line < wanted.start.line
        if fix is None or below or shown.range.start.line > wanted.end.line:
            continue
        edit = lsp.TextEdit(range_in(document, fix.line, fix.first, fix.end), fix.text)
        actions.append(
            lsp.CodeAction(
                title=fix.title,
                kind=lsp.CodeActionKind.QuickFix,
                diagnostics=[shown],
                edit=lsp.WorkspaceEdit(changes={uri: [edit]}),
                is_preferred=True,
            )
        )
    return actions


def prepare_rename(ls: MissionServer, params: lsp.PrepareRenameParams) -> lsp.Range | None:
    """Return the range of the name under the cursor; None if it cannot be renamed."""
    query = ls.query(params.text_document.uri, params.position)
    if query is None or renamed(query.reading, query.word, query.text.text) is None:
        return None
    name = query.text.text.partition(".")[0]
    first = query.text.column + (1 if name.startswith("$") else 0)
    line = params.position.line + 1
    return range_in(query.document, line, first, query.text.column + len(name))


def rename(ls: MissionServer, params: lsp.RenameParams) -> lsp.WorkspaceEdit | None:
    """Return the edits that rename a place, tree, key or other name in all files that use it."""
    query = ls.query(params.text_document.uri, params.position)
    name = renamed(query.reading, query.word, query.text.text) if query else None
    if query is None or name is None:
        return None
    try:
        return edits_of(ls, query.reading, name, params.new_name.removeprefix("$"))
    except InputError as error:
        raise JsonRpcException(str(error), code=REFUSED) from None
