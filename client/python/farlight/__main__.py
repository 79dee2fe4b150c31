# SPDX-License-Identifier: MIT
"""python3 -m farlight render MODEL -o picture.png"""
from __future__ import annotations

import argparse
import re
import sys
from typing import Any

import numpy as np

from . import client, importer, messages, png
from .errors import Error, InvalidValue
from .fields import Word
from .frame import Frame
from .scene import Camera, CameraOf, Scene

FAILED, USAGE, TRY_AGAIN, INTERRUPTED = 1, 2, 75, 130
# Where nothing is said, as the command `farlight render` has it: samples of a pixel, and the clamp of indirect light.
SAMPLES = {"path": 64}
OTHER_SAMPLES, CLAMP = 16, 10.0


def _vector(text: str) -> list[float]:
    numbers = [float(one) for one in text.split(",")]
    if len(numbers) != 3:
        raise ValueError
    return numbers


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d+)x(\d+)", text)
    if not found:
        raise ValueError
    return int(found[1]), int(found[2])


def _setting(text: str) -> tuple[str, Any]:
    """A field of the message render, as its type has it."""
    name, equals, value = text.partition("=")
    default = getattr(messages.Render(), name.replace("-", "_"), None)
    if not equals or isinstance(default, tuple) or default is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not FIELD=VALUE with a field of the message render")
    if isinstance(default, Word):
        return name.replace("-", "_"), value
    return name.replace("-", "_"), type(default)(value)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python3 -m farlight", description="A client of farlightd.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    render = commands.add_parser(
        "render", help="render a picture of a model", description="Render a picture of a model. Exit status: 0, 1 failed, "
        "2 usage, 75 the same may succeed later.")
    render.add_argument("models", nargs="+", metavar="MODEL", help="file that farlight-import can read")
    render.add_argument("-o", "--output", required=True, metavar="FILE",
                        help="PNG file, or .npz for the layers as arrays of floats")
    render.add_argument("--size", type=_size, default=(1280, 720), metavar="WxH", help="pixels (default: 1280x720)")
    render.add_argument("--samples", type=int, metavar="N", help="samples of a pixel (default: 16; path 64)")
    render.add_argument("--integrator", help="whitted, distributed, raycast, ao or path (default: distributed; with one "
                        "sample whitted)")
    render.add_argument("--tracer", default="bvh", help="bvh, ldc, abuffer, rayspace, quadtree, reference or naive")
    render.add_argument("--eye", type=_vector, metavar="X,Y,Z",
                        help="position of the camera (default: the model's first camera, else one that sees all)")
    render.add_argument("--look-at", type=_vector, metavar="X,Y,Z", help="point in the middle (default: 0,0,0)")
    render.add_argument("--fov", type=float, default=40.0, metavar="DEGREES", help="vertical field of view (default: 40)")
    render.add_argument("--layers", metavar="NAME,NAME",
                        help="of an .npz file: beauty, albedo, normal, depth, position, ao, id (default: beauty)")
    render.add_argument("--environment", metavar="FILE", help="image that lights the scene")
    render.add_argument("--set", type=_setting, action="append", default=[], metavar="FIELD=VALUE",
                        help="any other field of the message render: --set denoise=on --set seed=7")
    render.add_argument("--server", metavar="ADDRESS", help="unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET] "
                        "(default: FARLIGHT_SERVER, else a daemon of its own)")
    render.add_argument("--key", metavar="FILE", help="key that the daemon has as well: the connection is sealed")
    render.add_argument("--retry-for", type=float, default=0.0, metavar="SECONDS",
                        help="wait so long for a daemon that is lost or has no place")
    return parser


def _camera(options: argparse.Namespace, scene: Scene) -> CameraOf:
    if options.eye:
        return Camera(options.eye, options.look_at or (0, 0, 0), fov_degrees=options.fov)
    nodes = (node for node in scene.objects("node") if scene.get(node).kind == messages.NodeKind.CAMERA)
    return next(nodes, None)


def _write(options: argparse.Namespace, frame: Frame) -> None:
    if not options.output.endswith(".npz"):
        png.write(options.output, frame.colour)
        return
    try:
        np.savez_compressed(options.output, **{layer.word: frame.layer(layer) for layer in frame.layers})
    except OSError as why:
        raise Error(f"cannot be written: {why.strerror}", field=options.output) from None


def _render(options: argparse.Namespace) -> None:
    samples = options.samples if options.samples is not None else SAMPLES.get(options.integrator, OTHER_SAMPLES)
    integrator = options.integrator or ("distributed" if samples > 1 else "whitted")
    values: dict[str, Any] = {"width": options.size[0], "height": options.size[1], "samples": samples,
                              "integrator": integrator, "tracer": options.tracer, "clamp": CLAMP,
                              "primary": messages.Primary.AUTO, **dict(options.set)}
    is_npz = options.output.endswith(".npz")
    if not is_npz and (options.layers or not options.output.endswith(".png")):
        raise InvalidValue("is no .png file; layers are for .npz files", field=options.output)
    layers = (options.layers or "beauty").split(",") if is_npz else ()
    scene = importer.load(*options.models, environment=options.environment)
    for note in scene.notes:
        print(f"farlight: {note}", file=sys.stderr)
    with client.connect(options.server, key_file=options.key, retry_for=options.retry_for) as daemon:
        frame = daemon.render(scene, _camera(options, scene), layers=layers, **values)
    for warning in frame.warnings:
        print(f"farlight: {warning}", file=sys.stderr)
    _write(options, frame)


def main(arguments: list[str] | None = None) -> int:
    """The exit status."""
    options = _parser().parse_args(arguments)
    try:
        _render(options)
    except Error as why:
        print(f"farlight: {why}", file=sys.stderr)
        return USAGE if isinstance(why, InvalidValue) else TRY_AGAIN if why.retryable else FAILED
    except KeyboardInterrupt:
        return INTERRUPTED
    return 0


if __name__ == "__main__":
    sys.exit(main())
