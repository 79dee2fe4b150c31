# SPDX-License-Identifier: MIT
"""The plain client: each call returns when its work is done."""
from __future__ import annotations

import contextlib
import os
import selectors
import threading
import time
from collections.abc import Callable, Generator
from typing import Any, TypeVar

from . import address, messages
from .camera import Camera, CameraOf, command, one_frame, request
from .connection import Operation
from .core import Core, Progress
from .errors import ConnectionLost, Error, InvalidValue, Refused, TimedOut
from .fields import Message, takes
from .frame import Frame, LayersOf
from .jobs import Job
from .objects import Object
from .scene import Scene
from .sealed import read_key

T = TypeVar("T")

RECEIVE_BYTES = 1 << 20
SILENCE_S = 60.0  # a daemon answers pings at once, however long a frame takes
PAUSE_S, PAUSE_MAX_S = 0.25, 10.0  # between attempts


class Retry:
    """Decides how long, and at which intervals, to retry after a lost connection or a busy daemon."""

    def __init__(self, for_s: float) -> None:
        self.for_s, self.pause_s = for_s, PAUSE_S
        self.since: float | None = None

    def succeeded(self) -> None:
        """Treats the next failure as a new one."""
        self.since, self.pause_s = None, PAUSE_S

    def pause(self, why: Error) -> float:
        """Seconds to wait before the next attempt; raises `why` if there is none."""
        now = time.monotonic()
        self.since = now if self.since is None else self.since
        if not why.retryable or now - self.since >= self.for_s:
            raise why
        pause = max(self.pause_s, why.retry_after_s if isinstance(why, Refused) else 0)
        self.pause_s = min(2 * self.pause_s, PAUSE_MAX_S)
        return min(pause, self.since + self.for_s - now)


class Options:
    """Connection options of both clients."""

    def __init__(self, server: str | None, key_file: str | os.PathLike[str] | None, name: str, timeout: float,
                 retry_for: float, progress: Progress | None, has_tasks: bool = False) -> None:
        if server is not None and not isinstance(server, str):
            raise InvalidValue(f"{server!r:.80}; allowed: unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET]", field="server")
        for what, value, least in (("timeout", timeout, 1e-3), ("retry_for", retry_for, 0)):
            if not isinstance(value, (int, float)) or not least <= value < threading.TIMEOUT_MAX:
                raise InvalidValue(f"{value!r:.80}; allowed: seconds, at least {least:g}", field=what)
        self.server = server or address.usual_server()
        key_file = key_file or address.usual_key(self.server)
        self.key = read_key(key_file) if key_file and self.server else None
        self.name, self.timeout, self.retry_for, self.progress = name, timeout, retry_for, progress
        self.has_tasks = has_tasks

    def core(self, lost: Core | None) -> Core:
        """Makes the core of a new connection."""
        return Core(self.name, self.key, lost, self.progress, self.has_tasks)


class View:
    """A picture that follows a camera; a context manager."""

    def __init__(self, client: Client, job: Job) -> None:
        self._client, self._job, self._core = client, job, client._core

    def set_camera(self, camera: Camera, moving: bool = False, time_s: float = 0.0) -> int:
        """Moves the camera; returns the number that frames carry as begin.command. moving: more cameras will follow soon."""
        number = self._core.set_camera(self._job, command(camera, moving, time_s))
        self._client._flush()
        return number

    def next_frame(self) -> Frame:
        """Waits for the newest frame. No frame arrives while nothing changes and all samples are there."""
        return self._client._operate(self._core.next_frame(self._job))

    def close(self) -> None:
        """Ends the view."""
        if self._core.failure is None:
            self._client._operate(self._core.cancel(self._job))

    def __enter__(self) -> View:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Client:
    """A connection to a daemon; a context manager. Made by connect(). Not for several threads at once. A forked process, such
    as a data loader's, connects again at its first call."""

    def __init__(self, options: Options) -> None:
        self._options = options
        self._link: address.Link | None = None
        self._core: Core = options.core(None)
        self._selector = selectors.DefaultSelector()
        self._process = os.getpid()
        self._closed = False
        try:
            self._again(self._ensure)
        except BaseException:
            self.close()
            raise

    def __repr__(self) -> str:
        state = "closed" if self._closed else f"lost: {self._core.failure}" if self._core.failure else self._core.daemon
        return f"<farlight.Client of {self._options.server or 'a daemon of its own'}: {state}>"

    # ---- driving the core

    def _connect(self) -> None:
        self._drop()
        self._core = self._options.core(self._core)
        self._link = address.open_link(self._options.server, self._options.timeout)
        self._link.socket.setblocking(False)
        self._selector.register(self._link.socket, selectors.EVENT_READ)
        try:
            self._operate(self._core.greet(), self._options.timeout)
        except Error as why:
            address.explain(why, self._link)
            raise

    def _drop(self) -> None:
        if self._link is not None:
            self._selector.unregister(self._link.socket)
            self._link.close()
            self._link = None

    def _leave_parent(self) -> None:
        """Drops the connection in a forked process, as the parent continues to use it."""
        if self._process == os.getpid():
            return
        self._process = os.getpid()
        self._core.fail(ConnectionLost("the connection belongs to the process which forked this one", retryable=False))
        self._core = self._options.core(None)
        self._selector.close()
        self._selector = selectors.DefaultSelector()
        if self._link is not None:
            self._link.socket.close()  # says nothing to the daemon and does not end its program, which is the parent's
            self._link = None

    def _ensure(self) -> None:
        """Connects, and reconnects after a loss, noticed or not; a forked process gets its own connection."""
        if self._closed:
            raise ConnectionLost("the client is closed", retryable=False)
        self._leave_parent()
        if self._link is not None and self._core.failure is None:
            while self._receive() and self._core.failure is None:
                pass
        if self._link is None or self._core.failure is not None:
            self._connect()

    def _receive(self) -> bool:
        """Receives available bytes; False: there were none."""
        assert self._link is not None
        try:
            self._core.receive(self._link.socket.recv(RECEIVE_BYTES))
            return True
        except BlockingIOError:
            return False
        except OSError as why:
            self._core.fail(address.broken(why, self._link))
            return True

    def _flush(self) -> bool:
        """Sends what can be sent without waiting; returns whether that was anything."""
        assert self._link is not None
        has_sent = False
        try:
            while unsent := self._core.unsent():
                with memoryview(unsent) as view, view[:RECEIVE_BYTES] as part:
                    count = self._link.socket.send(part)
                self._core.sent(count)
                has_sent = True
        except BlockingIOError:
            pass
        except OSError as why:
            # The daemon may have sent a reason before it closed.
            while self._core.failure is None and self._receive():
                pass
            self._core.fail(address.broken(why, self._link))
            address.add_end(self._core.failure, self._link)
        return has_sent

    def _exchange(self, silence_s: float) -> None:
        """Sends, and waits until something has arrived or could be sent."""
        # Sent bytes free space, for which an upload may be waiting, so there is no need to wait for the daemon.
        if self._flush() or self._core.failure is not None:
            return
        assert self._link is not None
        quiet = 0
        while True:
            events = selectors.EVENT_READ | (selectors.EVENT_WRITE if self._core.unsent() else 0)
            self._selector.modify(self._link.socket, events)
            ready = self._selector.select(silence_s / 3)
            if ready and ready[0][1] & selectors.EVENT_READ:
                self._receive()
                address.add_end(self._core.failure, self._link)
            if ready:
                return
            quiet += 1
            if quiet == 3:
                self._core.fail(TimedOut(f"the daemon has been silent for {silence_s:g} s"))
                address.add_end(self._core.failure, self._link)
                return
            self._core.ping()
            self._flush()

    def _operate(self, operation: Operation[T], silence_s: float | None = None) -> T:
        with contextlib.closing(operation):  # closes the operation at once after Ctrl-C
            while True:
                try:
                    next(operation)
                except StopIteration as done:
                    self._flush()
                    result: T = done.value
                    return result
                self._exchange(silence_s or self._options.timeout)

    def _again(self, attempt: Callable[[], T]) -> T:
        """Attempts the operation until it succeeds or the time of retry_for is over."""
        retry = Retry(self._options.retry_for)
        while True:
            try:
                return attempt()
            except Error as why:
                time.sleep(retry.pause(why))

    def _call(self, make: Callable[[], Operation[T]]) -> T:
        def attempt() -> T:
            self._ensure()
            return self._operate(make())
        return self._again(attempt)

    # ---- what it is for

    @property
    def limits(self) -> dict[str, int]:
        """The daemon's limits; 0: not known."""
        return dict(self._core.limits)

    def send(self, scene: Scene, base_revision: int = 0) -> int:
        """Sends the scene's changes; returns its revision. Rendering does this by itself. base_revision: fails with `conflict`
        if other clients have changed the same objects since."""
        return self._call(lambda: self._core.commit(scene, base_revision))

    def close_scene(self, scene: Scene) -> None:
        """Releases the scene at the daemon; the next use sends it again."""
        self._call(lambda: self._core.close_scene(scene))

    def attach(self, name: str) -> Scene:
        """Attaches to an existing kept or shared scene, for rendering and editing; objects() lists its contents."""
        scene = Scene(name)
        scene.is_attached = True
        self._call(lambda: self._core.open(scene))
        return scene

    def changed(self, scene: Scene) -> int:
        """The newest revision of a kept or shared scene that other clients have made since it was opened here; 0: none."""
        self._ensure()
        return self._core.changed(scene)

    def objects(self, scene: Scene, kind: messages.ObjectKind | str, name: str = "") -> list[messages.ObjectEntry]:
        """Lists the scene's objects at the daemon, other clients' included."""
        return self._call(lambda: self._core.objects(scene, kind, name))

    def read(self, scene: Scene, thing: Object) -> tuple[Message, int]:
        """Reads a node, material, light or camera at the daemon, and the revision for send(base_revision=...)."""
        return self._call(lambda: self._core.read(scene, thing))

    def describe(self, scene: Scene) -> messages.SceneDescription:
        """Returns bounds, cameras and clips."""
        self.send(scene)
        return self._call(lambda: self._core.describe(scene))

    def scenes(self) -> list[messages.SceneEntry]:
        """Lists the scenes to which the client may attach."""
        reply, _ = self._call(lambda: self._core.ask(messages.SceneList(), messages.SceneListReply))
        entries: list[messages.SceneEntry] = list(reply.scenes)
        return entries

    def stats(self) -> messages.StatsReply:
        """Returns the daemon's state."""
        reply, _ = self._call(lambda: self._core.ask(messages.Stats(), messages.StatsReply))
        assert isinstance(reply, messages.StatsReply)
        return reply

    @takes(messages.job_keywords)
    def render(self, scene: Scene, camera: CameraOf = None, *, layers: LayersOf = (), **values: Any) -> Frame:
        """Renders a picture. camera: a Camera, a node with one, or None: the whole scene in view. layers: "depth" or ("beauty",
        "normal"), as floats. `values`: fields of messages.Render, such as width, samples, integrator="path"."""
        frame, = self.frames(scene, camera, layers=layers, **one_frame(values))
        return frame

    @takes(messages.job_keywords)
    def frames(self, scene: Scene, camera: CameraOf = None, *, layers: LayersOf = (), **values: Any) -> Generator[Frame, None, None]:
        """Renders the frames first_frame .. last_frame in order. After a lost connection it continues with the next frame, if
        retry_for is set. Several cameras are keys over time. Arguments are checked at once; the job starts with the first
        requested frame, and ends with the generator."""
        return self._frames(scene, request(camera, layers, {**values, "kind": messages.JobKind.BATCH}))

    def _frames(self, scene: Scene, render: messages.Render) -> Generator[Frame, None, None]:
        retry = Retry(self._options.retry_for)
        is_complete = False
        while not is_complete:
            try:
                self._ensure()
                with contextlib.closing(self._core.batch(scene, render)) as batch:
                    for frame in batch:
                        if frame is None:
                            self._exchange(self._options.timeout)
                            continue
                        self._flush()
                        retry.succeeded()
                        render.first_frame = frame.number + render.frame_step
                        is_complete = render.first_frame > render.last_frame
                        yield frame
                return
            except Error as why:
                if not is_complete:
                    time.sleep(retry.pause(why))
            finally:
                if self._link is not None:
                    self._flush()

    @takes(messages.view_keywords)
    def view(self, scene: Scene, camera: CameraOf = None, **values: Any) -> View:
        """Starts a picture that follows a camera."""
        render = request(camera, (), {**values, "kind": messages.JobKind.VIEW})
        return View(self, self._call(lambda: self._core.view(scene, render)))

    def ask(self, message: Message, answer: type[Message] = messages.Ok) -> Message:
        """Sends any request of the protocol; returns its answer."""
        made: Message = self._call(lambda: self._core.ask(message, answer))[0]
        return made

    def close(self) -> None:
        """Ends the connection; a private daemon ends, too."""
        self._leave_parent()
        if not self._closed and self._link is not None:
            self._core.leave()
            self._flush()
        self._closed = True
        self._drop()
        self._selector.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def connect(server: str | None = None, *, key_file: str | os.PathLike[str] | None = None, name: str = "python",
            timeout: float = SILENCE_S, retry_for: float = 0.0, progress: Progress | None = None) -> Client:
    """Connects to a daemon.

    server: unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET]; None: FARLIGHT_SERVER, else a private daemon, which ends with the
    client. key_file: the daemon's key, which seals the connection (default over TCP: FARLIGHT_KEY). timeout: maximum silence
    of the daemon in seconds. retry_for: time in seconds to retry after a lost connection or a busy daemon; scenes are then
    sent again, and animations continue. progress: called with "sending", bytes done and bytes in all, while arrays of a
    scene are sent.
    """
    return Client(Options(server, key_file, name, timeout, retry_for, progress))
