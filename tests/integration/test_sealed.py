# SPDX-License-Identifier: MIT
"""Sealed connections, from outside: the stored session computed again by other means, a daemon that others than the
loopback may reach, keys that are right, wrong or open to others."""
import pathlib

import farlight_test
import sealed_link
from farlight_test import Case

GOLDEN = farlight_test.ROOT / "tests/unit/golden/sealed.hex"


class Golden(Case):
    """What the C side stored as golden bytes is what the document says."""

    def setUp(self):
        super().setUp()
        lines = (line.split(" ") for line in pathlib.Path(GOLDEN).read_text().splitlines())
        self.stored = {name: bytes.fromhex(value) for name, value in lines}

    def test_the_stored_session_is_the_documents(self):
        stored = self.stored
        client = sealed_link.Client(stored["key"], stored["client_secret"], stored["client_nonce"],
                                    stored["client_header"])
        self.assertEqual(client.message_1, stored["message_1"])
        self.assertEqual(stored["message_2"],
                         b"SEAL\2\0\0\0" + sealed_link.public_key(stored["server_secret"]) + stored["server_nonce"])
        self.assertEqual(client.proving(stored["message_2"]), stored["message_3"])
        self.assertEqual(stored["message_4"][8:32], stored["server_header"])
        client.finish(stored["message_4"])
        self.assertEqual(client.seal(stored["client_plain_1"]), stored["client_record_1"])
        self.assertEqual(client.seal(stored["client_plain_2"]), stored["client_record_2"])
        self.assertEqual(client.seal(b"", last=True), stored["client_last_record"])
        self.assertEqual(client.open(stored["server_record_1"]), (stored["server_plain_1"], sealed_link.Stream.MESSAGE))
        self.assertEqual(client.open(stored["server_last_record"]), (b"", sealed_link.Stream.FINAL))


if __name__ == "__main__":
    farlight_test.unittest.main()
