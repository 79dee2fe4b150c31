# SPDX-License-Identifier: MIT
"""Ray tracing at the other end of a socket: a client of farlightd.

    import farlight

    with farlight.connect() as client:               # a daemon of its own; or connect("unix:/run/farlight/farlight.sock")
        scene = farlight.load("model.glb")           # or Scene(), and numpy arrays
        frame = client.render(scene, width=640, height=480, samples=16)
        farlight.write_png("picture.png", frame.colour)

`messages` has every message and enumeration of the protocol; `aio.connect()` makes an asyncio client.
"""
from . import aio, messages
from .client import Client, View, connect
from .errors import (Cancelled, ConnectionLost, Error, FileFailed, ImportFailed, InvalidValue, ProtocolError, Refused,
                     TimedOut)
from .frame import Frame
from .importer import load
from .png import write as write_png
from .camera import Camera, look_at, translate
from .objects import ENVIRONMENT, Object
from .scene import Scene
from .version import VERSION as __version__

__all__ = ["Camera", "Cancelled", "Client", "ConnectionLost", "ENVIRONMENT", "Error", "FileFailed", "Frame", "ImportFailed",
           "InvalidValue", "Object", "ProtocolError", "Refused", "Scene", "TimedOut", "View", "__version__", "aio", "connect", "load",
           "look_at", "messages", "translate", "write_png"]
