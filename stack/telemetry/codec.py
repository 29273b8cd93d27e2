"""Encode records to bytes and decode them: msgpack, driven by the records' type annotations.

A message is [stamp, name of the record, values of its fields in order]. The stamp is a digest of
the fields and types of all records, so that two incompatible versions reject each other's messages
instead of misreading them. Received names are never executed or imported.
"""

from __future__ import annotations

import dataclasses
import sys
import types
import typing
import zlib
from collections.abc import Callable, Iterable, Mapping
from enum import Enum
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np

from stack.errors import TelemetryError
from stack.parameters import values_of
from stack.telemetry.messages import CLIENT_SENDS, SERVER_SENDS
from stack.telemetry.records import Event

T = TypeVar("T")

FORMAT = 2
"""Version of the encoding; increase it for changes that the records' fields do not show."""

COMPRESS_ABOVE = 2048
"""Size of an array, bytes, above which it is compressed."""

MAX_ARRAY_BYTES = 256 * 1024 * 1024
"""Largest accepted array: a short message must not allocate all the memory."""

MAX_DEPTH = 32
"""Deepest nesting of lists and mappings in a field without a record type."""

_DTYPES = {"<f8", "<f4", "|i1", "|u1", "<i2", "<u2", "<i4", "<u4", "<i8", "<u8", "|b1"}


class MalformedError(Exception):
    """A value does not match the expected type."""


@dataclasses.dataclass(frozen=True)
class Codec:
    """Encoder to, and decoder from, what msgpack packs; `shape` describes the type.

    Both raise MalformedError for a value that the type does not allow.
    """

    encode: Callable[[Any], Any]
    decode: Callable[[Any], Any]
    shape: str


def encode(record: Any) -> bytes:
    """Encode a record (a Snapshot, Event, Command…).

    Raises:
        TelemetryError: a field has a value that its annotation does not allow.
    """
    kind: Any = type(record)
    try:
        return _packed([stamp(), kind.__name__, codec_of(kind).encode(record)])
    except (MalformedError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise TelemetryError(f"a {kind.__name__} cannot be sent: {error}") from None


def decode(encoded: bytes, kind: type[T]) -> T:
    """Decode a record of this type.

    Raises:
        TelemetryError: another message, a malformed one, or one of another version.
    """
    decoded: T = decode_one_of(encoded, (kind,))
    return decoded


def decode_one_of(encoded: bytes, kinds: Iterable[type]) -> Any:
    """Decode a record of one of these types.

    Raises:
        TelemetryError: another message, a malformed one, or one of another version.
    """
    by_name = {kind.__name__: kind for kind in kinds}
    message = _unpacked(encoded)
    if not isinstance(message, list) or len(message) != 3:
        raise TelemetryError(f"not a treepilot message: expected a {' or '.join(by_name)}")
    written, name, fields = message
    if written != stamp():
        raise TelemetryError(
            f"the other side uses telemetry version {written!r:.60}, this side {stamp()!r}; "
            "use the same treepilot version on both sides"
        )
    if not isinstance(name, str) or name not in by_name:
        raise TelemetryError(f"expected a {' or '.join(by_name)}, got {name!r:.60}")
    try:
        return codec_of(by_name[name]).decode(fields)
    except (MalformedError, TypeError, ValueError, OverflowError) as error:
        raise TelemetryError(f"malformed {name}: {error}") from None


@lru_cache(maxsize=1)
def stamp() -> str:
    """Version of the format: FORMAT and a digest of the fields and types of all records."""
    kinds = (Event, *CLIENT_SENDS, *SERVER_SENDS)
    shapes = "\n".join(codec_of(kind).shape for kind in kinds)
    return f"{FORMAT}.{zlib.crc32(shapes.encode()):08x}"


@lru_cache(maxsize=256)
def field_codecs(kind: type) -> Mapping[str, Codec]:
    """The codec of each field of a record that is sent, by name, in order."""
    hints = typing.get_type_hints(kind)
    sent = [item for item in dataclasses.fields(kind) if item.metadata.get("sent", True)]
    return {item.name: codec_of(hints[item.name]) for item in sent}


def plain_fields(record: Any) -> dict[str, Any]:
    """Return the encoded fields of a record by name; without arrays they are JSON values."""
    kind: Any = type(record)
    codecs = field_codecs(kind).items()
    return {name: codec.encode(getattr(record, name)) for name, codec in codecs}


def from_plain(kind: type[T], plain: Mapping[str, Any]) -> T:
    """Return a record of the values that `plain_fields` gave.

    Raises:
        LookupError, TypeError, MalformedError: they are not those of such a record.
    """
    made: Any = kind
    codecs = field_codecs(made).items()
    record: T = made(**{name: codec.decode(plain[name]) for name, codec in codecs})
    return record


def plain(value: Any) -> Any:
    """Convert a value to None, bool, int, float, str, lists and dicts with text keys.

    Raises:
        TypeError: it contains something else.
    """
    if isinstance(value, Enum):
        return plain(value.value)
    if value is None or type(value) in (bool, int, float, str):
        return value
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, str | int | float):
        return next(base(value) for base in (str, int, float) if isinstance(value, base))
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {name: plain(item) for name, item in values_of(value).items()}
    raise TypeError(f"{type(value).__name__} is neither number, text, list nor mapping")


def _packed(value: Any) -> bytes:
    import msgpack  # not with the names of `treepilot`

    return bytes(msgpack.packb(value, use_bin_type=True))


def _unpacked(encoded: bytes) -> Any:
    import msgpack

    try:
        return msgpack.unpackb(encoded, raw=False, strict_map_key=True)
    except (ValueError, TypeError, msgpack.UnpackException, RecursionError) as error:
        raise TelemetryError(f"not a treepilot message: {error}") from None


@lru_cache(maxsize=256)
def codec_of(kind: Any) -> Codec:
    """The codec of an annotated type.

    Raises:
        TypeError: it has none.
    """
    kind = _resolved(kind)
    origin, arms = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        return _union_codec(arms)
    if origin is np.ndarray or kind is np.ndarray:
        return Codec(_encode_array, _decode_array, "array")
    if origin is tuple:
        return _tuple_codec(arms)
    if origin is list:
        items = _tuple_codec((arms[0], ...))
        return Codec(items.encode, lambda values: list(items.decode(values)), items.shape)
    if origin is not None and issubclass(origin, Mapping):
        return _mapping_codec(arms)
    if isinstance(kind, type) and dataclasses.is_dataclass(kind):
        return _record_codec(kind)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return Codec(lambda member: member.value, kind, kind.__name__)
    if kind is Any:
        return Codec(plain, _decode_plain, "any")
    if kind in (str, int, bool, float, bytes):
        return _scalar_codec(kind)
    raise TypeError(f"{kind} has no encoding")


def _resolved(kind: Any) -> Any:
    """Return the type that an alias stands for: NumPy's NDArray is one from Python 3.12 on."""
    if sys.version_info >= (3, 12):
        alias = typing.get_origin(kind) or kind
        if isinstance(alias, typing.TypeAliasType):
            arguments = typing.get_args(kind)
            return _resolved(alias.__value__[arguments] if arguments else alias.__value__)
    return kind


def _decode_plain(value: Any, depth: int = MAX_DEPTH) -> Any:
    """Accept what `plain` makes: no bytes, extension types or keys other than text."""
    if value is None or type(value) in (bool, int, float, str):
        return value
    if depth == 0:
        raise MalformedError(f"values nested deeper than {MAX_DEPTH}")
    if type(value) is list:
        return [_decode_plain(item, depth - 1) for item in value]
    if type(value) is dict and all(type(key) is str for key in value):
        return {key: _decode_plain(item, depth - 1) for key, item in value.items()}
    raise MalformedError(f"expected a number, text, list or mapping, got {value!r:.60}")


def _scalar_codec(kind: type) -> Codec:
    def decode_scalar(value: Any) -> Any:
        if type(value) is not kind:
            raise MalformedError(f"expected {kind.__name__}, got {value!r:.60}")
        return value

    return Codec(kind, decode_scalar, kind.__name__)


def _record_codec(kind: type) -> Codec:
    pairs = list(field_codecs(kind).items())
    codecs = [codec for _, codec in pairs]

    def encode_record(record: Any) -> list[Any]:
        if type(record) is not kind:
            raise MalformedError(f"expected {kind.__name__}, got {type(record).__name__}")
        return [codec.encode(getattr(record, name)) for name, codec in pairs]

    def decode_record(values: Any) -> Any:
        items = _list_of(values, len(codecs), kind.__name__)
        return kind(*[codec.decode(item) for codec, item in zip(codecs, items, strict=True)])

    shape = ",".join(f"{name}:{codec.shape}" for name, codec in pairs)
    return Codec(encode_record, decode_record, f"{kind.__name__}({shape})")


def _tuple_codec(arms: tuple[Any, ...]) -> Codec:
    if len(arms) == 2 and arms[1] is Ellipsis:
        item = codec_of(arms[0])
        return Codec(
            lambda values: [item.encode(value) for value in values],
            lambda values: tuple(item.decode(value) for value in _list_of(values, None, "list")),
            f"[{item.shape}]",
        )
    codecs = [codec_of(arm) for arm in arms]

    def encode_tuple(values: Any) -> list[Any]:
        return [codec.encode(value) for codec, value in zip(codecs, values, strict=True)]

    def decode_tuple(values: Any) -> tuple[Any, ...]:
        items = _list_of(values, len(codecs), "tuple")
        return tuple(codec.decode(item) for codec, item in zip(codecs, items, strict=True))

    return Codec(encode_tuple, decode_tuple, f"({','.join(codec.shape for codec in codecs)})")


def _mapping_codec(arms: tuple[Any, ...]) -> Codec:
    item = codec_of(arms[1])

    def encode_mapping(mapping: Any) -> dict[str, Any]:
        return {str(key): item.encode(value) for key, value in mapping.items()}

    def decode_mapping(mapping: Any) -> dict[str, Any]:
        if not isinstance(mapping, dict) or not all(isinstance(key, str) for key in mapping):
            raise MalformedError(f"expected a mapping, got {mapping!r:.60}")
        return {key: item.decode(value) for key, value in mapping.items()}

    return Codec(encode_mapping, decode_mapping, f"{{{item.shape}}}")


def _union_codec(arms: tuple[Any, ...]) -> Codec:
    """X | None is encoded as nil or X; a union of several types as [index, value]."""
    kinds = [_resolved(arm) for arm in arms if arm is not type(None)]
    codecs = [codec_of(kind) for kind in kinds]
    if len(kinds) == 1:
        only = codecs[0]
        return Codec(
            lambda value: None if value is None else only.encode(value),
            lambda value: None if value is None else only.decode(value),
            f"{only.shape}?",
        )
    runtime = [typing.get_origin(kind) or kind for kind in kinds]

    def encode_union(value: Any) -> list[Any]:
        which = next((n for n, kind in enumerate(runtime) if isinstance(value, kind)), None)
        if which is None:
            expected = " or ".join(kind.__name__ for kind in runtime)
            raise MalformedError(f"expected {expected}, got {type(value).__name__}")
        return [which, codecs[which].encode(value)]

    def decode_union(values: Any) -> Any:
        which, value = _list_of(values, 2, "choice")
        if type(which) is not int or not 0 <= which < len(codecs):
            raise MalformedError(f"expected a choice of 0 to {len(codecs) - 1}, got {which!r:.60}")
        return codecs[which].decode(value)

    return Codec(encode_union, decode_union, "|".join(codec.shape for codec in codecs))


def _list_of(values: Any, length: int | None, what: str) -> list[Any]:
    if not isinstance(values, list) or (length is not None and len(values) != length):
        raise MalformedError(f"expected a {what}, got {values!r:.60}")
    return values


def _encode_array(array: Any) -> list[Any]:
    """Encode as [type, shape, compressed?, bytes]; little-endian, row-major."""
    array = np.asarray(array)
    array = np.ascontiguousarray(array, array.dtype.newbyteorder("<")).reshape(array.shape)
    if array.dtype.str not in _DTYPES:
        raise MalformedError(f"an array of {array.dtype} has no encoding")
    content = array.tobytes()
    if len(content) > COMPRESS_ABOVE and array.dtype.itemsize == 1 and array.ndim == 2:
        return [array.dtype.str, list(array.shape), True, zlib.compress(content, 1)]
    return [array.dtype.str, list(array.shape), False, content]


def _decode_array(values: Any) -> Any:
    kind, shape, compressed, content = _list_of(values, 4, "array")
    if kind not in _DTYPES or not isinstance(content, bytes) or not isinstance(shape, list):
        raise MalformedError("an array is [type, shape, compressed, bytes]")
    if len(shape) > 4 or any(type(side) is not int or side < 0 for side in shape):
        raise MalformedError(f"an array cannot have the shape {shape!r:.60}")
    size = np.dtype(kind).itemsize
    for side in shape:
        size *= side
    if size > MAX_ARRAY_BYTES:
        raise MalformedError(f"an array of {size} bytes; at most {MAX_ARRAY_BYTES} are accepted")
    if compressed:
        # One extra byte detects a stream that is longer than the shape says.
        try:
            content = zlib.decompressobj().decompress(content, size + 1)
        except zlib.error as error:
            raise MalformedError(f"an array that is damaged: {error}") from None
    if len(content) != size:
        raise MalformedError(f"an array of shape {shape} needs {size} bytes, got {len(content)}")
    return np.frombuffer(content, dtype=kind).reshape(shape)
