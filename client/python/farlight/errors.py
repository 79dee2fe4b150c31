# SPDX-License-Identifier: MIT
"""Exceptions. Every exception of this package is an Error: it names the field at fault, says what is wrong, and if possible
what to do about it."""
from __future__ import annotations


class Error(Exception):
    """An error. `field`: the field, file or address at fault. `retryable`: the same call may succeed later."""

    def __init__(self, text: str, *, field: str = "", remedy: str = "", retryable: bool = False) -> None:
        super().__init__(text)
        self.text, self.field, self.remedy, self.retryable = text, field, remedy, retryable

    def __str__(self) -> str:
        return (f"{self.field}: " if self.field else "") + self.text + (f"; {self.remedy}" if self.remedy else "")


class InvalidValue(Error, ValueError):
    """A value is not allowed; nothing was sent."""


class FileFailed(Error):
    """A model, a key or a program cannot be used."""


class ImportFailed(Error):
    """The importer refused a model."""


class ConnectionLost(Error):
    """No daemon could be reached, or the connection to it ended."""

    def __init__(self, text: str, *, field: str = "", remedy: str = "", retryable: bool = True) -> None:
        super().__init__(text, field=field, remedy=remedy, retryable=retryable)


class TimedOut(ConnectionLost):
    """The daemon was silent for too long. The connection is dropped."""


class ProtocolError(Error):
    """The other side sent an invalid message. The connection is dropped."""


class Refused(Error):
    """The daemon answered with an error; `code` is its messages.ErrorCode."""

    def __init__(self, text: str, *, code: int, field: str = "", remedy: str = "", retryable: bool = False,
                 retry_after_s: float = 0) -> None:
        super().__init__(text, field=field, remedy=remedy, retryable=retryable)
        self.code, self.retry_after_s = code, retry_after_s


class Cancelled(Refused):
    """The job was cancelled by its own client."""
