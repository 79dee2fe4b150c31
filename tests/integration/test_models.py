# SPDX-License-Identifier: MIT
"""Every real model renders, whole way: file, importer, daemon, exporter. Hostile ones render or are refused by name."""
import concurrent.futures
import json
import pathlib
import struct
import subprocess

import farlight_test
from farlight_test import LONG, SHARED_SCENES, Case, Daemon, farlight, grid_means, long_test, needs_shared_scenes, read_png

ENDINGS = {".glb", ".gltf", ".obj", ".nff"}
# Bigger ones than this are for the benchmark; the test must end on two cores under a sanitizer.
SIZE_MAX_BYTES = 6_000_000
# All hostile files go through the importer in test_import; of them every 60th goes the whole way, all in a long run.
HOSTILE_STRIDE = 1 if LONG else 60
# So do all others; of glTF's samples, which are most of them, every 20th goes the whole way.
GLTF_STRIDE = 1 if LONG else 20


def models(*folders):
    return sorted(path for folder in folders for path in (SHARED_SCENES / folder).rglob("*")
                  if path.suffix.lower() in ENDINGS and path.is_file())


def pixels(path):
    _, _, rows, channels = read_png(path)
    return [row[x:x + channels] for row in rows for x in range(0, len(row), channels)]


class Converter(Case):
    def convert(self, path, output):
        """BART's scenes as glTF. Debian's own Python has numpy."""
        made = subprocess.run(["/usr/bin/python3", farlight_test.ROOT / "tests/bench/aff_to_gltf.py", path, output], stderr=subprocess.PIPE,
                              text=True, check=False, timeout=farlight_test.TIMEOUT_S)
        self.assertEqual(made.returncode, 0, made.stderr)


class BartScenes(Converter):
    KEYS = ((-1, 0, 0, 0), (0, 0, 0, 0), (1, 2, 0, 0), (2, 2, 4, 0), (3, 2, 4, 0))

    def test_transforms_and_keys_of_aff_become_nodes_and_channels_of_gltf(self):
        (self.folder / "part.aff").write_text("% a triangle\nm vertices 3 0 0 0 1 0 0 0 1 0 triangles 1 0 1 2\n")
        keys = "\n".join(" ".join(map(str, key)) + " 0 0 0" for key in self.KEYS)
        (self.folder / "model.aff").write_text(
            "l 0 5 0 1 1 1\nfm 0 0 0 0.5 0.5 0.5 0 0 0 1 0 1\nx thing {\nxs 2 2 2 0 0 1 90 0 0 7 {\ni 0 part.aff\n}\n}\n"
            f"a 0 2 3\nk thing {{ transl {len(self.KEYS)}\n{keys} }}\n")
        self.convert(self.folder / "model.aff", self.folder / "model.glb")
        whole = (self.folder / "model.glb").read_bytes()
        size, = struct.unpack_from("<I", whole, 12)
        gltf = json.loads(whole[20:20 + size])

        def floats(number):
            accessor = gltf["accessors"][number]
            count = accessor["count"] * {"SCALAR": 1, "VEC3": 3}[accessor["type"]]
            return struct.unpack_from(f"<{count}f", whole, 28 + size + gltf["bufferViews"][accessor["bufferView"]]["byteOffset"])

        positions = gltf["accessors"][gltf["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
        for got, expected in ((positions["min"], (-2, 0, 7)), (positions["max"], (0, 2, 7))):  # a turn from x to y
            for a, b in zip(got, expected):
                self.assertAlmostEqual(a, b, delta=1e-6)
        sampler, = gltf["animations"][0]["samplers"]
        at_s, moved = floats(sampler["input"]), floats(sampler["output"])
        for time, *place in self.KEYS[1:-1]:
            got = moved[3 * at_s.index(time):][:3]
            self.assertTrue(all(abs(a - b) < 1e-6 for a, b in zip(got, place)), f"at {time} s: {got}, not {place}")
        self.expect(farlight("render", self.folder / "model.glb", "--size", "24x18", "--quiet", "-o", self.folder / "model.png"), 0)


@needs_shared_scenes
class Models(Converter):
    def render(self, path, daemon, output, size="64x48"):
        return path, output, farlight("render", path, "--server", daemon.address, "--size", size, "--depth", "2",
                                      "--quiet", "-o", output)

    def render_all(self, paths):
        """(path, output, result) of each, two at a time, through one daemon, which must outlive them all."""
        with Daemon() as daemon, concurrent.futures.ThreadPoolExecutor(2) as pool:
            jobs = [pool.submit(self.render, path, daemon, self.folder / f"{number}.png")
                    for number, path in enumerate(paths)]
            yield from (job.result() for job in jobs)
            self.assertIsNone(daemon.process.poll(), f"the daemon died: {daemon.messages()}")
            self.expect(farlight("stats", "--server", daemon.address), 0)

    def test_every_model_renders_and_shows_something(self):
        paths = models("common", "ldc", "bvh", "rayspace", "screenspace")[::1 if LONG else 6] + models("gltf")[::GLTF_STRIDE]
        small = [path for path in paths if path.stat().st_size <= SIZE_MAX_BYTES]
        print(f"{len(small)} models, {len(paths) - len(small)} above {SIZE_MAX_BYTES} bytes are left to make bench ", end="")
        for path, output, result in self.render_all(small):
            with self.subTest(model=str(path.relative_to(SHARED_SCENES))):
                # Points and lines have no surface: such a file is a picture of the background.
                self.expect(result, 0)
                width, height, rows, _ = read_png(output)
                self.assertEqual((width, height), (64, 48))
                if "Mesh_PrimitiveMode" not in path.parts:
                    self.assertGreater(len(set(b"".join(rows))), 2, "a picture of one colour")

    @long_test
    def test_the_reference_tracer_gives_the_picture_of_bvh(self):
        """Spheres, cutouts, glass, instances. 0.5 of 255 in the mean over a cell of 300 pixels: one pixel on an edge
        that goes from black to half white. Not here: models with two surfaces in one place (the leaves of
        ldc/oaktree.gltf), where each tracer may see the other one."""
        with Daemon() as daemon:
            for name in ("gltf/khronos/ClearCoat-glTF/ClearCoatTest.gltf", "gltf/samplebuilding_glass.gltf", "gltf/chinesedragon.gltf",
                         "bvh/spd-balls-3.nff", "bvh/spd-gears-2.nff"):
                means = []
                for tracer in ("bvh", "reference"):
                    result = farlight("render", SHARED_SCENES / name, "--server", daemon.address, "--size", "160x120", "--tracer",
                                      tracer, "--primary", "trace", "--quiet", "-o", self.folder / "x.png")
                    if tracer == "reference" and "libembree-dev" in result.stderr:
                        self.skipTest("this farlightd was built without Embree")
                    self.expect(result, 0)
                    means.append(grid_means(self.folder / "x.png"))
                apart = max(abs(a - b) for cells in zip(*means) for a, b in zip(*cells))
                self.assertLessEqual(apart, 0.5, name)

    @long_test
    def test_barts_scenes_move_and_show_their_images(self):
        """Kitchen, museum and robots at two times of their animations: the camera goes on. The converter fails where an image
        is missing."""
        with Daemon() as daemon:
            for name, times in (("museum/aff/museum5", (1, 4)), ("kitchen/aff/kitchen", (0, 9)), ("robot/aff/Robot", (0, 20))):
                means = []
                self.convert(SHARED_SCENES / "rayspace" / "bart" / f"{name}.aff", self.folder / "bart.glb")
                for time in times:
                    output = self.folder / "bart.png"
                    self.expect(farlight("render", self.folder / "bart.glb", "--server",
                                         daemon.address, "--size", "64x48", "--depth", "2", "--samples", "4", "--quiet",
                                         "--clip", "animation", "--clip-start", f"-{time}", "-o", output), 0)
                    colours = pixels(output)
                    self.assertGreater(len(set(colours)), 300, f"{name} at {time} s")
                    means.append(grid_means(output))
                # A twentieth of the range, on the average of all cells: the camera is in another place.
                apart = [abs(a - b) for cells in zip(*means) for a, b in zip(*cells)]
                self.assertGreater(sum(apart) / len(apart), 255 / 20, name)

    def test_hostile_files_are_rendered_or_refused_by_name_and_never_crash_anything(self):
        paths = models("hostile")[::HOSTILE_STRIDE]
        rendered = refused = 0
        for path, output, result in self.render_all(paths):
            name = str(path.relative_to(SHARED_SCENES))
            with self.subTest(model=name):
                self.assertIn(result.returncode, (0, 1), f"{name}: {result.stderr}")
                self.assertNotIn("Sanitizer", result.stderr)
                if result.returncode == 0:
                    read_png(output)
                    rendered += 1
                else:
                    self.assertIn(path.name, result.stderr)
                    self.assertFalse(pathlib.Path(output).exists())
                    refused += 1
        print(f"{len(paths)} files: {rendered} rendered, {refused} refused ", end="")
        self.assertGreater(rendered, 0)
        self.assertGreater(refused, 0)


if __name__ == "__main__":
    farlight_test.unittest.main()
