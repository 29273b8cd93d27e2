"""XML reader that keeps positions, with the part of XML that worlds and robots need.

Document types and entities are refused: they allow expansion attacks and access to other files.
Codes: E001 the file · E002 too large · E207 not XML, or the code of the caller.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from stack.documents.files import XML_BYTES, read_input
from stack.documents.findings import Finding, Mark
from stack.errors import InputError
from stack.types.printable import printable

NOT_XML = "E207"
MAX_DEPTH = 100


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

    def within(self) -> Iterator[Element]:
        """All elements below this one, in order."""
        for child in self.children:
            yield child
            yield from child.within()

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
    return parse_xml(read_input(path, what, XML_BYTES), str(path))


def parse_xml(raw: bytes, name: str, code: str = NOT_XML) -> Element:
    """The root element of XML bytes; `name` is the file name for messages.

    Control characters in attributes and texts are escaped.

    Raises:
        InputError: the bytes are not XML, nested too deeply, or have a document type.
    """
    builder = _Builder(name, code)
    try:
        builder.parser.Parse(raw, True)
    except expat.ExpatError as error:
        mark = Mark(name, error.lineno, error.offset + 1)
        sentence = f"not XML: {expat.errors.messages[error.code]}"
        raise _refusal(mark, code, sentence) from None
    except (LookupError, ValueError) as error:  # a declared encoding that Python does not have
        sentence = f"not XML: {type(error).__name__} {error}"
        raise _refusal(Mark(name), code, sentence) from None
    return builder.root


class _Builder:
    """Builds the tree of elements from expat's events."""

    def __init__(self, name: str, code: str) -> None:
        self._name, self._code = name, code
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
        attributes = {name: printable(value) for name, value in attributes.items()}
        element = Element(tag, attributes, self._mark)
        if len(self._open) >= MAX_DEPTH:
            raise _refusal(self._mark, self._code, f"elements nested more than {MAX_DEPTH} deep")
        if self._open:
            self._open[-1].children.append(element)
        else:
            self.root = element
        self._open.append(element)

    def _end(self, tag: str) -> None:
        element = self._open.pop()
        element.text = printable(element.text.strip())

    def _characters(self, text: str) -> None:
        if not self._open[-1].children:
            self._open[-1].text += text

    def _refuse_doctype(self, *_: object) -> None:
        raise _refusal(
            self._mark, self._code, "document types (<!DOCTYPE…>) are not supported", "remove it"
        )


def _refusal(mark: Mark, code: str, sentence: str, hint: str = "") -> InputError:
    return InputError([Finding(mark, code, sentence, hint)])
