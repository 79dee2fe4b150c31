# SPDX-License-Identifier: MIT
"""A short run of what `make soak` does, and that its verdict finds what is not flat."""
import pathlib
import sys

from farlight_test import ROOT, Case

sys.path.insert(0, str(ROOT / "tests/soak"))
import flat  # pylint: disable=wrong-import-position
import load  # pylint: disable=wrong-import-position
import soak  # pylint: disable=wrong-import-position

ROUNDS, SETTLED = 10, 4  # after so many every size and way had its turn
STACK_BYTES = (8 << 20) + (92 << 10)


def samples(count, **more):
    """Of a daemon that stays as it is but for `more`: name -> function of a sample's number."""
    one = dict(rss=150 << 20, data=190 << 20, threads=9, descriptors=8, scenes=0, clients=1, jobs=0, host_bytes=0,
               device_bytes=0, device_objects=40, blob_bytes=1000)
    return [{name: more[name](i) if name in more else value for name, value in one.items()} for i in range(count)]


class Verdicts(Case):
    def complaints(self, rounds=20, count=51, **more):
        return flat.Verdict(samples(count, **more), rounds, count // 3).complaints

    def test_what_stays_is_flat_and_so_is_what_only_comes_and_goes(self):
        self.assertEqual(self.complaints(), [])
        self.assertEqual(self.complaints(rss=lambda i: (150 << 20) + (i % 7 << 18)), [])

    def test_what_is_loaded_at_first_does_not_count(self):
        self.assertEqual(self.complaints(rss=lambda i: (150 if i else 60) << 20, threads=lambda i: 9 if i else 8), [])

    def test_a_leak_of_a_few_bytes_each_time_is_found(self):
        """As much as one round of 10 connects, one upload and 100 frames loses if a connect loses 300 bytes."""
        for at in (100, 40, 20):  # beside a late thread's stack, too
            found = self.complaints(rss=lambda i: (150 << 20) + i * 20 * 3000 + (i % 7 << 17) + STACK_BYTES * (i >= at))
            self.assertEqual(len(found), 1, at)

    def test_what_rises_once_or_twice_whenever_that_is_is_no_leak(self):
        """A thread's stack, which stays reserved when the thread ends; a program that the driver compiles late."""
        for first in range(1, 51):
            for second in range(first, 51):
                rises = {name: lambda i: (190 << 20) + STACK_BYTES * ((i >= first) + (i >= second)) for name in flat.MEMORY}
                self.assertEqual(self.complaints(**rises), [], (first, second))

    def test_one_descriptor_thread_or_object_more_is_found(self):
        for name in ("descriptors", "threads", "device_objects", "device_bytes"):
            found = self.complaints(**{name: lambda i: 8 + (i > 30)})
            self.assertEqual(len(found), 1)
            self.assertIn(name, found[0])

    def test_blobs_beyond_their_cache_are_found(self):
        self.assertEqual(len(self.complaints(blob_bytes=lambda i: 2 << 20)), 1)


class Short(Case):
    def test_some_connects_uploads_and_frames_leave_nothing_behind(self):
        taken, clients = soak.soak(pathlib.Path(self.folder), ROUNDS, load.SHORT, SETTLED, linger_s=0)
        self.assertGreaterEqual(clients.connects, 10 * ROUNDS)
        self.assertEqual(clients.uploads, ROUNDS)
        self.assertGreaterEqual(clients.frames, 25 * ROUNDS)
        verdict = flat.Verdict(taken, 1, SETTLED, memory=False)
        self.assertEqual(verdict.complaints, [], verdict.rows)


if __name__ == "__main__":
    import farlight_test
    farlight_test.unittest.main()
