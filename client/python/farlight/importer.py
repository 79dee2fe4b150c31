# SPDX-License-Identifier: MIT
"""Scenes from model files. The program farlight-import reads the files in a sandbox; this module is the server that it speaks
to, and trusts it no more than a server trusts a client."""
from __future__ import annotations

import os
import time
from collections.abc import Sequence

from . import address, framing, messages
from .blobs import blob_hash
from .connection import UPLOAD_CHANNEL
from .core import Progress
from .errors import FileFailed, ImportFailed, InvalidValue, ProtocolError
from .fields import Message
from .messages import ObjectKind
from .objects import Object
from .scene import Scene

WINDOW_BYTES = 16 << 20  # bytes that the importer may send ahead
RECEIVE_BYTES = 1 << 20
BYTES_MAX = 8 << 30
MODELS_MAX = 64


class _Import:
    """The state of an import."""

    def __init__(self, scene: Scene, max_bytes: int, progress: Progress | None = None) -> None:
        self.scene, self.left, self.progress = scene, max_bytes, progress
        self.incoming, self.out = bytearray(), bytearray()
        self.offered: dict[bytes, int] = {}
        self.partial: dict[tuple[int, bytes], bytearray] = {}
        self.sent: set[bytes] = set()
        self.transaction = 0
        self.credit = self.taken = 0
        self.complaint: ImportFailed | None = None
        self.is_done = False
        self._give_credit()

    def _give_credit(self) -> None:
        if self.credit - self.taken <= WINDOW_BYTES // 2:
            self.credit = self.taken + WINDOW_BYTES
            self.out += framing.pack(messages.Credit(UPLOAD_CHANNEL, self.credit))

    def receive(self, data: bytes) -> None:
        """Handles a message; raises ProtocolError or ImportFailed."""
        self.incoming += data
        while (received := framing.cut(self.incoming, ("client", "both", "local"))) is not None:
            self._take(received.message, received.request)

    def _take(self, message: Message, request: int) -> None:
        if isinstance(message, messages.ImportNote):
            text = f"{message.where}: {message.text}" if message.where else message.text
            if message.severity == messages.Severity.ERROR:
                self.complaint = self.complaint or ImportFailed(message.text, field=message.where)
            elif len(self.scene.notes) < 1000:
                self.scene.notes.append(text)
        elif isinstance(message, messages.BlobOffer):
            self.offered.update((blob.hash, blob.size_bytes) for blob in message.blobs)
            need = messages.BlobNeed([messages.BlobIndex(i) for i in range(len(message.blobs))])
            self.out += framing.pack(need, request)
        elif isinstance(message, messages.BlobData):
            self._take_piece(message, request)
        elif isinstance(message, messages.EditBegin):
            self.transaction = request
        elif isinstance(message, messages.EditCommit):
            self.out += framing.pack(messages.Ok(1), request)
        elif isinstance(message, messages.ImportDone):
            x, y, z = message.origin
            self.scene.origin = (x, y, z)
            self.is_done = True
        elif isinstance(message, messages.ImportProgress):
            if self.progress is not None:
                self.progress("importing", message.done_bytes, message.total_bytes)
        elif message.SENDER == "local":
            pass
        elif message.NAME.startswith("set_") and request == self.transaction:
            for blob in getattr(message, "arrays", ()):
                if blob.size_bytes and blob.hash not in self.sent:
                    raise ProtocolError("names a blob that was not sent", field=message.NAME)
            self.scene.set(message)
        elif isinstance(message, messages.Remove) and request == self.transaction:
            self.scene.remove(Object(ObjectKind(int(message.kind)), message.object))
        else:
            raise ProtocolError("the importer may not send this", field=message.NAME)

    def _take_piece(self, message: messages.BlobData, request: int) -> None:
        size, count = self.offered.get(message.hash, 0), len(message.data)
        blob = self.partial.setdefault((request, message.hash), bytearray())
        self.taken += count
        self.left -= count
        if message.offset_bytes != len(blob) or not count or len(blob) + count > size or self.taken > self.credit:
            raise ProtocolError(f"{count} bytes at {message.offset_bytes} of a blob of {size}", field="blob_data")
        if self.left < 0:
            raise ImportFailed("the model has more bytes than are allowed", field="max_bytes", remedy="allow more")
        blob += message.data
        if len(blob) == size:
            whole = bytes(self.partial.pop((request, message.hash)))
            if blob_hash(whole) != message.hash:
                raise ProtocolError("a blob does not have the hash that names it", field="blob_data.hash")
            self.sent.add(message.hash)
            self.scene.blob(whole)
            self.out += framing.pack(messages.Ok(0), request)
        self._give_credit()


def _run(link: address.Link, work: _Import, timeout: float, names: str) -> None:
    deadline = time.monotonic() + timeout
    while not work.is_done:
        left = deadline - time.monotonic()
        if left <= 0:
            raise ImportFailed(f"the import took more than {timeout:g} s", field=names, remedy="give a longer timeout")
        link.socket.settimeout(left)
        try:
            if work.out:
                link.socket.sendall(work.out)
                work.out.clear()
            data = link.socket.recv(RECEIVE_BYTES)
        except TimeoutError:
            continue
        except OSError:
            data = b""
        if not data:
            raise work.complaint or ImportFailed(f"the importer failed without a message: {link.last_words()[0]}", field=names)
        try:
            work.receive(data)
        except (ProtocolError, InvalidValue) as why:
            raise ImportFailed(f"the importer sent invalid data: {why}", field=names) from None
    if work.complaint:
        raise work.complaint


def _word(path: str | os.PathLike[str]) -> str:
    """Protects a path that begins with '-'."""
    try:
        name = os.fsdecode(path)
    except TypeError:
        raise InvalidValue(f"{path!r:.80} is no path", field="models") from None
    try:
        with open(os.open(name, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK), "rb"):
            pass
    except OSError as why:
        raise FileFailed(f"cannot be read: {why.strerror}", field=name) from None
    if not os.path.isfile(name):
        raise FileFailed("is not a file", field=name)
    return f"./{name}" if name.startswith("-") else name


def load(*models: str | os.PathLike[str], environment: str | os.PathLike[str] | None = None,
         environment_degrees: float = 0.0, variant: str | None = None, point_size: float | None = None,
         name: str = "", sharing: messages.Sharing | str = "private", arguments: Sequence[str] = (),
         timeout: float = 600.0, max_bytes: int = BYTES_MAX, progress: Progress | None = None) -> Scene:
    """Makes a scene from model files (glTF, OBJ, NFF, PLY and more), to be changed and rendered like any other; several files
    share one space. `scene.notes` lists contents of the files that are not shown. environment: an image that lights the scene.
    arguments: further ones of farlight-import, such as --at. The models' bytes are held in memory: at most max_bytes. progress:
    called with "importing", bytes read and bytes in all; 0: not known. Raises FileFailed, or ImportFailed with the importer's
    message."""
    words = ["--scene", "1", *arguments]
    if environment is not None:
        words += ["--environment", _word(environment), f"--environment-rotation={environment_degrees:.9g}"]
    if variant is not None:
        words += ["--variant", variant]
    if point_size is not None:
        words.append(f"--point-size={point_size:.9g}")
    if not models and environment is None:
        raise InvalidValue("a file name is needed", field="models")
    if len(models) > MODELS_MAX:
        raise InvalidValue(f"{len(models)} models, at most {MODELS_MAX} are allowed", field="models")
    words += [_word(model) for model in models] or ["--no-model"]
    scene = Scene(name, sharing)
    link = address.start_program("farlight-import", words)
    try:
        _run(link, _Import(scene, max_bytes, progress), timeout, ", ".join(map(os.fsdecode, models)) or "environment")
    except BaseException:  # an interrupted importer need not finish
        link.end()
        raise
    finally:
        link.close()
    return scene
