# SPDX-License-Identifier: MIT
"""Every real model renders, whole way: file, importer, daemon, exporter. Hostile ones render or are refused by name."""
import concurrent.futures
import json
import pathlib

import farlight_test
from farlight_test import LONG, SHARED_SCENES, Case, Daemon, farlight, grid_means, needs_shared_scenes, read_png

ENDINGS = {".glb", ".gltf", ".obj", ".nff"}
# Bigger ones than this are for the benchmark; the test must end on two cores under a sanitizer.
SIZE_MAX_BYTES = 6_000_000
# All hostile files go through the importer in test_import; of them every 8th goes the whole way, all in a long run.
HOSTILE_STRIDE = 1 if LONG else 8
# So do all others; of glTF's samples, which are most of them, every third goes the whole way.
GLTF_STRIDE = 1 if LONG else 3


def models(*folders):
    return sorted(path for folder in folders for path in (SHARED_SCENES / folder).rglob("*")
                  if path.suffix.lower() in ENDINGS and path.is_file())


def pixels(path):
    _, _, rows, channels = read_png(path)
    return [row[x:x + channels] for row in rows for x in range(0, len(row), channels)]


@needs_shared_scenes
class Models(Case):
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
        paths = models("common", "ldc", "bvh", "rayspace", "screenspace") + models("gltf")[::GLTF_STRIDE]
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

    def test_the_reference_tracer_gives_the_picture_of_bvh(self):
        """Spheres, cutouts, glass, instances. 0.5 of 255 in the mean over a cell of 300 pixels: one pixel on an edge
        that goes from black to half white. Not here: models with two surfaces in one place (the leaves of
        ldc/oaktree.gltf), where each tracer may see the other one."""
        names = ("gltf/khronos/ClearCoat-glTF/ClearCoatTest.gltf", "gltf/samplebuilding_glass.gltf",
                 "gltf/chinesedragon.gltf", "bvh/spd-balls-3.nff", "bvh/spd-gears-2.nff")
        with Daemon() as daemon:
            for name in names:
                with self.subTest(model=name):
                    means = []
                    for tracer in ("bvh", "reference"):
                        output = self.folder / f"{tracer}.png"
                        result = farlight("render", SHARED_SCENES / name, "--server", daemon.address, "--size", "160x120",
                                          "--tracer", tracer, "--primary", "trace", "--quiet", "-o", output)
                        if tracer == "reference" and "libembree-dev" in result.stderr:
                            self.skipTest("this farlightd was built without Embree")
                        self.expect(result, 0)
                        means.append(grid_means(output))
                    for got, want in zip(means[1], means[0]):
                        for channel in range(3):
                            self.assertAlmostEqual(got[channel], want[channel], delta=0.5, msg=name)

    def test_the_standard_procedural_databases_have_their_primitives_and_show_them(self):
        """Spheres are exact, polygons triangles, a cone or cylinder has 64 triangles. What covers the picture is held
        against one of the same view with nothing in it: all of it where the camera sees ground only."""
        databases = {  # triangles, spheres, minimum and maximum share of the picture that is covered
            "spd-balls-2": (2, 91, 1, 1), "spd-balls-3": (2, 820, 1, 1), "spd-balls-4": (2, 7381, 1, 1),
            "spd-balls-5": (2, 66430, 1, 1), "spd-gears-2": (4578, 0, 0.6, 0.99), "spd-gears": (36610, 0, 0.7, 0.99),
            "spd-mount": (8192, 4, 0.4, 0.8), "spd-rings": (64 * 4200 + 2, 4200, 0.95, 1),
            "spd-teapot": (2328, 0, 0.4, 0.8), "spd-tetra": (4096, 0, 0.15, 0.5),
            "spd-tree": (64 * 4095 + 2, 4095, 0.5, 0.8)}
        self.assertEqual(set(databases), {path.stem for path in (SHARED_SCENES / "bvh").glob("spd-*.nff")})
        with Daemon() as daemon:
            for name, (triangles, spheres, minimum, maximum) in databases.items():
                with self.subTest(database=name):
                    path = SHARED_SCENES / "bvh" / f"{name}.nff"
                    info = json.loads(self.expect(farlight("info", "--json", path), 0).stdout)
                    self.assertEqual((info["triangles"], info["spheres"], info["notes"]), (triangles, spheres, []))
                    empty = self.folder / f"{name}-empty.nff"
                    statements = path.read_text(encoding="utf-8").splitlines()
                    last_light = max(i for i, line in enumerate(statements) if line.startswith("l "))
                    eye, middle = ([float(x) for x in line.split()[1:]] for line in statements
                                   if line.startswith(("from ", "at ")))
                    behind = [2 * e - m for e, m in zip(eye, middle)]
                    empty.write_text("\n".join(statements[:last_light + 1]) + "\ns %g %g %g 0.001\n" % tuple(behind),
                                     encoding="utf-8")
                    _, shown, result = self.render(path, daemon, self.folder / f"{name}.png", "48x48")
                    self.expect(result, 0)
                    _, background, result = self.render(empty, daemon, self.folder / f"{name}-empty.png", "48x48")
                    self.expect(result, 0)
                    self.assertEqual(len(set(pixels(background))), 1)
                    covered = sum(a != b for a, b in zip(pixels(shown), pixels(background))) / (48 * 48)
                    self.assertTrue(minimum <= covered <= maximum, f"{covered} is covered")

    def test_barts_scenes_move_and_show_their_images(self):
        """Kitchen, museum and robots at two times of their animations: the camera goes on, and no picture has the marker of
        a missing image, magenta (which with light on it may be dark, but never has green). The museum alone by default:
        test_import_aff imports all three."""
        with Daemon() as daemon:
            scenes = (("museum/aff/museum5", (1, 4)), ("kitchen/aff/kitchen", (0, 9)), ("robot/aff/Robot", (0, 20)))
            for name, times in scenes if LONG else scenes[:1]:
                means = []
                for time in times:
                    output = self.folder / "bart.png"
                    self.expect(farlight("render", SHARED_SCENES / "rayspace" / "bart" / f"{name}.aff", "--server",
                                         daemon.address, "--size", "64x48", "--depth", "2", "--samples", "4", "--quiet",
                                         "--clip", "animation", "--clip-start", f"-{time}", "-o", output), 0)
                    colours = pixels(output)
                    self.assertGreater(len(set(colours)), 300, f"{name} at {time} s")
                    self.assertFalse([c for c in colours if c[0] > 60 and c[2] > 60 and c[1] < 10], f"{name} at {time} s")
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
