# SPDX-License-Identifier: MIT
"""`farlight edit`: materials, nodes, lights, cameras and environment of a scene that several clients share, and `--edit`."""
import base64
import json
import os
import pathlib
import struct
import subprocess
import tempfile
import threading

from farlight_test import BIN, TIMEOUT_S, Case, Daemon, bundled_scenes, farlight, long_test, read_png
from test_serve import Serving
from test_view import HIDE, difference, rest

PICTURE = ["--size", "48x36", "--samples", "1", "--integrator", "whitted", "-q"]


class Shared(Case):
    """A daemon with the Cornell box, and clients of it."""

    model, scene = "cornell.glb", "room"
    options = []

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        daemon = cls.enterClassContext(Daemon())
        os.environ["FARLIGHT_SERVER"] = cls.address = daemon.address
        cls.addClassCleanup(os.environ.pop, "FARLIGHT_SERVER")
        cls.enterClassContext(Serving(bundled_scenes() / cls.model, *cls.options, "--server", daemon.address, "--name", cls.scene,
                                      addresses=0))

    def edit(self, *arguments, status=0, **options):
        return self.expect(farlight("edit", "--scene", self.scene, *arguments, **options), status)

    def edit_for_now(self, *arguments):
        """The same, undone when the test ends."""
        undo = self.edit("--print-undo", *arguments).stdout
        self.addCleanup(self.edit, "--from", "-", input=undo)

    def picture(self, *arguments):
        """As another client sees the scene now."""
        path = self.folder / "seen.png"
        self.expect(farlight("render", "--scene", self.scene, "-o", path, *PICTURE, *arguments), 0)
        return read_png(path)

    def fields(self, thing):
        """{field: value} of one object."""
        listed = json.loads(self.edit("--list", "--json", thing).stdout)
        return {name: field["value"] for name, field in listed["fields"].items()}

    def revision(self):
        return json.loads(self.expect(farlight("scenes", "--json"), 0).stdout.splitlines()[0])["revision"]


class Edits(Shared):
    def test_each_kind_of_field_changes_what_others_see_and_can_be_undone(self):
        before = self.picture()
        undo = self.folder / "undo"
        for assignment, thing, field, value in (
                ("material.red.base_colour=#0000ff", "material.red", "base_colour", [0, 0, 1, 1]),
                ("material.glass.attenuation_colour=0,1,0", "material.glass", "attenuation_colour", [0, 1, 0]),
                ("material.block*.roughness=1", None, None, None),  # no material has that name
                ("node.mirror block.translate=0.25,0,0.5", "node.mirror block", "translate", [0.25, 0, 0.5]),
                ("node.block.rotate=0,45,0", "node.block", "rotate", [0, 45, 0]),
                ("node.glass sphere.scale=0.5", "node.glass sphere", "scale", [0.5, 0.5, 0.5]),
                ("hide=mirror block", "node.mirror block", "hidden", True),
                ("light.0.intensity=30", "light.#1", "intensity", 30),
                ("camera.camera.fov_y=80", "camera.0", "fov_y", 80)):
            with self.subTest(assignment):
                if thing is None:
                    self.assertIn("the scene has no material 'block*'", self.edit(assignment, status=2).stderr)
                    continue
                undo.write_text(self.edit("--print-undo", assignment).stdout)
                now = self.fields(thing)[field]
                for got, wanted in zip(now if isinstance(now, list) else [now], value if isinstance(value, list) else [value]):
                    self.assertAlmostEqual(got, wanted, 4)  # angles are rounded to this
                if "attenuation" not in field:  # of clear glass, for lack of a distance
                    self.assertNotEqual(self.picture(), before)
                self.edit("--from", undo)
        self.assertEqual(self.picture(), before)

    def test_one_bad_assignment_changes_nothing_and_is_named(self):
        revision, white = self.revision(), self.fields("material.white")
        for bad, said in (("material.wite.roughness=0.5", ("no material 'wite'", "did you mean 'white'?")),
                          ("node.nothing at all.hidden=1", ("no node 'nothing at all'", "it has 10 nodes: 'room', 'left wall'")),
                          ("material.white.roughnes=0.5", ("no field 'roughnes'", "did you mean 'roughness'?")),
                          ("material.white.roughness=1.5", ("roughness is 1.5, but must be 0 to 1",)),
                          ("material.white.roughness*=9", ("but must be 0 to 1",)),
                          ("light.0.outer_cone=10", ("light has no outer_cone",)),
                          ("camera.camera.fov_y=0", ("an orthographic camera shows a height above 0",)),
                          ("node.#9999.hidden=1", ("there is no node 9999",))):
            with self.subTest(bad):
                result = self.edit("material.white.metallic=1", bad, "hide=room", status=1 if "#" in bad or "camera" in bad else 2)
                for part in (bad, *said):
                    self.assertIn(part, result.stderr)
        self.assertEqual((self.revision(), self.fields("material.white")), (revision, white))

    def test_what_changes_nothing_makes_no_revision(self):
        revision = self.revision()
        self.edit("show=room", "material.white.roughness*=1")
        self.assertEqual(self.revision(), revision)

    def test_a_file_has_an_assignment_a_line(self):
        file, undo = self.folder / "edits", self.folder / "undo"
        file.write_text("# what is changed\n\n  material.green.base_colour = #ff0000   # no more green\r\nlight.*.intensity *= 0.5\n")
        lights = [self.fields(f"light.{i}")["intensity"] for i in (0, 1)]
        revision = self.revision()
        undo.write_text(self.edit("--print-undo", "--from", file, "hide=block").stdout)
        self.assertEqual(self.revision(), revision + 1)
        self.assertEqual(self.fields("material.green")["base_colour"][:2], [1, 0])
        for i, before in enumerate(lights):
            self.assertAlmostEqual(self.fields(f"light.{i}")["intensity"], before / 2, 3)
        self.edit("--from", "-", input=undo.read_text())
        self.assertFalse(self.fields("node.block")["hidden"])
        file.write_text("hide=block\nmaterial.green.colour=1\n")
        result = self.edit("--from", file, status=2)
        self.assertIn("edits:2: material.green.colour=1: a material has no field 'colour'", result.stderr)
        self.assertFalse(self.fields("node.block")["hidden"])

    def test_what_is_listed_can_be_read_back(self):
        things = ["material.*", "light.*", "camera.*", "node.*", "environment"]
        listed = self.edit("--list", *things).stdout
        self.assertIn("material.mirror.roughness=0 ", listed)
        revision = self.revision()
        self.edit("--from", "-", input=listed)
        # Angles and scales are rounded, so that some matrix may have changed by a bit; nothing else has.
        self.assertLessEqual(self.revision(), revision + 1)
        self.assertEqual(self.edit("--list", *things).stdout, listed)
        names = [json.loads(line) for line in self.edit("--list", "--json").stdout.splitlines()]
        self.assertIn({"kind": "material", "id": 2, "name": "red"}, names)
        self.assertEqual({entry["kind"] for entry in names}, {"material", "light", "camera", "node", "environment"})

    @long_test
    def test_two_clients_that_change_one_object_lose_nothing(self):
        """Each adds to another field, or to the same one: no edit may be made of values that are out of date."""
        self.addCleanup(self.edit, "material.mirror.roughness=0", "material.mirror.ior=1.5", "material.mirror.metallic=1")
        self.edit("material.mirror.roughness=0", "material.mirror.ior=1", "material.mirror.metallic=0")

        def add(*assignments):
            for _ in range(8):
                self.edit(*assignments)

        threads = [threading.Thread(target=add, args=(one, "material.mirror.metallic+=0.0625"))
                   for one in ("material.mirror.roughness+=0.125", "material.mirror.ior+=0.125")]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        fields = self.fields("material.mirror")
        self.assertEqual([fields[name] for name in ("roughness", "ior", "metallic")], [1, 2, 1])

    @long_test
    def test_an_open_view_shows_what_another_client_changes(self):
        events = self.folder / "events"
        looks = [event for i in range(2000) for event in ({"screenshot": f"{i}.png", "after": 0.1}, {"state": f"{i}"})]
        events.write_text(json.dumps([rest(2), *HIDE, {"screenshot": "first.png"}, {"state": "first"}, *looks]))
        command = [BIN / "farlight", "view", "--scene", self.scene, "--server", self.address, "--headless", "--replay", events,
                   "--size", "64x48", "--samples", "2"]
        with subprocess.Popen(list(map(str, command)), cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                              text=True) as viewer:
            patience = threading.Timer(TIMEOUT_S, viewer.kill)
            patience.start()
            seen = False
            for line in viewer.stdout:
                state = json.loads(line)["state"]
                if state == "first":
                    self.edit_for_now("material.white.base_colour=0,0.2,1")
                elif difference(self.folder / "first.png", self.folder / f"{state}.png") > 5:
                    seen = True
                    break
            viewer.terminate()
            patience.cancel()
            viewer.communicate(timeout=TIMEOUT_S)
        self.assertTrue(seen)

    def test_wrong_usage_is_reported(self):
        for arguments, part in ((["hide=room"], "--scene"), (["--scene", "room"], "nothing to change"),
                                (["--scene", "room", "--list", "--from", "x"], "--from"),
                                (["--scene", "room", "--list", "room"], "material.Steel")):
            self.assertIn(part, self.expect(farlight("edit", *arguments), 2).stderr)
        self.assertIn("'hall'", self.expect(farlight("edit", "--scene", "hall", "hide=room"), 1).stderr.replace('"', "'"))
        self.assertEqual(farlight("edit", "--scene", "room", "--from", "/nonexistent").returncode, 1)
        result = farlight("render", "--scene", "room", "--edit", "hide=room", "-o", self.folder / "a.png")
        self.assertIn("farlight edit", self.expect(result, 2).stderr)

    @long_test
    def test_a_model_may_be_changed_for_one_picture(self):
        before = self.picture()
        model, path = bundled_scenes() / self.model, self.folder / "own.png"
        self.expect(farlight("render", model, "-o", path, *PICTURE, "--edit", "hide=mirror block",
                             "--edit", "material.red.base_colour=#00ff00"), 0)
        self.assertNotEqual(read_png(path), before)
        self.edit_for_now("hide=mirror block", "material.red.base_colour=#00ff00")
        self.assertEqual(read_png(path), self.picture())
        result = farlight("render", model, "-o", path, *PICTURE, "--edit", "material.rod.roughness=1")
        self.assertIn("did you mean 'red'?", self.expect(result, 2).stderr)


class Environment(Shared):
    """The box with an image around it: rows from +y down, red at the left, green at the right."""

    @classmethod
    def setUpClass(cls):
        cls.image = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory())) / "sky.hdr"
        cls.image.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n" +
                              (bytes((128, 16, 0, 129)) * 4 + bytes((0, 128, 32, 129)) * 4) * 4)
        cls.options = ["--environment", cls.image, "--environment-rotation", "30"]
        super().setUpClass()

    def test_the_environment_is_changed_and_keeps_its_image(self):
        """As the importer would have turned it; undone it is the very picture."""
        before = self.picture()
        fields = self.fields("environment")
        self.assertEqual((fields["intensity"], fields["colour"], fields["backdrop"], fields["display_values"]), (1, [1, 1, 1], False, False))
        self.assertAlmostEqual(fields["rotation"], 30, 3)
        undo = self.edit("--print-undo", "environment.rotation+=90", "environment.intensity*=0.5").stdout
        changed = self.picture()
        path = self.folder / "own.png"
        self.expect(farlight("render", bundled_scenes() / self.model, "-o", path, *PICTURE, "--environment", self.image,
                             "--environment-rotation", "120", "--edit", "environment.intensity=0.5"), 0)
        self.assertEqual(changed, read_png(path))
        self.assertNotEqual(changed, before)
        self.edit("--from", "-", input=undo)
        self.assertEqual((self.picture(), self.fields("environment")), (before, fields))
        self.assertIn("a backdrop is a colour alone", self.edit("environment.backdrop=true", status=1).stderr)

    @long_test
    def test_two_clients_that_change_the_environment_lose_nothing(self):
        self.edit_for_now("environment.rotation=0", "environment.intensity=1")

        def add(assignment):
            for _ in range(8):
                self.edit(assignment)

        threads = [threading.Thread(target=add, args=(one,)) for one in ("environment.rotation+=10", "environment.intensity+=1")]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        fields = self.fields("environment")
        self.assertAlmostEqual(fields["rotation"], 80, 3)
        self.assertEqual(fields["colour"], [9, 9, 9])


class Readers(Case):
    def test_one_who_may_only_look_lists_and_is_refused_to_edit(self):
        config = self.folder / "conf"
        config.write_text(f"[server]\nreaders = {os.getuid()}\n")
        with Serving(bundled_scenes() / "cornell.glb", "--name", "room", "--listen", f"unix:{self.folder}/s", "--",
                     "--config", config) as serving:
            where = ["edit", "--scene", "room", "--server", serving.lines[-1].split()[-1]]
            self.assertIn("material.red.metallic=0", self.expect(farlight(*where, "--list", "material.red"), 0).stdout)
            self.assertIn("may only look", self.expect(farlight(*where, "hide=room"), 1).stderr)


class Many(Case):
    @long_test
    def test_thousands_of_objects_change_in_one_transaction(self):
        """More than the buffers between two programs hold."""
        count, model = 12000, self.folder / "many.gltf"
        corners = base64.b64encode(struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)).decode()
        model.write_text(json.dumps({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(count))}],
            "nodes": [{"name": f"n{i}", "mesh": 0, "translation": [i, 0, 0]} for i in range(count)],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "buffers": [{"byteLength": 36, "uri": f"data:application/octet-stream;base64,{corners}"}]}))
        with Serving(model, "--name", "many", "--listen", f"unix:{self.folder}/s") as serving:
            where = ["edit", "--scene", "many", "--server", serving.lines[-1].split()[-1]]
            undo = self.expect(farlight(*where, "--print-undo", "hide=n*"), 0).stdout
            self.assertEqual(len(undo.splitlines()), count)
            self.expect(farlight(*where, "--from", "-", input=undo), 0)
            scenes = self.expect(farlight("scenes", "--json", "--server", where[-1]), 0).stdout
            self.assertEqual(json.loads(scenes)["revision"], 3)


class Animated(Shared):
    model, scene = "carousel.glb", "fair"

    def test_a_playing_clip_has_precedence_over_an_edit_of_what_it_moves(self):
        riding = ["--clip", "ride", "--time", "1"]
        moving, still = self.picture(*riding), self.picture()
        # The clip turns the platform; its material is nobody's but the edit's.
        self.edit_for_now("node.platform.rotate=0,77,0")
        self.assertEqual(self.picture(*riding), moving)
        self.assertNotEqual(self.picture(), still)
        self.edit_for_now("material.cream.base_colour=0,0,1")
        self.assertNotEqual(self.picture(*riding), moving)

    @long_test
    def test_a_light_is_known_by_the_node_that_shows_it(self):
        before = self.fields("light.key light")["intensity"]
        self.edit_for_now("light.key light.intensity*=2", "light.*fill light.intensity*=0")
        self.assertAlmostEqual(self.fields("light.key light")["intensity"], 2 * before, 3)
        self.assertEqual(self.fields("light.fill light")["intensity"], 0)

    @long_test
    def test_an_animation_goes_on_while_its_scene_is_edited(self):
        command = [BIN / "farlight", "animate", "--scene", self.scene, "--clip", "ride", "--frames", "0-23", "--fps", "8",
                   *PICTURE, "-o", self.folder / "%d.png"]
        with subprocess.Popen(list(map(str, command)), stderr=subprocess.PIPE, text=True) as animation:
            for roughness in (0, 0.5, 1):
                self.edit_for_now(f"material.slate.roughness={roughness}")
            _, errors = animation.communicate(timeout=TIMEOUT_S)
        self.assertEqual((animation.returncode, errors), (0, ""))
        self.assertEqual(len(self.leftovers()), 24)
