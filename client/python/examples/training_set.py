#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Writes pictures of a model from random cameras, with all that is known of them, for training: training_set.py MODEL FOLDER

Each .npz file has colour (uint8), depth (metres, infinite where there is nothing), normal, albedo, node (the number of the
object that is seen, 0: none), K and world_from_view; beside it lies the picture as .png. coco.json names the objects and has
the box of each in each picture. File n depends on the seed and n alone, and files that are there are left: a run that was
stopped goes on.
"""
import argparse
import json
import pathlib

import numpy as np

import farlight


def random_camera(random, lower, upper):
    """A camera outside the bounding box that points at a place within it."""
    middle, radius = (lower + upper) / 2, np.linalg.norm(upper - lower) / 2
    direction = random.normal(size=3)
    direction[1] = abs(direction[1]) * 0.7  # favours views from above
    eye = middle + direction / np.linalg.norm(direction) * radius * random.uniform(1.5, 3)
    target = middle + (upper - lower) * random.uniform(-0.2, 0.2, size=3)
    return farlight.Camera(eye, target, fov_degrees=random.uniform(30, 60))


def boxes(node):
    """Yields the number, the pixel count and the COCO box of each visible object."""
    for number in np.unique(node[node > 0]).tolist():
        rows, columns = np.nonzero(node == number)
        left, top = int(columns.min()), int(rows.min())
        yield number, len(rows), [left, top, int(columns.max()) - left + 1, int(rows.max()) - top + 1]


def write_coco(folder, scene, count):
    """Builds coco.json from the pictures' files."""
    named = scene.names().nodes.items()
    made = {"images": [], "annotations": [], "categories": [{"id": number, "name": node.name or f"node {number}"} for number, node in named]}
    for number in range(count):
        with np.load(folder / f"{number:05}.npz") as known:
            node = known["node"]
        height, width = node.shape
        made["images"].append({"id": number, "file_name": f"{number:05}.png", "width": width, "height": height})
        for category, area, box in boxes(node):
            made["annotations"].append({"id": len(made["annotations"]) + 1, "image_id": number, "category_id": category, "bbox": box,
                                        "area": area, "iscrowd": 0})
    (folder / "coco.json").write_text(json.dumps(made))


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
            exact = client.render(scene, camera, layers=("depth", "normal", "albedo", "id"), **size)
            farlight.write_png(path.with_suffix(".png"), picture.colour)
            unfinished = path.with_suffix(".part.npz")
            np.savez_compressed(unfinished, colour=picture.colour, depth=exact.depth, normal=exact.normal, albedo=exact.albedo,
                                node=exact.ids[..., 0], K=exact.K, world_from_view=exact.world_from_view)
            unfinished.rename(path)
            print(path)
    write_coco(options.folder, scene, options.count)


if __name__ == "__main__":
    try:
        main()
    except farlight.Error as why:
        raise SystemExit(f"training_set: {why}") from None
