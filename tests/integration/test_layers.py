# SPDX-License-Identifier: MIT
"""Layers of an EXR file: which channels there are, that their numbers fit each other and the picture, and what is
refused."""
import math

import farlight_test
from farlight_test import Daemon, OneDaemon, bundled_scenes, exr_attributes, exr_channels, exr_parts, farlight, frames_of, read_exr

EYE, LOOK_AT = (0.3, 1.1, 3.1), (0.0, 0.9, 0.0)
VIEW = ["--size", "48x40", "--eye", ",".join(map(str, EYE)), "--look-at", ",".join(map(str, LOOK_AT)), "--fov", "50"]
ALL = "beauty,albedo,normal,depth,position,ao,id,unknown,crypto-object,crypto-material,motion"
UINT, HALF, FLOAT = 0, 1, 2
ZIP, DWAA = 3, 8  # OpenEXR's numbers of compressions
CHANNELS = {
    "beauty": {"R": HALF, "G": HALF, "B": HALF, "A": HALF},
    "albedo": {"albedo.R": HALF, "albedo.G": HALF, "albedo.B": HALF},
    "normal": {"normal.X": HALF, "normal.Y": HALF, "normal.Z": HALF},
    "depth": {"Z": FLOAT},
    "position": {"position.X": FLOAT, "position.Y": FLOAT, "position.Z": FLOAT},
    "ao": {"ao.Y": HALF},
    "id": {"id.node": UINT, "id.material": UINT},
    "unknown": {"unknown.Y": HALF},
    "crypto-object": {f"CryptoObject{n:02}.{one}": FLOAT for n in range(3) for one in ("red", "green", "blue", "alpha")},
    "crypto-material": {f"CryptoMaterial{n:02}.{one}": FLOAT for n in range(3) for one in ("red", "green", "blue", "alpha")},
    "motion": {f"{way}.{axis}": FLOAT for way in ("forward", "backward") for axis in "uv"},
}


class Layers(OneDaemon):
    def render(self, *options, name="x.exr", scene="cornell.glb", status=0):
        path = self.folder / name
        return path, self.expect(farlight("render", bundled_scenes() / scene, "-o", path, *VIEW, "--timings=json", *options),
                                 status)

    def read(self, *options, **more):
        return read_exr(self.render(*options, **more)[0])[2]

    def test_channels_are_those_of_the_layers_named(self):
        for layers in ("beauty", "depth", "id,albedo", ALL):
            with self.subTest(layers=layers):
                path, _ = self.render("--layers", layers)
                wanted = {}
                for layer in layers.split(","):
                    wanted.update(CHANNELS[layer])
                self.assertEqual(exr_channels(path), wanted)
                words = [word for name in CHANNELS if name in layers.split(",")
                         for word in ([f"{name}{n}" for n in range(3)] if name.startswith("crypto") else [name])]
                self.assertEqual(exr_attributes(path).get("farlight/layers", b"").decode().strip("\0"),
                                 ",".join(words) if layers != "beauty" else "")

        channels = exr_channels(self.render("--layers", ALL, "--float")[0])
        self.assertEqual({name: kind for name, kind in channels.items() if kind != FLOAT}, CHANNELS["id"])

    def test_the_picture_is_the_one_without_layers_or_passes(self):
        """Denoised, too, which changes no other layer."""
        for options in (("--float",), ("--samples", "2", "--exposure", "1", "--integrator", "path", "--denoise")):
            plain, layered = self.read(*options), self.read(*options, "--layers", ALL)
            self.assertEqual({name: layered[name] for name in "RGBA"}, plain, options)
        noisy = self.read(*options[:-1], "--layers", ALL)
        self.assertEqual({name for name in layered if layered[name] != noisy[name]}, {"R", "G", "B"})
        options = ["--layers", ALL, "--samples", "4", "--float"]
        self.assertEqual(self.read(*options, "--progressive=4"), self.read(*options, "--progressive=1"))

    def test_parts_of_the_light_add_up_to_the_picture(self):
        """Sums of some tens of floats in two orders: a few roundings of 2^-24, of values up to 4."""
        got = self.read("--layers", "beauty,light", "--float", "--samples", "2", "--exposure", "1")
        names = sorted({name.split(".")[0] for name in got} - set("RGBA"))
        self.assertEqual(names, ["background", "diffuse_direct", "diffuse_indirect", "emission", "specular_direct",
                                 "specular_indirect", "transmission"])
        for channel in "RGB":
            parts = [sum(values) for values in zip(*(got[f"{name}.{channel}"] for name in names))]
            self.assertGreater(max(parts), 0.5)
            for part, whole in zip(parts, got[channel]):
                self.assertAlmostEqual(part, whole, delta=2e-6 * max(whole, 1))
        result = self.render("--layers", "light", "--integrator", "whitted", status=1)[1]
        self.assertIn("choose distributed or path", result.stderr)

    def test_light_groups_are_layers_of_their_names(self):
        """Sums of some tens of floats in two orders: a few roundings of 2^-24, of values up to 4."""
        got = self.read("--light-group", "panel=light", "--light-group", "sky=environment", "--light-group", "panel=mirror*",
                        "--float", "--samples", "2", "--integrator", "path")
        self.assertEqual(set(got), {*"RGBA", *(f"light_{name}.{channel}" for name in ("panel", "rest", "sky") for channel in "RGB")})
        self.assertGreater(max(got["light_panel.G"]), 0.5)
        for channel in "RGB":
            for whole, *parts in zip(got[channel], *(got[f"light_{name}.{channel}"] for name in ("panel", "rest", "sky"))):
                self.assertAlmostEqual(sum(parts), whole, delta=2e-6 * max(whole, 1))

    def test_wrong_light_groups_are_refused(self):
        many = [word for n in range(8) for word in ("--light-group", f"g{n}=light")]
        for options, status, text in ((["--light-group", "a=lihgt"], 2, "--light-group a=lihgt: the scene has no node 'lihgt' (did you mean 'light'?"),
                                      (["--light-group", "a=no such node"], 2, "'glass sphere', 'block'"),
                                      (["--light-group", "a.b=light"], 2, "letters, digits and _"),
                                      (["--light-group", "rest=light"], 2, "choose another name"),
                                      (["--light-group", "a=light,"], 2, "no name of a node"),
                                      (many, 2, "there may be 7"),
                                      (["--light-group", "a=light", "--integrator", "whitted"], 1, "choose distributed or path"),
                                      (["--light-group", "a=light", "--integrator", "path", "--tracer", "ldc"], 1, "which node glows")):
            with self.subTest(options=options):
                self.assertIn(text, self.render(*options, status=status)[1].stderr)
        result = farlight("render", bundled_scenes() / "cornell.glb", "-o", self.folder / "x.png", "--light-group", "a=light")
        self.assertIn("png files do not have the layers of --light-group", self.expect(result, 2).stderr)

    def test_dwaa_loses_nothing_but_of_colours(self):
        """Y of a position or a normal too, which the library takes for a luminance by its name."""
        options = ["--layers", "albedo,ao,beauty,depth,id,normal,position", "--samples", "1"]
        plain, small = self.render(*options, name="zip.exr")[0], self.render(*options, "--exr-compression", "dwaa", name="dwaa.exr")[0]
        wanted = read_exr(plain)[2]
        self.assertEqual([head["compression"][0] for head in exr_parts(small)], [DWAA, ZIP])
        self.assertEqual(set(exr_channels(small)), {*"RGBA", "albedo.R", "albedo.G", "albedo.B"})
        got = read_exr(small, part=1)[2]
        self.assertEqual(set(got) | set(exr_channels(small)), set(wanted))
        for name, values in got.items():
            self.assertEqual(values, wanted[name], name)
        # What DWAA is made for: errors that are hardly seen.
        self.expect(farlight("compare", plain, small, "--fail-above", "psnr=35"), 0)
        self.assertEqual([head["compression"][0] for head in exr_parts(self.render("--exr-compression", "dwaa")[0])], [DWAA])
        result = farlight("render", bundled_scenes() / "cornell.glb", "-o", self.folder / "x.png", "--exr-compression", "dwaa")
        self.assertIn("png files do not have it", self.expect(result, 2).stderr)

    def test_places_depths_and_normals_fit_each_other_and_the_camera(self):
        """One sample, which lies in the middle of its pixel."""
        got = self.read("--layers", "beauty,normal,depth,position,id", "--float", "--primary", "trace", "--samples", "1")
        way = [b - a for a, b in zip(EYE, LOOK_AT)]
        length = math.hypot(*way)
        forward = [w / length for w in way]
        right = [-forward[2], 0, forward[0]]
        scale = 1 / math.hypot(*right)
        right = [scale * r for r in right]
        up = [right[1] * forward[2] - right[2] * forward[1], right[2] * forward[0] - right[0] * forward[2],
              right[0] * forward[1] - right[1] * forward[0]]
        seen = 0
        for i, depth in enumerate(got["Z"]):
            place = [got[f"position.{axis}"][i] for axis in "XYZ"]
            normal = [got[f"normal.{axis}"][i] for axis in "XYZ"]
            if got["id.node"][i] == 0:
                self.assertEqual([depth, *place, *normal], [0] * 7, "nothing is there")
                continue
            seen += 1
            ray = [p - e for p, e in zip(place, EYE)]
            # Single floats of a few metres: 1e-6 of them, times the few operations on the way.
            self.assertAlmostEqual(sum(r * f for r, f in zip(ray, forward)), depth, delta=2e-5)
            self.assertAlmostEqual(math.hypot(*normal), 1, delta=1e-4)
            self.assertLess(sum(r * n for r, n in zip(ray, normal)), 1e-3, "towards the eye")
            half = math.tan(math.radians(25))
            x = 24 + 20 * sum(r * a for r, a in zip(ray, right)) / depth / half
            y = 20 - 20 * sum(r * a for r, a in zip(ray, up)) / depth / half
            self.assertAlmostEqual(x, i % 48 + 0.5, delta=0.01)
            self.assertAlmostEqual(y, i // 48 + 0.5, delta=0.01)
        self.assertGreater(seen, 48 * 40 / 2)

    def test_numbers_tell_objects_apart(self):
        got = self.read("--layers", "albedo,id", "--float", "--samples", "1")
        colours = {}
        for i, number in enumerate(got["id.material"]):
            colours.setdefault(number, set()).add(tuple(round(got[f"albedo.{c}"][i], 4) for c in "RGB"))
        self.assertGreater(len(colours), 3, "walls of several colours, and what stands in the box")
        for number, seen in colours.items():
            self.assertEqual(len(seen), 1, f"material {number} has one colour: the box has no textures")

    def test_layers_travel_compressed_too(self):
        digests = set()
        for encoding in ("raw", "zstd", "predicted"):
            frame, = frames_of(self.render("--layers", ALL, "--encoding", encoding)[1])
            self.assertEqual((frame["encoding"], frame["pixels_bytes"]), (encoding, 48 * 40 * 16 * 15))
            self.assertEqual(frame["wire_bytes"] < frame["pixels_bytes"], encoding != "raw")
            digests.add(frame["digest"])
        self.assertEqual(len(digests), 1)
        with Daemon(listen="tcp:127.0.0.1:0") as daemon:
            address = daemon.ready[0].split()[1]
            frame, = frames_of(self.render("--layers", ALL, "--server", address)[1])
            self.assertEqual((frame["encoding"], {frame["digest"]}), ("zstd", digests))

    def test_an_animation_has_them_in_every_frame(self):
        self.expect(farlight("animate", bundled_scenes() / "teapot.glb", "--orbit", "--frames", "1-2", "--size", "32x24", "-o",
                             self.folder / "%d.exr", "--layers", "beauty,depth"), 0)
        self.assertNotEqual(*(read_exr(self.folder / f"{n}.exr")[2]["Z"] for n in (1, 2)))

    def test_the_picture_of_an_exr_with_layers_is_compared(self):
        plain, layered = self.render(name="plain.exr")[0], self.render("--layers", ALL, name="layered.exr")[0]
        self.assertIn("R,G,B,A", self.expect(farlight("compare", plain, layered, "--fail-above", "0"), 0).stdout)

    def test_what_cannot_have_layers_is_refused_before_a_model_is_read(self):
        missing = self.folder / "no such model.glb"
        for output, options, says in (
                ("x.png", [], "write an .exr file, or leave out --layers"), ("x.hdr", [], "write an .exr file"),
                ("x.jpg", [], "write an .exr file"), ("x.exr", ["--encoding", "jpeg"], "raw, zstd or predicted"),
                ("x.exr", ["--size", "8192x8192"], "some of them at a time"),
                ("x.exr", ["--layers", "beauty,z"], "known: beauty, albedo, normal, depth, position, ao, id, unknown, crypto-object, crypto-material"),
                ("x.exr", ["--layers", ""], "known: beauty")):
            with self.subTest(output=output, options=options):
                result = self.expect(farlight("render", missing, "-o", self.folder / output, "--layers", ALL, *options), 2)
                self.assertIn(says, result.stderr)
        result = self.expect(farlight("animate", missing, "--frames", "1-2", "-o", self.folder / "x.mp4", "--layers", ALL), 2)
        self.assertIn("mp4 files do not have the layers of --layers", result.stderr)
        self.assertEqual(self.leftovers(), [])


if __name__ == "__main__":
    farlight_test.unittest.main()
