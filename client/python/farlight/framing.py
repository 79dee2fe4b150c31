# SPDX-License-Identifier: MIT
"""Messages in a stream of bytes: u32 payload bytes, u16 type, u16 flags (0), u32 request, u32 channel, the payload, and
zeros up to a multiple of 8."""
from __future__ import annotations

import struct
from typing import NamedTuple

from . import fields
from .errors import ProtocolError
from .fields import Message
from .messages import MESSAGES

_HEADER = struct.Struct("<I2H2I")
_IGNORABLE = 0x8000  # a type that an older peer skips


class Received(NamedTuple):
    """A received message."""
    message: Message
    request: int
    channel: int


def pack(message: Message, request: int = 0, channel: int = 0) -> bytes:
    """Encodes a message for sending; InvalidValue names the field."""
    return wrap(message.TYPE, fields.encode(message), request, channel)


def wrap(kind: int, payload: bytes, request: int = 0, channel: int = 0) -> bytes:
    """Adds the header and padding to a payload of this type of message."""
    return b"".join((_HEADER.pack(len(payload), kind, 0, request, channel), payload, bytes(-len(payload) % 8)))


def cut(data: bytearray, senders: tuple[str, ...]) -> Received | None:
    """Cuts off the first message; None: it is incomplete. Type, sender and size are checked as soon as the header is there, so
    that `data` need not hold more than the largest message."""
    while len(data) >= _HEADER.size:
        size, kind, flags, request, channel = _HEADER.unpack_from(data)
        row = MESSAGES.get(kind)
        name = row.NAME if row else f"message {kind:#06x}"
        if flags:
            raise ProtocolError("flags are not zero", field=name)
        if row is None and not kind & _IGNORABLE:
            raise ProtocolError("its type is unknown", field=name)
        if row is not None and row.SENDER not in senders:
            raise ProtocolError("this may not be sent by the other side", field=name)
        most = fields.payload_max_bytes(row) if row else fields.CONTROL_MAX_BYTES
        if size > most:
            raise ProtocolError(f"{size} bytes, at most {most} are allowed", field=name)
        end = _HEADER.size + size
        whole = end + -size % 8
        if len(data) < whole:
            return None
        with memoryview(data) as view:
            payload = bytes(view[_HEADER.size:end])  # a single copy; slicing `data` would make two
        if any(data[end:whole]):
            raise ProtocolError("padding is not zero", field=name)
        del data[:whole]
        if row is not None:
            return Received(fields.decode(row, payload), request, channel)
    return None
