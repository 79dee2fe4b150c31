# SPDX-License-Identifier: MIT
"""Connections to daemons. Blender forbids Python threads of an add-on, so a connection runs only while it is waited for, in
slices, between which Blender is asked whether the user has cancelled: Esc ends a job within some 0.1 s.

A daemon that is away, full, or refuses a value ends the render with an error that names the address or field; the picture keeps
what has arrived, and the next F12 connects again and sends the whole scene. The error of a failed ssh has its last line, and a
command that shows what is missing.
"""
from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from typing import Any, Optional, TypeVar

import farlight
import farlight.aio
from farlight.aio import AsyncClient
from farlight.frame import Frame

T = TypeVar("T")
IDLE_S = 5.0  # a daemon allows longer silence
SLICE_S = 0.05  # delay until Blender's Esc is noticed


class Stopped(Exception):
    """The user has cancelled."""


def _never() -> bool:
    return False


class Session:
    """A connection to a daemon. Several of Blender's threads may wait at once, for a render and for the viewport: they take
    turns."""

    def __init__(self, server: Optional[str], key_file: Optional[str]) -> None:
        self._server, self._key_file = server, key_file
        self._client: Optional[AsyncClient] = None
        self._loop = asyncio.new_event_loop()
        self._turn = threading.Lock()

    def start(self, operation: Coroutine[Any, Any, T]) -> asyncio.Task[T]:
        """Starts an operation, which continues while any thread waits, or in idle()."""
        return self._loop.create_task(operation)

    def slice(self, task: asyncio.Task[Any], seconds: float) -> None:
        """Runs all operations until this one is done."""
        with self._turn:
            self._loop.run_until_complete(asyncio.wait({task}, timeout=seconds))

    def wait(self, operation: Coroutine[Any, Any, T], is_stopped: Callable[[], bool] = _never) -> T:
        """Waits for an operation's result. Cancels it and raises Stopped once is_stopped() returns true."""
        task = self.start(operation)
        while True:
            self.slice(task, SLICE_S)
            if task.done():
                return task.result()
            if is_stopped():
                task.cancel()
                self.slice(task, 1)
                raise Stopped

    def idle(self) -> None:
        """Answers the daemon's pings between waits, so that it does not disconnect the client."""
        self.wait(asyncio.sleep(0.001))

    async def client(self) -> AsyncClient:
        """The connection, made at its first use; it reconnects by itself after a loss."""
        if self._client is None:
            self._client = await farlight.aio.connect(self._server, key_file=self._key_file, name="blender")
        return self._client

    async def send(self, scene: farlight.Scene) -> None:
        """Sends the scene's changes."""
        await (await self.client()).send(scene)

    async def render(self, scene: farlight.Scene, camera: Any, **values: Any) -> Frame:
        """Renders a picture; see Client.render()."""
        return await (await self.client()).render(scene, camera, **values)

    async def forget(self, scene: farlight.Scene) -> None:
        """Releases a scene that will not be rendered again."""
        with contextlib.suppress(farlight.Error):  # a lost daemon has no scene to release
            if self._client is not None:
                await self._client.close_scene(scene)

    async def _frames(self, scene: farlight.Scene, camera: Any, values: dict[str, Any]) -> AsyncIterator[Frame]:
        client = await self.client()
        frames = client.frames(scene, camera, **values)
        try:
            async for frame in frames:
                yield frame
        finally:
            await frames.aclose()  # cancels the job if it is running

    def frames(self, scene: farlight.Scene, camera: Any, is_stopped: Callable[[], bool], **values: Any) -> Iterator[Frame]:
        """Renders a range of frames; see Client.frames(). Raises Stopped after cancelling the job."""
        frames = self._frames(scene, camera, values)

        async def following() -> Optional[Frame]:
            return await anext(frames, None)

        async def end() -> None:
            await frames.aclose()  # type: ignore[attr-defined]

        try:
            while (frame := self.wait(following(), is_stopped)) is not None:
                yield frame
        finally:
            self.wait(end())

    def close(self) -> None:
        """Ends the connection; a private daemon ends, too."""
        if self._client is not None:
            self.wait(self._client.close())
        self.wait(self._loop.shutdown_default_executor())
        self._loop.close()


_sessions: dict[tuple[Optional[str], Optional[str]], Session] = {}


def session(server: Optional[str], key_file: Optional[str]) -> Session:
    """The connection to a daemon, shared by all renders."""
    key = server, key_file
    if key not in _sessions:
        _sessions[key] = Session(server, key_file)
    return _sessions[key]


def release(scene: farlight.Scene) -> None:
    """Releases a scene at the daemons, without waiting."""
    for one in _sessions.values():
        one.start(one.forget(scene))


def idle() -> float:
    """Runs idle() of all sessions; returns the delay in seconds until the next call."""
    for one in list(_sessions.values()):
        one.idle()
    return IDLE_S


def close_all() -> None:
    """Ends all connections, when the add-on is disabled."""
    while _sessions:
        _sessions.popitem()[1].close()
