"""Signed MAVLink 2 frames: a key in a file, and the check of signatures and time stamps.

A signed link refuses frames without a signature, with a wrong one, and those that were sent before.
It encrypts nothing: everybody on the link can read everything.

pymavlink notes the time stamp of a frame before it checks the signature, so that one forged frame
with a stamp in the far future locks the genuine sender out. `SignedCodec` checks the signature
first, as the specification says.
"""

from __future__ import annotations

import hmac
import os
import secrets
import stat
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from struct import unpack
from threading import Lock
from time import time  # noqa: TID251 - signatures carry the time of day
from typing import Any

from stack.errors import InputError

EPOCH = 1420070400.0
"""UNIX time of 1 January 2015, from which stamps count, in units of 10 microseconds."""

UNITS = 100_000.0
"""Of stamps per second."""

MINUTE = round(60 * UNITS)
"""A new stream may lag so far behind the newest stamp. A restarted robot begins so far after the
stored one: frames of its former run are then too old."""

MAX_STREAMS = 64
"""Senders (link, system, component) whose stamps are followed; no other is accepted."""

STORE_PERIOD = round(5 * UNITS)
"""The stamp is stored so often, and so far ahead: a crash stores nothing."""

KEY_BYTES = 32
SIGNATURE_BYTES = 6


def make_key(path: Path) -> None:
    """Write a new key into a file that only its owner can read: 64 hexadecimal digits.

    Raises:
        InputError: the file exists, or cannot be written.
    """
    try:
        number = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        raise InputError(f"{path} exists; choose another name, or remove it first") from None
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror}") from None
    with os.fdopen(number, "w") as file:
        file.write(secrets.token_hex(KEY_BYTES) + "\n")


def read_key(path: Path) -> bytes:
    """The secret of a key file: the SHA-256 of its digits.

    MAVProxy (`signing key`) and QGroundControl do the same with what is typed into them, so that
    the digits of the file can be given to them.

    Raises:
        InputError: the file cannot be read, others can read it, or it holds no key.
    """
    try:
        with path.open("rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            content = file.read(1000)
    except OSError as error:
        raise InputError(f"MAVLink key {path} cannot be read: {error.strerror}") from None
    if stat.S_ISREG(mode) and mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise InputError(f"MAVLink key {path} can be read by others: chmod 600 {path}")
    digits = content.strip()
    if len(digits) != 2 * KEY_BYTES or not all(byte in b"0123456789abcdef" for byte in digits):
        raise InputError(
            f"MAVLink key {path}: expected {2 * KEY_BYTES} hexadecimal digits; "
            "`treepilot keys mavlink` makes a key"
        )
    return sha256(digits).digest()


class Signing:
    """Key and time stamps of one link, shared by all its codecs.

    It has the attributes that pymavlink's codec uses.

    Args:
        key: 32 bytes, as `read_key` returns them.
        link_id: distinct for each link with the same key.
        store: file that keeps the newest stamp over restarts; None: it is not kept.
        clock: returns the time of day, seconds since 1970.

    Raises:
        InputError: the file cannot be read or written.

    Attributes:
        stream_timestamps: newest stamp by (link, system, component).
    """

    sign_outgoing = True
    allow_unsigned_callback = None
    sig_count = badsig_count = goodsig_count = unsigned_count = reject_count = 0

    def __init__(
        self, key: bytes, *, link_id: int = 0, store: Path | None = None,
        clock: Callable[[], float] = time,
    ) -> None:  # fmt: skip
        self.secret_key, self.link_id = key, link_id
        self.stream_timestamps: dict[tuple[int, int, int], int] = {}
        self._store, self._clock, self._lock = store, clock, Lock()
        kept = _stored(store)
        self._newest = 0 if kept is None else kept + MINUTE + 1
        self._written = 0
        try:
            self._keep()
        except OSError as error:
            raise InputError(f"{store} cannot be written: {error.strerror}") from None

    @property
    def timestamp(self) -> int:
        """Stamp of the next frame: of now, but always newer than all before."""
        return max(self._newest, round((self._clock() - EPOCH) * UNITS))

    @timestamp.setter
    def timestamp(self, stamp: int) -> None:
        self._newest = max(self._newest, stamp)
        with suppress(OSError):  # e.g. a full disk: the link goes on
            self._keep()

    def accepts(self, stream: tuple[int, int, int], stamp: int) -> bool:
        """Whether a stamp of a frame with a good signature is new; it is noted then."""
        with self._lock:
            last = self.stream_timestamps.get(stream)
            if last is None:
                if len(self.stream_timestamps) >= MAX_STREAMS or stamp + MINUTE < self.timestamp:
                    return False
            elif stamp <= last:
                return False
            self.stream_timestamps[stream] = stamp
            self.timestamp = stamp
            return True

    def close(self) -> None:
        """Store the newest stamp itself."""
        with suppress(OSError):
            self._write(self.timestamp)

    def _keep(self) -> None:
        """Store a stamp that lies ahead of all that come until it is stored again."""
        if self._store is not None and self.timestamp >= self._written - STORE_PERIOD:
            self._written = self.timestamp + 2 * STORE_PERIOD
            self._write(self._written)

    def _write(self, stamp: int) -> None:
        if self._store is None:
            return
        new = self._store.with_name(f"{self._store.name}.new")
        number = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(number, "w") as file:
            file.write(f"{stamp}\n")
        new.replace(self._store)


def _stored(store: Path | None) -> int | None:
    """The stamp of a file; None if there is none.

    Raises:
        InputError: the file holds something else.
    """
    if store is None or not store.exists():
        return None
    text = store.read_text("utf-8").strip()
    if not text.isdecimal() or len(text) > 16:
        raise InputError(f"{store} holds no time stamp; remove it if no frame can be replayed")
    return int(text)


def stamp_file(key: Path) -> Path:
    """The file beside a key that keeps the newest stamp."""
    return key.with_name(f"{key.name}.stamp")


@lru_cache(maxsize=1)
def _codec_class() -> Any:
    from pymavlink.dialects.v20 import all as dialect

    base: Any = dialect.MAVLink

    class SignedCodec(base):  # type: ignore[misc]
        """A codec that checks the signature before the time stamp."""

        def check_signature(self, msgbuf: bytearray, srcSystem: int, srcComponent: int) -> bool:
            """Whether a frame is signed with our key and was not seen before."""
            expected = sha256(self.signing.secret_key + msgbuf[:-SIGNATURE_BYTES]).digest()
            if not hmac.compare_digest(
                expected[:SIGNATURE_BYTES], bytes(msgbuf[-SIGNATURE_BYTES:])
            ):
                return False
            (stamp,) = unpack("<Q", bytes(msgbuf[-12:-6]) + b"\0\0")
            return bool(self.signing.accepts((msgbuf[-13], srcSystem, srcComponent), stamp))

    return SignedCodec


def signed_codecs(signing: Signing) -> Callable[[int, int], Any]:
    """The `make_codec` of a `Link` whose frames are signed."""

    def make(system: int, component: int) -> Any:
        codec = _codec_class()(None, system, component)
        codec.signing = signing
        return codec

    return make
