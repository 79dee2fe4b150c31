# SPDX-License-Identifier: MIT
"""Addresses of daemons, and private daemons."""
from __future__ import annotations

import contextlib
import itertools
import os
import re
import shlex
import shutil
import socket
import subprocess
import tempfile
from dataclasses import dataclass
from typing import IO, Optional

from .errors import ConnectionLost, Error, FileFailed, InvalidValue, TimedOut

REMOTE_SOCKET = "/run/farlight/farlight.sock"
TRY_AGAIN_STATUS, FIRST_SIGNAL_STATUS = 75, 128  # our programs' statuses; ssh has 255
# Variables for a program that reads other people's files; it must not see tokens and passwords (client/lib/process.c).
PASSED = re.compile("PATH|LANG|LANGUAGE|LC_.*|TZ|TZDIR|LD_.*|GLIBC_.*|GCOV_.*|LLVM_PROFILE_FILE|(A|L|UB)SAN_OPTIONS|FARLIGHT_UNCONFINED")
TALK_BYTES = 16 << 20  # limit of ssh's output before it is ended, since another host chooses a part of it


@dataclass
class Link:
    """A connected socket, and the program at its other end, if we started it."""
    socket: socket.socket
    process: Optional["subprocess.Popen[bytes]"] = None
    talk: Optional[IO[bytes]] = None  # the program's output
    remote: tuple[str, str] = ("", "")  # ssh only: the host, and the daemon's address there
    name: str = ""  # the program's name
    server: str = "farlightd"  # the address, if there is one
    is_final: bool = False
    words: str = ""  # how the program ended, once this is known

    def last_line(self) -> str:
        """The last line of the program's output."""
        if self.talk is None:
            return ""
        number = self.talk.fileno()  # its file offset is shared with the program, hence pread
        end = os.pread(number, 2048, max(0, os.fstat(number).st_size - 2048))
        lines = [one for one in end.strip().splitlines() if not one.startswith(b"READY")]
        name = self.name.encode() + b": "  # prefix of an error and, in the next line, its remedy
        told = [one.removeprefix(name) for one in itertools.takewhile(lambda one: one.startswith(name), reversed(lines))]
        line = b"; ".join(reversed(told or lines[-1:]))[:400]
        return "".join(one if one.isprintable() else "?" for one in line.decode("utf-8", "replace"))

    def last_words(self) -> tuple[str, bool]:
        """Says how a program that has closed its end ended, with its last line, and whether another start would end the same
        way."""
        if self.process is None:
            return "", False
        try:
            status = self.process.wait(1)
        except subprocess.TimeoutExpired:
            return "", False
        name = os.path.basename(str(self.process.args[0])) if isinstance(self.process.args, list) else "it"
        words = f"{name} ended with status {status}" if status >= 0 else f"{name} was ended by signal {-status}"
        line = self.last_line()
        return f"{words}: {line}" if line else words, 0 < status < FIRST_SIGNAL_STATUS and status != TRY_AGAIN_STATUS

    def end(self) -> None:
        """Ends the program, which has nothing to finish."""
        if self.process is not None:
            self.process.terminate()

    def close(self) -> None:
        """Closes the socket and waits for the program's end."""
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
    """Finds a program in the folder FARLIGHT_LIBEXEC, else in PATH."""
    folder = os.environ.get("FARLIGHT_LIBEXEC")
    found = (shutil.which(name, path=folder) if folder else None) or shutil.which(name)
    if found is None:
        raise FileFailed("this program, a part of farlight, is not installed", field=name,
                         remedy="put it into PATH, or name its folder in FARLIGHT_LIBEXEC")
    return found


def _bound_talk(process: int) -> None:
    with contextlib.suppress(ImportError, AttributeError, OSError):  # systems other than Linux
        import resource  # pylint: disable=import-outside-toplevel
        resource.prlimit(process, resource.RLIMIT_FSIZE, (TALK_BYTES, TALK_BYTES))


def start_program(name: str, arguments: list[str], remote: tuple[str, str] = ("", "")) -> Link:
    """Starts a program with a socket as a descriptor, or for ssh as standard input and output."""
    path = find_program(name)
    ours, theirs = socket.socketpair()
    talk = tempfile.TemporaryFile()
    try:
        if any(remote):
            process = subprocess.Popen([path, *arguments], stdin=theirs.fileno(), stdout=theirs.fileno(), stderr=talk)
            _bound_talk(process.pid)
        else:
            environment = {variable: value for variable, value in os.environ.items() if PASSED.fullmatch(variable)}
            # The daemon gets a process group of its own: Ctrl-C is for us, and we end the daemon properly.
            process = subprocess.Popen([path, "--fd", str(theirs.fileno()), *arguments], pass_fds=[theirs.fileno()],
                                       stdin=subprocess.DEVNULL, stdout=talk, stderr=talk, process_group=0,
                                       env=None if name == "farlightd" else environment)
    except OSError as why:
        ours.close()
        talk.close()
        raise FileFailed(f"cannot be started: {why.strerror}", field=path) from None
    finally:
        theirs.close()
    return Link(ours, process, talk, remote, name)


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
    return start_program("ssh", ["-T", "--", host, "farlight", "bridge", f"unix:{path}"], (host, f"unix:{path}"))


def usual_server() -> str | None:
    """The default address: FARLIGHT_SERVER; None: a private daemon."""
    return os.environ.get("FARLIGHT_SERVER") or None


def usual_key(server: str | None) -> str | None:
    """The default key file for TCP: FARLIGHT_KEY."""
    return os.environ.get("FARLIGHT_KEY") or None if server and server.startswith("tcp:") else None


def broken(why: OSError, link: Link | None) -> ConnectionLost:
    """Converts a failed system call. A program of ours that ends may or may not reset its socket: both mean that it closed it."""
    has_closed = link is not None and link.process is not None and isinstance(why, (BrokenPipeError, ConnectionResetError))
    return ConnectionLost("the daemon closed the connection" if has_closed else f"the connection broke: {why.strerror}")


def add_end(why: Error | None, link: Link | None) -> bool:
    """Adds to a lost connection how the program at the other end ended, if we started it; returns whether it would do so again."""
    if link is None or not isinstance(why, ConnectionLost):
        return link is not None and link.is_final
    why.field = why.field or link.server
    if not link.words and not isinstance(why, TimedOut):
        link.words, link.is_final = link.last_words()
        why.text += f": {link.words}" if link.words else ""
    return link.is_final


def explain(why: Error, link: Link) -> None:
    """Adds the address and the program's output to an error of connecting."""
    why.field = why.field or link.server
    if add_end(why, link):
        why.retryable = False
    if not any(link.remote) or not isinstance(why, ConnectionLost):
        return
    host, address = link.remote
    line = "" if link.words else link.last_line()
    why.text = f"no daemon can be reached: {link.words or why.text}" + (f": {line}" if line else "")
    why.remedy = f"try 'ssh {shlex.quote(host)} farlight ping --count 1 --server {address}' in a terminal"


def _open(server: str | None, timeout: float) -> Link:
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


def open_link(server: str | None, timeout: float) -> Link:
    """Connects to unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET]; None starts a private daemon, which ends with the connection."""
    link = _open(server, timeout)
    link.server = server or link.server
    return link
