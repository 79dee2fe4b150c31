#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Converts a scene of BART, a Benchmark for Animated Ray Tracing, to glTF. Usage: aff_to_gltf.py MODEL.aff MODEL.glb

AFF is in J. Lext, U. Assarsson, T. Möller. BART: A Benchmark for Animated Ray Tracing. Chalmers University of Technology,
Technical Report 00-14, 2000. The geometry, its motion and the camera's are those of the scene. Materials and lights are
glTF's, which come near: colours of a display become linear, shares of mirrors the metallic factor, and lights, which AFF
does not weaken with distance, give in the middle of the scene what they give there in AFF. Spheres become triangles."""
import json
import pathlib
import re
import struct
import sys
import zlib

import numpy as np

KEYS_PER_S = 30  # of curves that are no polynomials, beside the file's own keys
ROUND = 32  # sides of a cone, and of a sphere's equator
WIDTHS = {"transl": 3, "rot": 4, "scale": 3}
PATHS = {"transl": "translation", "rot": "rotation", "scale": "scale"}


# ---- quaternions x y z w and matrices

def turn(axis_degrees):
    """Quaternions of rows x y z degrees; no turn about an axis of 0."""
    rows = np.atleast_2d(np.asarray(axis_degrees, float))
    length = np.linalg.norm(rows[:, :3], axis=1, keepdims=True)
    half = np.radians(rows[:, 3:]) / 2 * (length > 0)
    return np.hstack([rows[:, :3] / np.where(length > 0, length, 1) * np.sin(half), np.cos(half)])


def times(a, b):
    xyz = a[:, 3:] * b[:, :3] + b[:, 3:] * a[:, :3] + np.cross(a[:, :3], b[:, :3])
    return np.hstack([xyz, a[:, 3:] * b[:, 3:] - np.sum(a[:, :3] * b[:, :3], 1, keepdims=True)])


def logarithm(a, b):
    """Of the turns from a to b: their axes times half their angles."""
    between = times(a * (-1, -1, -1, 1), b)
    sine = np.linalg.norm(between[:, :3], axis=1, keepdims=True)
    return between[:, :3] * np.where(sine > 0, np.arctan2(sine, between[:, 3:]) / np.where(sine > 0, sine, 1), 0)


def exponential(axis):
    half = np.linalg.norm(axis, axis=1, keepdims=True)
    return np.hstack([axis * np.sinc(half / np.pi), np.cos(half)])


def slerp(a, b, t):
    angle = np.arccos(np.clip(np.sum(a * b, 1, keepdims=True), -1, 1))
    sine = np.where(np.sin(angle) > 1e-6, np.sin(angle), 0)
    divisor = np.where(sine > 0, sine, 1)
    mixed = np.where(sine > 0, np.sin((1 - t) * angle) / divisor, 1 - t) * a + np.where(sine > 0, np.sin(t * angle) / divisor, t) * b
    return mixed / np.linalg.norm(mixed, axis=1, keepdims=True)


def affine(scale=(1, 1, 1), rotation=(0, 0, 0, 1), translation=(0, 0, 0)):
    x, y, z, w = rotation
    turned = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                       [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                       [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turned * scale, translation
    return matrix


# ---- splines of Kochanek and Bartels; the first and the last key only shape the segments beside them

class Curve:
    def __init__(self, kind, rows):
        self.times, self.is_turn = rows[:, 0], kind == "rot"
        self.values = turn(rows[:, 1:5]) if self.is_turn else rows[:, 1:4]
        for i in range(1, len(rows) if self.is_turn else 0):
            if self.values[i - 1] @ self.values[i] < 0:
                self.values[i] *= -1
        tension, continuity, bias = rows[1:-1, -3:].T
        span, after = self.times[2:] - self.times[:-2], self.times[2:] - self.times[1:-1]
        leaving = np.where(span > 0, after / np.where(span > 0, span, 1), 0) * (1 - tension)
        coming = np.where(span > 0, 1 - after / np.where(span > 0, span, 1), 0) * (1 - tension)
        steps = logarithm(self.values[:-1], self.values[1:]) if self.is_turn else np.diff(self.values, axis=0)
        shares = [(leaving * (1 + continuity) * (1 + bias), leaving * (1 - continuity) * (1 - bias)),
                  (coming * (1 - continuity) * (1 + bias), coming * (1 + continuity) * (1 - bias))]
        # By key, of which the first and the last have none.
        self.steps = steps
        self.leaving, self.coming = (np.pad(one[:, None] * steps[:-1] + two[:, None] * steps[1:], ((1, 1), (0, 0))) for one, two in shares)

    def at(self, t):
        i = np.clip(np.searchsorted(self.times, t, "right") - 1, 1, len(self.times) - 3)
        begin, end = self.times[i], self.times[i + 1]
        s = np.where(end > begin, np.clip((t - begin) / np.where(end > begin, end - begin, 1), 0, 1), t >= begin)[:, None]
        a, b, leaving, coming = self.values[i], self.values[i + 1], self.leaving[i], self.coming[i + 1]
        if not self.is_turn:
            return (2 * s**3 - 3 * s**2 + 1) * a + (3 * s**2 - 2 * s**3) * b + (s**3 - 2 * s**2 + s) * leaving + (s**3 - s**2) * coming
        inner = (times(a, exponential((leaving - self.steps[i]) / 2)), times(b, exponential((self.steps[i] - coming) / 2)))
        return slerp(slerp(a, b, s), slerp(*inner, s), 2 * s * (1 - s))


# ---- shapes, each as rows of corners: position, normal, texture coordinates

def flat(triangles):
    """Of triangles x 3 positions."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    return np.concatenate([triangles, np.repeat(normal[:, None], 3, 1), np.zeros((len(triangles), 3, 2))], 2).reshape(-1, 8)


def fan(corners):
    """Of a convex polygon's corners."""
    return np.concatenate([corners[[0, i, i + 1]] for i in range(1, len(corners) - 1)])


def lattice(points, normals):
    """Triangles of rows x columns of points."""
    grid = np.concatenate([points, normals, np.zeros(points.shape[:2] + (2,))], 2)
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    return np.stack([a, b, c, a, c, d], 2).reshape(-1, 8)


def sphere(centre, radius):
    down, around = np.meshgrid(np.linspace(0, np.pi, ROUND // 2 + 1), np.linspace(0, 2 * np.pi, ROUND + 1), indexing="ij")
    normals = np.stack([np.sin(down) * np.cos(around), np.cos(down), np.sin(down) * np.sin(around)], 2)
    return lattice(centre + radius * normals, normals)


def cone(base, base_radius, apex, apex_radius):
    along = apex - base
    side = np.cross(along, (1, 0, 0) if abs(along[0]) < max(abs(along[1:])) else (0, 1, 0))
    side /= np.linalg.norm(side)
    other = np.cross(along, side) / np.linalg.norm(along)
    around = np.linspace(0, 2 * np.pi, ROUND + 1)[:, None]
    out = np.cos(around) * side + np.sin(around) * other
    normal = out + (base_radius - apex_radius) * along / (along @ along)
    return lattice(np.stack([base + base_radius * out, apex + apex_radius * out]), np.stack([normal, normal]))


class Group:
    """What moves together."""
    def __init__(self, name="", parent=None, parent_from_group=None):
        self.name, self.parent, self.parent_from_group = name, parent, parent_from_group
        self.shapes, self.morphs = {}, {}


class Reader:
    def __init__(self, path):
        self.folder, self.detail, self.groups, self.keys, self.lights, self.materials = path.parent, 0, [Group()], {}, [], []
        self.view, self.ambient, self.animation, self.fill = None, np.ones(3), (0, 0), None
        self.blocks = [(self.groups[0], np.eye(4))]
        self.read(path)

    def read(self, path):
        outside = self.__dict__.get("words")
        text = re.sub(r"[#%].*", "", path.read_text(encoding="latin-1").replace("\r", "\n"))
        self.words = iter(re.findall(r"[{}]|[^\s{}]+", text))
        for word in self.words:
            if word == "}":
                self.blocks.pop()
            else:
                getattr(self, f"read_{word}")()
        self.words = outside

    def numbers(self, count):
        return np.array([float(next(self.words)) for _ in range(count)])

    def rows(self, width):
        return self.numbers(int(next(self.words)) * width).reshape(-1, width)

    def add(self, corners, texture=None):
        group, matrix = self.blocks[-1]
        corners = np.array(corners, float)
        corners[:, :3] = corners[:, :3] @ matrix[:3, :3].T + matrix[:3, 3]
        corners[:, 3:6] = corners[:, 3:6] @ np.linalg.inv(matrix[:3, :3])
        corners[:, 3:6] /= np.maximum(np.linalg.norm(corners[:, 3:6], axis=1, keepdims=True), 1e-30)
        if np.linalg.det(matrix[:3, :3]) < 0:
            corners = corners.reshape(-1, 3, 8)[:, ::-1].reshape(-1, 8)
        group.shapes.setdefault(self.material(texture), []).append(corners)

    def material(self, texture):
        key = (self.fill, texture)
        if key not in self.materials:
            self.materials.append(key)
        return self.materials.index(key)

    def read_i(self):
        detail, name = int(next(self.words)), next(self.words)
        if detail <= self.detail:
            self.read(self.folder / name)

    def read_d(self):
        self.detail = int(next(self.words))

    def read_am(self):
        self.ambient = self.numbers(3)

    def read_a(self):
        self.animation = self.numbers(3)[:2]

    def read_b(self):
        self.numbers(3)

    def read_v(self):
        self.view = {next(self.words): self.numbers(count) for count in (3, 3, 3, 1, 1, 2)}

    def read_l(self, name=""):
        numbers = self.numbers(6)
        self.lights.append((name, numbers[:3], numbers[3:]))

    def read_la(self):
        self.read_l(next(self.words))

    def read_f(self):
        red, green, blue, diffuse, specular, shine, through, index = self.numbers(8)
        colour = np.array([red, green, blue])
        self.fill = (0, 0, 0, *colour * diffuse, specular, specular, specular, shine, through, index)

    def read_fm(self):
        self.fill = tuple(self.numbers(12))

    def read_xs(self):
        scale, axis, translation = self.numbers(3), self.numbers(4), self.numbers(3)
        group, matrix = self.blocks[-1]
        self.blocks.append((group, matrix @ affine(scale, turn(axis)[0], translation)))
        next(self.words)

    def read_x(self):
        self.groups.append(Group(next(self.words), *self.blocks[-1]))
        self.blocks.append((self.groups[-1], np.eye(4)))
        next(self.words)

    def read_k(self):
        name, curves = next(self.words), {}
        next(self.words)
        for kind in iter(lambda: next(self.words), "}"):
            rows = self.rows(2 if kind in ("visibility", "visible") else WIDTHS[kind] + 4)
            rows = rows[rows[:, 0] >= np.maximum.accumulate(rows[:, 0])]  # one of BART's robot goes back in time
            curves["visibility" if kind not in WIDTHS else kind] = rows if kind not in WIDTHS else Curve(kind, rows)
        self.keys[name] = curves

    def read_s(self):
        numbers = self.numbers(4)
        self.add(sphere(numbers[:3], abs(numbers[3])))

    def read_c(self):
        numbers = self.numbers(8)
        self.add(cone(numbers[:3], abs(numbers[3]), numbers[4:7], abs(numbers[7])))

    def read_p(self):
        self.add(flat(fan(self.rows(3)).reshape(-1, 3, 3)))

    def read_pp(self):
        corners = fan(self.rows(6))
        self.add(np.hstack([corners, np.zeros((len(corners), 2))]))

    def read_tt(self):
        texture, rows = next(self.words), self.numbers(15).reshape(3, 5)
        corners = flat(rows[None, :, :3])
        corners[:, 6:] = rows[:, 3:]
        self.add(corners, texture)

    def read_ttp(self):
        self.add(self.numbers(24).reshape(3, 8), next(self.words))

    def read_tpa(self):
        group, matrix = self.blocks[-1]
        rows = self.rows(19)
        corners = rows[:, 1:].reshape(-1, 3, 6)
        corners[..., :3] = corners[..., :3] @ matrix[:3, :3].T + matrix[:3, 3]
        corners[..., 3:] = corners[..., 3:] @ np.linalg.inv(matrix[:3, :3])
        group.morphs.setdefault((tuple(rows[:, 0]), self.material(None)), []).append(corners)

    def read_m(self):
        texture, arrays = None, {}
        for word in iter(lambda: next(self.words), "triangles"):
            if word == "texturecoords":
                count, texture = int(next(self.words)), next(self.words)
                arrays[word] = self.numbers(count * 2).reshape(-1, 2)
            else:
                arrays[word] = self.rows(3)
        faces = self.rows(3 * len(arrays)).astype(int).reshape(-1, len(arrays), 3)
        corners = flat(arrays["vertices"][faces[:, 0]])
        for at, name in enumerate(list(arrays)[1:], 1):
            corners[:, slice(3, 6) if name == "normals" else slice(6, 8)] = arrays[name][faces[:, at]].reshape(len(corners), -1)
        self.add(corners, texture)


# ---- glTF

def linear(shown):
    shown = np.clip(shown, 0, 1)
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)


def png_of_ppm(path):
    head = re.match(rb"P6\s+(?:#.*\s+)*(\d+)\s+(?:#.*\s+)*(\d+)\s+255\s", path.read_bytes())
    width, height = int(head[1]), int(head[2])
    rows = np.frombuffer(path.read_bytes(), np.uint8, width * height * 3, head.end()).reshape(height, -1)
    chunks = ((b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
              (b"IDAT", zlib.compress(np.pad(rows, ((0, 0), (1, 0))).tobytes())), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
                                            for name, data in chunks)


class Writer:
    def __init__(self, reader):
        self.reader, self.bytes, self.textures = reader, bytearray(), {}
        self.gltf = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [], "materials": [],
                     "accessors": [], "bufferViews": []}
        self.samplers, self.channels, self.bounds = [], [], []
        self.begin, self.end = reader.animation

    def view(self, data):
        self.bytes += bytes(-len(self.bytes) % 4)
        self.gltf["bufferViews"].append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)})
        self.bytes += data
        return len(self.gltf["bufferViews"]) - 1

    def accessor(self, array):
        array = np.ascontiguousarray(array, "<u4" if array.dtype.kind in "iu" else "<f4")
        bounds = array.reshape(len(array), -1)
        self.gltf["accessors"].append({
            "bufferView": self.view(array.tobytes()), "componentType": 5125 if array.dtype.kind == "u" else 5126, "count": len(array),
            "type": {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}[bounds.shape[1]],
            "min": bounds.min(0).tolist(), "max": bounds.max(0).tolist()})
        return len(self.gltf["accessors"]) - 1

    def texture(self, name):
        if name not in self.textures:
            places = [self.reader.folder / name, self.reader.folder / "../TextureFiles" / name]
            image = {"bufferView": self.view(png_of_ppm(next(place for place in places if place.is_file()))), "mimeType": "image/png"}
            self.gltf.setdefault("images", []).append(image)
            self.textures[name] = len(self.gltf["images"]) - 1
            self.gltf.setdefault("textures", []).append({"source": self.textures[name]})
        return {"index": self.textures[name]}

    def material(self, fill, texture):
        ambient, diffuse, specular = (linear(np.array(fill[i:i + 3])) for i in (0, 3, 6))
        sent, mirrored, through = diffuse + specular, specular.max(), min(max(fill[10], 0), 1)
        share = float(mirrored / sent.max()) if mirrored > 0 else 0.0
        surface = {"baseColorFactor": [*(np.minimum(sent, 1).tolist() if through == 0 else [1.0, 1.0, 1.0]), 1.0],
                   "metallicFactor": share if through == 0 else 0.0, "roughnessFactor": 0.0 if share > 0 or through > 0 else 1.0}
        material = {"pbrMetallicRoughness": surface, "doubleSided": True,
                    "emissiveFactor": np.clip(ambient * self.reader.ambient, 0, 1).tolist()}
        if texture:
            surface["baseColorTexture"] = material["emissiveTexture"] = self.texture(texture)
        if through > 0:
            material["extensions"] = {"KHR_materials_transmission": {"transmissionFactor": through},
                                      "KHR_materials_ior": {"ior": max(fill[11], 1.0)}}
        self.gltf["materials"].append(material)

    def node(self, parent=None, **values):
        self.gltf["nodes"].append(values)
        number = len(self.gltf["nodes"]) - 1
        (self.gltf["scenes"][0]["nodes"] if parent is None else self.gltf["nodes"][parent].setdefault("children", [])).append(number)
        return number

    def channel(self, node, path, at_s, values, interpolation="LINEAR"):
        self.samplers.append({"input": self.accessor(np.asarray(at_s) - self.begin), "output": self.accessor(np.asarray(values, float)),
                              "interpolation": interpolation})
        self.channels.append({"sampler": len(self.samplers) - 1, "target": {"node": node, "path": path}})

    def animate(self, node, name, wanted=(*WIDTHS, "visibility")):
        """The node's pose at the animation's start, and its channels. Returns the node within, which is hidden by a scale of 0."""
        curves = self.reader.keys.get(name, {})
        for kind in WIDTHS:
            if kind in wanted and kind in curves:
                own = curves[kind].times
                at_s = np.concatenate([np.arange(self.begin, self.end, 1 / KEYS_PER_S), own[(own > self.begin) & (own < self.end)], [self.end]])
                at_s = np.unique(at_s.astype(np.float32))
                self.gltf["nodes"][node][PATHS[kind]] = curves[kind].at(at_s[:1])[0].tolist()
                self.channel(node, PATHS[kind], at_s, curves[kind].at(at_s))
        if "visibility" not in wanted or "visibility" not in curves:
            return node
        within, rows = self.node(node), curves["visibility"]
        at_s = np.unique(np.concatenate([[self.begin], rows[(rows[:, 0] > self.begin) & (rows[:, 0] <= self.end), 0]]))
        last = np.searchsorted(rows[:, 0], at_s, "right") - 1
        shown = np.where(last < 0, 1, rows[np.maximum(last, 0), 1] != 0)
        self.gltf["nodes"][within]["scale"] = [float(shown[0])] * 3
        self.channel(within, "scale", at_s, np.repeat(shown[:, None], 3, 1), "STEP")
        return within

    def mesh(self, parent, primitives, **more):
        self.gltf["meshes"].append({"primitives": primitives, **more})
        return self.node(parent, mesh=len(self.gltf["meshes"]) - 1)

    def primitive(self, material, corners):
        corners, indices = np.unique(np.asarray(corners, np.float32), axis=0, return_inverse=True)
        self.bounds += [corners[:, :3].min(0), corners[:, :3].max(0)]
        attributes = {"POSITION": self.accessor(corners[:, :3]), "NORMAL": self.accessor(corners[:, 3:6])}
        if self.reader.materials[material][1]:
            attributes["TEXCOORD_0"] = self.accessor(corners[:, 6:8])
        return {"attributes": attributes, "indices": self.accessor(indices.reshape(-1)), "material": material}

    def morph(self, parent, at_s, material, triangles):
        poses = np.concatenate([one[:, :, None] for one in triangles], 2).transpose(0, 2, 1, 3).reshape(len(at_s), -1, 6)
        targets = [{"POSITION": self.accessor(pose[:, :3] - poses[0][:, :3]), "NORMAL": self.accessor(pose[:, 3:] - poses[0][:, 3:])}
                   for pose in poses[1:]]
        attributes = {"POSITION": self.accessor(poses[0][:, :3]), "NORMAL": self.accessor(poses[0][:, 3:])}
        node = self.mesh(parent, [{"attributes": attributes, "material": material, **({"targets": targets} if targets else {})}])
        if targets:
            self.channel(node, "weights", at_s, np.eye(len(at_s))[:, 1:].reshape(-1))

    def group(self, group, nodes):
        outer = nodes.get(group.parent)
        if group.name and not np.array_equal(group.parent_from_group, np.eye(4)):
            outer = self.node(outer, matrix=group.parent_from_group.T.reshape(-1).tolist())
        nodes[group] = inner = self.animate(self.node(outer, name=group.name or "scene"), group.name)
        if group.shapes:
            self.mesh(inner, [self.primitive(material, np.concatenate(shapes)) for material, shapes in group.shapes.items()])
        for (at_s, material), triangles in group.morphs.items():
            self.morph(inner, at_s, material, triangles)

    def camera(self, view):
        back = view["from"] - view["at"]
        right = np.cross(view["up"], back)
        axes = np.stack([axis / np.linalg.norm(axis) for axis in (right, np.cross(back, right), back)], 1)
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = axes, view["from"]
        self.gltf["cameras"] = [{"type": "perspective", "perspective": {"yfov": float(np.radians(view["angle"][0])), "znear": 0.001}}]
        if "camera" in self.reader.keys:
            self.animate(self.node(name="view", camera=0, translation=view["from"].tolist()), "camera", ("transl", "rot"))
        else:
            self.node(name="view", camera=0, matrix=matrix.T.reshape(-1).tolist())

    def light(self, name, position, colour):
        low, high = np.min(self.bounds, 0), np.max(self.bounds, 0)
        reach = max(np.linalg.norm(position - (low + high) / 2), np.linalg.norm(high - low) / 4)
        strength = max(colour.max(), 1e-6)
        lights = self.gltf.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})["lights"]
        lights.append({"type": "point", "color": np.clip(colour / strength, 0, 1).tolist(), "intensity": float(np.pi * strength * reach**2)})
        node = self.node(name=name or "light", translation=position.tolist(), extensions={"KHR_lights_punctual": {"light": len(lights) - 1}})
        self.animate(node, name, ("transl",))

    def write(self, path):
        for fill, texture in self.reader.materials:
            self.material(fill or (0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 0, 1), texture)
        nodes = {}
        for group in self.reader.groups:
            self.group(group, nodes)
        for light in self.reader.lights:
            self.light(*light)
        if self.reader.view:
            self.camera(self.reader.view)
        if self.channels:
            self.gltf["animations"] = [{"name": "animation", "channels": self.channels, "samplers": self.samplers}]
        self.gltf["extensionsUsed"] = ["KHR_lights_punctual", "KHR_materials_transmission", "KHR_materials_ior"]
        self.gltf["buffers"] = [{"byteLength": len(self.bytes)}]
        text = json.dumps({key: value for key, value in self.gltf.items() if value != []}).encode()
        text += b" " * (-len(text) % 4)
        self.bytes += bytes(-len(self.bytes) % 4)
        path.write_bytes(struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(self.bytes), len(text), 0x4e4f534a) + text +
                         struct.pack("<II", len(self.bytes), 0x004e4942) + self.bytes)


if __name__ == "__main__":
    Writer(Reader(pathlib.Path(sys.argv[1]))).write(pathlib.Path(sys.argv[2]))
