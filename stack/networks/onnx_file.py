"""Header of an ONNX file: inputs and metadata, read without a library.

ONNX is protocol buffers (onnx.proto of the ONNX project). OpenCV runs such models, but does not
tell their metadata, in which exporters write the names of the classes. Fields are skipped unless
they are needed, so that the weights are not copied.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from stack.documents.files import note_input
from stack.errors import InputError

_IR_VERSION, _GRAPH, _METADATA = 1, 7, 14
"""Fields of ModelProto."""
_INITIALIZER, _INPUT = 5, 11
"""Fields of GraphProto."""

LARGEST = 1 << 30
"""Bytes of the largest model that is read."""

Field = tuple[int, int | memoryview]


class _Malformed(Exception):
    """The bytes are no protocol buffer."""


@dataclass(frozen=True)
class Tensor:
    """An input of a model.

    Attributes:
        name: in the model.
        shape: sizes; None where the file leaves one open.
    """

    name: str
    shape: tuple[int | None, ...]

    def __str__(self) -> str:
        sizes = " x ".join("?" if size is None else str(size) for size in self.shape)
        return f"{self.name} ({sizes})"


@dataclass(frozen=True)
class OnnxHeader:
    """What an ONNX file says about its model."""

    inputs: tuple[Tensor, ...]
    metadata: dict[str, str]


def read_header(file: Path) -> OnnxHeader:
    """Return the header of an ONNX file.

    Raises:
        InputError: it cannot be read, or is no ONNX file.
    """
    try:
        if file.stat().st_size > LARGEST:
            raise InputError(f"{file} is larger than {LARGEST >> 20} MB")
        note_input(file)
        content = file.read_bytes()
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror}") from None
    try:
        header = _header(memoryview(content))
    except (_Malformed, UnicodeDecodeError):
        header = None
    if header is None:
        begin = content[:12]
        raise InputError(
            f"{file} is not an ONNX file: it has {len(content)} bytes and begins with {begin!r}; "
            "export the model as ONNX, and check that the file was copied completely"
        )
    return header


def _header(content: memoryview) -> OnnxHeader | None:
    """Return the header; None if the bytes are a protocol buffer, but not a model."""
    model = _grouped(content)
    graphs = model.get(_GRAPH, [])
    if _IR_VERSION not in model or len(graphs) != 1:
        return None
    graph = _grouped(_bytes(graphs[0]))
    stored = {_text(_grouped(_bytes(item)), 8) for item in graph.get(_INITIALIZER, [])}
    inputs = (_tensor(_bytes(item)) for item in graph.get(_INPUT, []))
    entries = [_grouped(_bytes(item)) for item in model.get(_METADATA, [])]
    return OnnxHeader(
        tuple(tensor for tensor in inputs if tensor.name not in stored),
        {_text(entry, 1): _text(entry, 2) for entry in entries},
    )


def _tensor(content: memoryview) -> Tensor:
    """Return a ValueInfoProto: name = 1, type = 2 { tensor_type = 1 { shape = 2 { dim = 1 }}}."""
    info = _grouped(content)
    inner = info
    for number in (2, 1, 2):
        inner = _grouped(_bytes(inner[number][0])) if number in inner else {}
    sizes = [_grouped(_bytes(item)).get(1, [None])[0] for item in inner.get(1, [])]
    return Tensor(
        _text(info, 1),
        tuple(size if isinstance(size, int) and size > 0 else None for size in sizes),
    )


def _grouped(content: memoryview) -> dict[int, list[int | memoryview]]:
    """Return the fields of a message by number."""
    found: dict[int, list[int | memoryview]] = {}
    for number, value in _fields(content):
        found.setdefault(number, []).append(value)
    return found


def _fields(content: memoryview) -> Iterator[Field]:
    """Yield number and value of the fields: an integer, or the bytes."""
    at = 0
    while at < len(content):
        key, at = _varint(content, at)
        number, kind = key >> 3, key & 7
        if kind == 0:
            value, at = _varint(content, at)
            yield number, value
            continue
        if kind == 2:
            size, at = _varint(content, at)
        elif kind in (1, 5):
            size = 8 if kind == 1 else 4
        else:
            raise _Malformed
        if number == 0 or at + size > len(content):
            raise _Malformed
        yield number, content[at : at + size]
        at += size


def _varint(content: memoryview, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        if at >= len(content):
            break
        byte = content[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
    raise _Malformed


def _bytes(value: int | memoryview) -> memoryview:
    if isinstance(value, int):
        raise _Malformed
    return value


def _text(message: dict[int, list[int | memoryview]], number: int) -> str:
    values = message.get(number)
    return "" if not values else bytes(_bytes(values[-1])).decode("utf-8")
