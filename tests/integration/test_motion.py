# SPDX-License-Identifier: MIT
"""Motion vectors of animations and stills, as a compositor reads them."""
import base64
import json
import math
import struct

import farlight_test
from farlight_test import OneDaemon, exr_attributes, exr_channels, farlight, read_exr

FLOAT = 2
WIDTH, HEIGHT = 48, 36
CHANNELS = ["backward.u", "backward.v", "forward.u", "forward.v"]
# A metre at a distance of 5, in pixels.
SCALE = HEIGHT / 2 / math.tan(math.radians(20)) / 5
VIEW = ["--size", f"{WIDTH}x{HEIGHT}", "--eye", "0,0,5", "--look-at", "0,0,0", "--fov", "40", "--samples", "1", "--float"]


def model(folder):
    """Two squares that shine by the colours of their corners. The wall turns and its upper edge is drawn out by a morph
    target; the small one before it goes by 1 m to the right and 0.5 m down in the second of the clip."""
    numbers = [*(-4, -4, 0, 4, -4, 0, -4, 4, 0, 4, 4, 0), *(0.1, 0.2, 0.3, 0.8, 0.3, 0.1, 0.2, 0.9, 0.4, 0.7, 0.6, 0.9),
               *(0, 0, 0, 0, 0, 0, -1, 2, 0, 1, 2, 0), *(0, 1), *(-0.5, 0.25, 1, 0.5, -0.25, 1), *(0, 0, 0, 1, 0, 0, 0.5, 0.75 ** 0.5),
               *(0, 1)]
    lengths = [48, 48, 48, 8, 24, 32, 8]
    data = struct.pack(f"<{len(numbers)}f6H", *numbers, 0, 1, 2, 2, 1, 3)
    places = [sum(lengths[:i]) for i in range(len(lengths) + 1)]
    views = [{"buffer": 0, "byteOffset": at, "byteLength": size} for at, size in zip(places, [*lengths, 12])]
    kinds = [("VEC3", 4), ("VEC3", 4), ("VEC3", 4), ("SCALAR", 2), ("VEC3", 2), ("VEC4", 2), ("SCALAR", 2)]
    accessors = [{"bufferView": i, "componentType": 5126, "type": kind, "count": count} for i, (kind, count) in enumerate(kinds)]
    accessors[0].update(min=[-4, -4, 0], max=[4, 4, 0])
    accessors[2].update(min=[-1, 0, 0], max=[1, 2, 0])
    accessors[3].update(min=[0], max=[1])
    accessors.append({"bufferView": 7, "componentType": 5123, "type": "SCALAR", "count": 6})
    square = {"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 7, "material": 0}
    samplers = [{"input": 3, "output": output} for output in (4, 5, 6)]
    document = {
        "asset": {"version": "2.0"}, "extensionsUsed": ["KHR_materials_unlit"], "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"name": "wall", "mesh": 0, "translation": [0, 0, -1]}, {"name": "small", "mesh": 1, "scale": [0.2] * 3}],
        "meshes": [{"primitives": [{**square, "targets": [{"POSITION": 2}]}], "weights": [0]}, {"primitives": [square]}],
        "materials": [{"doubleSided": True, "extensions": {"KHR_materials_unlit": {}}}],
        "animations": [{"name": "go", "samplers": samplers, "channels": [
            {"sampler": i, "target": {"node": node, "path": path}}
            for i, (node, path) in enumerate(((1, "translation"), (0, "rotation"), (0, "weights")))]}],
        "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}],
        "bufferViews": views, "accessors": accessors}
    path = folder / "model.gltf"
    path.write_text(json.dumps(document))
    return path


class Motion(OneDaemon):
    def setUp(self):
        super().setUp()
        self.model = model(self.folder)

    def animate(self, *options, frames="1-2", layers="beauty,motion,id"):
        """Frame -> channels."""
        self.expect(farlight("animate", self.model, "-o", self.folder / "%d.exr", "--frames", frames, "--fps", "10", "--clip-once",
                             "--layers", layers, *VIEW, *options), 0)
        first, last = map(int, frames.split(":")[0].split("-"))
        return {n: read_exr(self.folder / f"{n}.exr")[2] for n in range(first, last + 1) if (self.folder / f"{n}.exr").exists()}

    def test_a_node_has_the_pixels_that_it_moves(self):
        """By a tenth of a metre to the right and half of that down, in each frame but before the first; and whatever the step."""
        small = {}
        for frames in ("1-3", "1-3:2"):
            for number, got in self.animate("--clip", "go", frames=frames).items():
                self.assertEqual({name: kind for name, kind in exr_channels(self.folder / f"{number}.exr").items() if "ward" in name},
                                 dict.fromkeys(CHANNELS, FLOAT))
                small.setdefault(number, []).append(got)
        self.assertEqual(small[3][0], small[3][1])
        place = -0.5 + 0.1 * 2
        column, row = round(WIDTH / 2 + place * SCALE), round(HEIGHT / 2 - (0.25 - 0.05 * 2) * SCALE)
        node = small[3][0]["id.node"][row * WIDTH + column]
        for number, (got, *_) in small.items():
            seen = [i for i, one in enumerate(got["id.node"]) if one == node]
            self.assertGreater(len(seen), 30)
            moved = 0 if number == 1 else 1
            # It is at a distance of 4 m; floats of some metres and a bind of 0.2 m, times 12 pixels a metre.
            for name, wanted in zip(CHANNELS, (-0.1 * moved, 0.05 * moved, 0.1, -0.05)):
                for i in seen:
                    self.assertAlmostEqual(got[name][i], wanted * SCALE * 5 / 4, delta=2e-4)

    def test_pictures_are_warped_into_the_next_ones(self):
        """Along an orbit, while a morph target and two nodes move. Where the pixels that are looked up show the same object,
        what is left is that colours are no linear function of the picture within two pixels: less than a step of 8 bits."""
        frames = self.animate("--clip", "go", "--orbit=20", frames="1-4")
        before, after = frames[3], frames[4]
        squared, plain, count = 0, 0, 0
        for i, node in enumerate(after["id.node"]):
            x, y = i % WIDTH + after["backward.u"][i], i // WIDTH - after["backward.v"][i]
            left, top = math.floor(x), math.floor(y)
            if node == 0 or not (0 <= left < WIDTH - 1 and 0 <= top < HEIGHT - 1):
                continue
            corners = [(top + b) * WIDTH + left + a for b in (0, 1) for a in (0, 1)]
            if any(before["id.node"][corner] != node for corner in corners):
                continue
            shares = [s * t for t in (1 - y + top, y - top) for s in (1 - x + left, x - left)]
            for channel in "RGB":
                warped = sum(share * before[channel][corner] for share, corner in zip(shares, corners))
                squared += (warped - after[channel][i]) ** 2
                plain += (before[channel][i] - after[channel][i]) ** 2
                count += 1
            # And the way back from there, to what interpolation of vectors loses within a pixel of 3.
            forward = sum(share * before["forward.u"][corner] for share, corner in zip(shares, corners))
            self.assertAlmostEqual(forward, -after["backward.u"][i], delta=0.05)
        psnr, unmoved = (-10 * math.log10(each / count) for each in (squared, plain))
        self.assertGreater(count, 3 * WIDTH * HEIGHT / 2)
        self.assertGreater(psnr, 20 * math.log10(255))
        self.assertLess(unmoved, psnr - 10, "the pictures differ, and by their motion")

    def test_a_part_has_the_vectors_of_the_whole(self):
        options = ["--clip", "go", "--orbit=10"]
        whole = self.animate(*options)[2]
        part = self.animate(*options, "--crop", "8,4,24,20")[2]
        for name in CHANNELS:
            self.assertEqual(part[name], [whole[name][(4 + i // 24) * WIDTH + 8 + i % 24] for i in range(24 * 20)])

    def test_a_still_has_the_motion_of_its_clips_alone(self):
        path = self.folder / "still.exr"
        for clips in ([], ["--clip", "go", "--time", "0.5"]):
            self.expect(farlight("render", self.model, "-o", path, "--layers", "motion", *VIEW, *clips), 0)
            got = read_exr(path)[2]
            self.assertEqual(sorted(got), CHANNELS)
            self.assertEqual(exr_attributes(path)["farlight/layers"].strip(b"\0"), b"motion")
            self.assertEqual(any(any(got[name]) for name in CHANNELS), bool(clips))

    def test_views_are_rendered_for_it_and_those_of_depth_layers_have_none(self):
        path = self.folder / "pair.exr"
        for layer in ("light", "motion"):
            self.expect(farlight("render", self.model, "-o", path, "--stereo", "0.065", "--layers", layer, *VIEW, "--clip", "go",
                                 "--integrator", "distributed"), 0)
        self.assertEqual(sorted(exr_channels(path)), CHANNELS)
        result = farlight("animate", self.model, "-o", self.folder / "%d.exr", "--frames", "1-4", "--upsample", "2", "--layers", "motion", *VIEW)
        self.assertIn("leave out motion", self.expect(result, 1).stderr)


if __name__ == "__main__":
    farlight_test.unittest.main()
