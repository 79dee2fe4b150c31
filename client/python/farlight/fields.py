# SPDX-License-Identifier: MIT
"""Fields of messages: their allowed values, and their form on the wire. Every value is checked in both directions; a payload
becomes a complete message or an error that names the field.

A payload: u16 size of the fixed part, the fixed fields without gaps, then strings, arrays and bulk data, each after a u32
count. A nested record is u16 size and its fixed fields. A shorter fixed part than ours is from an older peer: missing fields get their defaults. A longer one is from a newer
peer: the rest is skipped."""
from __future__ import annotations

import enum
import inspect
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from dataclasses import fields as dataclass_fields
from typing import Any, ClassVar, ParamSpec, TypeVar, Union

from .errors import Error, InvalidValue, ProtocolError

Bytes = Union[bytes, bytearray, memoryview]
P = ParamSpec("P")
T = TypeVar("T")

CONTROL_MAX_BYTES = 65536  # payload of a message without bulk data
BULK_MAX_BYTES = 262144 + 4096


class _Default:
    """A default that signatures show, and that is no value."""

    def __init__(self, meaning: str) -> None:
        self.meaning = meaning

    def __repr__(self) -> str:
        return self.meaning


NEXT: Any = _Default("the next free number")
KEPT: Any = _Default("as it is")


def takes(signature: Callable[P, None]) -> Callable[[Callable[..., T]], Callable[P, T]]:
    """Decorates a method that takes the fields of a message as keywords: its signature lists them all, for help(), editors and
    type checkers."""
    def decorate(method: Callable[..., T]) -> Callable[P, T]:
        named = inspect.signature(signature)
        setattr(method, "__signature__", named.replace(return_annotation=inspect.signature(method).return_annotation))
        return method
    return decorate


class Word(enum.IntEnum):
    """An enumeration of the protocol; its words are accepted in place of its values."""

    @classmethod
    def of(cls, value: int | str) -> Word:
        """Converts a word or number; raises ValueError if it is invalid."""
        if isinstance(value, str):
            member = cls.__members__.get(value.upper().replace("-", "_"))
            if member is None:
                raise ValueError(f"{value!r} is none of {', '.join(word.word for word in cls)}")
            return member
        return cls(value)

    @property
    def word(self) -> str:
        """The word that people read and type."""
        return self.name.lower().replace("_", "-")


@dataclass
class Record:
    """A struct within the arrays of messages."""
    NAME: ClassVar[str] = ""
    FIELDS: ClassVar[tuple[Field, ...]] = ()

    @classmethod
    def names(cls) -> list[str]:
        """Its attributes, those of nested records among them."""
        return [one.name for one in dataclass_fields(cls)]


@dataclass
class Message(Record):
    """A message: `SENDER` is client, server, both, or local (between a client and its helper programs)."""
    TYPE: ClassVar[int] = 0
    SENDER: ClassVar[str] = ""


class Reader:
    """A cursor over received bytes; missing bytes raise ProtocolError."""

    def __init__(self, data: Bytes) -> None:
        self.data, self.at = memoryview(data), 0

    def take(self, count: int, path: str) -> memoryview:
        """Reads the next bytes; nothing is allocated for missing ones."""
        if count > len(self.data) - self.at:
            raise ProtocolError(f"{count} bytes where {len(self.data) - self.at} are left", field=path)
        self.at += count
        return self.data[self.at - count:self.at]

    def left(self) -> int:
        """Number of bytes after the cursor."""
        return len(self.data) - self.at

    def count(self, maximum: int, path: str) -> int:
        """Reads the u32 before a counted field."""
        number = int.from_bytes(self.take(4, path), "little")
        if number > maximum:
            raise ProtocolError(f"{number} of them where {maximum} are allowed", field=path)
        return number


class Field:
    """A field of a message; `fixed_bytes` is 0 for counted fields."""
    fixed_bytes = 0
    least_bytes = 4  # minimum size of a counted field: its count

    def __init__(self, name: str) -> None:
        self.name = name  # name of the attribute; a keyword of Python gets an underscore
        self.wire_name = name.rstrip("_")

    def encode(self, value: Any, out: bytearray, path: str) -> None:
        """Appends the value; raises InvalidValue."""
        raise NotImplementedError

    def decode(self, reader: Reader, path: str) -> Any:
        """Reads a value; raises ProtocolError."""
        raise NotImplementedError

    def encode_of(self, holder: Record, out: bytearray, path: str) -> None:
        """Appends the attribute, or those of a nested record; `path` is the holder's."""
        self.encode(getattr(holder, self.name), out, f"{path}.{self.wire_name}")

    def decode_into(self, values: dict[str, Any], reader: Reader, path: str) -> None:
        """Reads it into arguments for the holder's class."""
        values[self.name] = self.decode(reader, f"{path}.{self.wire_name}")


def _out_of_range(value: object, low: object, high: object) -> str:
    return f"{value} is not within {low} .. {high}"


class _Whole(Field):
    def __init__(self, name: str, letter: str, low: int, high: int, listed: tuple[int, ...], zero: bool) -> None:
        super().__init__(name)
        self.low, self.high, self.listed, self.zero = low, high, listed, zero
        self.fixed_bytes = struct.calcsize("<" + letter)

    def fault(self, value: int) -> str:
        """Why the value is not allowed; empty: it is."""
        if self.listed and value not in self.listed:
            return f"{value} is none of {', '.join(map(str, self.listed))}"
        if not self.low <= value <= self.high and not (self.zero and value == 0):
            return _out_of_range(value, self.low, self.high)
        return ""

    def encode(self, value: Any, out: bytearray, path: str) -> None:
        try:
            number = int(value)
        except (TypeError, ValueError):
            raise InvalidValue(f"{value!r} is no whole number", field=path) from None
        if number != value or (fault := self.fault(number)):
            raise InvalidValue(fault if number == value else f"{value!r} is no whole number", field=path)
        out += number.to_bytes(self.fixed_bytes, "little")

    def decode(self, reader: Reader, path: str) -> int:
        value = int.from_bytes(reader.take(self.fixed_bytes, path), "little")
        if fault := self.fault(value):
            raise ProtocolError(fault, field=path)
        return value


class _Choice(Field):
    fixed_bytes = 4

    def __init__(self, name: str, words: type[Word]) -> None:
        super().__init__(name)
        self.words = words

    def encode(self, value: Any, out: bytearray, path: str) -> None:
        try:
            out += int(self.words.of(value)).to_bytes(4, "little")
        except ValueError as why:
            raise InvalidValue(str(why), field=path) from None

    def decode(self, reader: Reader, path: str) -> Word:
        value = int.from_bytes(reader.take(4, path), "little")
        try:
            return self.words(value)
        except ValueError:
            raise ProtocolError(f"{value} is no value of {self.words.__name__}", field=path) from None


def _as_f32(value: float) -> float:
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


class _Real(Field):
    """An f32, or a fixed number of them."""

    def __init__(self, name: str, low: float, high: float, count: int, zero: bool) -> None:
        super().__init__(name)
        self.low, self.high, self.count, self.zero = _as_f32(low), _as_f32(high), count, zero
        self.form = struct.Struct(f"<{max(count, 1)}f")
        self.fixed_bytes = self.form.size

    def check(self, values: Sequence[float], path: str, kind: type[Error]) -> None:
        """NaN is outside every range."""
        for i, value in enumerate(values):
            if not self.low <= value <= self.high and not (self.zero and value == 0):
                raise kind(_out_of_range(value, self.low, self.high), field=f"{path}[{i}]" if self.count else path)

    def encode(self, value: Any, out: bytearray, path: str) -> None:
        try:
            values = [float(one) for one in value] if self.count else [float(value)]
        except (TypeError, ValueError):
            raise InvalidValue(f"{value!r} is no number" if not self.count else f"{value!r} are no numbers",
                               field=path) from None
        if self.count and len(values) != self.count:
            raise InvalidValue(f"{len(values)} numbers where {self.count} belong", field=path)
        try:
            packed = self.form.pack(*values)
        except OverflowError:
            raise InvalidValue("a number is too large", field=path) from None
        self.check(self.form.unpack(packed), path, InvalidValue)
        out += packed

    def decode(self, reader: Reader, path: str) -> Any:
        values = self.form.unpack(reader.take(self.form.size, path))
        self.check(values, path, ProtocolError)
        return values if self.count else values[0]


class _Exactly(Field):
    def __init__(self, name: str, count: int) -> None:
        super().__init__(name)
        self.fixed_bytes = count

    def encode(self, value: Any, out: bytearray, path: str) -> None:
        if not isinstance(value, (bytes, bytearray, memoryview)):
            raise InvalidValue(f"{value!r:.80} are no bytes", field=path)
        if len(value) != self.fixed_bytes:
            raise InvalidValue(f"{len(value)} bytes where {self.fixed_bytes} belong", field=path)
        out += value

    def decode(self, reader: Reader, path: str) -> bytes:
        return bytes(reader.take(self.fixed_bytes, path))


class _Text(Field):
    def __init__(self, name: str, maximum: int) -> None:
        super().__init__(name)
        self.maximum = maximum

    def encode(self, value: Any, out: bytearray, path: str) -> None:
        if not isinstance(value, str):
            raise InvalidValue(f"{value!r} is no text", field=path)
        data = value.encode("utf-8", "surrogatepass")
        if len(data) > self.maximum or b"\0" in data or not _is_utf8(data):
            raise InvalidValue(f"{value!r} is not at most {self.maximum} bytes of UTF-8 without NUL", field=path)
        out += len(data).to_bytes(4, "little") + data

    def decode(self, reader: Reader, path: str) -> str:
        data = bytes(reader.take(reader.count(self.maximum, path), path))
        if b"\0" in data or not _is_utf8(data):
            raise ProtocolError("is no UTF-8 without NUL", field=path)
        return data.decode()


def _is_utf8(data: bytes) -> bool:
    try:
        data.decode()
    except UnicodeDecodeError:
        return False
    return True


class _Nested(Field):
    """A record in a message, whose class has the record's fields as its own attributes: u16 bytes, then the fields."""

    def __init__(self, name: str, record: type[Record]) -> None:
        super().__init__(name)
        self.fields = record.FIELDS
        self.record_bytes = sum(field.fixed_bytes for field in self.fields)
        self.fixed_bytes = 2 + self.record_bytes

    def encode_of(self, holder: Record, out: bytearray, path: str) -> None:
        out += self.record_bytes.to_bytes(2, "little")
        for field in self.fields:
            field.encode_of(holder, out, path)  # the caller knows attributes

    def decode_into(self, values: dict[str, Any], reader: Reader, path: str) -> None:
        _decode_fixed(values, reader, self.fields, f"{path}.{self.wire_name}")


class _Array(Field):
    def __init__(self, name: str, record: type[Record], maximum: int) -> None:
        super().__init__(name)
        self.record, self.maximum = record, maximum
        self.record_bytes = sum(field.fixed_bytes or field.least_bytes for field in record.FIELDS)

    def encode(self, value: Any, out: bytearray, path: str) -> None:
        if not isinstance(value, (list, tuple)):
            raise InvalidValue(f"{value!r:.80} is no list of {self.record.__name__}", field=path)
        if len(value) > self.maximum:
            raise InvalidValue(f"{len(value)} of them where {self.maximum} are allowed", field=path)
        out += len(value).to_bytes(4, "little")
        for i, one in enumerate(value):
            if not isinstance(one, self.record):
                raise InvalidValue(f"{one!r} is no {self.record.__name__}", field=f"{path}[{i}]")
            for field in self.record.FIELDS:
                field.encode_of(one, out, f"{path}[{i}]")

    def decode(self, reader: Reader, path: str) -> list[Record]:
        count = reader.count(self.maximum, path)
        if count * self.record_bytes > reader.left():
            raise ProtocolError(f"{count} elements where {reader.left()} bytes are left", field=path)
        return [self.record(**{field.name: field.decode(reader, f"{path}[{i}].{field.wire_name}")
                               for field in self.record.FIELDS}) for i in range(count)]


class _Bulk(Field):
    """Bulk data, aligned to 8 bytes within the payload."""

    def __init__(self, name: str, maximum: int) -> None:
        super().__init__(name)
        self.maximum = maximum

    def encode(self, value: Any, out: bytearray, path: str) -> None:
        if len(value) > self.maximum:
            raise InvalidValue(f"{len(value)} bytes where {self.maximum} are allowed", field=path)
        out += len(value).to_bytes(4, "little")
        out += bytes(-len(out) % 8)
        out += value

    def decode(self, reader: Reader, path: str) -> memoryview:
        count = reader.count(self.maximum, path)
        if any(reader.take(-reader.at % 8, path)):
            raise ProtocolError("padding is not zero", field=path)
        return reader.take(count, path)


def whole(name: str, letter: str, low: int, high: int, listed: tuple[int, ...] = (), zero: bool = False) -> Field:
    """Describes a u8 .. u64; `zero`: 0 stands for a default, whatever the range."""
    return _Whole(name, letter, low, high, listed, zero)


def choice(name: str, words: type[Word]) -> Field:
    """Describes a value of an enumeration."""
    return _Choice(name, words)


def real(name: str, low: float, high: float, count: int = 0, zero: bool = False) -> Field:
    """Describes an f32, or `count` of them."""
    return _Real(name, low, high, count, zero)


def exactly(name: str, count: int) -> Field:
    """Describes `count` bytes."""
    return _Exactly(name, count)


def text(name: str, maximum: int) -> Field:
    """Describes UTF-8 without NUL."""
    return _Text(name, maximum)


def nested(name: str, record: type[Record]) -> Field:
    """One record."""
    return _Nested(name, record)


def array(name: str, record: type[Record], maximum: int) -> Field:
    """Describes an array of at most `maximum` records."""
    return _Array(name, record, maximum)


def bulk(name: str, maximum: int) -> Field:
    """Describes at most `maximum` bytes, decoded as a view into the payload."""
    return _Bulk(name, maximum)


def payload_max_bytes(kind: type[Message]) -> int:
    """Maximum payload of a message of this kind."""
    return BULK_MAX_BYTES if any(isinstance(field, _Bulk) for field in kind.FIELDS) else CONTROL_MAX_BYTES


def encode(message: Message) -> bytes:
    """Encodes the payload; InvalidValue names the field."""
    out = bytearray(2)
    fixed_bytes = sum(field.fixed_bytes for field in message.FIELDS)
    out[:] = fixed_bytes.to_bytes(2, "little")
    for field in message.FIELDS:
        field.encode_of(message, out, message.NAME)
    if len(out) > payload_max_bytes(type(message)):
        raise InvalidValue(f"{len(out)} bytes, at most {payload_max_bytes(type(message))} can be sent",
                           field=message.NAME)
    return bytes(out)


def _decode_fixed(values: dict[str, Any], reader: Reader, fields: tuple[Field, ...], path: str) -> None:
    """The fixed fields that are there, behind a u16 of their bytes."""
    size = int.from_bytes(reader.take(2, f"{path}.struct_bytes"), "little")
    fixed = Reader(reader.take(size, f"{path}.struct_bytes"))
    for field in fields:
        if field.fixed_bytes and fixed.left():
            field.decode_into(values, fixed, path)


def decode(kind: type[Message], payload: Bytes) -> Message:
    """Decodes a payload; ProtocolError names the field."""
    reader = Reader(payload)
    values: dict[str, Any] = {}
    _decode_fixed(values, reader, kind.FIELDS, kind.NAME)
    for field in kind.FIELDS:
        if not field.fixed_bytes:
            field.decode_into(values, reader, kind.NAME)
    if reader.left():
        raise ProtocolError(f"{reader.left()} bytes too many", field=kind.NAME)
    return kind(**values)
