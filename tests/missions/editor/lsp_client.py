"""Speaks LSP to `treepilot lsp` over a pipe: frames of JSON-RPC, nothing else."""

import json
import os
import subprocess
import sys
import threading
from pathlib import Path

ROOT = Path(__file__).parents[3]
PATIENCE = 60.0
"""Wall seconds after which a server that does not answer is killed."""


class Client:
    """One server with one file open."""

    def __init__(self, folder: Path, delay: float = 0.0) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "missions.cli.app", "lsp"], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=folder,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
        self.watchdog = threading.Timer(PATIENCE, self.process.kill)
        self.watchdog.start()
        self.number = self.version = 0
        self.notes = []
        general = {"positionEncodings": ["utf-16"]}
        answer = self.ask("initialize", processId=None, rootUri=None,
                          capabilities={"general": general},
                          initializationOptions={"delay": delay})  # fmt: skip
        self.capabilities = answer["capabilities"]
        self.tell("initialized")

    def send(self, **message):
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        self.process.stdin.flush()

    def receive(self):
        length = 0
        while line := self.process.stdout.readline().strip():
            name, _, value = line.partition(b": ")
            assert name.startswith(b"Content"), f"not a frame: {line!r}"
            length = int(value) if name == b"Content-Length" else length
        assert length, self.process.stderr.read().decode()
        return json.loads(self.process.stdout.read(length))

    def ask(self, method, **params):
        self.number += 1
        self.send(id=self.number, method=method, params=params)
        while (message := self.receive()).get("id") != self.number:
            self.notes.append(message)
        assert "error" not in message, message["error"]
        return message["result"]

    def tell(self, method, **params):
        self.send(method=method, params=params)

    def open(self, path, text):
        """Open a file with a text; what is wrong with it."""
        self.uri, self.text, self.version = path.as_uri(), text, 1
        document = {"uri": self.uri, "languageId": "yaml", "version": 1, "text": text}
        self.tell("textDocument/didOpen", textDocument=document)
        return self.diagnostics()

    def change(self, text):
        """Change the whole text; what is wrong with it now."""
        self.tell_change(text)
        return self.diagnostics()

    def tell_change(self, text):
        self.version, self.text = self.version + 1, text
        document = {"uri": self.uri, "version": self.version}
        changes = [{"text": text}]
        self.tell("textDocument/didChange", textDocument=document, contentChanges=changes)

    def diagnostics(self):
        """The next findings: `code line:column-end severity message`, counted from 0."""
        while (message := self.receive())["method"] != "textDocument/publishDiagnostics":
            self.notes.append(message)
        lines = []
        for item in message["params"]["diagnostics"]:
            start, end = item["range"]["start"], item["range"]["end"]
            where = f"{start['line']}:{start['character']}-{end['character']}"
            lines.append(f"{item['code']} {where} {item['severity']} {item['message']}")
        return lines

    def at(self, marked):
        """Position of `|` in a piece of the text, `na|me`."""
        piece = marked.replace("|", "")
        offset = self.text.index(piece) + marked.index("|")
        before = self.text[:offset]
        column = len(before[before.rfind("\n") + 1 :].encode("utf-16-le")) // 2
        return {"line": before.count("\n"), "character": column}

    def hover(self, marked):
        answer = self.ask("textDocument/hover", textDocument={"uri": self.uri},
                          position=self.at(marked))  # fmt: skip
        return answer["contents"]["value"] if answer else ""

    def definition(self, marked):
        """(file name, line) of where the word at `|` is defined, the line from 1."""
        answer = self.ask("textDocument/definition", textDocument={"uri": self.uri},
                          position=self.at(marked))  # fmt: skip
        if answer is None:
            return None
        return Path(answer["uri"]).name, answer["range"]["start"]["line"] + 1

    def complete(self, marked):
        """What may be written at `|`: label -> the text that replaces the word."""
        answer = self.ask("textDocument/completion", textDocument={"uri": self.uri},
                          position=self.at(marked))  # fmt: skip
        return {item["label"]: item["textEdit"]["newText"] for item in answer}

    def symbols(self):
        """The outline: (name, kind, first line, children), lines from 1."""
        answer = self.ask("textDocument/documentSymbol", textDocument={"uri": self.uri})
        return [self._symbol(item) for item in answer]

    def _symbol(self, item):
        assert item["range"]["start"] == item["selectionRange"]["start"]
        below = [self._symbol(inner) for inner in item.get("children") or ()]
        return (item["name"], item["range"]["start"]["line"] + 1, below)

    def rename(self, marked, new):
        """The files after a rename: file name -> text; or the error message."""
        params = {"textDocument": {"uri": self.uri}, "position": self.at(marked)}
        self.number += 1
        self.send(id=self.number, method="textDocument/rename", params={**params, "newName": new})
        while (message := self.receive()).get("id") != self.number:
            self.notes.append(message)
        if "error" in message:
            return message["error"]["message"]
        files = {}
        for uri, edits in ((message["result"] or {}).get("changes") or {}).items():
            path = Path(uri.removeprefix("file://"))
            text = self.text if uri == self.uri else path.read_text("utf-8")
            files[path.name] = edited(text, edits)
        return files

    def fixes(self, marked):
        """The quick fixes at `|`: title -> the text after it."""
        place = self.at(marked)
        answer = self.ask("textDocument/codeAction", textDocument={"uri": self.uri},
                          range={"start": place, "end": place},
                          context={"diagnostics": []})  # fmt: skip
        return {
            item["title"]: edited(self.text, item["edit"]["changes"][self.uri]) for item in answer
        }

    def close(self):
        self.ask("shutdown")
        self.tell("exit")
        try:
            return self.process.wait(timeout=PATIENCE)
        finally:
            self.watchdog.cancel()
            for pipe in (self.process.stdin, self.process.stdout, self.process.stderr):
                pipe.close()


def edited(text, edits):
    """The text after edits, whose columns count UTF-16 units."""
    lines = text.split("\n")
    order = sorted(edits, key=lambda edit: (edit["range"]["start"]["line"],
                                            edit["range"]["start"]["character"]))  # fmt: skip
    for edit in reversed(order):
        start, end = edit["range"]["start"], edit["range"]["end"]
        assert start["line"] == end["line"]
        row = lines[start["line"]].encode("utf-16-le")
        new = edit["newText"].encode("utf-16-le")
        row = row[: 2 * start["character"]] + new + row[2 * end["character"] :]
        lines[start["line"]] = row.decode("utf-16-le")
    return "\n".join(lines)
