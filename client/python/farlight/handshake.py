# SPDX-License-Identifier: MIT
"""The handshake: the first bytes of a connection, whose layout never changes. No I/O."""
from __future__ import annotations

import os
from dataclasses import dataclass

from . import messages
from .errors import InvalidValue, ProtocolError, Refused
from .messages import ErrorCode

VERSION = 2
MAGIC = b"FARL"
NEEDS_KEY, TRY_AGAIN = 1 << 2, 1 << 4  # bits of capabilities
NAME_MAX_BYTES, LIMITS_MAX_BYTES, FIXED_BYTES = 64, 256, 48


def hello(name: str) -> bytes:
    """Makes a client's hello; the daemon shows `name`."""
    encoded = name.encode("utf-8", "replace") if isinstance(name, str) else b"\0"
    if len(encoded) > NAME_MAX_BYTES or b"\0" in encoded:
        raise InvalidValue(f"{name!r} is not at most {NAME_MAX_BYTES} bytes without NUL", field="name")
    made = MAGIC + VERSION.to_bytes(2, "little") * 2 + bytes(8)
    made += os.urandom(16) + bytes((len(encoded),)) + encoded
    return made + bytes(-len(made) % 8)


@dataclass(frozen=True)
class Reply:
    """A daemon's reply that accepts the client; its size was `size` bytes."""
    limits: dict[str, int]
    daemon: str
    size: int


def _limits(data: bytes) -> dict[str, int]:
    """Reads the limits; those that an older daemon lacks are 0, and further ones of a newer daemon are skipped."""
    limits, at = {}, 0
    for name, letter, _ in messages.LIMITS:
        size = 8 if letter == "Q" else 4
        limits[name] = int.from_bytes(data[at:at + size], "little") if at + size <= len(data) else 0
        at += size
    return limits


def parse(data: bytearray) -> Reply | None:
    """Parses the daemon's reply; None: it is incomplete. Raises ProtocolError for a wrong byte at once, Refused with the
    daemon's reason."""
    if not MAGIC.startswith(bytes(data[:4])):
        raise ProtocolError("the server there is no farlight daemon", field="handshake")
    if len(data) < FIXED_BYTES:
        return None
    limits_bytes = int.from_bytes(data[6:8], "little")
    if limits_bytes > LIMITS_MAX_BYTES:
        raise ProtocolError(f"{limits_bytes} bytes of limits, at most {LIMITS_MAX_BYTES}", field="handshake")
    at, texts = FIXED_BYTES + limits_bytes, []
    for _ in range(2):
        if len(data) <= at or len(data) < at + 1 + data[at]:
            return None
        texts.append(bytes(data[at + 1:at + 1 + data[at]]).decode("utf-8", "replace"))
        at += 1 + data[at]
    at += -at % 8
    if len(data) < at:
        return None
    version, capabilities = int.from_bytes(data[4:6], "little"), int.from_bytes(data[8:16], "little")
    if version == 0 and capabilities & NEEDS_KEY:
        raise Refused("the daemon accepts only clients with its key", code=ErrorCode.DENIED,
                      remedy="give key_file, the file with a copy of the key")
    if version != VERSION:
        raise Refused(texts[1] or f"the daemon chose version {version}", code=ErrorCode.VERSION,
                      retryable=bool(capabilities & TRY_AGAIN))
    return Reply(_limits(bytes(data[FIXED_BYTES:FIXED_BYTES + limits_bytes])), texts[0], at)
