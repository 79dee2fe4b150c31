# SPDX-License-Identifier: MIT
"""A connection without I/O: bytes in, bytes out, no socket and no clock. It does not trust the peer: every fault is stored
in `failure`, which all operations raise.

Operations with several steps are generators: they yield while they wait for something to arrive or to be sent, and return
their result. Several may wait at once.
"""
from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any, TypeVar

from . import framing, handshake, messages
from .errors import Cancelled, ConnectionLost, Error, InvalidValue, ProtocolError, Refused
from .fields import Bytes, Message
from .jobs import Job, Pending
from .messages import ErrorCode
from .sealed import Seal

T = TypeVar("T")
Operation = Generator[None, None, T]

UPLOAD_CHANNEL = 1
QUEUED_BYTES = 4 << 20  # bytes that may be queued before an operation waits
STATES_CHANGE = (ErrorCode.SHUTTING_DOWN, ErrorCode.DEVICE_LOST, ErrorCode.BUSY)


def refused(error: messages.Error) -> Refused:
    """Converts an error message to an exception."""
    kind = Cancelled if error.code == ErrorCode.CANCELLED else Refused
    code = ErrorCode(int(error.code))
    return kind(error.text or code.word, code=code, field=error.field, remedy=error.remedy,
                retryable=bool(error.retryable) or code in STATES_CHANGE, retry_after_s=error.retry_after_ms / 1000)


class Connection:
    """A connection from the handshake to the goodbye: messages, requests and their answers, frames of jobs."""

    def __init__(self, name: str, key: bytes | None) -> None:
        self._in, self._out = bytearray(), bytearray()
        self._seal = Seal(key) if key else None
        self._is_greeted = False
        self.failure: Error | None = None
        self.limits: dict[str, int] = {}
        self.daemon = ""
        self._changes: dict[int, int] = {}  # scene -> revision of another client's last change
        self._pending: dict[int, Pending] = {}
        self._jobs: dict[int, Job] = {}
        self._request = self._scene_number = 0
        self._credit = 0  # total of blob bytes that may be sent
        self._out += handshake.hello(name)

    # ---- bytes

    def unsent(self) -> Bytes:
        """The bytes to send now."""
        if self._seal is None:
            return self._out
        if self._out and self._seal.may_seal:
            self._seal.seal(self._out)
            self._out.clear()
        return self._seal.out

    def sent(self, count: int) -> None:
        """Removes bytes of unsent() that were sent."""
        del (self._out if self._seal is None else self._seal.out)[:count]

    def receive(self, data: Bytes) -> None:
        """Processes received bytes; empty: the other side has closed."""
        if self.failure is not None:
            return
        try:
            if not data:
                self._ended()
            self._in += self._seal.receive(data) if self._seal else data
            while self._take_one():
                pass
        except Error as why:
            self.fail(why)

    def fail(self, why: Error) -> None:
        """Drops the connection."""
        if self.failure is None:
            self.failure = why

    def _ended(self) -> None:
        if self._seal is not None:
            self._seal.check_end()
        raise ConnectionLost("the daemon closed the connection" + " in the middle of a message" * bool(self._in))

    def _send(self, message: Message, request: int = 0, channel: int = 0) -> None:
        self._out += framing.pack(message, request, channel)

    def _take_one(self) -> bool:
        """Handles a message; False: there is no whole one."""
        if not self._is_greeted:
            return self._take_reply()
        received = framing.cut(self._in, ("server", "both"))
        if received is not None:
            self._dispatch(*received)
        return received is not None

    # ---- handshake

    def _take_reply(self) -> bool:
        reply = handshake.parse(self._in)
        if reply is not None:
            self.limits, self.daemon = reply.limits, reply.daemon
            del self._in[:reply.size]
            self._is_greeted = True
        return reply is not None

    def greet(self) -> Operation[None]:
        """Waits for the end of the handshake."""
        return self._until(lambda: self._is_greeted)

    # ---- messages that come

    def _dispatch(self, message: Message, request: int, channel: int) -> None:
        if isinstance(message, messages.Ping):
            self._send(messages.Pong(message.sent_ns), request)
        elif isinstance(message, messages.Credit):
            if message.channel == UPLOAD_CHANNEL:
                self._credit = max(self._credit, message.total)
        elif isinstance(message, messages.Blocked):
            pass
        elif isinstance(message, messages.SceneChanged):
            if message.scene <= self._scene_number:
                self._changes[message.scene] = message.revision
        elif isinstance(message, messages.Goodbye):
            raise ConnectionLost(f"the daemon ended the connection: {message.text or messages.ErrorCode(int(message.code)).word}",
                                 retryable=message.code == ErrorCode.SHUTTING_DOWN or message.code == ErrorCode.TIMEOUT)
        elif isinstance(message, messages.Error) and request == 0:
            raise refused(message)
        elif isinstance(message, (messages.FrameBegin, messages.FrameData, messages.FrameEnd)):
            self._take_frame(message, request, channel)
        else:
            self._take_answer(message, request)

    def _take_frame(self, message: Message, request: int, channel: int) -> None:
        job = self._jobs.get(channel)
        if job is None or job.request != request:
            raise ProtocolError(f"channel {channel} and request {request} are no job's", field=message.NAME)
        frame = job.take(message)
        if job.is_abandoned:
            return
        if job.is_view and isinstance(message, messages.FrameBegin):
            self._send(messages.FrameAck(channel, message.frame, 0, 0))
        if frame is not None:
            if job.is_view:
                self._send(messages.FrameAck(channel, frame.number, 1, 0))
            job.frames.append(frame)

    def _take_answer(self, message: Message, request: int) -> None:
        pending = self._pending.get(request)
        if pending is None:
            raise ProtocolError(f"request {request} was not made, or has been answered", field=message.NAME)
        if isinstance(message, (messages.Error, *pending.finals)):
            pending.answer = message
            del self._pending[request]
            for channel in [channel for channel, job in self._jobs.items() if job.request == request]:
                del self._jobs[channel]
        elif pending.extra is not None and isinstance(message, pending.extra) and pending.came is None:
            pending.came = message
        else:
            raise ProtocolError(f"is no answer to request {request}", field=message.NAME)

    # ---- requests

    def _until(self, ready: Callable[[], bool]) -> Operation[None]:
        while not ready():
            if self.failure is not None:
                raise self.failure
            yield
        if self.failure is not None:
            raise self.failure

    def _begin(self, finals: tuple[type[Message], ...], extra: type[Message] | None = None) -> tuple[int, Pending]:
        if self.failure is not None:
            raise self.failure
        self._request = self._request % 0xffffffff + 1
        pending = self._pending[self._request] = Pending(finals, extra)
        return self._request, pending

    def _has_room(self) -> bool:
        """True if another request may be sent; the last one in flight is reserved for a cancel."""
        return len(self._pending) < max(self.limits.get("requests_in_flight") or 64, 2) - 1 and self._has_space()

    def _has_space(self) -> bool:
        return len(self._out) + (len(self._seal.out) if self._seal else 0) < QUEUED_BYTES

    def _answer(self, pending: Pending) -> Operation[Message]:
        yield from self._until(lambda: pending.answer is not None)
        assert pending.answer is not None
        if isinstance(pending.answer, messages.Error):
            raise refused(pending.answer)
        return pending.answer

    def ask(self, message: Message, answer: type[Message] = messages.Ok,
            extra: type[Message] | None = None) -> Operation[tuple[Any, Any]]:
        """Sends a request; returns its answer, and the message before it."""
        if not isinstance(message, Message) or message.SENDER not in ("client", "both"):
            raise InvalidValue(f"{message!r:.80} is no message of a client", field="message")
        framing.pack(message)  # checks the message before anything is sent
        yield from self._until(self._has_room)
        request, pending = self._begin((answer,), extra)
        self._send(message, request)
        return (yield from self._answer(pending)), pending.came

    def ping(self) -> None:
        """Sends a ping."""
        if self._is_greeted and self.failure is None and self._has_room():
            request, _ = self._begin((messages.Pong,))
            self._send(messages.Ping(0), request)

    def leave(self) -> None:
        """Says goodbye; the connection ignores everything after that."""
        if self._is_greeted and self.failure is None:
            self._send(messages.Goodbye(ErrorCode.NONE, ""))
            self.unsent()
            if self._seal is not None and self._seal.may_seal:
                self._seal.seal(b"")
        self.fail(ConnectionLost("the connection was closed here", retryable=False))
