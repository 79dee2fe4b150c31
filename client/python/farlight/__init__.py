# SPDX-License-Identifier: MIT
"""Ray tracing at the other end of a socket: a client of farlightd.

    import farlight

    with farlight.connect() as client:               # a daemon of its own; or connect("unix:/run/farlight/farlight.sock")
        scene = farlight.load("model.glb")           # or Scene(), and numpy arrays
        frame = client.render(scene, width=640, height=480, samples=16)
        farlight.write_png("picture.png", frame.colour)

Requests. The keywords of `render`, `frames` and `view` are the fields of `farlight.messages.Render`; those of an `add_` method
and of `change` are the fields of that object's message, such as `farlight.messages.SetMaterial`. `help()` of a message says what
each field means; editors and type checkers know them. `encoding="zstd"` or "jpeg" sends fewer bytes. `client.frames(scene,
camera, camera_path="orbit", orbit_turn=6.28, orbit_seconds=4, last_frame=95)` is an animation. `aio.connect()` makes an asyncio
client, which several tasks may use at once. With `connect(retry_for=60)` a lost daemon is sought again for a minute, and
animations continue with the missing frame.

Scenes. `add_mesh` and the like return objects. An object without a node when the scene is sent is shown where its vertices are;
`place=False` leaves it to nodes that are added later. The daemon keeps a scene that was sent: later only differences travel. `change(ENVIRONMENT,
intensity=2)` keeps the image. `load()` starts farlight-import, which reads files in a sandbox. `client.attach(NAME)`, `objects()`
and `read()` give a scene that others made. Never sent: folders, or more of a file than the scene. Objects of a model that have no
name get the file's, without its folder.

Layers. `layers=("depth", "normal")` gives `frame.depth` and `frame.normal` as floats; "id" gives `frame.ids`, the `frame.names` of
these numbers, and `frame.mask("Wheel")` of a name, a node or a material; "motion" gives `frame.motion`, the distance in pixels
(x right, y up) to the place of a surface in the next frame and in the one before. Nodes and the environment with `light_group=1`
are in the layer `light_group1`; all groups and `light_group0`, the remaining light, add up to the beauty.

Space is right-handed, in metres, y up. A camera looks along -z. Pixels begin at the top left; the first one's middle is (0.5, 0.5):

    y   -z (the view)          0 ---- u
    |  /                       |
    | /                        |  frame.K @ (x, -y, -z) = (u, v, 1) * depth
    o ---- x                   v

`Camera.from_matrix(world_from_camera)` takes such a pose; with `convention="opencv"` one that looks along +z with y down.
`Camera.intrinsics(K, width, height, pose)` takes a pinhole with any principal point: it returns the camera and the keywords of
`render` that cut the picture out of a larger one. `frame.K` and `frame.world_from_view` are the camera of a frame.

Errors. Invalid input raises InvalidValue, which names the argument, its value and the allowed ones, before anything is sent.
Refused is the daemon's refusal, with code, field and remedy. ConnectionLost may be tried again if it is `retryable`; Ctrl-C in an
upload costs the connection, and the next call makes another. A daemon that violates the protocol raises ProtocolError: nothing is
allocated before it has arrived, a frame is no larger than requested, and lossless frames are checked against the daemon's digest
if the system has libxxhash0 (`frame.is_checked`). FileFailed names a missing library: zstd needs libzstd1, JPEG libturbojpeg0,
sealed connections libsodium23. Keys are wiped where ctypes holds them, but not in Python's memory.

Not there: H.264, whose frames need those before them (JPEG's stand alone); attachments, parts and margins of views (use layers).
A mesh of 10 million triangles (180 MB) is copied once, and takes 0.5 s of a CPU to add and 0.4 s to send.
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
