# SPDX-License-Identifier: MIT
"""python3 -m farlight render MODEL -o picture.png"""
from __future__ import annotations

import argparse
import difflib
import os
import re
import sys
import time
from typing import Any

import numpy as np

from . import client, files, importer, messages, png
from .camera import Camera, CameraOf, one_frame, request, usual_clamp
from .errors import Error, FileFailed, InvalidValue
from .fields import Word
from .frame import Frame
from .scene import Scene
from .version import VERSION

FAILED, USAGE, TRY_AGAIN, INTERRUPTED = 1, 2, 75, 130
# Default samples of a pixel, as for the command `farlight render`.
SAMPLES = {"path": 64}
OTHER_SAMPLES = 16


class _Progress:
    """A progress line on a terminal, drawn at most ten times a second."""

    def __init__(self) -> None:
        self.is_shown, self.is_drawn, self.next_s = sys.stderr.isatty(), False, 0.0

    def show(self, what: str, done: int = 0, total: int = 0) -> None:
        """Shows the progress; `total` 0: unknown."""
        now = time.monotonic()
        if self.is_shown and (now >= self.next_s or not total):
            share = f" {100 * min(done, total) // total} % of {total / 1e6:.1f} MB" if total else ""
            print(f"\r\033[K{what}{share}", end="", file=sys.stderr, flush=True)
            self.is_drawn, self.next_s = True, now + 0.1

    def clear(self) -> None:
        """Removes the line before anything else is printed."""
        if self.is_drawn:
            print("\r\033[K", end="", file=sys.stderr, flush=True)
        self.is_drawn = False


def _vector(text: str) -> list[float]:
    try:
        numbers = [float(one) for one in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 3:
        raise argparse.ArgumentTypeError(f"{text!r} is not X,Y,Z, such as 0,1.5,4")
    return numbers


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,9})x(\d{1,9})", text, re.ASCII)
    if not found:
        raise argparse.ArgumentTypeError(f"{text!r} is not WxH, such as 1280x720")
    return int(found[1]), int(found[2])


def _setting(text: str) -> tuple[str, Any]:
    """Reads a field of the message render, by the type of the field."""
    word, equals, value = text.partition("=")
    name, render = word.replace("-", "_"), messages.Render()
    known = [name for name in render.names() if not isinstance(getattr(render, name), tuple)]
    if not equals or name not in known:
        like = " or ".join(difflib.get_close_matches(name, known)) if equals else ""
        raise argparse.ArgumentTypeError(f"{text!r} is not FIELD=VALUE with a field of the message render" +
                                         (f"; did you mean {like}?" if like else ""))
    default = getattr(render, name)
    if isinstance(default, Word):
        return name, value
    try:
        return name, type(default)(value)
    except ValueError:
        kind = "number" if isinstance(default, float) else "whole number"
        raise argparse.ArgumentTypeError(f"{name}: {value!r} is no {kind}") from None


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python3 -m farlight", description="A client of farlightd.")
    parser.add_argument("--version", action="version", version=f"farlight {VERSION}")
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
    render.add_argument("--key", metavar="FILE", help="key shared with the daemon, which seals the connection")
    render.add_argument("--retry-for", type=float, default=0.0, metavar="SECONDS",
                        help="wait so long for a daemon that is lost or has no place")
    return parser


def _camera(options: argparse.Namespace, scene: Scene) -> CameraOf:
    if options.eye:
        return Camera(options.eye, options.look_at or (0, 0, 0), fov_degrees=options.fov)
    nodes = (node for node in scene.objects("node") if scene.get(node).kind == messages.NodeKind.CAMERA)
    return next(nodes, None)


def _write(options: argparse.Namespace, frame: Frame) -> None:
    if options.output.endswith(".png"):
        png.write(options.output, frame.colour)
    else:
        layers = {layer.word: frame.layer(layer) for layer in frame.layers}
        files.write(options.output, lambda file: np.savez_compressed(file, **layers))


def _values(options: argparse.Namespace) -> dict[str, Any]:
    samples = options.samples if options.samples is not None else SAMPLES.get(options.integrator, OTHER_SAMPLES)
    integrator = options.integrator or ("distributed" if samples > 1 else "whitted")
    denoise = messages.Denoise.AUTO if options.output.endswith(".png") else messages.Denoise.OFF
    return {"width": options.size[0], "height": options.size[1], "samples": samples, "integrator": integrator,
            "tracer": options.tracer, "clamp": usual_clamp(samples), "primary": messages.Primary.AUTO,
            "denoise": denoise, **dict(options.set)}


def _layers(options: argparse.Namespace) -> tuple[str, ...]:
    if options.output.endswith(".npz"):
        return tuple((options.layers or "beauty").split(","))
    if not options.output.endswith(".png"):
        raise InvalidValue("is neither .png nor .npz", field=options.output,
                           remedy="name such a file, or run 'farlight render', which writes other formats")
    if options.layers:
        raise InvalidValue("a .png has no layers", field=options.output, remedy="name an .npz file")
    return ()


def _render(options: argparse.Namespace, progress: _Progress) -> None:
    # Faults of options are reported before a large model is read.
    values, layers = _values(options), _layers(options)
    request(Camera(options.eye or (0, 0, 1), options.look_at or (0, 0, 0), fov_degrees=options.fov), layers, one_frame(values))
    if not os.path.isdir(os.path.dirname(options.output) or "."):
        raise FileFailed("its folder is not there", field=options.output)
    progress.show("importing")
    scene = importer.load(*options.models, environment=options.environment, progress=progress.show)
    progress.clear()
    for note in scene.notes:
        print(f"farlight: {note}", file=sys.stderr)
    with client.connect(options.server, key_file=options.key, retry_for=options.retry_for, progress=progress.show) as daemon:
        daemon.send(scene)
        progress.show("rendering")
        frame = daemon.render(scene, _camera(options, scene), layers=layers, **values)
    progress.clear()
    for warning in frame.warnings:
        print(f"farlight: {warning}", file=sys.stderr)
    _write(options, frame)


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns the exit status."""
    options = _parser().parse_args(arguments)
    progress = _Progress()
    try:
        _render(options, progress)
    except Error as why:
        progress.clear()
        print(f"farlight: {why}", file=sys.stderr)
        return USAGE if isinstance(why, InvalidValue) else TRY_AGAIN if why.retryable else FAILED
    except MemoryError:
        progress.clear()
        print("farlight: out of memory", file=sys.stderr)
        return FAILED
    except KeyboardInterrupt:
        progress.clear()
        print("farlight: interrupted", file=sys.stderr)
        return INTERRUPTED
    return 0


if __name__ == "__main__":
    sys.exit(main())
