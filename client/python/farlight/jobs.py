# SPDX-License-Identifier: MIT
"""Requests in flight, and the frames of jobs. No I/O; received messages are checked against the request."""
from __future__ import annotations

import collections
from dataclasses import dataclass, field
from typing import Optional

from . import decode, messages
from .errors import ProtocolError
from .fields import Message
from .frame import Frame, pixels_bytes
from .messages import Encoding
from .objects import Names


@dataclass
class Pending:
    """A request in flight."""
    finals: tuple[type[Message], ...]
    extra: Optional[type[Message]] = None  # message that may arrive once before the answer
    came: Optional[Message] = None
    answer: Optional[Message] = None


@dataclass
class Job:
    """A request whose frames arrive on a channel of its own."""
    request: int
    channel: int
    render: messages.Render
    pending: Pending
    credit: int
    begun: Optional[messages.FrameBegin] = None
    data: bytearray = field(default_factory=bytearray)
    frames: collections.deque[Frame] = field(default_factory=collections.deque)
    came: int = 0
    command: int = 0
    is_abandoned: bool = False
    known: Names = Names({}, {})

    @property
    def is_view(self) -> bool:
        return self.render.kind == messages.JobKind.VIEW

    def check_begin(self, begin: messages.FrameBegin) -> None:
        """Checks that the frame matches the request, so that no more than that is kept."""
        render, pixels = self.render, begin.width * begin.height
        width = render.crop_width or render.width * render.views_across
        height = render.crop_height or render.height * render.views_down
        if self.begun is not None:
            raise ProtocolError("a frame begins within another one", field="frame_begin")
        if self.came >= self.credit:
            raise ProtocolError(f"frame {self.came + 1} of a job with a credit of {self.credit}", field="frame_begin")
        if pixels > width * height or (not self.is_view and (begin.width, begin.height) != (width, height)):
            raise ProtocolError(f"a picture of {begin.width}x{begin.height} where {width}x{height} was requested",
                                field="frame_begin.width")
        encodings = {render.encoding, render.still_encoding} if self.is_view else {render.encoding}
        if begin.encoding not in encodings or (begin.format, begin.layers) != (render.format, render.layers or 1):
            raise ProtocolError(f"{begin.encoding!r}, {begin.format!r}, layers {begin.layers}: differs from the request",
                                field="frame_begin.encoding")
        most = decode.encoded_bytes_max(begin, pixels_bytes(begin))
        attached = begin.depth_bytes + begin.normal_bytes + begin.sticking_bytes
        if not 0 < begin.size_bytes <= most or (begin.encoding == Encoding.RAW and begin.size_bytes != most) or attached:
            raise ProtocolError(f"{begin.size_bytes} bytes, and {attached} attached, where the picture has {most}",
                                field="frame_begin.size_bytes")

    def _window(self) -> Optional[tuple[int, int, int, int]]:
        render = self.render
        return (render.crop_x, render.crop_y, render.width, render.height) if render.crop_width else None

    def take(self, message: Message) -> Optional[Frame]:
        """Handles a message of a frame; returns the frame that it completes."""
        if isinstance(message, messages.FrameBegin):
            if not self.is_abandoned:
                self.check_begin(message)
            self.begun, self.data = message, bytearray()
            return None
        if self.is_abandoned:
            return None
        if self.begun is None:
            raise ProtocolError("arrives without a frame_begin", field=message.NAME)
        if isinstance(message, messages.FrameData):
            if message.offset_bytes != len(self.data) or len(self.data) + len(message.data) > self.begun.size_bytes:
                raise ProtocolError(f"{len(message.data)} bytes at {message.offset_bytes}, where {len(self.data)} of "
                                    f"{self.begun.size_bytes} have arrived", field="frame_data.offset_bytes")
            self.data += message.data
            return None
        assert isinstance(message, messages.FrameEnd)
        if message.frame != self.begun.frame or message.abandoned or len(self.data) != self.begun.size_bytes:
            raise ProtocolError(f"frame {message.frame} ends with {len(self.data)} of {self.begun.size_bytes} bytes, "
                                f"and frame {self.begun.frame} was begun", field="frame_end.frame")
        pixels, is_checked = decode.decode(self.begun, self.data, pixels_bytes(self.begun))
        frame = Frame(self.begun, message, pixels, is_checked, self._window(), self.known)
        self.begun, self.data, self.came = None, bytearray(), self.came + 1
        return frame
