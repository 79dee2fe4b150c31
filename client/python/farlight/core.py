# SPDX-License-Identifier: MIT
"""Operations of a client on a connection: scenes, their blobs and edits, jobs and their frames. The plain and the asyncio
client drive it."""
from __future__ import annotations

import collections
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass

from . import fields, framing, messages
from .connection import UPLOAD_CHANNEL, Connection, Operation, refused
from .errors import ConnectionLost, InvalidValue, ProtocolError, Refused
from .fields import Bytes, Message
from .frame import Frame
from .jobs import Job, Pending
from .messages import ErrorCode, Layer, ObjectKind, Sharing
from .objects import Names, Object
from .scene import Scene

PIECE_BYTES = 262144
OFFER_BLOBS = 1024
BLOBS_IN_FLIGHT = 16
FRAMES_AHEAD = 2
READABLE: dict[ObjectKind, type[Message]] = {
    ObjectKind.NODE: messages.SetNode, ObjectKind.MATERIAL: messages.SetMaterial, ObjectKind.LIGHT: messages.SetLight,
    ObjectKind.CAMERA: messages.SetCamera, ObjectKind.ENVIRONMENT: messages.SetEnvironment,
}
Progress = Callable[[str, int, int], None]  # activity, bytes done, bytes in all


@dataclass
class SceneState:
    """The state of a scene at the daemon."""
    scene: int = 0  # identifier on this connection; 0: not opened yet
    version: int = 0  # Scene.version of the last commit
    revision: int = 0
    is_busy: bool = False


class Core(Connection):
    """The core of a client. `lost`: the previous connection's core, whose scenes may still linger at the daemon."""

    def __init__(self, name: str = "python", key: bytes | None = None, lost: Core | None = None,
                 progress: Progress | None = None, has_tasks: bool = False) -> None:
        super().__init__(name, key)
        self.has_tasks = has_tasks  # several tasks use the core at once
        self._channel = UPLOAD_CHANNEL
        self._uploaded = 0
        self._held: set[bytes] = set()
        self._is_uploading = False
        self._scenes: dict[Scene, SceneState] = {}
        self._before: dict[Scene, SceneState] = {**lost._before, **lost._scenes} if lost else {}
        self._progress = progress

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
            chosen = [(part[index], blobs[part[index]]) for index in wanted if index < len(part)]
            yield from self._send_blobs(chosen)
            self._held.update(part)

    def _send_blobs(self, wanted: Sequence[tuple[bytes, Bytes]]) -> Operation[None]:
        before, total = self._uploaded, sum(len(data) for _, data in wanted)
        on_way: collections.deque[Pending] = collections.deque()
        for name, data in wanted:
            if len(on_way) >= BLOBS_IN_FLIGHT:
                yield from self._answer(on_way.popleft())
            yield from self._until(self._has_room)
            request, pending = self._begin((messages.Ok,))
            on_way.append(pending)
            try:
                for _ in self._send_pieces(name, data, request, pending):
                    if self._progress is not None:
                        self._progress("sending", self._uploaded - before, total)
                    yield
            except BaseException:  # Ctrl-C may arrive at any place
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
                # An unchanged revision shows that the daemon has everything that was sent.
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
        """The scene's state at the daemon, opened or attached if necessary."""
        if not isinstance(scene, Scene):
            raise InvalidValue(f"{scene!r:.80} is no farlight.Scene", field="scene", remedy="farlight.load(FILE) makes one of a file")
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
            self._send(messages.EditCommit(), request)
        except BaseException:
            self.fail(ConnectionLost("a transaction was left in its middle"))
            raise
        answer = yield from self._answer(pending)
        assert isinstance(answer, messages.Ok)
        return answer

    def commit(self, scene: Scene, base_revision: int = 0) -> Operation[int]:
        """Sends the scene's changes since the last commit; returns its revision."""
        state = yield from self.open(scene)
        yield from self._until(lambda: not state.is_busy)
        scene.show_unplaced()
        if state.version == scene.version:
            return state.revision
        state.is_busy = True
        try:
            version, edits = scene.version, scene.edits_since(state.version)
            payloads = [(edit.TYPE, fields.encode(edit)) for edit in edits]  # checks all before the first is sent
            yield from self._upload(scene.blobs_of(edits))
            answer = yield from self._transact(messages.EditBegin(state.scene, base_revision), payloads)
            state.revision, state.version = answer.revision, version
        finally:
            state.is_busy = False
        return state.revision

    def close_scene(self, scene: Scene) -> Operation[None]:
        """Releases the scene, which ends its jobs."""
        state = self._scenes.pop(scene, None)
        if state is not None and state.scene:
            yield from self.ask(messages.SceneClose(state.scene))

    def changed(self, scene: Scene) -> int:
        """The revision of other clients' last change."""
        state = self._scenes.get(scene)
        return self._changes.get(state.scene, 0) if state else 0

    def read(self, scene: Scene, thing: Object) -> Operation[tuple[Message, int]]:
        """Reads an object at the daemon, and the scene's revision."""
        if not isinstance(thing, Object) or thing.kind not in READABLE:
            raise InvalidValue(f"{thing!r:.80} cannot be read; allowed: {', '.join(kind.word for kind in READABLE)}",
                               field="object")
        state = yield from self.open(scene)
        answer, came = yield from self.ask(messages.ObjectGet(state.scene, thing.kind, thing.number),
                                           extra=READABLE[thing.kind])
        if came is None:
            self.fail(ProtocolError("the answer has no object", field="object_get"))
            raise ProtocolError("the answer has no object", field="object_get")
        return came, answer.revision

    def objects(self, scene: Scene, kind: messages.ObjectKind | str,
                name: str) -> Operation[list[messages.ObjectEntry]]:
        """Lists objects of a kind, or of a name."""
        state = yield from self.open(scene)
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
        """Returns bounds, cameras and clips."""
        state = yield from self.open(scene)
        answer, _ = yield from self.ask(messages.SceneDescribe(state.scene), messages.SceneDescription)
        assert isinstance(answer, messages.SceneDescription)
        return answer

    # ---- jobs

    def _will_end(self, job: Job) -> bool:
        return job.is_abandoned or (self.has_tasks and not job.is_view)

    def _start(self, render: messages.Render) -> Operation[Job]:
        most = self.limits.get("views_per_client") or 4
        # If no other job is about to end, the daemon itself reports that there are too many.
        yield from self._until(lambda: self._has_room() and (
            len(self._jobs) < most or not any(self._will_end(job) for job in self._jobs.values())))
        self._channel += 1
        render.channel = self._channel
        fields.encode(render)
        request, pending = self._begin((messages.Ok,))
        # Words become values, for comparison with received messages.
        plain = fields.decode(messages.Render, fields.encode(render))
        assert isinstance(plain, messages.Render)
        job = self._jobs[self._channel] = Job(request, self._channel, plain, pending, plain.credit)
        self._send(render, request)
        return job

    def hand_out(self, job: Job) -> Frame | None:
        """Takes a frame out of the queue and grants credit for another one."""
        if not job.frames:
            return None
        if self.failure is None and job.pending.answer is None:
            job.credit += 1
            self._send(messages.Credit(job.channel, job.credit))
        return job.frames.popleft()

    def abandon(self, job: Job) -> None:
        """Cancels a job without waiting."""
        job.is_abandoned = True
        job.frames.clear()
        job.data = bytearray()
        if self.failure is None and job.pending.answer is None:
            request, _ = self._begin((messages.Ok,))
            self._send(messages.Cancel(job.request), request)

    def _render_of(self, scene: Scene, render: messages.Render) -> Operation[Job]:
        yield from self.commit(scene)
        render.scene = self._scenes[scene].scene
        known = (yield from self._names(scene)) if render.layers >> Layer.ID & 1 else None
        job = yield from self._start(render)
        job.known = known or job.known
        return job

    def _names(self, scene: Scene) -> Operation[Names]:
        if not scene.is_attached:
            return scene.names()
        nodes = yield from self.objects(scene, ObjectKind.NODE, "")
        return Names.of(nodes, (yield from self.objects(scene, ObjectKind.MATERIAL, "")))

    def batch(self, scene: Scene, render: messages.Render) -> Generator[Frame | None, None, None]:
        """Commits the scene, then yields the frames of a batch. None: no frame has arrived yet."""
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
        """Starts a view."""
        render.credit = FRAMES_AHEAD
        return (yield from self._render_of(scene, render))

    def set_camera(self, job: Job, camera: messages.ViewCamera) -> int:
        """Moves a view's camera; returns the number that frames carry."""
        if self.failure is not None:
            raise self.failure
        camera.channel, camera.command = job.channel, job.command + 1
        self._send(camera)
        job.command += 1
        return job.command

    def next_frame(self, job: Job) -> Operation[Frame]:
        """Waits for a frame of a view; raises if the view has ended."""
        yield from self._until(lambda: bool(job.frames) or job.pending.answer is not None)
        frame = self.hand_out(job)
        if frame is not None:
            return frame
        if isinstance(job.pending.answer, messages.Error):
            raise refused(job.pending.answer)
        raise ConnectionLost("the view has ended", retryable=False)

    def cancel(self, job: Job) -> Operation[None]:
        """Cancels a job, and waits for its end."""
        if job.pending.answer is None:
            self.abandon(job)
            yield from self._until(lambda: job.pending.answer is not None)
