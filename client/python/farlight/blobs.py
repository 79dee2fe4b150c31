# SPDX-License-Identifier: MIT
"""Hashes that name bulk data."""
from __future__ import annotations

import concurrent.futures
import hashlib

from .fields import Bytes

CHUNK_BYTES = 1 << 20
THREADS_FROM_BYTES = 8 << 20


def _hash(data: Bytes) -> bytes:
    return hashlib.blake2b(data, digest_size=32).digest()


def blob_hash(data: Bytes) -> bytes:
    """Computes BLAKE2b-256 over the BLAKE2b-256 hashes of the chunks, for large data in threads."""
    view = memoryview(data).cast("B")
    chunks = (view[at:at + CHUNK_BYTES] for at in range(0, len(view), CHUNK_BYTES))
    if len(view) < THREADS_FROM_BYTES:
        return _hash(b"".join(map(_hash, chunks)))
    with concurrent.futures.ThreadPoolExecutor() as threads:
        return _hash(b"".join(threads.map(_hash, chunks)))
