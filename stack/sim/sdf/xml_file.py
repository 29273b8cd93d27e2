"""XML reader that keeps positions, with the part of XML that world files need.

Document types and entities are refused: worlds do not need them, and they allow expansion attacks
and access to other files. Codes: E001 the file · E002 too large · E207 not XML.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from stack.documents import Finding, Mark
from stack.errors import InputError
from stack.parameters import suggestion

NOT_XML = "E207"
MAX_BYTES, MAX_DEPTH = 50_000_000, 100


@dataclass(slots=True)
class Element:
    """An XML element with its position in the file.

    Attributes:
        tag: name of the element.
        mark: position of its start.
        text: text before its first child, stripped of white space.
    """

    tag: str
    attributes: dict[str, str]
    mark: Mark
    text: str = ""
    children: list[Element] = field(default_factory=list)

    @property
    def name(self) -> str:
        """The attribute `name`, or an empty string."""
        return self.attributes.get("name", "")

    def all(self, tag: str) -> Iterator[Element]:
        """The children with this tag, in order."""
        return (child for child in self.children if child.tag == tag)

    def first(self, *path: str) -> Element | None:
        """The first child with this tag; with several tags, the first descendant on that path."""
        found: Element | None = self
        for tag in path:
            found = None if found is None else next(found.all(tag), None)
        return found

    def text_of(self, *path: str) -> str:
        """The text of the element that `first` returns, or an empty string."""
        found = self.first(*path)
        return "" if found is None else found.text


def read_xml(path: Path, what: str = "file") -> Element:
    """The root element of an XML file.

    Raises:
        InputError: the file is missing, a folder, too large, not XML, or has a document type.
    """
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        near = path.parent.glob(f"*{path.suffix}") if path.parent.is_dir() else iter(())
        hint = suggestion(path.name, [item.name for item in near])
        raise _refusal(Mark(str(path)), "E001", f"there is no such {what}", hint) from None
    except IsADirectoryError:
        raise _refusal(Mark(str(path)), "E001", f"this is a folder, not a {what}") from None
    except OSError as error:
        raise _refusal(Mark(str(path)), "E001", f"cannot be read: {error.strerror}") from None
    if len(raw) > MAX_BYTES:
        sentence = f"{len(raw)} bytes; a {what} may have at most {MAX_BYTES}"
        raise _refusal(Mark(str(path)), "E002", sentence)
    return parse_xml(raw, str(path))


def parse_xml(raw: bytes, name: str) -> Element:
    """The root element of XML bytes; `name` is the file name for messages.

    Raises:
        InputError: the bytes are not XML, nested too deeply, or have a document type.
    """
    builder = _Builder(name)
    try:
        builder.parser.Parse(raw, True)
    except expat.ExpatError as error:
        mark = Mark(name, error.lineno, error.offset + 1)
        sentence = f"not XML: {expat.errors.messages[error.code]}"
        raise _refusal(mark, NOT_XML, sentence) from None
    except (LookupError, ValueError) as error:  # a declared encoding that Python does not have
        raise _refusal(Mark(name), NOT_XML, f"not XML: {error}") from None
    return builder.root


class _Builder:
    """Builds the tree of elements from expat's events."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._open: list[Element] = []
        self.root = Element("", {}, Mark(name))
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._characters
        self.parser.StartDoctypeDeclHandler = self._refuse_doctype

    @property
    def _mark(self) -> Mark:
        parser = self.parser
        return Mark(self._name, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, self._mark)
        if len(self._open) >= MAX_DEPTH:
            raise _refusal(self._mark, NOT_XML, f"elements nested more than {MAX_DEPTH} deep")
        if self._open:
            self._open[-1].children.append(element)
        else:
            self.root = element
        self._open.append(element)

    def _end(self, tag: str) -> None:
        element = self._open.pop()
        element.text = element.text.strip()

    def _characters(self, text: str) -> None:
        if not self._open[-1].children:
            self._open[-1].text += text

    def _refuse_doctype(self, *_: object) -> None:
        raise _refusal(
            self._mark, NOT_XML, "document types (<!DOCTYPE…>) are not supported", "remove it"
        )


def _refusal(mark: Mark, code: str, sentence: str, hint: str = "") -> InputError:
    return InputError([Finding(mark, code, sentence, hint)])
