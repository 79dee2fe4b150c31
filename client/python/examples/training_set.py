#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Writes pictures of a model from random cameras, with depths and normals, for training: training_set.py MODEL FOLDER

Each .npz file has colour (uint8), depth (metres, infinite where there is nothing), normal, albedo, world_from_view and
fov_y. File n depends on the seed and n alone, and files that are there are left: a run that was stopped goes on.
"""
import argparse
import pathlib

import numpy as np

import farlight


def random_camera(random, lower, upper):
    """Somewhere round the box, looking at a point within it."""
    middle, radius = (lower + upper) / 2, np.linalg.norm(upper - lower) / 2
    direction = random.normal(size=3)
    direction[1] = abs(direction[1]) * 0.7  # rather from above
    eye = middle + direction / np.linalg.norm(direction) * radius * random.uniform(1.5, 3)
    target = middle + (upper - lower) * random.uniform(-0.2, 0.2, size=3)
    return farlight.Camera(eye, target, fov_degrees=random.uniform(30, 60))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--count", type=int, default=16)
    parser.add_argument("--size", type=int, default=256, help="pixels of a side")
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    scene = farlight.load(options.model)
    size = {"width": options.size, "height": options.size}
    with farlight.connect(retry_for=60) as client:
        bounds = client.describe(scene)
        lower, upper = np.array(bounds.lower_world), np.array(bounds.upper_world)
        for number in range(options.count):
            path = options.folder / f"{number:05}.npz"
            if path.exists():
                continue
            camera = random_camera(np.random.default_rng((options.seed, number)), lower, upper)
            picture = client.render(scene, camera, samples=options.samples, integrator="distributed", **size)
            exact = client.render(scene, camera, layers=("depth", "normal", "albedo"), **size)
            unfinished = path.with_suffix(".part.npz")
            np.savez_compressed(unfinished, colour=picture.colour, depth=exact.depth, normal=exact.normal, albedo=exact.albedo,
                                world_from_view=exact.world_from_view, fov_y=exact.begin.fov_y)
            unfinished.rename(path)
            print(path)


if __name__ == "__main__":
    try:
        main()
    except farlight.Error as why:
        raise SystemExit(f"training_set: {why}") from None
