# SPDX-License-Identifier: MIT
"""Scenes for the add-on's tests, built in Blender, and their pictures as arrays."""
import math
import pathlib
import tempfile

import bpy
import numpy as np

WIDTH, HEIGHT = 96, 72
FOLDER = tempfile.TemporaryDirectory(prefix="farlight-blender-")


def empty(world=(0, 0, 0)):
    """A scene with a camera that looks along +y, slightly down, at the origin."""
    for group in (bpy.data.objects, bpy.data.meshes, bpy.data.materials, bpy.data.lights, bpy.data.cameras, bpy.data.images,
                  bpy.data.node_groups, bpy.data.curves, bpy.data.worlds):
        for one in list(group):
            if one.users == 0 or group in (bpy.data.objects, bpy.data.worlds):
                group.remove(one)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = WIDTH, HEIGHT, 100
    scene.render.film_transparent = scene.render.use_border = scene.use_nodes = False
    scene.render.use_motion_blur = bpy.context.view_layer.use_pass_vector = False
    scene.view_settings.view_transform = "Raw"
    scene.frame_set(1)
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (*world, 1)
    scene.camera = put("camera", bpy.data.cameras.new("camera"), (0, -8, 3), (math.radians(70), 0, 0))
    scene.farlight.samples, scene.farlight.step_samples, scene.farlight.denoise = 64, 32, "auto"
    scene.farlight.server, scene.farlight.use_auto_clamp, scene.farlight.clamp = "", False, 10
    return scene


def put(name, data, place=(0, 0, 0), turn=(0, 0, 0), scale=(1, 1, 1)):
    thing = bpy.data.objects.new(name, data)
    thing.location, thing.rotation_euler, thing.scale = place, turn, scale
    bpy.context.scene.collection.objects.link(thing)
    return thing


def material(name="material", **inputs):
    """Principled, with values by the names of its inputs."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    for key, value in inputs.items():
        made.node_tree.nodes["Principled BSDF"].inputs[key.replace("_", " ")].default_value = value
    return made


def grid(name, size, of=None, place=(0, 0, 0), turn=(0, 0, 0)):
    """A square with UV."""
    mesh = bpy.data.meshes.new(name)
    half = size / 2
    mesh.from_pydata([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], [], [(0, 1, 2, 3)])
    mesh.uv_layers.new().data.foreach_set("uv", (0, 0, 1, 0, 1, 1, 0, 1))
    if of:
        mesh.materials.append(of)
    return put(name, mesh, place, turn)


def ball(name, of=None, place=(0, 0, 1), radius=1.0):
    """Smooth."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=radius, location=place)
    made = bpy.context.object
    made.name = name
    bpy.ops.object.shade_smooth()
    if of:
        made.data.materials.append(of)
    return made


def hairs(thing, count, material=1, **values):
    """A particle system with straight hairs, and its settings."""
    thing.modifiers.new("hairs", "PARTICLE_SYSTEM")
    settings = thing.particle_systems[0].settings
    settings.type, settings.count, settings.material = "HAIR", count, material
    for name, value in values.items():
        setattr(settings, name, value)
    return settings


def bow_and_points(name, place=(0, 0, 0)):
    """An object of curves (hair) whose geometry nodes make a bent one of five points, and a row of points."""
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.outputs.new("NodeSocketGeometry", "Geometry")
    joined, end = tree.nodes.new("GeometryNodeJoinGeometry"), tree.nodes.new("NodeGroupOutput")
    tree.links.new(joined.outputs[0], end.inputs[0])
    curve = {"Start": (0, 0, 0), "Start Handle": (0, 0, 1), "End Handle": (0.5, 0, 2), "End": (1, 0, 1)}
    for chain in ((("CurvePrimitiveBezierSegment", curve), ("ResampleCurve", {"Count": 5}), ("SetCurveRadius", {"Radius": 0.2}),
                   ("SetMaterial", {"Material": diffuse((0.1, 0.3, 0.8, 1))})),
                  (("MeshLine", {"Offset": (0.6, 0, 0), "Count": 5}), ("MeshToPoints", {"Radius": 0.25}),
                   ("SetMaterial", {"Material": diffuse((0.2, 0.7, 0.2, 1))}))):
        before = None
        for kind, inputs in chain:
            node = tree.nodes.new(f"GeometryNode{kind}")
            for key, value in inputs.items():
                node.inputs[key].default_value = value
            if before:
                tree.links.new(before.outputs[0], node.inputs[0])
            before = node
        tree.links.new(before.outputs[0], joined.inputs[0])
    data = bpy.data.hair_curves.new(name)
    made = put(name, data, place)
    made.modifiers.new(name, "NODES").node_group = tree
    return made


def add_light(kind, energy, place=(0, 0, 4), turn=(0, 0, 0), **values):
    data = bpy.data.lights.new(kind.lower(), kind)
    data.energy = energy
    for name, value in values.items():
        setattr(data, name, value)
    return put(data.name, data, place, turn)


def image(name, pixels, space="sRGB", is_float=False):
    """Height x width x 4, rows from the top; in a file, from which Cycles takes them."""
    pixels = np.asarray(pixels, np.float32)
    made = bpy.data.images.new(name, pixels.shape[1], pixels.shape[0], alpha=True, float_buffer=is_float)
    made.pixels.foreach_set(np.ascontiguousarray(pixels[::-1]).ravel())
    made.file_format = "OPEN_EXR" if is_float else "PNG"
    made.filepath_raw = str(pathlib.Path(FOLDER.name) / name)
    made.save()
    path = made.filepath_raw
    bpy.data.images.remove(made)
    made = bpy.data.images.load(path)
    made.colorspace_settings.name = space
    return made


def shader(of):
    """The node that makes the surface."""
    return of.node_tree.nodes["Material Output"].inputs["Surface"].links[0].from_node


def textured(of, name, picture, interpolation="Linear"):
    """Feeds an input of the shader from an image."""
    tree = of.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.interpolation = picture, interpolation
    tree.links.new(node.outputs["Color"], shader(of).inputs[name])
    return node


def load(path):
    """Height x width x 4 floats, rows from the top."""
    picture = bpy.data.images.load(str(path))
    picture.colorspace_settings.name = "Non-Color"
    width, height = picture.size
    values = np.empty(width * height * 4, np.float32)
    picture.pixels.foreach_get(values)
    bpy.data.images.remove(picture)
    return values.reshape(height, width, 4)[::-1]


def rendered(engine, samples=128, file_format="OPEN_EXR"):
    """F12: the file, of linear floats."""
    scene = bpy.context.scene
    scene.render.engine = engine
    if engine == "CYCLES":
        scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = samples, False, False
        # The same paths: as many bounces of each kind, no light left out, and no surface rougher after a rough one, which takes
        # 12 % of the light of metals and a third of that below glass.
        for bounces in ("max", "diffuse", "glossy", "transmission", "transparent_max"):
            setattr(scene.cycles, f"{bounces}_bounces", scene.farlight.depth)
        scene.cycles.sample_clamp_indirect, scene.cycles.blur_glossy = scene.farlight.clamp, 0
        scene.cycles.caustics_refractive = scene.cycles.caustics_reflective = True
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = file_format, "32"
    scene.render.image_settings.color_mode = "RGBA"
    path = pathlib.Path(FOLDER.name) / f"{engine}.exr"
    path.unlink(missing_ok=True)
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return path


def render(engine="FARLIGHT", samples=128):
    """F12, linear."""
    return load(rendered(engine, samples))


def blocks(picture, across=8, down=6):
    """Means of the picture's parts: noise is averaged away, light is not."""
    height, width = picture.shape[0] // down, picture.shape[1] // across
    cut = picture[:height * down, :width * across].astype(np.float64)
    return cut.reshape(down, height, across, width, -1).mean(axis=(1, 3))


def diffuse(colour):
    """Lambert's, which both engines have alike."""
    made = bpy.data.materials.new("diffuse")
    made.use_nodes = True
    tree = made.node_tree
    node = tree.nodes.new("ShaderNodeBsdfDiffuse")
    node.inputs["Color"].default_value = colour
    tree.links.new(node.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    return made


def mixture(kind, *parts, share=None):
    """Mix or Add Shader of (node, {input: value}). share: a number, or the name of the node that is the factor."""
    made = bpy.data.materials.new("mixture")
    made.use_nodes = True
    tree = made.node_tree
    joined = tree.nodes.new(f"ShaderNode{kind}Shader")
    if isinstance(share, str):
        tree.links.new(tree.nodes.new(f"ShaderNode{share}").outputs[0], joined.inputs["Fac"])
    elif share is not None:
        joined.inputs["Fac"].default_value = share
    for (name, values), socket in zip(parts, [one for one in joined.inputs if one.type == "SHADER"]):
        node = tree.nodes.new(f"ShaderNode{name}")
        if name in {"BsdfPrincipled", "BsdfGlossy"}:
            node.distribution = "MULTI_GGX"  # with the light that facets give each other, as in farlight
        for key, value in values.items():
            node.inputs[key].default_value = value
        tree.links.new(node.outputs[0], socket)
    tree.links.new(joined.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    return made


def procedural(kind, output="Color", of=None, to="Color", **inputs):
    """Feeds an input of the shader, of Lambert's without one, from a procedural texture; its node and the material."""
    made = of or diffuse((1, 1, 1, 1))
    node = made.node_tree.nodes.new(f"ShaderNodeTex{kind}")
    for key, value in inputs.items():
        node.inputs[key].default_value = value
    made.node_tree.links.new(node.outputs[output], shader(made).inputs[to])
    return made


def group(name, inputs, outputs):
    """A tree of a group: its sockets by their names, of types such as Color; and the nodes of both ends."""
    tree = bpy.data.node_groups.new(name, "ShaderNodeTree")
    for sockets, given in ((tree.inputs, inputs), (tree.outputs, outputs)):
        for key, kind in given.items():
            sockets.new(f"NodeSocket{kind}", key)
    return tree, tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")


def use_group(tree, of, **values):
    """A node of a group in another tree."""
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = of
    for key, value in values.items():
        node.inputs[key].default_value = value
    return node


def without_surface(kind, **inputs):
    """A material that is a volume alone."""
    made = bpy.data.materials.new("volume")
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.remove(tree.nodes["Principled BSDF"])
    node = tree.nodes.new(f"ShaderNodeVolume{kind}")
    for key, value in inputs.items():
        node.inputs[key].default_value = value
    tree.links.new(node.outputs[0], tree.nodes["Material Output"].inputs["Volume"])
    return made


def cube(name, of, place=(0, 0, 1), size=1.5):
    bpy.ops.mesh.primitive_cube_add(size=size, location=place)
    made = bpy.context.object
    made.name = name
    made.data.materials.append(of)
    return made
