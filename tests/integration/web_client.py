# SPDX-License-Identifier: MIT
"""farlight-web as a process, and a WebSocket (RFC 6455) of plain bytes, which also sends what browsers do not."""
import base64
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import urllib.parse

from farlight_test import BIN, TIMEOUT_S

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10


class Gateway:
    """A running farlight-web on a free port; a context manager. Arguments: a model, or --server and --scene."""

    def __init__(self, *arguments, listen="127.0.0.1:0", environment=None):
        self.command = [BIN / "farlight-web", "--listen", listen, *map(str, arguments)]
        # A view at rest gets better, so it has as many samples as usual.
        self.environment = {name: value for name, value in (environment or os.environ).items() if name != "FARLIGHT_SAMPLES"}

    def __enter__(self):
        self.process = subprocess.Popen(self.command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                        env=self.environment)
        self.link, _, self.link_gives = self.process.stdout.readline().strip().partition("  ")
        edit_line = self.process.stdout.readline().strip() if "--allow-edit" in self.command else ""
        self.edit_link, _, self.edit_link_gives = edit_line.partition("  ")
        if not self.link:
            raise AssertionError(f"farlight-web printed no link, but: {self.process.communicate()[1]}")
        self.host = urllib.parse.urlsplit(self.link).netloc
        self.machine, self.port = urllib.parse.urlsplit(self.link).hostname, urllib.parse.urlsplit(self.link).port
        self.path, self.edit_path = urllib.parse.urlsplit(self.link).path, urllib.parse.urlsplit(self.edit_link).path
        return self

    def stop(self, number=signal.SIGINT):
        """(exit status, what it has said on standard error)"""
        if self.process.poll() is None:
            self.process.send_signal(number)
        status = self.process.wait(TIMEOUT_S)
        return status, self.process.stderr.read()

    def said_until(self, words):
        """What it says on standard error up to the line that has these words, or until it ends."""
        lines = []
        for line in self.process.stderr:
            lines.append(line)
            if words in line:
                break
        return "".join(lines)

    def __exit__(self, *_):
        self.stop(signal.SIGKILL)
        self.process.stdout.close()
        self.process.stderr.close()

    @property
    def daemon(self):
        """The process of its daemon; None: it has none of its own."""
        children = pathlib.Path(f"/proc/{self.process.pid}/task").glob("*/children")
        found = [child for part in children for child in part.read_text().split()
                 if pathlib.Path(f"/proc/{child}/comm").read_text().strip() == "farlightd"]
        return int(found[0]) if found else None

    def get(self, path, method="GET", host=None):
        """(status, headers by their name in small letters, body)"""
        with socket.create_connection((self.machine, self.port), TIMEOUT_S) as peer:
            lines = [f"{method} {path} HTTP/1.1", f"Host: {self.host if host is None else host}", "Connection: close"]
            peer.sendall("\r\n".join([*lines, "", ""]).encode())
            answer = b""
            while piece := peer.recv(65536):
                answer += piece
        head, _, body = answer.partition(b"\r\n\r\n")
        first, *rest = head.decode("latin-1").split("\r\n")
        return int(first.split()[1]), {name.lower(): value for name, value in (line.split(": ", 1) for line in rest)}, body


class Socket:
    """A WebSocket to a gateway; `status` is that of the handshake, 101 if it is open."""

    def __init__(self, gateway, path=None, origin=None, protocol="farlight", host=None):
        self.peer = socket.create_connection((gateway.machine, gateway.port), TIMEOUT_S)
        key = base64.b64encode(os.urandom(16)).decode()
        lines = [f"GET {gateway.path + 'view' if path is None else path} HTTP/1.1", f"Host: {host or gateway.host}",
                 "Upgrade: websocket", "Connection: Upgrade", f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13"]
        lines += [f"Sec-WebSocket-Protocol: {protocol}"] if protocol else []
        origin = f"http://{gateway.host}" if origin is None else origin
        lines += [f"Origin: {origin}"] if origin else []
        self.peer.sendall("\r\n".join([*lines, "", ""]).encode())
        self.buffer = b""
        while b"\r\n\r\n" not in self.buffer:
            piece = self.peer.recv(65536)
            if not piece:
                break
            self.buffer += piece
        head, _, self.buffer = self.buffer.partition(b"\r\n\r\n")
        found = re.match(rb"HTTP/1\.[01] (\d+)", head)
        self.status = int(found[1]) if found else 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.peer.close()

    def send(self, message, kind=TEXT, final=True):
        """A dictionary as JSON, or bytes as they are."""
        data = json.dumps(message).encode() if isinstance(message, dict) else message
        mask = os.urandom(4)
        head = bytes([kind | (0x80 if final else 0)])
        head += bytes([0x80 | len(data)]) if len(data) < 126 else struct.pack(">BH", 0x80 | 126, len(data))
        self.peer.sendall(head + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(data)))

    def _take(self, count):
        while len(self.buffer) < count:
            piece = self.peer.recv(262144)
            if not piece:
                raise ConnectionError("the gateway has closed the socket")
            self.buffer += piece
        taken, self.buffer = self.buffer[:count], self.buffer[count:]
        return taken

    def receive(self):
        """(kind, bytes) of the next message; pings are answered."""
        whole, first_kind = b"", 0
        while True:
            first, second = self._take(2)
            length = second & 0x7f
            if length > 125:
                length = int.from_bytes(self._take(2 if length == 126 else 8), "big")
            data, kind = self._take(length), first & 0xf
            if kind == PING:
                self.send(data, PONG)
            elif kind in (CLOSE, PONG):
                return kind, data
            else:
                whole, first_kind = whole + data, kind or first_kind
                if first & 0x80:
                    return first_kind, whole

    def frame(self):
        """(header, encoded picture) of the next frame; what else comes is passed over."""
        while True:
            kind, data = self.receive()
            if kind == BINARY:
                size = int.from_bytes(data[:4], "little")
                self.send({"shown": 1})
                return json.loads(data[4:4 + size]), data[4 + size:]
            if kind == CLOSE or b'"error"' in data:
                raise AssertionError(f"instead of a frame came {data}")

    def closed_with(self):
        """The status with which the gateway closes it; 0: without one."""
        try:
            while True:
                kind, data = self.receive()
                if kind == CLOSE:
                    return int.from_bytes(data[:2], "big")
        except ConnectionError:
            return 0
