# SPDX-License-Identifier: MIT
"""The Python package in the hands of its users: arguments that are wrong, frames that come encoded, the environment, Ctrl-C,
and daemons that end in the middle."""
import asyncio
import ctypes
import inspect
import os
import pty
import random
import shutil
import signal
import subprocess
import sys
import time
import unittest.mock

import farlight_test
from farlight_test import Case, OneDaemon, bundled_scenes, long_test
from test_sealed import SealedDaemon
from test_python import DEBIANS, PACKAGE, STRAIGHT, begin, python, say, started, triangle

import numpy as np
import farlight
from farlight import decode, libraries, messages
from farlight.core import Core

SQUARE = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], np.float64)

# 513, 511 and 512 bytes of 0, of which a picture of 16x8 has the last.
ZSTD_513, ZSTD_511, ZSTD_512 = (bytes.fromhex(one) for one in (
    "28b52ffd6001014d00001000000100fc2ac002", "28b52ffd60ff004d00001000000100fa2ac002", "28b52ffd6000014d00001000000100fb2ac002"))
DIGEST_OF_ZEROS = 0xb2987a9d949e807c  # XXH3-64 of those 512


def jpeg(width, height):
    """A black one."""
    library = libraries.find("turbojpeg", 0)
    library.tjInitCompress.restype = ctypes.c_void_p
    coder, made, size = ctypes.c_void_p(library.tjInitCompress()), ctypes.c_void_p(), ctypes.c_ulong()
    failed = library.tjCompress2(coder, bytes(width * height * 4), width, 0, height, decode.RGBA, ctypes.byref(made), ctypes.byref(size), 0, 90, 0)
    assert not failed
    data = ctypes.string_at(made.value, size.value)
    library.tjFree(made)
    library.tjDestroy(coder)
    return data


class Arguments(Case):
    def refused(self, attempt, field, *texts):
        with self.subTest(field=field, texts=texts), self.assertRaises(farlight.InvalidValue) as raised:
            attempt()
        self.assertEqual(raised.exception.field, field)
        for text in texts:
            self.assertIn(text, str(raised.exception))

    def test_an_array_that_does_not_fit_is_refused_with_its_type_its_shape_and_what_is_allowed(self):
        scene = farlight.Scene()
        for positions, triangles, texts in ((SQUARE, [(0, 1, 2, 3)], ("(1, 4)", "(n, 3)")), (SQUARE, [(0, 1, 4)], ("vertex 4", "0 .. 3")),
                                            (SQUARE, np.zeros((1, 3)), ("float64", "astype(numpy.uint32)")), (SQUARE, [(0, 1, -1)], ("-1 .. 1",))):
            self.refused(lambda p=positions, t=triangles: scene.add_mesh(p, t), "triangles", *texts)
        for positions, texts in ((SQUARE, ("4 points", "three for each")), (SQUARE.astype(complex), ("complex128", "(n, 3)")),
                                 ([(1, 2, 3), (1, 2)], ("differ in length",)), ("abc", ("'abc'",)), (None, ("None", "(n, 3)")), (SQUARE[None], ("(1, 4, 3)",)),
                                 (np.where(SQUARE > 0, 1e39, 0)[:3], ("1e+39 at [1, 0]",)), ([(0, 0, np.inf)] * 3, ("inf at [0, 2]",))):
            self.refused(lambda p=positions: scene.add_mesh(p), "positions", *texts)
        corners = [(0, 1, 2)]
        self.refused(lambda: scene.add_mesh(SQUARE, corners, colours=np.full((4, 4), 300)), "colours", "300", "0 .. 255")
        self.refused(lambda: scene.add_mesh(SQUARE, corners, texcoords=SQUARE), "texcoords", "(4, 3)", "(4, 2)")
        self.refused(lambda: scene.add_mesh(SQUARE, corners, materials=[1, 2]), "materials", "(2,)", "(1,)")
        self.refused(lambda: scene.add_mesh(SQUARE, np.zeros((5000, 3), int), materials=np.arange(5000) % 2 + 1), "materials", "5000", "sort")
        self.refused(lambda: scene.add_spheres(SQUARE, "large"), "radii", "one for each of the 4")
        self.refused(lambda: scene.add_texture("wood.png"), "image", "(height, width, 3)")
        self.refused(lambda: scene.set_environment(image=np.zeros((0, 4, 3))), "image", "(0, 4, 3)")
        self.refused(lambda: scene.add_node(None, (0, 1, 0)), "transform", "(3,)", "translate")
        self.refused(lambda: scene.add_node(None, farlight.translate(1, 2, 3).T), "transform", "last row", "transpose")
        self.assertEqual(scene.edits_since(0), [])

    def test_colours_may_be_bytes_or_floats_and_mean_the_same(self):
        scene, shades = farlight.Scene(), np.array([[0, 51, 102], [153, 204, 255], [255, 0, 51]])
        made = [scene.get(scene.add_mesh(SQUARE[:3], colours=colours)).arrays[6] for colours in (
            shades, shades.astype(np.uint8), shades / 255, np.column_stack((shades, [255] * 3)))]
        self.assertEqual([one.hash for one in made], [made[0].hash] * 4)
        self.assertEqual(made[0].size_bytes, 3 * 4)
        dark = scene.get(scene.add_mesh(SQUARE[:3], colours=shades / 25500)).arrays[6]  # which bytes would make 0 or 1
        self.assertEqual(dark.size_bytes, 3 * 4 * 2)
        image = [scene.get(scene.add_texture(one)).arrays[0].hash for one in (shades, shades / 255, np.repeat(shades[..., None], 3, axis=2))]
        self.assertEqual(image, image[:1] * 3)

    def test_what_is_no_object_of_the_scene_is_refused_by_name(self):
        scene, other = farlight.Scene(), farlight.Scene()
        material, node = other.add_material(), other.add_node()
        for attempt, field, text in ((lambda: scene.add_mesh(SQUARE[:3], material=1), "material", "1 is no material"),
                                     (lambda: scene.add_mesh(SQUARE[:3], material=material), "material", "not in this scene"),
                                     (lambda: scene.add_material(textures={"colour": material}), "textures", "base_colour"),
                                     (lambda: scene.add_material(textures={"normal": 3}), "textures['normal']", "3 is no texture"),
                                     (lambda: scene.add_node(material), "shows", "mesh or spheres or light or camera"),
                                     (lambda: scene.add_node(parent=node), "parent", "not in this scene"), (lambda: scene.move(material, None), "node", "no node"),
                                     (lambda: scene.change("steel", roughness=1), "object", "'steel'"), (lambda: scene.remove(node), "object", "not in this scene"),
                                     (lambda: scene.remove(farlight.ENVIRONMENT), "object", "environment"), (lambda: scene.find("materials", "x"), "kind", "material,"),
                                     (lambda: scene.add_instances(node, 3), "transforms", "3")):
            self.refused(attempt, field, text)
        # A light that cannot be placed is not left behind.
        self.refused(lambda: scene.add_light("point", (1, 1, 1), (0, 4, 0)), "transform")
        self.assertEqual(scene.edits_since(0), [])

    def test_a_camera_that_sees_nothing_is_refused_where_it_is_made(self):
        self.refused(lambda: farlight.Camera((0, 0)), "camera.eye", "3 finite numbers")
        self.refused(lambda: farlight.Camera(3), "camera.eye")
        self.refused(lambda: farlight.Camera((0, 0, 3), fov_degrees=200), "camera.fov_degrees", "177.6")
        self.assertEqual(farlight.Camera(np.array([1, 2, 3])), farlight.Camera((1.0, 2.0, 3.0)))

    def test_what_is_no_value_of_its_type_is_refused_by_the_name_of_its_field(self):
        scene, material = triangle()
        for attempt, field, text in ((lambda: scene.change(material, textures=3), "set_material.textures", "no list of TextureUse"),
                                     (lambda: scene.change(material, base_colour="red"), "set_material.base_colour", "'red'"),
                                     (lambda: farlight.Scene(3), "scene_open.name", "3"), (lambda: farlight.Scene("a", "all"), "scene_open.sharing", "kept"),
                                     (lambda: scene.blob("text"), "blob", "'text'"), (lambda: scene.set(3), "edit", "no edit"),
                                     (lambda: farlight.connect(5), "server", "tcp:HOST:PORT"), (lambda: farlight.load(5), "models", "5 is no path"),
                                     (lambda: farlight.camera.request(None, (), {"clips": ["ride"]}), "render.clips[0]", "no ClipUse")):
            self.refused(attempt, field, text)

    def test_a_message_that_its_caller_changes_later_counts_when_it_is_set(self):
        scene, material = triangle()
        message = scene.get(material)
        for roughness in (0.25, 0.5):
            before = scene.version
            message.roughness = roughness
            self.assertEqual(scene.get(material).roughness, 1 if roughness == 0.25 else 0.25)
            scene.set(message)
            self.assertEqual((scene.version, scene.get(material).roughness), (before + 1, roughness))

    def test_intensity_is_the_largest_number_of_a_colour(self):
        scene, _ = triangle()
        light = scene.shown(scene.objects("node")[-1])
        scene.change(light, intensity=12)
        self.assertEqual(scene.get(light).colour, [12, 12, 12])
        scene.change(farlight.ENVIRONMENT, colour=(0.2, 0.4, 0.1), intensity=2)
        np.testing.assert_allclose(scene.get(farlight.ENVIRONMENT).colour, (1, 2, 0.5), rtol=1e-6)
        self.refused(lambda: scene.change(light, intensity="bright"), "set_light.intensity")
        self.refused(lambda: scene.change(light, intensity=-1), "set_light.colour[0]")

    def test_a_keyword_that_an_object_has_not_is_refused_with_those_that_it_has(self):
        scene, material = triangle()
        light = scene.shown(scene.objects("node")[-1])
        version = scene.version
        for attempt, field, text in ((lambda: scene.change(material, roughnes=0.5), "set_material.roughnes", "did you mean roughness"),
                                     (lambda: scene.change(material, fov_y=1), "set_material.fov_y", "there are alpha_mode, double_sided"),
                                     (lambda: scene.change(material, intensity=1), "set_material.intensity", "there is no such keyword"),
                                     (lambda: scene.change(material, material=7), "set_material.material", "there is no such keyword"),
                                     (lambda: scene.change(light, zoom=1), "set_light.zoom", "outer_cone, size, name, intensity")):
            self.refused(attempt, field, text)
        self.assertEqual((scene.version, scene.objects("material")), (version, [material]))


class Keywords(Case):
    SCRIPT = """import farlight
with farlight.connect() as client:
    scene = farlight.Scene()
    red = scene.add_material((0.8, 0.1, 0.1), roughness=0.3, alpha_mode="blend")
    scene.add_mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], material=red)
    frame = client.render(scene, samples=64, layers=("depth", "normal"), integrator="path")
    scene.change(red, metallic=0.5)
    scene.change(red, alpha_mode="mask", base_colour=(0, 0, 1, 1))
    scene.change(farlight.ENVIRONMENT, intensity=2)
async def main() -> None:
    async with await farlight.aio.connect() as client:
        (await client.render(scene, width=32)).depth
        async for frame in client.frames(scene, last_frame=3):
            print(frame.depth)
"""

    def test_type_checkers_know_the_keywords_and_the_types_of_their_values(self):
        if shutil.which("mypy") is None:
            self.skipTest("mypy is not installed")
        wrong = (("roughness=", "roughnes="), ('"blend"', '"blended"'), ("samples=64", 'samples="64"'), ("integrator=", "intergrator="),
                 ("metallic=0.5", 'metallic="half"'), ('"mask"', '"masked"'), ("base_colour=", "base_color="), ("intensity=", "intensify="),
                 ("width=32", "widht=32"), ("last_frame=3", 'last_frame="3"'))
        script = self.SCRIPT
        for right, mistake in wrong:
            script = script.replace(right, mistake)
        files = [self.folder / "right.py", self.folder / "wrong.py"]
        for path, text in zip(files, (self.SCRIPT, script)):
            path.write_text(text)
        said = subprocess.run(["mypy", "--strict", "--cache-dir", self.folder / "cache", *files], env={**os.environ, "MYPYPATH": str(PACKAGE)},
                              capture_output=True, text=True).stdout
        lines = [line for line in said.splitlines() if ": error: " in line]
        self.assertEqual([line.split("wrong.py:")[-1][:2] for line in lines], ["4:", "4:", "6:", "6:", "7:", "8:", "8:", "9:", "12", "13"], said)

    def test_signatures_have_every_keyword_with_the_default_of_the_message(self):
        for method in (farlight.Client.render, farlight.Client.frames, farlight.Client.view, farlight.aio.AsyncClient.render):
            taken = inspect.signature(method).parameters
            for name in ("width", "integrator", "clamp", "denoise", "quadtree_radius"):
                self.assertEqual(taken[name].default, getattr(messages.Render(), name))
            self.assertNotIn("values", taken)
        scene = farlight.Scene()
        made = scene.get(scene.add_material())
        for name, one in inspect.signature(scene.add_material).parameters.items():
            if name not in ("material", "textures"):
                np.testing.assert_equal(getattr(made, name), one.default, name)


class Encoded(Case):
    """Frames that are not raw, and daemons that lie about them."""

    def hear(self, data, size, digest=0, **values):
        asked, why = started(say(begin(size_bytes=size, digest=digest, **values), 4, 2))
        why = why or asked.hear(say(messages.FrameData(0, data), 4, 2) + say(messages.FrameEnd(), 4, 2))
        return asked, why or asked.core.failure

    def test_pixels_that_are_not_those_that_were_rendered_are_refused(self):
        if libraries.find("xxhash", 0) is None:
            self.skipTest("libxxhash is not installed")
        asked, why = self.hear(bytes(range(256)) * 2, 512, digest=1)
        self.assertIsInstance(why, farlight.ProtocolError)
        self.assertEqual((why.field, asked.frames), ("frame_begin.digest", []))
        with unittest.mock.patch.object(decode, "_xxhash", lambda: None):
            asked, why = self.hear(bytes(range(256)) * 2, 512, digest=1)
        self.assertIsNone(why)
        self.assertFalse(asked.frames[0].is_checked)

    def test_damaged_pictures_are_refused(self):
        for encoding, lies in ((messages.Encoding.ZSTD, (b"x" * 64, ZSTD_513, ZSTD_513[:-3], ZSTD_511)),
                               (messages.Encoding.JPEG, (b"x" * 64, jpeg(8, 8), jpeg(16, 16), jpeg(16, 8)[:-9]))):
            for lie in lies:
                with self.subTest(encoding=encoding, lie=lie[:8]):
                    begun = begin(encoding=encoding, size_bytes=len(lie))
                    with self.assertRaises(farlight.ProtocolError) as raised:
                        decode.decode(begun, bytearray(lie), 512)
                    self.assertEqual(raised.exception.field, "frame_data")
        self.assertEqual(bytes(decode.decode(begin(encoding=messages.Encoding.ZSTD, digest=DIGEST_OF_ZEROS), bytearray(ZSTD_512), 512)[0]), bytes(512))
        good = jpeg(16, 8)
        pixels, is_checked = decode.decode(begin(encoding=messages.Encoding.JPEG, size_bytes=len(good)), bytearray(good), 512)
        self.assertEqual((bytes(pixels), is_checked), (b"\0\0\0\xff" * 128, False))

    def test_changed_bytes_of_encoded_pictures_make_other_pixels_or_a_refusal_and_nothing_else(self):
        random.seed(1)
        for encoding, honest in ((messages.Encoding.JPEG, jpeg(16, 8)), (messages.Encoding.ZSTD, ZSTD_512)):
            refused = 0
            for _ in range(400):
                changed = bytearray(honest)
                for _ in range(random.randrange(1, 4)):
                    changed[random.randrange(len(changed))] = random.randrange(256)
                try:
                    pixels, _ = decode.decode(begin(encoding=encoding, size_bytes=len(changed), digest=DIGEST_OF_ZEROS), changed, 512)
                    self.assertEqual(len(pixels), 512)
                except farlight.ProtocolError:
                    refused += 1
            self.assertGreater(refused, 0, encoding)

    def test_a_library_that_is_missing_is_named_with_its_package(self):
        for encoding, cached, package in (("jpeg", decode._turbojpeg, "libturbojpeg0"), ("zstd", decode._zstd, "libzstd1")):  # pylint: disable=protected-access
            cached.cache_clear()
            self.addCleanup(cached.cache_clear)
            with self.subTest(encoding=encoding), unittest.mock.patch.object(libraries, "find", lambda *_: None):
                with self.assertRaises(farlight.FileFailed) as raised:
                    farlight.camera.request(STRAIGHT, (), {"encoding": encoding})
                self.assertIn(package, raised.exception.remedy)
        with self.assertRaises(farlight.InvalidValue) as raised:
            farlight.camera.request(STRAIGHT, (), {"encoding": "h264"})
        self.assertIn("raw, zstd, jpeg", str(raised.exception))
        self.assertEqual(raised.exception.remedy, "use jpeg")


class WithDaemon(OneDaemon):
    def connect(self, **options):
        client = farlight.connect(self.daemon.address, **options)
        self.addCleanup(client.close)
        return client

    def test_encoded_frames_have_the_pixels_of_raw_ones(self):
        client, (scene, _) = self.connect(), triangle()
        size = {"width": 120, "height": 90}
        raw, zstd, jpeg = (client.render(scene, STRAIGHT, encoding=encoding, quality=0, **size) for encoding in ("raw", "zstd", "jpeg"))
        self.assertEqual(zstd.data, raw.data)
        self.assertEqual([frame.is_checked for frame in (raw, zstd, jpeg)], [libraries.find("xxhash", 0) is not None] * 2 + [False])
        # JPEG of quality 90 is within some levels, but for a few pixels along edges; alpha is dropped.
        opaque = raw.colour[..., 3] == 255
        self.assertLess(np.abs(jpeg.colour[opaque].astype(int) - raw.colour[opaque]).mean(), 3)
        self.assertTrue((jpeg.colour[..., 3] == 255).all())
        self.assertFalse(jpeg.colour.flags.writeable or zstd.colour.flags.writeable)
        depth = [client.render(scene, STRAIGHT, layers="depth", encoding=encoding, **size).depth for encoding in ("raw", "zstd")]
        np.testing.assert_array_equal(*depth)
        with client.view(scene, STRAIGHT, encoding="jpeg", **size) as view:
            self.assertEqual(view.next_frame().size, (120, 90))

    @long_test
    def test_the_environment_of_another_client_is_read_and_edited_and_keeps_its_image(self):
        owner, guest = self.connect(), self.connect()
        scene = farlight.Scene("python-sky", "shared")
        image = np.zeros((8, 16, 3))
        image[:, :8] = 1, 0, 0  # what is left of -z is red, right of it green
        image[:, 8:] = 0, 1, 0
        scene.set_environment((0.5, 0.5, 0.5), image)
        scene.add_node(scene.add_spheres([(0, -100, 0)], 1))
        shape = {"width": 16, "height": 8, "format": "rgba32f"}
        ahead = farlight.Camera((0, 0, 0), (0, 0, -1))
        before = owner.render(scene, ahead, **shape).colour
        np.testing.assert_allclose(before[4, (2, 13), :3], [(0.5, 0, 0), (0, 0.5, 0)], atol=1e-3)

        other = guest.attach("python-sky")
        with self.assertRaises(farlight.InvalidValue) as raised:
            other.change(farlight.ENVIRONMENT, intensity=2)
        self.assertIn("read()", raised.exception.remedy)
        message, revision = guest.read(other, farlight.ENVIRONMENT)
        self.assertEqual((message.keeps_image, tuple(message.colour)), (1, (0.5, 0.5, 0.5)))
        other.set(message)
        other.change(farlight.ENVIRONMENT, intensity=2, rotation=np.pi)
        self.assertEqual(guest.send(other, base_revision=revision), revision + 1)
        after = guest.render(other, ahead, **shape).colour
        np.testing.assert_allclose(after[4, (2, 13), :3], [(0, 2, 0), (2, 0, 0)], atol=4e-3)
        self.assertEqual(asyncio.run(self.read_async("python-sky")), [2, 2, 2])

        sent = owner._core._uploaded  # pylint: disable=protected-access
        scene.change(farlight.ENVIRONMENT, intensity=1)
        np.testing.assert_allclose(owner.render(scene, ahead, **shape).colour[4, (2, 13), :3], [(1, 0, 0), (0, 1, 0)], atol=2e-3)
        self.assertEqual(owner._core._uploaded, sent)  # pylint: disable=protected-access
        other.set(messages.SetEnvironment(colour=(0, 0, 3), backdrop=1))
        guest.send(other)
        np.testing.assert_allclose(guest.render(other, ahead, **shape).colour[4, 2, :3], (0, 0, 3), atol=6e-3)
        with self.assertRaises(farlight.InvalidValue) as raised:
            guest.read(other, farlight.Object(messages.ObjectKind.MESH, 1))
        self.assertIn("environment", str(raised.exception))

    async def read_async(self, name):
        async with await farlight.aio.connect(self.daemon.address) as client:
            return list((await client.read(await client.attach(name), farlight.ENVIRONMENT))[0].colour)

    @long_test
    def test_clips_of_a_file_are_played_by_their_objects(self):
        client, scene = self.connect(), farlight.load(bundled_scenes() / "carousel.glb")
        clip, = scene.objects("clip")
        self.assertEqual(scene.find("clip", scene.get(clip).name), [clip])
        values = {"width": 64, "height": 48, "first_frame": 24}
        camera = next(node for node in scene.objects("node") if scene.shown(node) and scene.shown(node).kind == messages.ObjectKind.CAMERA)
        still, moved, same = (client.render(scene, camera, clips=clips, **values).data for clips in (
            [], [clip], [messages.ClipUse(clip.number, 0, 1)]))
        self.assertNotEqual(moved, still)
        self.assertEqual(moved, same)

    @long_test
    def test_objects_of_others_are_removed_by_their_numbers(self):
        owner, guest = self.connect(), self.connect()
        scene = farlight.Scene("python-removed", "shared")
        node = scene.add_node(scene.add_spheres([(0, 0, 0)], 1), name="ball")
        owner.send(scene)
        other = guest.attach("python-removed")
        other.remove(node)
        guest.send(other)
        self.assertEqual(owner.objects(scene, "node"), [])

    def test_a_wrong_request_sends_nothing(self):
        client, (scene, _) = self.connect(), triangle()
        for values, field in (({"width": 0}, "render.width"), ({"layers": "dept"}, "render.layers"), ({"last_frame": 3}, "render.last_frame"),
                              ({"attachments": 1}, "render.attachments"), ({"camera": (0, 0, 5)}, "camera"), ({"camera": []}, "camera"),
                              ({"clips": 3}, "render.clips"), ({"integrator": "pth"}, "render.integrator"), ({"wdth": 4}, "render.wdth")):
            with self.subTest(**values), self.assertRaises(farlight.InvalidValue) as raised:
                client.render(scene, **values)
            self.assertEqual(raised.exception.field, field)
        for wrong in (None, "model.glb"):
            with self.assertRaises(farlight.InvalidValue) as raised:
                client.render(wrong)
            self.assertEqual(raised.exception.field, "scene")
        self.assertEqual(client.scenes(), [])
        self.assertEqual(client.render(scene, STRAIGHT, width=8, height=8, first_frame=7).number, 7)
        for attempt, field in ((lambda: client.frames(scene, width=0), "render.width"), (lambda: client.ask(3), "message"),
                               (lambda: client.view(scene, STRAIGHT, width=8, height=8).set_camera((0, 0, 3)), "camera")):
            with self.assertRaises(farlight.InvalidValue) as raised:
                attempt()
            self.assertEqual(raised.exception.field, field)
        for options, field in (({"timeout": 0}, "timeout"), ({"retry_for": "long"}, "retry_for")):
            with self.assertRaises(farlight.InvalidValue) as raised:
                farlight.connect(self.daemon.address, **options)
            self.assertEqual(raised.exception.field, field)

    def test_more_unfinished_animations_than_the_daemon_allows_are_refused_and_not_waited_for(self):
        client, (scene, _) = self.connect(), triangle()
        begun = [client.frames(scene, STRAIGHT, width=8, height=8, last_frame=1000) for _ in range(client.limits["views_per_client"])]
        self.assertEqual([next(one).number for one in begun], [0] * len(begun))
        with self.assertRaises(farlight.Refused) as raised:
            client.render(scene, STRAIGHT, width=8, height=8)
        self.assertTrue(raised.exception.remedy)
        begun.pop().close()
        self.assertEqual(next(begun[0]).number, 1)
        self.assertEqual(client.render(scene, STRAIGHT, width=8, height=8).size, (8, 8))

    @staticmethod
    def large(number):
        """36 MB, which take a while; others for each number, as a daemon keeps what it has."""
        scene, points = farlight.Scene(), np.zeros((3000000, 3), np.float32)
        points[:3], points[3:] = [(-1, -1, 0), (3, -1, 0), (-1, 3, 0)], number
        scene.add_node(scene.add_mesh(points, [(0, 1, 2)]))
        return scene, points.nbytes

    def test_progress_is_told_and_a_ctrl_c_in_an_upload_leaves_a_client_that_works(self):
        told = []

        def tell(what, done, total):
            told.append((what, done, total))
            if len(told) == 3:
                raise KeyboardInterrupt

        client, (scene, size) = self.connect(progress=tell), self.large(1)
        with self.assertRaises(KeyboardInterrupt):
            client.send(scene)
        self.assertEqual(client.describe(scene).triangles, 1)
        self.assertEqual({(what, total >= size) for what, _, total in told}, {("sending", True)})
        self.assertLess(told[2][1], size)
        self.assertGreater(told[-1][1], size // 2)

    @long_test
    def test_a_task_that_is_cancelled_in_an_upload_leaves_a_client_that_works(self):
        async def all_of_it():
            task = None

            def tell(*_):
                if task and not task.cancelling():
                    task.cancel()

            async with await farlight.aio.connect(self.daemon.address, progress=tell) as client:
                scene, _ = self.large(2)
                task = asyncio.create_task(client.send(scene))
                ended, = await asyncio.gather(task, return_exceptions=True)
                self.assertIsInstance(ended, asyncio.CancelledError)
                return (await client.describe(scene)).triangles

        self.assertEqual(asyncio.run(all_of_it()), 1)


class Sealed(Case):
    @long_test
    def test_a_large_upload_over_tcp_waits_for_nothing_but_the_daemon(self):
        """The system may take all that is queued at once; then no answer is due, and the rest must follow all the same. Pings
        would hide it: each makes an answer."""
        for name in ("key", "reader"):
            self.expect(farlight_test.farlight("key", self.folder / name), 0)
        scene, size = WithDaemon.large(3)
        with SealedDaemon(self.folder) as daemon, unittest.mock.patch.object(Core, "ping"):
            with farlight.connect(daemon.reached, key_file=self.folder / "key") as client:
                self.assertGreater(size, 2 * client.limits["upload_window_bytes"])
                self.assertEqual(client.describe(scene).triangles, 1)


class Ends(Case):
    def test_a_daemon_of_ones_own_that_is_killed_is_said_to_have_been(self):
        os.environ.pop("FARLIGHT_SERVER", None)

        def kill(client):
            process = client._link.process  # pylint: disable=protected-access
            process.kill()
            process.wait()

        scene, _ = triangle()
        with farlight.connect() as client:
            client.send(scene)
            kill(client)
            # Where its end is seen before the request is sent, another one is started, and killed after a frame.
            with self.assertRaises(farlight.ConnectionLost) as raised:
                for _ in client.frames(scene, STRAIGHT, width=8, height=8, last_frame=100000):
                    kill(client)
            self.assertTrue(raised.exception.retryable)
            self.assertEqual(client.render(scene, STRAIGHT, width=8, height=8).size, (8, 8))  # of another one
        with farlight.connect() as client:
            batch = client.frames(scene, STRAIGHT, width=8, height=8, last_frame=100000)
            next(batch)
            kill(client)
            with self.assertRaises(farlight.ConnectionLost) as raised:
                for _ in batch:
                    pass
            self.assertIn("farlightd was ended by signal 9", str(raised.exception))

    @long_test
    def test_ctrl_c_ends_the_command_line_without_a_traceback_and_leaves_no_daemon(self):
        parent, child = pty.openpty()
        path = os.pathsep.join([str(PACKAGE)] + [DEBIANS] * (DEBIANS in sys.path))
        environment = {**os.environ, "PYTHONPATH": path}
        environment.pop("FARLIGHT_SERVER", None)
        arguments = ("render", bundled_scenes() / "teapot.glb", "-o", self.folder / "never.png", "--samples", "65536", "--integrator", "path")
        # A shell's background commands ignore SIGINT, and so do those that they start.
        with subprocess.Popen([sys.executable, "-m", "farlight", *map(str, arguments)], stderr=child, stdout=subprocess.DEVNULL,
                              env=environment, start_new_session=True,
                              preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)) as process:
            os.close(child)
            said, deadline = b"", time.monotonic() + farlight_test.TIMEOUT_S
            while b"rendering" not in said and time.monotonic() < deadline:
                said += os.read(parent, 4096)
            self.assertIn(b"importing", said)
            process.send_signal(signal.SIGINT)
            try:
                status = process.wait(farlight_test.TIMEOUT_S)
            finally:
                process.kill()
            try:
                while more := os.read(parent, 4096):
                    said += more
            except OSError:  # all have closed it, the daemon too
                pass
        os.close(parent)
        self.assertEqual(status, 130)
        self.assertIn(b"farlight: interrupted", said)
        self.assertNotIn(b"Traceback", said)
        self.assertEqual(list(self.folder.iterdir()), [])

    @long_test
    def test_the_command_line_says_what_is_wrong_before_it_reads_a_model(self):
        output = ("-o", self.folder / "a.png")
        for arguments, text in ((("--size", "64", *output), "not WxH"), (("--eye", "1,2", *output), "not X,Y,Z"), (("--samples", "0", *output), "render.samples"),
                                (("--fov", "300", *output), "177.6"), (("--set", "sed=3", *output), "did you mean seed"), (("--set", "seed=x", *output), "whole number"),
                                (("--set", "encoding=h264", *output), "raw, zstd, jpeg"), (("-o", "a.tiff"), ".npz"), ((*output, "--layers", "depth"), ".npz")):
            with self.subTest(arguments=arguments):
                result = self.expect(python("-m", "farlight", "render", "no-such-model.glb", *arguments), 2)
                self.assertIn(text, result.stderr)
                self.assertNotIn("no-such-model", result.stderr)
        self.assertIn("no-such-folder", self.expect(python("-m", "farlight", "render", "a.glb", "-o", "no-such-folder/a.png"), 1).stderr)
        self.assertIn(farlight.__version__, self.expect(python("-m", "farlight", "--version"), 0).stdout)


if __name__ == "__main__":
    farlight_test.unittest.main()
