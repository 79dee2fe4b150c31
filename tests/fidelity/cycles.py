# SPDX-License-Identifier: MIT
"""Run by Blender: renders one view of a model with Cycles on processors, as often as it is told, and prints the seconds
of processor time of each render.

blender --background --factory-startup --python cycles.py -- JOB.json

The job has model, eye, look_at, up, fov (vertical, degrees), size, depth, environment (a file or null), and renders: a
list of samples, seed and output. Models are imported so that the job's places hold: glTF, whose +y is up, is turned by
Blender, OBJ is taken as it is."""
import json
import math
import pathlib
import sys
import time

import bpy
import mathutils
import numpy

numpy.bool = bool  # which NumPy 1.24 has no more, and Blender 3.4's importer of glTF needs

def of_model(job, vector):
    """A place of the model in Blender's space."""
    x, y, z = vector
    return mathutils.Vector((x, y, z) if job["model"].endswith(".obj") else (x, -z, y))


def import_model(job):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if job["model"].endswith(".obj"):
        bpy.ops.wm.obj_import(filepath=job["model"], forward_axis="Y", up_axis="Z")
    else:
        bpy.ops.import_scene.gltf(filepath=job["model"], convert_lighting_mode="COMPAT")
    for light in bpy.data.lights:  # our extra property of lights; Blender keeps it without using it
        light.shadow_soft_size = light.get("radius", 0)
    bpy.context.scene.frame_set(0)  # the pose at the beginning of the clips


def add_camera(job):
    eye = of_model(job, job["eye"])
    backward = (eye - of_model(job, job["look_at"])).normalized()
    right = of_model(job, job["up"]).cross(backward).normalized()
    turned = mathutils.Matrix((right, backward.cross(right), backward)).transposed().to_4x4()
    data = bpy.data.cameras.new("view")
    data.sensor_fit, data.angle, data.clip_start, data.clip_end = "VERTICAL", math.radians(job["fov"]), 1e-4, 1e5
    camera = bpy.data.objects.new("view", data)
    camera.matrix_world = mathutils.Matrix.Translation(eye) @ turned
    bpy.context.collection.objects.link(camera)
    bpy.context.scene.camera = camera


def add_world(job):
    world = bpy.context.scene.world = bpy.data.worlds.new("world")
    world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    if not job["environment"]:
        background.inputs["Color"].default_value = (0, 0, 0, 1)
        return
    image = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
    image.image = bpy.data.images.load(job["environment"])
    world.node_tree.links.new(image.outputs["Color"], background.inputs["Color"])


def settle(job):
    """No approximation that ours does not make: no clamp, no blurred gloss, no threshold, no adaptive samples."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = job["size"]
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    cycles = scene.cycles
    cycles.device, cycles.use_denoising, cycles.use_adaptive_sampling = "CPU", False, False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = cycles.light_sampling_threshold = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    for kind in ("max", "diffuse", "glossy", "transmission", "transparent_max"):
        setattr(cycles, f"{kind}_bounces", job["depth"])
    cycles.pixel_filter_type, cycles.use_auto_tile = "BOX", False


def main():
    job = json.loads(pathlib.Path(sys.argv[sys.argv.index("--") + 1]).read_text())
    import_model(job)
    add_camera(job)
    add_world(job)
    settle(job)
    scene = bpy.context.scene
    for render in job["renders"]:
        scene.cycles.samples, scene.cycles.seed = render["samples"], render["seed"]
        scene.render.filepath = render["output"]
        before = time.process_time()
        bpy.ops.render.render(write_still=True)
        print("CPU_S", render["samples"], time.process_time() - before, flush=True)


main()
