#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""A turntable in cells, as notebooks and editors run them one by one: turntable.py [MODEL [FOLDER [FRAMES]]]"""
# %% A private daemon, and a scene from a file or from arrays.
import pathlib
import sys

import numpy as np

import farlight

model, folder, count = (sys.argv[1:] + ["", "", ""][len(sys.argv) - 1:])[:3]
folder, count = pathlib.Path(folder or "turntable"), int(count or 24)
client = farlight.connect(retry_for=60)


def knot(points=400, around=24, radius=0.25):
    """A torus knot: positions, normals and triangles of its tube."""
    t = np.linspace(0, 2 * np.pi, points, endpoint=False)
    centre = np.stack([(2 + np.cos(3 * t)) * np.cos(2 * t), np.sin(3 * t), (2 + np.cos(3 * t)) * np.sin(2 * t)], axis=1)
    forward = np.roll(centre, -1, axis=0) - np.roll(centre, 1, axis=0)
    side = np.cross(forward, centre)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(side, forward)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    a = np.linspace(0, 2 * np.pi, around, endpoint=False)[None, :, None]
    normals = np.cos(a) * side[:, None] + np.sin(a) * up[:, None]
    i, j = np.meshgrid(np.arange(points), np.arange(around), indexing="ij")
    here, right = i * around + j, i * around + (j + 1) % around
    ahead, both = (i + 1) % points * around + j, (i + 1) % points * around + (j + 1) % around
    triangles = np.stack([here, right, ahead, right, both, ahead], axis=-1)
    return (centre[:, None] + radius * normals).reshape(-1, 3), normals.reshape(-1, 3), triangles.reshape(-1, 3)


if model:
    scene = farlight.load(model)
else:
    scene = farlight.Scene()
    positions, normals, triangles = knot()
    gold = scene.add_material((1.0, 0.75, 0.3), metallic=1, roughness=0.2)
    scene.add_node(scene.add_mesh(positions, triangles, normals=normals, material=gold))

# %% The scene's size, and one picture.
bounds = client.describe(scene)
lower, upper = np.array(bounds.lower_world), np.array(bounds.upper_world)
middle, radius = (lower + upper) / 2, np.linalg.norm(upper - lower) / 2
size = {"width": 320, "height": 240}


def camera(degrees):
    """A camera on a circle a little above the middle."""
    angle = np.radians(degrees)
    return farlight.Camera(middle + 2.5 * radius * np.array([np.sin(angle), 0.4, np.cos(angle)]), middle)


first = client.render(scene, camera(0), samples=4, integrator="distributed", **size)
print("first picture:", first.size, "rays:", first.end.primary_rays + first.end.shadow_rays)

# %% Once around, as a single job: the daemon renders ahead while we write.
folder.mkdir(parents=True, exist_ok=True)
keys = {"camera_path": "orbit", "orbit_turn": 2 * np.pi, "orbit_seconds": count / 24}
for frame in client.frames(scene, camera(0), samples=4, integrator="distributed", last_frame=count - 1, **keys, **size):
    farlight.write_png(folder / f"{frame.number:03}.png", frame.colour)
print(f"{count} frames in {folder}")

# %% Another material, without delay: only its values travel.
if not model:
    scene.change(gold, base_colour=(0.9, 0.2, 0.3, 1), metallic=0, clearcoat=1)
    farlight.write_png(folder / "lacquer.png", client.render(scene, camera(30), samples=16, integrator="path", **size).colour)
client.close()
