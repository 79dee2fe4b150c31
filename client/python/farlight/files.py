# SPDX-License-Identifier: MIT
"""Files that are complete or not there at all."""
from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from typing import IO, Any

from .errors import FileFailed


def write(path: str | os.PathLike[str], fill: Callable[[IO[bytes]], Any]) -> None:
    """Under a temporary name, then renamed; FileFailed."""
    name, temporary = os.fspath(path), ""
    try:
        descriptor, temporary = tempfile.mkstemp(dir=os.path.dirname(name) or ".", prefix=".farlight-")
        with open(descriptor, "wb") as file:
            umask = os.umask(0)
            os.umask(umask)
            os.fchmod(file.fileno(), 0o666 & ~umask)
            fill(file)
        os.replace(temporary, name)
        temporary = ""
    except OSError as why:
        raise FileFailed(f"cannot be written: {why.strerror}", field=name) from None
    finally:
        if temporary:
            os.unlink(temporary)
