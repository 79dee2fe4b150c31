# SPDX-License-Identifier: MIT
"""Names of bulk data."""
from __future__ import annotations

import hashlib

from .fields import Bytes

CHUNK_BYTES = 1 << 20


def blob_hash(data: Bytes) -> bytes:
    """BLAKE2b-256 over the BLAKE2b-256 hashes of the chunks."""
    view = memoryview(data).cast("B")
    names = b"".join(hashlib.blake2b(view[at:at + CHUNK_BYTES], digest_size=32).digest()
                     for at in range(0, len(view), CHUNK_BYTES))
    return hashlib.blake2b(names, digest_size=32).digest()
