# SPDX-License-Identifier: MIT
"""Sealed connections, as the document of the protocol defines them: both ends prove that they have the same key, then
everything goes in records that cannot be read, changed, repeated or left out on the way. No I/O; the cryptography is the
system's libsodium.
"""
from __future__ import annotations

import ctypes
import functools
import hashlib
import hmac
import os
import stat

from . import libraries
from .errors import ConnectionLost, FileFailed, ProtocolError, Refused
from .fields import Bytes
from .messages import ErrorCode

KEY_BYTES = 32
HELLO_BYTES, PROVING_BYTES, HEAD_BYTES, TAG_BYTES = 72, 64, 8, 17
PLAIN_MAX_BYTES = 65536
STATE_BYTES = 52  # size of crypto_secretstream_xchacha20poly1305_state
MESSAGE, FINAL = 0, 3  # tags
WRONG_KEY, TOO_MANY, NO_KEY, OTHER_VERSION = 1, 2, 3, 4
REFUSALS = {
    WRONG_KEY: ("the daemon has another key", "name the file with a copy of the daemon's key"),
    TOO_MANY: ("too many wrong keys came from this address", "try again in a minute"),
    NO_KEY: ("the daemon has no key", "leave the key out, or start the daemon with --key-file"),
    OTHER_VERSION: ("the daemon speaks another version of sealed connections", ""),
}


@functools.cache
def _sodium() -> ctypes.CDLL:
    library = libraries.need("sodium", 23, "sealed connections")
    size = library.crypto_secretstream_xchacha20poly1305_statebytes
    size.restype = ctypes.c_size_t
    if library.sodium_init() < 0 or size() > STATE_BYTES:
        raise FileFailed("this library cannot be used", field="libsodium")
    return library


def read_key(path: str | os.PathLike[str]) -> bytes:
    """Reads the 32 bytes of a key file, which only its owner may be able to read or write."""
    name = os.fspath(path)
    try:
        with open(os.open(name, os.O_RDONLY | os.O_CLOEXEC | os.O_NOCTTY | os.O_NONBLOCK), "rb") as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise FileFailed("is not a regular file, so it cannot hold a key", field=name)
            if status.st_uid != os.geteuid():
                raise FileFailed("belongs to another user", field=name, remedy="run 'chown'")
            if status.st_mode & 0o077:
                raise FileFailed(f"is open to others (mode {stat.S_IMODE(status.st_mode):04o})", field=name,
                                 remedy="run 'chmod 600'")
            key = file.read(KEY_BYTES + 1)
    except OSError as why:
        raise FileFailed(f"cannot be read: {why.strerror}", field=name) from None
    if len(key) != KEY_BYTES:
        raise FileFailed(f"has {'more' if len(key) > KEY_BYTES else 'fewer'} than the 32 bytes of a key", field=name,
                         remedy="'farlight key FILE' creates one")
    return key


def _head(number: int) -> bytes:
    return b"SEAL" + bytes((number, 0, 0, 0))


def _blake2b(key: bytes, *parts: bytes) -> bytes:
    return hashlib.blake2b(b"".join(parts), key=key, digest_size=32).digest()


class Seal:
    """A client's end of a sealed connection. receive() turns received bytes into plain text, seal() the reverse; `out` is to be
    sent."""

    def __init__(self, key: bytes) -> None:
        self._key, self._in, self.out = key, bytearray(), bytearray()
        public, self._secret = ctypes.create_string_buffer(32), ctypes.create_string_buffer(32)
        _sodium().crypto_kx_keypair(public, self._secret)
        self._hello = b"SEAL" + bytes((1, 1, 0, 0)) + public.raw + os.urandom(32)
        self._answer = self._proving = self._up = self._down = b""
        self._sending: ctypes.Array[ctypes.c_char] | None = None
        self._receiving: ctypes.Array[ctypes.c_char] | None = None
        self.is_whole = False  # the last record has arrived: nothing is missing
        self.out += self._hello

    @property
    def may_seal(self) -> bool:
        """True once records may be sent, which is before the daemon's proof arrives."""
        return self._sending is not None

    # ---- handshake

    def _derive(self, label: bytes) -> bytes:
        label = b"farlight sealed " + label
        return _blake2b(self._key, label.ljust(32, b"\0"), self._up, self._down, self._hello, self._answer)

    def _message(self, number: int, size: int) -> bytes:
        """Handles the next message of the daemon; empty: it is incomplete. A fault is reported as soon as its byte is there."""
        begun, wanted = bytes(self._in[:HEAD_BYTES]), _head(number)
        for i, byte in enumerate(begun):
            if i != 5 and byte != wanted[i]:
                raise ProtocolError("these bytes begin no sealed connection" if i < 4 else
                                    "this is not the expected message", field="sealed")
        if len(begun) == HEAD_BYTES and begun[5]:
            if begun[5] not in REFUSALS:
                raise ProtocolError(f"status {begun[5]} is unknown", field="sealed")
            text, remedy = REFUSALS[begun[5]]
            raise Refused(text, code=ErrorCode.DENIED, remedy=remedy, retryable=begun[5] == TOO_MANY,
                          retry_after_s=60 if begun[5] == TOO_MANY else 0)
        if len(self._in) < size:
            return b""
        message = bytes(self._in[:size])
        del self._in[:size]
        return message

    def _prove(self, answer: bytes) -> None:
        sodium, theirs = _sodium(), answer[8:40]
        down, up = ctypes.create_string_buffer(32), ctypes.create_string_buffer(32)
        if (theirs == self._hello[8:40] or
                sodium.crypto_kx_client_session_keys(down, up, self._hello[8:40], self._secret, theirs) != 0):
            raise ProtocolError("there is no secret with the daemon's public key", field="sealed")
        self._answer, self._down, self._up = answer, down.raw, up.raw
        state, header = ctypes.create_string_buffer(STATE_BYTES), ctypes.create_string_buffer(24)
        sodium.crypto_secretstream_xchacha20poly1305_init_push(state, header, self._derive(b"client stream"))
        begun = _head(3) + header.raw
        self._proving = begun + _blake2b(self._derive(b"client proof"), begun)
        self.out += self._proving
        self._sending = state

    def _finish(self, message: bytes) -> None:
        if not hmac.compare_digest(_blake2b(self._derive(b"server proof"), self._proving, message[:32]), message[32:]):
            raise ProtocolError("the other side does not have the key", field="sealed")
        state = ctypes.create_string_buffer(STATE_BYTES)
        sodium = _sodium()
        sodium.crypto_secretstream_xchacha20poly1305_init_pull(state, message[8:32], self._derive(b"server stream"))
        self._receiving = state
        ctypes.memset(self._secret, 0, 32)
        self._key = self._up = self._down = b""

    # ---- records

    def seal(self, plain: Bytes) -> None:
        """Appends records to `out`. Empty plain text makes the last one."""
        if self._sending is None:
            raise ProtocolError("nothing can be sealed yet", field="sealed")
        sodium = _sodium()
        for at in range(0, max(len(plain), 1), PLAIN_MAX_BYTES):
            with memoryview(plain) as view:
                piece = bytes(view[at:at + PLAIN_MAX_BYTES])
            length = (len(piece) + TAG_BYTES).to_bytes(4, "little")
            record = ctypes.create_string_buffer(len(piece) + TAG_BYTES)
            sodium.crypto_secretstream_xchacha20poly1305_push(
                self._sending, record, None, piece, ctypes.c_ulonglong(len(piece)), length, ctypes.c_ulonglong(4),
                ctypes.c_ubyte(MESSAGE if piece else FINAL))
            self.out += length + record.raw

    def _open(self) -> bytes | None:
        """Opens the next record; None: it is incomplete."""
        if len(self._in) < 4:
            return None
        size = int.from_bytes(self._in[:4], "little")
        if not TAG_BYTES <= size <= PLAIN_MAX_BYTES + TAG_BYTES:
            raise ProtocolError(f"a record of {size} bytes", field="sealed")
        if len(self._in) < 4 + size:
            return None
        length, record = bytes(self._in[:4]), bytes(self._in[4:4 + size])
        del self._in[:4 + size]
        plain, tag = ctypes.create_string_buffer(max(size - TAG_BYTES, 1)), ctypes.c_ubyte()
        failed = _sodium().crypto_secretstream_xchacha20poly1305_pull(
            self._receiving, plain, None, ctypes.byref(tag), record, ctypes.c_ulonglong(size), length,
            ctypes.c_ulonglong(4))
        is_last = size == TAG_BYTES
        if failed or tag.value != (FINAL if is_last else MESSAGE):
            raise ProtocolError("a record was changed on the way", field="sealed")
        self.is_whole = is_last
        return plain.raw[:size - TAG_BYTES]

    def receive(self, data: Bytes) -> bytes:
        """Processes received bytes; returns the plain text that is complete; raises ProtocolError or Refused."""
        self._in += data
        plain = bytearray()
        if not self._answer and (answer := self._message(2, HELLO_BYTES)):
            self._prove(answer)
        if self._answer and self._receiving is None and (message := self._message(4, PROVING_BYTES)):
            self._finish(message)
        while self._receiving is not None and (opened := self._open()) is not None:
            if self.is_whole:
                if self._in:
                    raise ProtocolError("bytes came behind the last record", field="sealed")
                break
            plain += opened
        return bytes(plain)

    def check_end(self) -> None:
        """Handles a close by the other side; raises ConnectionLost if something is missing."""
        if not self.is_whole:
            raise ConnectionLost("the daemon closed the connection, or it was cut on the way: its sealed end is missing")
