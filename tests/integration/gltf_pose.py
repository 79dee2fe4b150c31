# SPDX-License-Identifier: MIT
"""glTF 2.0 read and posed on its own: JSON and struct, nothing of the project. What the other half of a comparison
is made of, so it follows the specification's words (sections 3.6 accessors, 3.7 geometry, 3.11 and appendix C
animations) and no other program's."""
import base64
import bisect
import json
import math
import operator
import pathlib
import struct

COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
FORMS = {5120: ("b", 127), 5121: ("B", 255), 5122: ("h", 32767), 5123: ("H", 65535), 5125: ("I", None), 5126: ("f", None)}
IDENTITY = (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1)


# ---- matrices: 16 numbers, row by row

def multiply(a, b):
    columns = [b[column::4] for column in range(4)]
    return tuple([sum(map(operator.mul, a[row:row + 4], column)) for row in range(0, 16, 4) for column in columns])


def from_columns(m):
    return tuple(m[column * 4 + row] for row in range(4) for column in range(4))


def from_parts(translation, rotation, scale):
    x, y, z, w = rotation
    turn = (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
            2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
            2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y))
    rows = [tuple(turn[row * 3 + c] * scale[c] for c in range(3)) + (translation[row],) for row in range(3)]
    return rows[0] + rows[1] + rows[2] + (0, 0, 0, 1)


def blend(matrices, weights):
    if len(matrices) == 1:
        return matrices[0]
    return tuple([sum(map(operator.mul, weights, column)) for column in zip(*matrices)])


def move(m, p):
    x, y, z = p
    return (m[0] * x + m[1] * y + m[2] * z + m[3], m[4] * x + m[5] * y + m[6] * z + m[7],
            m[8] * x + m[9] * y + m[10] * z + m[11])


def inverse_transpose(m):
    """Of the upper 3x3, row by row."""
    a, b, c, d, e, f, g, h, i = m[0:3] + m[4:7] + m[8:11]
    cofactors = (e * i - f * h, f * g - d * i, d * h - e * g, c * h - b * i, a * i - c * g, b * g - a * h,
                 b * f - c * e, c * d - a * f, a * e - b * d)
    determinant = a * cofactors[0] + b * cofactors[1] + c * cofactors[2]
    return tuple(value / determinant for value in cofactors), determinant


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return tuple(x / length for x in v) if length > 0 else tuple(v)


def turn_normal(m, n):
    t, _ = inverse_transpose(m)
    return unit([sum(t[row * 3 + c] * n[c] for c in range(3)) for row in range(3)])


# ---- curves

def slerp(a, b, t):
    d = sum(x * y for x, y in zip(a, b))
    if d < 0:
        b, d = [-x for x in b], -d
    angle = math.acos(min(d, 1.0))
    if angle < 1e-6:
        return unit([x + (y - x) * t for x, y in zip(a, b)])
    return [(math.sin((1 - t) * angle) * x + math.sin(t * angle) * y) / math.sin(angle) for x, y in zip(a, b)]


def sample(times, values, width, interpolation, is_rotation, time):
    """`values`: all numbers of the sampler's output behind each other."""
    cubic = interpolation == "CUBICSPLINE"
    stride = width * (3 if cubic else 1)

    def part(key, which):
        return values[key * stride + which * width:key * stride + (which + 1) * width]

    def value(key):
        return part(key, 1 if cubic else 0)

    if time <= times[0] or len(times) == 1:
        result = value(0)
    elif time >= times[-1]:
        result = value(len(times) - 1)
    else:
        key = bisect.bisect_right(times, time) - 1
        span = times[key + 1] - times[key]
        t = (time - times[key]) / span
        if interpolation == "STEP":
            result = value(key)
        elif cubic:
            v0, v1, leaving, arriving = value(key), value(key + 1), part(key, 2), part(key + 1, 0)
            result = [(2 * t ** 3 - 3 * t ** 2 + 1) * v0[i] + span * (t ** 3 - 2 * t ** 2 + t) * leaving[i] +
                      (-2 * t ** 3 + 3 * t ** 2) * v1[i] + span * (t ** 3 - t ** 2) * arriving[i]
                      for i in range(width)]
        elif is_rotation:
            result = slerp(unit(value(key)), unit(value(key + 1)), t)
        else:
            result = [a + (b - a) * t for a, b in zip(value(key), value(key + 1))]
    return unit(result) if is_rotation else list(result)


# ---- the file

class Part:
    """What one primitive of a node shows: corners of triangles, in world space."""

    def __init__(self, node, material, positions, normals, texcoords):
        self.node, self.material = node, material
        self.positions, self.normals, self.texcoords = positions, normals, texcoords


class Model:
    def __init__(self, path):
        self.path = pathlib.Path(path)
        data, self.binary = self.path.read_bytes(), b""
        if data[:4] == b"glTF":
            size, = struct.unpack_from("<I", data, 12)
            self.binary = data[28 + size:]
            data = data[20:20 + size]
        self.json = json.loads(data)
        self.buffers = [self.buffer(entry) for entry in self.json.get("buffers", [])]
        self.nodes = self.json.get("nodes", [])
        self.parents = {child: i for i, node in enumerate(self.nodes) for child in node.get("children", [])}
        self.known = {}

    def buffer(self, entry):
        uri = entry.get("uri")
        if uri is None:
            return self.binary[:entry["byteLength"]]
        if uri.startswith("data:"):
            return base64.b64decode(uri.partition(",")[2])
        return (self.path.parent / uri).read_bytes()

    def view(self, index):
        view = self.json["bufferViews"][index]
        start = view.get("byteOffset", 0)
        return self.buffers[view["buffer"]][start:start + view["byteLength"]], view.get("byteStride")

    def numbers(self, index):
        """An accessor's elements, as tuples; normalised integers as floats."""
        if index in self.known:
            return self.known[index]
        accessor = self.json["accessors"][index]
        count, components = accessor["count"], COMPONENTS[accessor["type"]]
        form, maximum = FORMS[accessor["componentType"]]
        size = struct.calcsize(form) * components

        def unpack(data, offset, stride, amount):
            return [struct.unpack_from(f"<{components}{form}", data, offset + i * (stride or size)) for i in range(amount)]

        elements = [(0,) * components] * count
        if "bufferView" in accessor:
            data, stride = self.view(accessor["bufferView"])
            elements = unpack(data, accessor.get("byteOffset", 0), stride, count)
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            at, values = sparse["indices"], sparse["values"]
            places = struct.unpack_from(f"<{sparse['count']}{FORMS[at['componentType']][0]}",
                                        self.view(at["bufferView"])[0], at.get("byteOffset", 0))
            for place, value in zip(places, unpack(self.view(values["bufferView"])[0], values.get("byteOffset", 0), None,
                                                   sparse["count"])):
                elements[place] = value
        if accessor.get("normalized"):
            elements = [tuple(max(x / maximum, -1.0) for x in element) for element in elements]
        self.known[index] = elements
        return elements

    # ---- poses

    def pose(self, animation, time):
        """{(node, path): value} of an animation at a time; None: nothing is animated."""
        found = {}
        if animation is None:
            return found
        animation = self.json["animations"][animation]
        for channel in animation["channels"]:
            target, sampler = channel["target"], animation["samplers"][channel["sampler"]]
            if "node" not in target:
                continue
            times = [t for t, in self.numbers(sampler["input"])]
            values = [x for element in self.numbers(sampler["output"]) for x in element]
            interpolation = sampler.get("interpolation", "LINEAR")
            width = len(values) // len(times) // (3 if interpolation == "CUBICSPLINE" else 1)
            found[target["node"], target["path"]] = sample(times, values, width, interpolation,
                                                           target["path"] == "rotation", time)
        return found

    def local(self, node, pose):
        entry = self.nodes[node]
        if "matrix" in entry:
            return from_columns(entry["matrix"])
        return from_parts(pose.get((node, "translation"), entry.get("translation", (0, 0, 0))),
                          unit(pose.get((node, "rotation"), entry.get("rotation", (0, 0, 0, 1)))),
                          pose.get((node, "scale"), entry.get("scale", (1, 1, 1))))

    def world(self, node, pose):
        m = self.local(node, pose)
        while node in self.parents:
            node = self.parents[node]
            m = multiply(self.local(node, pose), m)
        return m

    def shown_nodes(self):
        """In the order of the scene, a node before its children."""
        if "scenes" in self.json:
            stack = list(self.json["scenes"][self.json.get("scene", 0)].get("nodes", []))[::-1]
        else:
            stack = [i for i in range(len(self.nodes)) if i not in self.parents][::-1]
        while stack:
            node = stack.pop()
            yield node
            stack += self.nodes[node].get("children", [])[::-1]

    def joint_matrices(self, skin, pose):
        skin = self.json["skins"][skin]
        bind = [from_columns(m) for m in self.numbers(skin["inverseBindMatrices"])] if "inverseBindMatrices" in skin else \
            [IDENTITY] * len(skin["joints"])
        return [multiply(self.world(joint, pose), m) for joint, m in zip(skin["joints"], bind)]

    def morphed(self, primitive, name, weights):
        """One attribute of all vertices with what the targets add; None: it has none."""
        if name not in primitive["attributes"]:
            return None
        base = self.numbers(primitive["attributes"][name])
        for target, weight in zip(primitive.get("targets", []), weights):
            if name in target and weight != 0:
                base = [tuple(b + weight * o for b, o in zip(v, offset))
                        for v, offset in zip(base, self.numbers(target[name]))]
        return base

    def influences(self, primitive):
        """For each vertex: pairs of joint and weight, weights adding up to 1."""
        attributes, vertices = primitive["attributes"], []
        key = ("influences", attributes["JOINTS_0"], attributes["WEIGHTS_0"])
        if key in self.known:
            return self.known[key]
        sets = [(self.numbers(attributes[f"JOINTS_{i}"]), self.numbers(attributes[f"WEIGHTS_{i}"]))
                for i in range(9) if f"JOINTS_{i}" in attributes]
        for vertex in range(len(sets[0][0])):
            pairs = [(j, w) for joints, weights in sets for j, w in zip(joints[vertex], weights[vertex]) if w > 0]
            total = sum(w for _, w in pairs)
            vertices.append([(j, w / total) for j, w in pairs])
        self.known[key] = vertices
        return vertices

    def vertex_matrices(self, node, primitive, pose):
        """Where each vertex goes: one matrix for each."""
        count = len(self.numbers(primitive["attributes"]["POSITION"]))
        if "skin" not in self.nodes[node]:
            return [self.world(node, pose)] * count
        joints = self.joint_matrices(self.nodes[node]["skin"], pose)
        return [blend([joints[j] for j, _ in pairs], [w for _, w in pairs]) for pairs in self.influences(primitive)]

    def parts(self, animation=None, time=0.0):
        """What is shown of the meshes at a time of an animation."""
        pose = self.pose(animation, time)
        for node in self.shown_nodes():
            entry = self.nodes[node]
            if "mesh" not in entry:
                continue
            mesh = self.json["meshes"][entry["mesh"]]
            weights = pose.get((node, "weights"), entry.get("weights", mesh.get("weights", [])))
            for primitive in mesh["primitives"]:
                positions = self.morphed(primitive, "POSITION", weights)
                normals = self.morphed(primitive, "NORMAL", weights)
                matrices = self.vertex_matrices(node, primitive, pose)
                positions = [move(m, p) for m, p in zip(matrices, positions)]
                if normals:
                    normals = [turn_normal(m, n) for m, n in zip(matrices, normals)]
                texcoords = [name for name in ("TEXCOORD_0", "TEXCOORD_1") if name in primitive["attributes"]]
                corners = [i for i, in self.numbers(primitive["indices"])] if "indices" in primitive else \
                    range(len(positions))
                yield Part(node, primitive.get("material"), [positions[i] for i in corners],
                           [normals[i] for i in corners] if normals else None,
                           {name: [self.numbers(primitive["attributes"][name])[i] for i in corners] for name in texcoords})

    def times(self, animation):
        """First and last key."""
        found = [t for sampler in self.json["animations"][animation]["samplers"]
                 for t, in self.numbers(sampler["input"])]
        return min(found), max(found)


# ---- writing

class Writer:
    """A glTF file whose buffer is in it, piece by piece."""

    def __init__(self):
        self.data = bytearray()
        self.json = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": []}

    def view(self, data):
        self.data += b"\0" * (-len(self.data) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)})
        self.data += data
        return len(self.json["bufferViews"]) - 1

    def accessor(self, kind, elements, component=5126, **more):
        """`elements`: tuples, or numbers for SCALAR."""
        form, flat = FORMS[component][0], []
        for element in elements:
            flat += element if isinstance(element, (tuple, list)) else [element]
        entry = {"bufferView": self.view(struct.pack(f"<{len(flat)}{form}", *flat)), "componentType": component,
                 "count": len(flat) // COMPONENTS[kind], "type": kind, **more}
        self.json["accessors"].append(entry)
        return len(self.json["accessors"]) - 1

    def text(self):
        self.json["buffers"] = [{"uri": "data:application/octet-stream;base64," +
                                        base64.b64encode(self.data).decode("ascii"), "byteLength": len(self.data)}]
        return json.dumps(self.json)


def write_still(model, animation, time, path):
    """The model as it is at a time of an animation, as a file without skins, morph targets and animations: the
    vertices are moved, materials and textures are the same."""
    writer, meshes = Writer(), []
    for key in ("materials", "textures", "samplers", "extensionsUsed"):
        if key in model.json:
            writer.json[key] = model.json[key]
    if "images" in model.json:
        writer.json["images"] = [still_image(model, image) for image in model.json["images"]]
    for part in model.parts(animation, time):
        attributes = {"POSITION": writer.accessor("VEC3", part.positions)}
        if part.normals:
            attributes["NORMAL"] = writer.accessor("VEC3", part.normals)
        for name, texcoords in part.texcoords.items():
            attributes[name] = writer.accessor("VEC2", texcoords)
        primitive = {"attributes": attributes}
        if part.material is not None:
            primitive["material"] = part.material
        meshes.append({"primitives": [primitive]})
    writer.json["meshes"] = meshes
    writer.json["nodes"] = [{"mesh": i} for i in range(len(meshes))]
    writer.json["scenes"], writer.json["scene"] = [{"nodes": list(range(len(meshes)))}], 0
    pathlib.Path(path).write_text(writer.text(), encoding="utf-8")


def still_image(model, image):
    if "bufferView" in image:
        data, kind = model.view(image["bufferView"])[0], image["mimeType"]
    elif image["uri"].startswith("data:"):
        return image
    else:
        data = (model.path.parent / image["uri"]).read_bytes()
        kind = "image/png" if data[:4] == b"\x89PNG" else "image/jpeg"
    return {"uri": f"data:{kind};base64," + base64.b64encode(data).decode("ascii")}
