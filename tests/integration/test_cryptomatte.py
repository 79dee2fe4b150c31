# SPDX-License-Identifier: MIT
"""Cryptomatte in EXR files, read as Psyop's specification says, version 1.2: mattes of objects and materials by name."""
import base64
import json
import struct

import farlight_test
from farlight_test import OneDaemon, exr_attributes, exr_channels, farlight, read_exr

HALF, FLOAT, ZIP = 1, 2, 3
WIDTH, HEIGHT, SAMPLES = 24, 18, 16
LAYERS = "beauty,crypto-object,crypto-material"
VIEW = ["--size", f"{WIDTH}x{HEIGHT}", "--eye", "0.1,0.2,5", "--look-at", "0,0,0", "--fov", "40", "--samples", str(SAMPLES),
        "--background", "transparent", "--float", "--layers", LAYERS]
# name -> where it is, how large, its material, and what it hangs below. Two have the same name, and two are called nothing.
WHEELS = {"left": ((-0.7, 0.1, 0), 0.5, "red"), "right": ((0.6, 0.2, 0), 0.5, "red")}
OTHERS = {"floor": ((0.1, -0.5, -1), 1.1, "grey"), "pane": ((0, 0, 1), 5, 'a "pane" ä')}
MATERIALS = {"red": (1, 0, 0, 1), "grey": (0.5, 0.5, 0.5, 1), 'a "pane" ä': (0, 0, 1, 0.25)}


def model(folder, *wanted):
    """Turned squares that stand upright, which cut pixels in parts."""
    corners = struct.pack("<12f", -1, -0.6, 0, 0.8, -1, 0, -0.8, 1, 0, 1, 0.7, 0)
    data = corners + struct.pack("<6H", 0, 1, 2, 2, 1, 3)
    nodes, roots = [], []
    for name in wanted:
        place, scale, material = {**WHEELS, **OTHERS}[name]
        shown = {"mesh": list(MATERIALS).index(material), "translation": place, "scale": [scale] * 3}
        roots.append(len(nodes))
        if name in WHEELS:
            nodes += [{"name": name, "children": [len(nodes) + 1]}, {"name": "wheel", **shown}]
        else:
            nodes.append({"name": name, **shown})
    materials = [{"name": name, "doubleSided": True, "pbrMetallicRoughness": {"baseColorFactor": colour},
                  "alphaMode": "OPAQUE" if colour[3] == 1 else "BLEND"} for name, colour in MATERIALS.items()]
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": roots}], "nodes": nodes, "materials": materials,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": i}]} for i in range(len(materials))],
        "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
                      {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}]}
    path = folder / f"{'-'.join(wanted)}.gltf"
    path.write_text(json.dumps(document))
    return path


def turned(value, bits):
    return (value << bits | value >> 32 - bits) & 0xffffffff


def murmur3(text):
    """MurmurHash3_x86_32 with seed 0, as its author describes it."""
    data, value = text.encode(), 0
    for at in range(0, len(data), 4):
        block = data[at:at + 4]
        value ^= turned(int.from_bytes(block, "little") * 0xcc9e2d51 & 0xffffffff, 15) * 0x1b873593 & 0xffffffff
        if len(block) == 4:
            value = turned(value, 13) * 5 + 0xe6546b64 & 0xffffffff
    value ^= len(data)
    for shift, factor in ((16, 0x85ebca6b), (13, 0xc2b2ae35)):
        value = (value ^ value >> shift) * factor & 0xffffffff
    return value ^ value >> 16


class Mattes:
    """A file as a compositor reads it."""

    def __init__(self, path):
        self.path = path
        self.width, self.height, self.channels = read_exr(path)
        self.attributes = {name: data.decode() for name, data in exr_attributes(path).items()
                           if name.startswith("cryptomatte/")}

    def layer(self, name):
        """What is said of it, under the key that the specification makes of its name."""
        start = f"cryptomatte/{murmur3(name):08x}"[:-1] + "/"
        return {key[len(start):]: value for key, value in self.attributes.items() if key.startswith(start)}

    def manifest(self, name):
        return json.loads(self.layer(name)["manifest"])

    def ranks(self, name):
        """Of each rank identifiers, as bits, and shares."""
        pairs = [(f"{name}{n:02}.{a}", f"{name}{n:02}.{b}") for n in range(3) for a, b in (("red", "green"), ("blue", "alpha"))]
        return [([struct.unpack("<I", struct.pack("<f", one))[0] for one in self.channels[a]], self.channels[b]) for a, b in pairs]

    def matte(self, layer, name):
        wanted, ranks = int(self.manifest(layer)[name], 16), self.ranks(layer)
        return [sum(shares[i] for ids, shares in ranks if ids[i] == wanted) for i in range(self.width * self.height)]

    def sums(self, layer):
        return [sum(shares) for shares in zip(*(shares for _, shares in self.ranks(layer)))]


class Cryptomatte(OneDaemon):
    def render(self, *wanted, options=("--integrator", "whitted"), command="render", output="x.exr"):
        path = model(self.folder, *wanted)
        self.expect(farlight(command, path, "-o", self.folder / output, *VIEW, *options), 0)
        return Mattes(self.folder / output.replace("%d", "1"))

    def near(self, a, b, delta=2e-7):
        """Sums of whole shares of 1 / SAMPLES, or of two roundings of such numbers to floats."""
        self.assertEqual(len(a), len(b))
        self.assertLessEqual(max(abs(x - y) for x, y in zip(a, b)), delta)

    def test_the_file_says_what_the_specification_asks_for(self):
        file = self.render("floor", "left", "right", "pane")
        for layer, names in (("CryptoObject", {"floor", "left/wheel", "right/wheel", "pane"}),
                             ("CryptoMaterial", {"default", *MATERIALS})):
            said = file.layer(layer)
            self.assertEqual((said["name"], said["hash"], said["conversion"]), (layer, "MurmurHash3_32", "uint32_to_float32"))
            self.assertEqual(set(file.manifest(layer)), names)
            for name, stored in file.manifest(layer).items():
                bits = murmur3(name)
                self.assertEqual(stored, f"{bits ^ (1 << 23 if (bits >> 23 & 255) in (0, 255) else 0):08x}", name)
        path = model(self.folder, "floor")
        self.expect(farlight("render", path, "-o", self.folder / "half.exr", "--size", "8x8", "--layers", LAYERS), 0)
        kinds = exr_channels(self.folder / "half.exr")
        self.assertEqual({kinds[name] for name in kinds if name.startswith("Crypto")}, {FLOAT})
        self.assertEqual(kinds["R"], HALF)
        self.assertEqual(exr_attributes(file.path)["compression"][0], ZIP, "no loss")

    def test_a_matte_is_what_the_object_covers(self):
        """The samples of a pixel lie in the same places, whatever there is in the scene: shares agree to the sample."""
        file = self.render("floor", "left", "right")
        left, right, floor = (file.matte("CryptoObject", name) for name in ("left/wheel", "right/wheel", "floor"))
        alone = {name: self.render(name).channels["A"] for name in ("left", "right")}
        self.near(left, alone["left"])
        self.near(right, alone["right"])
        both = self.render("floor", "left").channels["A"]
        whole = self.render("floor", "left", "right").channels["A"]
        self.near(floor, [w - a - b for w, a, b in zip(whole, left, right)])
        self.near(self.render("floor", "left").matte("CryptoObject", "floor"), [b - a for b, a in zip(both, left)])
        self.assertTrue(any(0 < one < 1 for one in left) and any(one == 1 for one in left), "edges, and what is within")
        self.near(file.matte("CryptoMaterial", "red"), [a + b for a, b in zip(left, right)])
        self.near(file.matte("CryptoMaterial", "grey"), floor)

    def test_what_is_seen_through_a_blended_surface_has_what_that_leaves(self):
        without, file = self.render("floor", "left", "right"), self.render("floor", "left", "right", "pane")
        self.near(file.matte("CryptoObject", "pane"), [0.25] * (WIDTH * HEIGHT))
        for name in ("left/wheel", "right/wheel", "floor"):
            self.near(file.matte("CryptoObject", name), [0.75 * share for share in without.matte("CryptoObject", name)])

    def test_all_shares_are_alpha_and_the_largest_come_first(self):
        for options in (["--integrator", "whitted"], ["--integrator", "distributed"], ["--integrator", "path", "--denoise"],
                        ["--integrator", "raycast"], ["--integrator", "ao"], ["--noise", "0.2", "--samples", "64"],
                        ["--aperture", "0.3"], ["--crop", "5,4,11,9"], ["--tracer", "abuffer"]):
            with self.subTest(options=options):
                file = self.render("floor", "left", "right", "pane", options=options)
                for layer in ("CryptoObject", "CryptoMaterial"):
                    self.near(file.sums(layer), file.channels["A"], 1e-6)  # of up to 64 samples, added up one by one
                    shares = [shares for _, shares in file.ranks(layer)]
                    self.assertTrue(all(a >= b for more, less in zip(shares, shares[1:]) for a, b in zip(more, less)))

    def test_parts_frames_and_files_without_a_picture_have_the_same_mattes(self):
        whole = self.render("floor", "left", "pane")
        crop = self.render("floor", "left", "pane", options=["--integrator", "whitted", "--crop", "5,4,11,9"])
        wanted = whole.matte("CryptoObject", "wheel")
        self.assertEqual(crop.matte("CryptoObject", "wheel"),
                         [wanted[y * WIDTH + x] for y in range(4, 13) for x in range(5, 16)])
        series = self.render("floor", "left", "pane", options=["--integrator", "whitted", "--frames", "1-2"], command="animate",
                             output="%d.exr")
        for file in (series, Mattes(self.folder / "2.exr")):  # frames have samples in other places
            self.assertEqual(file.manifest("CryptoObject"), whole.manifest("CryptoObject"))
            self.near(file.sums("CryptoObject"), file.channels["A"], 1e-6)
        alone = self.render("floor", "left", "pane", options=["--integrator", "whitted", "--layers", "crypto-object"])
        self.assertEqual(alone.matte("CryptoObject", "wheel"), wanted)
        self.assertNotIn("A", alone.channels)


if __name__ == "__main__":
    farlight_test.unittest.main()
