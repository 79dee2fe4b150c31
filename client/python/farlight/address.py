# SPDX-License-Identifier: MIT
"""Where a daemon is: an address, or a daemon of one's own."""
from __future__ import annotations

import os
import re
import shutil
import socket
import subprocess
import tempfile
from dataclasses import dataclass
from typing import IO, Optional

from .errors import ConnectionLost, Error, FileFailed, InvalidValue

REMOTE_SOCKET = "/run/farlight/farlight.sock"
TRY_AGAIN_STATUS, FIRST_SIGNAL_STATUS = 75, 128  # of our programs; ssh has 255


@dataclass
class Link:
    """A connected socket, and the program that holds its other end, if we started one."""
    socket: socket.socket
    process: Optional["subprocess.Popen[bytes]"] = None
    talk: Optional[IO[bytes]] = None  # what the program says
    is_told: bool = False  # how it ended
    is_final: bool = False

    def last_words(self) -> tuple[str, bool]:
        """How a program that has closed its end ended, with its last line; and whether it would do so again."""
        if self.process is None:
            return "", False
        try:
            status = self.process.wait(1)
        except subprocess.TimeoutExpired:
            return "", False
        name = os.path.basename(str(self.process.args[0])) if isinstance(self.process.args, list) else "it"
        words = f"{name} ended with status {status}" if status >= 0 else f"{name} was ended by signal {-status}"
        line = b""
        if self.talk is not None:
            self.talk.seek(max(0, self.talk.seek(0, os.SEEK_END) - 2048))
            lines = [one for one in self.talk.read().strip().splitlines() if not one.startswith(b"READY")]
            line = lines[-1][:400] if lines else b""
        text = "".join(one if one.isprintable() else "?" for one in line.decode("utf-8", "replace"))
        return f"{words}: {text}" if text else words, 0 < status < FIRST_SIGNAL_STATUS and status != TRY_AGAIN_STATUS

    def end(self) -> None:
        """Ends the program, which has nothing to finish."""
        if self.process is not None:
            self.process.terminate()

    def close(self) -> None:
        """Closes the socket, and sees that the program ends."""
        self.socket.close()
        if self.talk is not None:
            self.talk.close()
        if self.process is not None:
            for end in (lambda: None, self.process.terminate, self.process.kill):
                end()
                try:
                    self.process.wait(3)
                    return
                except subprocess.TimeoutExpired:
                    continue


def find_program(name: str) -> str:
    """In the folder of FARLIGHT_LIBEXEC, else in PATH."""
    folder = os.environ.get("FARLIGHT_LIBEXEC")
    found = (shutil.which(name, path=folder) if folder else None) or shutil.which(name)
    if found is None:
        raise FileFailed("this program, a part of farlight, is not installed", field=name,
                         remedy="put it into PATH, or name its folder in FARLIGHT_LIBEXEC")
    return found


def start_program(name: str, arguments: list[str], is_remote: bool = False) -> Link:
    """Starts a program with a socket as its descriptor, or, as ssh wants it, as its standard input and output."""
    path = find_program(name)
    ours, theirs = socket.socketpair()
    talk = None
    try:
        if is_remote:
            process = subprocess.Popen([path, *arguments], stdin=theirs.fileno(), stdout=theirs.fileno())
        else:
            talk = tempfile.TemporaryFile()
            # In a process group of its own: a Ctrl-C is for us, and we end it properly.
            process = subprocess.Popen([path, "--fd", str(theirs.fileno()), *arguments], pass_fds=[theirs.fileno()],
                                       stdin=subprocess.DEVNULL, stdout=talk, stderr=talk, process_group=0)
    except OSError as why:
        ours.close()
        raise FileFailed(f"cannot be started: {why.strerror}", field=path) from None
    finally:
        theirs.close()
    return Link(ours, process, talk)


def _connect(server: str, family: int, where: object, timeout: float) -> socket.socket:
    made = socket.socket(family, socket.SOCK_STREAM)
    made.settimeout(timeout)
    try:
        made.connect(where)  # type: ignore[arg-type]
    except OSError as why:
        made.close()
        retryable = isinstance(why, (ConnectionRefusedError, FileNotFoundError, BlockingIOError, TimeoutError))
        raise ConnectionLost(f"no daemon can be reached: {why.strerror or why}", field=server, retryable=retryable,
                             remedy="start one with 'farlightd --listen ADDRESS', or leave the address out") from None
    return made


def _connect_tcp(server: str, timeout: float) -> socket.socket:
    found = re.fullmatch(r"tcp:(?:\[([^][]+)\]|([^][:]+)):(\d{1,5})", server)
    if not found or not 0 < int(found[3]) < 65536:
        raise InvalidValue("is not tcp:HOST:PORT with a port of 1 to 65535", field=server)
    try:
        places = socket.getaddrinfo(found[1] or found[2], int(found[3]), type=socket.SOCK_STREAM)
    except socket.gaierror as why:
        raise ConnectionLost(f"unknown host: {why.strerror}", field=server,
                             retryable=why.errno == socket.EAI_AGAIN) from None
    failure: ConnectionLost | None = None
    for family, _, _, _, where in places:
        try:
            made = _connect(server, family, where, timeout)
            made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return made
        except ConnectionLost as why:
            failure = why
    raise failure or ConnectionLost("unknown host", field=server)


def _start_ssh(server: str) -> Link:
    host, _, path = server.removeprefix("ssh:").partition(":")
    path = path or REMOTE_SOCKET
    if not host or host.startswith("-") or not re.fullmatch(r"[\w/.+@%,=-]+", path, re.ASCII):
        raise InvalidValue("is not ssh:HOST[:SOCKET] with a path of letters, digits and /._-+@%,=", field=server)
    return start_program("ssh", ["-T", "--", host, "farlight", "bridge", f"unix:{path}"], is_remote=True)


def usual_server() -> str | None:
    """What is meant where no address is given: FARLIGHT_SERVER; None: a daemon of one's own."""
    return os.environ.get("FARLIGHT_SERVER") or None


def usual_key(server: str | None) -> str | None:
    """FARLIGHT_KEY, over TCP."""
    return os.environ.get("FARLIGHT_KEY") or None if server and server.startswith("tcp:") else None


def tell_end(why: Error | None, link: Link | None) -> bool:
    """Adds to a lost connection how the program at its other end ended, if we started it; whether it would do so again."""
    if link is None or link.process is None or type(why) is not ConnectionLost or link.is_told:
        return link is not None and link.is_final
    words, link.is_final = link.last_words()
    link.is_told = bool(words)
    why.text += f": {words}" if words else ""
    return link.is_final


def explain(why: Error, server: str | None, link: Link | None) -> None:
    """Adds to an error of the beginning where it happened, and what the program there said."""
    why.field = why.field or server or "farlightd"
    if tell_end(why, link):
        why.retryable = False


def open_link(server: str | None, timeout: float) -> Link:
    """unix:PATH, tcp:HOST:PORT, ssh:HOST[:SOCKET]; None starts a daemon, which ends with the connection."""
    if server is None:
        return start_program("farlightd", [])
    if server.startswith("ssh:"):
        return _start_ssh(server)
    if server.startswith("tcp:"):
        return Link(_connect_tcp(server, timeout))
    if server.startswith("unix:") and 0 < len(os.fsencode(server)) - 5 < 108:
        return Link(_connect(server, socket.AF_UNIX, server[5:], timeout))
    raise InvalidValue("is not an address of a daemon", field=server,
                       remedy="give unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET]")
