# SPDX-License-Identifier: MIT
"""The client's end of a sealed connection, written from protocol.md and from RFC 7748 and 8439 alone, with nothing but
hashlib for BLAKE2b: a second opinion on what the C side computes. Slow, and careless about how long things take, which
real ones must not be."""
import hashlib
import os
import struct

PRIME = 2**255 - 19


def x25519(secret, point):
    """RFC 7748, the Montgomery ladder."""
    k = int.from_bytes(bytes([secret[0] & 248]) + secret[1:31] + bytes([secret[31] & 127 | 64]), "little")
    u = int.from_bytes(point, "little") & (2**255 - 1)
    x2, z2, x3, z3, swap = 1, 0, u, 1, 0
    for t in reversed(range(255)):
        bit = k >> t & 1
        if swap != bit:
            x2, x3, z2, z3 = x3, x2, z3, z2
        swap = bit
        a, b, c, d = x2 + z2, x2 - z2, x3 + z3, x3 - z3
        da, cb, aa, bb = d * a, c * b, a * a, b * b
        e = aa - bb
        x3, z3 = (da + cb)**2 % PRIME, u * (da - cb)**2 % PRIME
        x2, z2 = aa * bb % PRIME, e * (aa + 121665 * e) % PRIME
    if swap:
        x2, z2 = x3, z3
    return (x2 * pow(z2, PRIME - 2, PRIME) % PRIME).to_bytes(32, "little")


def public_key(secret):
    return x25519(secret, (9).to_bytes(32, "little"))


def _rounds(state):
    x = list(state)
    for _ in range(10):
        for a, b, c, d in ((0, 4, 8, 12), (1, 5, 9, 13), (2, 6, 10, 14), (3, 7, 11, 15),
                           (0, 5, 10, 15), (1, 6, 11, 12), (2, 7, 8, 13), (3, 4, 9, 14)):
            for one, two, three, turn in ((a, b, d, 16), (c, d, b, 12), (a, b, d, 8), (c, d, b, 7)):
                x[one] = (x[one] + x[two]) & 0xffffffff
                mixed = x[three] ^ x[one]
                x[three] = (mixed << turn | mixed >> (32 - turn)) & 0xffffffff
    return x


CONSTANTS = struct.unpack("<4I", b"expand 32-byte k")


def chacha20(key, nonce, counter, data):
    """RFC 8439 with a nonce of 12 bytes."""
    out, words = bytearray(), struct.unpack("<8I", key)
    for i in range(0, len(data), 64):
        state = (*CONSTANTS, *words, counter + i // 64, *struct.unpack("<3I", nonce))
        block = struct.pack("<16I", *((a + b) & 0xffffffff for a, b in zip(_rounds(state), state)))
        out += bytes(a ^ b for a, b in zip(data[i:i + 64], block))
    return bytes(out)


def hchacha20(key, head):
    x = _rounds((*CONSTANTS, *struct.unpack("<8I", key), *struct.unpack("<4I", head)))
    return struct.pack("<8I", *x[:4], *x[12:])


def poly1305(key, data):
    r = int.from_bytes(key[:16], "little") & 0x0ffffffc0ffffffc0ffffffc0fffffff
    total = 0
    for i in range(0, len(data), 16):
        total = (total + int.from_bytes(data[i:i + 16] + b"\1", "little")) * r % (2**130 - 5)
    return ((total + int.from_bytes(key[16:], "little")) & (2**128 - 1)).to_bytes(16, "little")


class Stream:
    """crypto_secretstream_xchacha20poly1305, one direction, of fewer than 2^32 records."""
    MESSAGE, FINAL = 0, 3

    def __init__(self, key, header):
        self.key, self.inner, self.counter = hchacha20(key, header[:16]), header[16:], 1

    def _apply(self, tag_in, tag_out, data_in, extra):
        """The other text, and the code over what is sealed; which of the two it is the tags say."""
        nonce = struct.pack("<I", self.counter) + self.inner
        one_time = chacha20(self.key, nonce, 0, bytes(64))[:32]
        block = chacha20(self.key, nonce, 1, bytes([tag_in]) + bytes(63))
        data_out = chacha20(self.key, nonce, 2, data_in)
        tag, sealed = (block[0], data_out) if tag_out is None else (tag_out, data_in)
        rest = bytes([tag]) + block[1:] + sealed
        # The paddings are libsodium's: that of the text counts from 16 bytes fewer than RFC 8439 would.
        whole = extra + bytes(-len(extra) % 16) + rest + bytes((16 - 64 + len(sealed)) % 16)
        whole += struct.pack("<QQ", len(extra), 64 + len(sealed))
        return block[0], data_out, poly1305(one_time, whole)

    def _turn(self, code):
        self.inner = bytes(a ^ b for a, b in zip(self.inner, code))
        self.counter += 1

    def push(self, plain, tag, extra):
        sealed_tag, sealed, code = self._apply(tag, None, plain, extra)
        self._turn(code)
        return bytes([sealed_tag]) + sealed + code

    def pull(self, record, extra):
        tag, plain, code = self._apply(record[0], record[0], record[1:-16], extra)
        if code != record[-16:]:
            raise ValueError("a record was changed")
        self._turn(code)
        return plain, tag


def blake2b(data, key=b"", size=32):
    return hashlib.blake2b(data, key=key, digest_size=size).digest()


class Refused(Exception):
    """The daemon's status."""


class Client:
    """Bytes in, bytes out; the random numbers may be given."""

    def __init__(self, key, secret=None, nonce=None, header=None):
        self.key, self.secret = key, secret or os.urandom(32)
        self.header = header or os.urandom(24)
        self.message_1 = b"SEAL" + bytes((1, 1, 0, 0)) + public_key(self.secret) + (nonce or os.urandom(32))
        self.message_2 = self.message_3 = None
        self.sending = self.receiving = None

    def _derive(self, label):
        label = b"farlight sealed " + label
        return blake2b(label + bytes(32 - len(label)) + self.up + self.down + self.message_1 + self.message_2, self.key)

    def proving(self, message_2):
        """Message 3, in answer to message 2."""
        if message_2[:5] != b"SEAL\2" or message_2[5]:
            raise Refused(message_2[5])
        self.message_2 = message_2
        shared = x25519(self.secret, message_2[8:40])
        both = blake2b(shared + self.message_1[8:40] + message_2[8:40], size=64)
        self.down, self.up = both[:32], both[32:]
        begun = b"SEAL\3\0\0\0" + self.header
        self.message_3 = begun + blake2b(begun, self._derive(b"client proof"))
        self.sending = Stream(self._derive(b"client stream"), self.header)
        return self.message_3

    def finish(self, message_4):
        if message_4[:5] != b"SEAL\4" or message_4[5]:
            raise Refused(message_4[5])
        if blake2b(self.message_3 + message_4[:32], self._derive(b"server proof")) != message_4[32:]:
            raise ValueError("the server does not have the key")
        self.receiving = Stream(self._derive(b"server stream"), message_4[8:32])

    def seal(self, plain, last=False):
        head = struct.pack("<I", len(plain) + 17)
        return head + self.sending.push(plain, Stream.FINAL if last else Stream.MESSAGE, head)

    def open(self, record):
        """Plain text and tag of one whole record."""
        return self.receiving.pull(record[4:], record[:4])
