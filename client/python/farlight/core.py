# SPDX-License-Identifier: MIT
"""A connection without I/O: bytes in, bytes out, no socket and no clock. The plain and the asyncio clients drive it.

What takes more than one step is an operation, a generator: it yields where it waits for something to arrive or to be
sent, and returns its result. Several may wait at once. The core believes nothing that comes: every failure ends up in
`failure`, which all operations raise.
"""
from __future__ import annotations

import collections
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from . import fields, framing, handshake, messages
from .errors import Cancelled, ConnectionLost, Error, InvalidValue, ProtocolError, Refused
from .fields import Bytes, Message
from .frame import Frame
from .jobs import Job, Pending
from .messages import ErrorCode
from .scene import Scene, Sharing
from .sealed import Seal

T = TypeVar("T")
Operation = Generator[None, None, T]

UPLOAD_CHANNEL, PIECE_BYTES = 1, 262144
QUEUED_BYTES = 4 << 20  # that may wait to be sent before an operation waits
OFFER_BLOBS = 1024
BLOBS_IN_FLIGHT = 16
FRAMES_AHEAD = 2
STATES_CHANGE = (ErrorCode.SHUTTING_DOWN, ErrorCode.DEVICE_LOST, ErrorCode.BUSY)


def refused(error: messages.Error) -> Refused:
    """The exception of a message."""
    kind = Cancelled if error.code == ErrorCode.CANCELLED else Refused
    code = ErrorCode(int(error.code))
    return kind(error.text or code.word, code=code, field=error.field, remedy=error.remedy,
                retryable=bool(error.retryable) or code in STATES_CHANGE, retry_after_s=error.retry_after_ms / 1000)


@dataclass
class SceneState:
    """What the daemon has of a scene."""
    scene: int = 0  # identifier on this connection; 0: not opened yet
    version: int = 0  # Scene.version that was committed
    revision: int = 0
    is_busy: bool = False


class Core:
    """One connection. `lost`: the previous one's core, whose scenes may still linger at the daemon."""

    def __init__(self, name: str = "python", key: bytes | None = None, lost: Core | None = None) -> None:
        self._in, self._out = bytearray(), bytearray()
        self._seal = Seal(key) if key else None
        self._is_greeted = False
        self.failure: Error | None = None
        self.limits: dict[str, int] = {}
        self.capabilities = 0
        self.daemon = ""
        self._changes: dict[int, int] = {}  # scene -> revision of another client's last change
        self._pending: dict[int, Pending] = {}
        self._jobs: dict[int, Job] = {}
        self._request, self._channel, self._scene_number = 0, UPLOAD_CHANNEL, 0
        self._credit = self._uploaded = 0
        self._held: set[bytes] = set()
        self._is_uploading = False
        self._scenes: dict[Scene, SceneState] = {}
        self._before: dict[Scene, SceneState] = {**lost._before, **lost._scenes} if lost else {}
        self._out += handshake.hello(name)

    # ---- bytes

    def unsent(self) -> Bytes:
        """What is to be sent now."""
        if self._seal is None:
            return self._out
        if self._out and self._seal.may_seal:
            self._seal.seal(self._out)
            self._out.clear()
        return self._seal.out

    def sent(self, count: int) -> None:
        """So many bytes of unsent() were."""
        del (self._out if self._seal is None else self._seal.out)[:count]

    def receive(self, data: Bytes) -> None:
        """Takes what came; empty: the other side has closed."""
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
        """Gives the connection up."""
        if self.failure is None:
            self.failure = why

    def _ended(self) -> None:
        if self._seal is not None:
            self._seal.check_end()
        raise ConnectionLost("the daemon closed the connection" + " in the middle of a message" * bool(self._in))

    def _send(self, message: Message, request: int = 0, channel: int = 0) -> None:
        self._out += framing.pack(message, request, channel)

    def _take_one(self) -> bool:
        """False: there is no whole message."""
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
            self.limits, self.capabilities, self.daemon = reply.limits, reply.capabilities, reply.daemon
            del self._in[:reply.size]
            self._is_greeted = True
        return reply is not None

    def greet(self) -> Operation[None]:
        """Until the handshake is done."""
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
        """Of the requests that may be in flight one is left for a cancel."""
        return len(self._pending) < max(self.limits.get("requests_in_flight") or 64, 2) - 1 and self._has_space()

    def _has_space(self) -> bool:
        return len(self._out) < QUEUED_BYTES

    def _answer(self, pending: Pending) -> Operation[Message]:
        yield from self._until(lambda: pending.answer is not None)
        assert pending.answer is not None
        if isinstance(pending.answer, messages.Error):
            raise refused(pending.answer)
        return pending.answer

    def ask(self, message: Message, answer: type[Message] = messages.Ok,
            extra: type[Message] | None = None) -> Operation[tuple[Any, Any]]:
        """Sends a request; its answer, and what came before it."""
        yield from self._until(self._has_room)
        request, pending = self._begin((answer,), extra)
        try:
            self._send(message, request)
        except InvalidValue:
            del self._pending[request]
            raise
        return (yield from self._answer(pending)), pending.came

    def ping(self) -> None:
        """Asks for a sign of life."""
        if self._is_greeted and self.failure is None and self._has_room():
            request, _ = self._begin((messages.Pong,))
            self._send(messages.Ping(0), request)

    def leave(self) -> None:
        """Says goodbye; the connection takes nothing more."""
        if self._is_greeted and self.failure is None:
            self._send(messages.Goodbye(ErrorCode.NONE, ""))
            self.unsent()
            if self._seal is not None and self._seal.may_seal:
                self._seal.seal(b"")
        self.fail(ConnectionLost("the connection was closed here", retryable=False))

    # ---- scenes

    def _upload(self, blobs: dict[bytes, Bytes]) -> Operation[None]:
        yield from self._until(lambda: not self._is_uploading)  # another scene may have the same blobs
        self._is_uploading = True
        try:
            yield from self._upload_what_lacks(blobs)
        finally:
            self._is_uploading = False

    def _upload_what_lacks(self, blobs: dict[bytes, Bytes]) -> Operation[None]:
        names = [name for name in blobs if name not in self._held]
        for at in range(0, len(names), OFFER_BLOBS):
            part = names[at:at + OFFER_BLOBS]
            offer = messages.BlobOffer([messages.BlobRef(len(blobs[name]), name) for name in part])
            need, _ = yield from self.ask(offer, messages.BlobNeed)
            wanted = [one.index for one in need.needed]
            if any(index >= len(part) for index in wanted) or len(set(wanted)) != len(wanted):
                self.fail(ProtocolError("names blobs that were not offered", field="blob_need.needed"))
            yield from self._send_blobs([(part[index], blobs[part[index]]) for index in wanted if index < len(part)])
            self._held.update(part)

    def _send_blobs(self, wanted: Sequence[tuple[bytes, Bytes]]) -> Operation[None]:
        on_way: collections.deque[Pending] = collections.deque()
        for name, data in wanted:
            if len(on_way) >= BLOBS_IN_FLIGHT:
                yield from self._answer(on_way.popleft())
            yield from self._until(self._has_room)
            request, pending = self._begin((messages.Ok,))
            on_way.append(pending)
            try:
                yield from self._send_pieces(name, data, request, pending)
            except GeneratorExit:
                self.fail(ConnectionLost("an upload was left in its middle"))
                raise
        for pending in on_way:
            yield from self._answer(pending)

    def _send_pieces(self, name: bytes, data: Bytes, request: int, pending: Pending) -> Operation[None]:
        view = memoryview(data).cast("B")
        for offset in range(0, len(view), PIECE_BYTES):
            piece = view[offset:offset + PIECE_BYTES]
            yield from self._until(lambda: pending.answer is not None or (
                self._has_space() and self._credit - self._uploaded >= len(piece)))
            if pending.answer is not None:
                return
            self._send(messages.BlobData(offset, name, piece), request, UPLOAD_CHANNEL)
            self._uploaded += len(piece)

    def _open(self, scene: Scene, state: SceneState) -> Operation[None]:
        self._scene_number += 1
        number, before = self._scene_number, self._before.pop(scene, None)
        is_other = scene.is_attached
        if is_other or (before is not None and before.scene and scene.sharing != Sharing.PRIVATE):
            try:
                answer, _ = yield from self.ask(messages.SceneAttach(number, scene.name))
                state.revision = answer.revision
                # It has not changed since: it has all that was sent.
                state.version = before.version if before and before.revision == answer.revision else 0
                state.scene = number
                return
            except Refused as why:
                if is_other or why.code != ErrorCode.UNKNOWN_ID:
                    raise
                self._scene_number += 1
                number = self._scene_number
        yield from self.ask(messages.SceneOpen(number, scene.sharing, scene.name))
        state.scene = number

    def open(self, scene: Scene) -> Operation[SceneState]:
        """The scene as the daemon has it, opened or attached to."""
        state = self._scenes.setdefault(scene, SceneState())
        yield from self._until(lambda: not state.is_busy)
        if not state.scene:
            state.is_busy = True
            try:
                yield from self._open(scene, state)
            finally:
                state.is_busy = False
        return state

    def _transact(self, begin: messages.EditBegin, edits: Sequence[tuple[int, bytes]]) -> Operation[messages.Ok]:
        yield from self._until(self._has_room)
        request, pending = self._begin((messages.Ok,))
        self._send(begin, request)
        try:
            for kind, payload in edits:
                if not self._has_space():
                    yield from self._until(lambda: self._has_space() or pending.answer is not None)
                self._out += framing.wrap(kind, payload, request)
        except GeneratorExit:
            self.fail(ConnectionLost("a transaction was left in its middle"))
            raise
        self._send(messages.EditCommit(), request)
        answer = yield from self._answer(pending)
        assert isinstance(answer, messages.Ok)
        return answer

    def commit(self, scene: Scene, base_revision: int = 0) -> Operation[int]:
        """Sends what has changed in the scene since the last time; its revision."""
        state = yield from self.open(scene)
        yield from self._until(lambda: not state.is_busy)
        if state.version == scene.version:
            return state.revision
        state.is_busy = True
        try:
            version, edits = scene.version, scene.edits_since(state.version)
            payloads = [(edit.TYPE, fields.encode(edit)) for edit in edits]  # all are valid before the first is sent
            yield from self._upload(scene.blobs_of(edits))
            answer = yield from self._transact(messages.EditBegin(state.scene, base_revision), payloads)
            state.revision, state.version = answer.revision, version
        finally:
            state.is_busy = False
        return state.revision

    def close_scene(self, scene: Scene) -> Operation[None]:
        """Releases it; what ends with it ends."""
        state = self._scenes.pop(scene, None)
        if state is not None and state.scene:
            yield from self.ask(messages.SceneClose(state.scene))

    def changed(self, scene: Scene) -> int:
        """The revision of others' last change."""
        state = self._scenes.get(scene)
        return self._changes.get(state.scene, 0) if state else 0

    def _check_reads_objects(self) -> None:
        if not self.capabilities & handshake.CAN_READ_OBJECTS:
            raise Refused("the daemon is too old to tell of its objects", code=ErrorCode.UNSUPPORTED)

    def read(self, scene: Scene, kind: messages.ObjectKind, number: int) -> Operation[tuple[Message, int]]:
        """An object as the daemon has it, and the scene's revision."""
        state = yield from self.open(scene)
        self._check_reads_objects()
        extra = {messages.ObjectKind.NODE: messages.SetNode, messages.ObjectKind.MATERIAL: messages.SetMaterial,
                 messages.ObjectKind.LIGHT: messages.SetLight, messages.ObjectKind.CAMERA: messages.SetCamera}.get(kind)
        if extra is None:
            raise InvalidValue("only nodes, materials, lights and cameras can be read", field="object_get.kind")
        answer, came = yield from self.ask(messages.ObjectGet(state.scene, kind, number), extra=extra)
        if came is None:
            self.fail(ProtocolError("the object did not come", field="object_get"))
            raise ProtocolError("the object did not come", field="object_get")
        return came, answer.revision

    def objects(self, scene: Scene, kind: messages.ObjectKind | str,
                name: str) -> Operation[list[messages.ObjectEntry]]:
        """Those of a kind, or those of a name."""
        state = yield from self.open(scene)
        self._check_reads_objects()
        found: list[messages.ObjectEntry] = []
        at = 0
        while True:
            reply, _ = yield from self.ask(messages.SceneObjects(state.scene, kind, 0, at, name),
                                           messages.SceneObjectsReply)
            found += reply.objects
            if reply.next == 0 or len(found) > reply.total:
                return found
            at = reply.next

    def describe(self, scene: Scene) -> Operation[messages.SceneDescription]:
        """Bounds, cameras and clips."""
        state = yield from self.open(scene)
        answer, _ = yield from self.ask(messages.SceneDescribe(state.scene), messages.SceneDescription)
        assert isinstance(answer, messages.SceneDescription)
        return answer

    # ---- jobs

    def _start(self, render: messages.Render) -> Operation[Job]:
        most = self.limits.get("views_per_client") or 4
        yield from self._until(lambda: self._has_room() and (
            len(self._jobs) < most or all(job.is_view for job in self._jobs.values())))
        self._channel += 1
        render.channel = self._channel
        if not self.capabilities & handshake.CAN_CHOOSE_PRIMARY and render.primary in ("auto", messages.Primary.AUTO):
            is_reference = render.tracer in ("reference", messages.Tracer.REFERENCE)
            render.primary = messages.Primary.TRACE if is_reference else messages.Primary.RASTER
        fields.encode(render)
        request, pending = self._begin((messages.Ok,))
        # With the words as values, to compare what comes.
        plain = fields.decode(messages.Render, fields.encode(render))
        assert isinstance(plain, messages.Render)
        job = self._jobs[self._channel] = Job(request, self._channel, plain, pending, plain.credit)
        self._send(render, request)
        return job

    def hand_out(self, job: Job) -> Frame | None:
        """The next frame that is there; another one may come for it."""
        if not job.frames:
            return None
        if self.failure is None and job.pending.answer is None:
            job.credit += 1
            self._send(messages.Credit(job.channel, job.credit))
        return job.frames.popleft()

    def abandon(self, job: Job) -> None:
        """Ends a job without waiting for it."""
        job.is_abandoned = True
        job.frames.clear()
        job.data = bytearray()
        if self.failure is None and job.pending.answer is None:
            request, _ = self._begin((messages.Ok,))
            self._send(messages.Cancel(job.request), request)

    def _render_of(self, scene: Scene, render: messages.Render) -> Operation[Job]:
        yield from self.commit(scene)
        render.scene = self._scenes[scene].scene
        return (yield from self._start(render))

    def batch(self, scene: Scene, render: messages.Render) -> Generator[Frame | None, None, None]:
        """Commits the scene; then the frames of a batch. None: nothing has come yet."""
        render.credit = FRAMES_AHEAD
        job = yield from self._render_of(scene, render)
        try:
            while True:
                frame = self.hand_out(job)
                if frame is not None:
                    yield frame
                elif job.pending.answer is None:
                    if self.failure is not None:
                        raise self.failure
                    yield None
                elif isinstance(job.pending.answer, messages.Error):
                    raise refused(job.pending.answer)
                else:
                    return
        finally:
            self.abandon(job)

    def view(self, scene: Scene, render: messages.Render) -> Operation[Job]:
        """Begins a view."""
        render.credit = FRAMES_AHEAD
        return (yield from self._render_of(scene, render))

    def look(self, job: Job, camera: messages.ViewCamera) -> int:
        """Moves a view's camera; the number by which frames name it."""
        if self.failure is not None:
            raise self.failure
        camera.channel, camera.command = job.channel, job.command + 1
        self._send(camera)
        job.command += 1
        return job.command

    def next_frame(self, job: Job) -> Operation[Frame]:
        """Of a view; raises where the view has ended."""
        yield from self._until(lambda: bool(job.frames) or job.pending.answer is not None)
        frame = self.hand_out(job)
        if frame is not None:
            return frame
        if isinstance(job.pending.answer, messages.Error):
            raise refused(job.pending.answer)
        raise ConnectionLost("the view has ended", retryable=False)

    def cancel(self, job: Job) -> Operation[None]:
        """Ends a job, and waits for its end."""
        if job.pending.answer is None:
            self.abandon(job)
            yield from self._until(lambda: job.pending.answer is not None)
