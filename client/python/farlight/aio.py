# SPDX-License-Identifier: MIT
"""The asyncio client: like the plain one, with awaits; several tasks may use it at once."""
from __future__ import annotations

import asyncio
import contextlib
import os
from collections.abc import AsyncGenerator, Callable
from typing import Any, TypeVar

from . import address, messages
from .camera import Camera, CameraOf, command, one_frame, request
from .client import RECEIVE_BYTES, SILENCE_S, Options, Retry
from .connection import Operation
from .core import Core, Progress
from .errors import ConnectionLost, Error, TimedOut
from .fields import Message, takes
from .frame import Frame, LayersOf
from .jobs import Job
from .objects import Object
from .scene import Scene

T = TypeVar("T")


class AsyncView:
    """A picture that follows a camera; an asynchronous context manager."""

    def __init__(self, client: AsyncClient, job: Job) -> None:
        self._client, self._job, self._core = client, job, client._core

    def set_camera(self, camera: Camera, moving: bool = False, time_s: float = 0.0) -> int:
        """Moves the camera; see View.set_camera()."""
        number = self._core.set_camera(self._job, command(camera, moving, time_s))
        self._client._flush(self._core)
        return number

    async def next_frame(self) -> Frame:
        """Returns the newest frame; see View.next_frame()."""
        return await self._client._operate(self._core, self._core.next_frame(self._job))

    async def close(self) -> None:
        """Ends the view."""
        if self._core.failure is None:
            await self._client._operate(self._core, self._core.cancel(self._job))

    async def __aenter__(self) -> AsyncView:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()


class AsyncClient:
    """A connection to a daemon; an asynchronous context manager. Made by connect()."""

    def __init__(self, options: Options) -> None:
        self._options = options
        self._core = options.core(None)
        self._link: address.Link | None = None
        self._writer: asyncio.StreamWriter | None = None
        self._pump_task: asyncio.Task[None] | None = None
        self._changed = asyncio.Event()  # replaced whenever something has arrived
        self._connecting = asyncio.Lock()
        self._closed = False

    # ---- driving the core

    async def _connect(self) -> None:
        await self._drop()
        core = self._core = self._options.core(self._core)
        self._link = await asyncio.to_thread(address.open_link, self._options.server, self._options.timeout)
        self._link.socket.setblocking(False)
        reader, self._writer = await asyncio.open_connection(sock=self._link.socket, limit=RECEIVE_BYTES)
        self._pump_task = asyncio.create_task(self._pump(core, reader))
        try:
            await self._operate(core, core.greet())
        except Error as why:
            await asyncio.to_thread(address.explain, why, self._link)
            raise

    async def _drop(self) -> None:
        if self._pump_task is not None:
            self._pump_task.cancel()
            await asyncio.gather(self._pump_task, return_exceptions=True)
            self._pump_task = None
        if self._writer is not None:
            # The socket may be closed only after the loop has removed it, since a new one may get the same number.
            self._writer.transport.abort()
            with contextlib.suppress(OSError):
                await self._writer.wait_closed()
            self._writer = None
        if self._link is not None:
            await asyncio.to_thread(self._link.close)
            self._link = None

    async def _ensure(self) -> Core:
        if self._closed:
            raise ConnectionLost("the client is closed", retryable=False)
        async with self._connecting:
            if self._link is None or self._core.failure is not None:
                await self._connect()
        return self._core

    def _wake(self) -> None:
        self._changed.set()
        self._changed = asyncio.Event()

    async def _pump(self, core: Core, reader: asyncio.StreamReader) -> None:
        """Passes received bytes to the core until the connection is dropped."""
        quiet, writer = 0, self._writer
        while core.failure is None:
            try:
                data = await asyncio.wait_for(reader.read(RECEIVE_BYTES), self._options.timeout / 3)
                core.receive(data)
                quiet = 0
            except asyncio.TimeoutError:
                quiet += 1
                if quiet == 3:
                    core.fail(TimedOut(f"the daemon has been silent for {self._options.timeout:g} s"))
                core.ping()
            except OSError as why:
                core.fail(address.broken(why, self._link))
            if core.failure is not None and self._link is not None:
                await asyncio.to_thread(address.add_end, core.failure, self._link)
            self._flush(core)
            self._wake()
        if writer is not None:
            writer.transport.abort()  # unsent bytes are dropped

    def _flush(self, core: Core) -> None:
        if core is self._core and self._writer is not None and (unsent := core.unsent()):
            data = bytes(unsent)
            core.sent(len(data))
            self._writer.write(data)

    async def _operate(self, core: Core, operation: Operation[T]) -> T:
        with contextlib.closing(operation):  # closes at once if the task is cancelled
            while True:
                changed = self._changed
                try:
                    next(operation)
                except StopIteration as done:
                    self._flush(core)
                    result: T = done.value
                    return result
                await self._wait(core, changed)

    async def _wait(self, core: Core, changed: asyncio.Event) -> None:
        """Waits until something has arrived, or until queued bytes are being sent."""
        if not core.unsent():
            await changed.wait()
            return
        self._flush(core)
        try:
            if self._writer is not None:
                await self._writer.drain()
        except OSError:
            await changed.wait()  # the pump sets the reason

    async def _again(self, attempt: Callable[[Core], Operation[T]]) -> T:
        retry = Retry(self._options.retry_for)
        while True:
            try:
                core = await self._ensure()
                return await self._operate(core, attempt(core))
            except Error as why:
                await asyncio.sleep(retry.pause(why))

    # ---- what it is for

    @property
    def limits(self) -> dict[str, int]:
        """The daemon's limits; 0: not known."""
        return dict(self._core.limits)

    async def send(self, scene: Scene, base_revision: int = 0) -> int:
        """Sends the scene's changes; see Client.send()."""
        return await self._again(lambda core: core.commit(scene, base_revision))

    async def close_scene(self, scene: Scene) -> None:
        """Releases a scene at the daemon; see Client.close_scene()."""
        await self._again(lambda core: core.close_scene(scene))

    async def attach(self, name: str) -> Scene:
        """Attaches to a scene; see Client.attach()."""
        scene = Scene(name)
        scene.is_attached = True
        await self._again(lambda core: core.open(scene))
        return scene

    def changed(self, scene: Scene) -> int:
        """The newest revision by other clients; see Client.changed()."""
        return self._core.changed(scene)

    async def objects(self, scene: Scene, kind: messages.ObjectKind | str, name: str = "") -> list[messages.ObjectEntry]:
        """Lists objects of a scene; see Client.objects()."""
        return await self._again(lambda core: core.objects(scene, kind, name))

    async def read(self, scene: Scene, thing: Object) -> tuple[Message, int]:
        """Reads an object; see Client.read()."""
        return await self._again(lambda core: core.read(scene, thing))

    async def describe(self, scene: Scene) -> messages.SceneDescription:
        """Describes a scene; see Client.describe()."""
        await self.send(scene)
        return await self._again(lambda core: core.describe(scene))

    async def scenes(self) -> list[messages.SceneEntry]:
        """Lists scenes; see Client.scenes()."""
        reply, _ = await self._again(lambda core: core.ask(messages.SceneList(), messages.SceneListReply))
        entries: list[messages.SceneEntry] = list(reply.scenes)
        return entries

    async def stats(self) -> messages.StatsReply:
        """The daemon's state; see Client.stats()."""
        reply, _ = await self._again(lambda core: core.ask(messages.Stats(), messages.StatsReply))
        assert isinstance(reply, messages.StatsReply)
        return reply

    @takes(messages.job_keywords)
    async def render(self, scene: Scene, camera: CameraOf = None, *, layers: LayersOf = (), **values: Any) -> Frame:
        """Renders a picture; see Client.render()."""
        frame, = [frame async for frame in self.frames(scene, camera, layers=layers, **one_frame(values))]
        return frame

    @takes(messages.job_keywords)
    def frames(self, scene: Scene, camera: CameraOf = None, *, layers: LayersOf = (),
               **values: Any) -> AsyncGenerator[Frame, None]:
        """Renders a range of frames; see Client.frames()."""
        return self._frames(scene, request(camera, layers, {**values, "kind": messages.JobKind.BATCH}))

    async def _frames(self, scene: Scene, render: messages.Render) -> AsyncGenerator[Frame, None]:
        retry = Retry(self._options.retry_for)
        is_complete = False
        while not is_complete:
            core = self._core
            try:
                core = await self._ensure()
                with contextlib.closing(core.batch(scene, render)) as batch:
                    changed = self._changed
                    for frame in batch:
                        if frame is None:
                            await self._wait(core, changed)
                        else:
                            self._flush(core)
                            retry.succeeded()
                            render.first_frame = frame.number + render.frame_step
                            is_complete = render.first_frame > render.last_frame
                            yield frame
                        changed = self._changed
                return
            except Error as why:
                if not is_complete:
                    await asyncio.sleep(retry.pause(why))
            finally:
                self._flush(core)

    @takes(messages.view_keywords)
    async def view(self, scene: Scene, camera: CameraOf = None, **values: Any) -> AsyncView:
        """Starts a view; see Client.view()."""
        render = request(camera, (), {**values, "kind": messages.JobKind.VIEW})
        return AsyncView(self, await self._again(lambda core: core.view(scene, render)))

    async def ask(self, message: Message, answer: type[Message] = messages.Ok) -> Message:
        """Sends any request; see Client.ask()."""
        made: Message = (await self._again(lambda core: core.ask(message, answer)))[0]
        return made

    async def close(self) -> None:
        """Ends the connection; see Client.close()."""
        if not self._closed and self._writer is not None:
            self._core.leave()
            self._flush(self._core)
            self._writer.close()
            with contextlib.suppress(OSError, asyncio.TimeoutError):
                await asyncio.wait_for(self._writer.wait_closed(), 1)
        self._closed = True
        await self._drop()

    async def __aenter__(self) -> AsyncClient:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()


async def connect(server: str | None = None, *, key_file: str | os.PathLike[str] | None = None, name: str = "python",
                  timeout: float = SILENCE_S, retry_for: float = 0.0, progress: Progress | None = None) -> AsyncClient:
    """Connects to a daemon; see farlight.connect()."""
    client = AsyncClient(Options(server, key_file, name, timeout, retry_for, progress, has_tasks=True))
    retry = Retry(retry_for)
    while True:
        try:
            await client._ensure()
            return client
        except Error as why:
            try:
                pause = retry.pause(why)
            except Error:
                await client.close()
                raise
            await asyncio.sleep(pause)
