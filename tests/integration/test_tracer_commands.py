# SPDX-License-Identifier: MIT
"""What the command line has of each tracer: options and their mistakes, what a frame says of its structure, limits,
warnings, and animation. Their answers are held against brute force in tests/tracers, their pictures in test_pictures."""
import json
import os
import subprocess

import farlight_test
from farlight_test import BIN, Case, Daemon, OneDaemon, bundled_scenes, farlight, frames_of, long_test, read_exr, read_png, tracers

SMALL = ["--size", "48x36", "--integrator", "whitted", "--samples", "1"]
ROOM, TEAPOT, CAROUSEL = (f"{name}.glb" for name in ("cornell", "teapot", "carousel"))

WRONG = (  # option, values, what is allowed
    ("--ldc-resolution", ("15", "4097", "fine"), "16 to 4096"), ("--ldc-form", ("papers",), "fast, paper"),
    ("--quadtree-pixels", ("-1", "nan"), ""),
    ("--abuffer-resolution", ("15", "4097", "fine"), "16 to 4096"),
    ("--abuffer-voxels", ("100", "512", "8", "many"), "auto, 16, 32, 64, 128, 256"),
    ("--integrator", ("photons",), "whitted, distributed, raycast, ao, path"), ("--brdf", ("phong",), "ggx, ward"),
    ("--ao-distance", ("-1",), "-1"), ("--ao-falloff", ("65",), "64"), ("--ao-rays", ("0", "257"), "256"),
    ("--layer-opacity", ("0", "1.5"), "from 1e-06 to 1"), ("--bounces", ("33",), "32"), ("--denoise", ("much",), "off, on, auto"))

CONTRADICTORY = (  # options, what is said
    (["--abuffer-resolution", "64", "--abuffer-voxels", "128"], ["--abuffer-voxels: 128", "64 texels", "--abuffer-resolution"]),
    (["--depth", "3", "--bounces", "0"], ["--bounces: 0 contradicts --depth 3", "(leave out one of them)"]),
    (["--bounces", "3", "--depth", "0"], ["--depth: 0 contradicts --bounces 3"]))

# Options, rows of --timings=json with a value that is always so (None: any), and a line of the table of --timings.
KINDS = ("primary", "secondary", "shadow")
RAYSPACE = ("cone_tests_per_ray", "triangle_tests_per_ray", "waves", "sorted", "turned", "pairs_max", "passes", "halvings")
QUADTREE = ("behind_layer_1_per_ray", "behind_layer_2_per_ray", "unknown_behind_per_ray", "unknown_outside_per_ray")
STRUCTURES = {
    "bvh": ([], {"nodes": None, "nodes_rebuilt": None, "nodes_refitted": None}, r"nodes \d+"),
    "ldc": (["--ldc-resolution", "128"],
            {"static/resolution": 128, "static/built": True, "static/samples_lost": 0, "static/cell_metres": None},
            r"static +resolution 128, cell [0-9.]+ m?m, layers needed \d+, layers kept \d+, samples \d+, samples lost 0; "
            r"built for 1 of 1 frame\n"),
    "abuffer": (["--abuffer-resolution", "128"], {"resolution": 128, "built": True, "longest_list": None, "cell_metres": None},
                r"resolution 128, cell [0-9.]+ m?m, samples \d+, longest list \d+; built for 1 of 1 frame\n"),
    "rayspace": ([], {f"{kind}/{row}": None for kind in KINDS for row in RAYSPACE},
                 r"shadow +cone tests [0-9.]+ a ray, triangle tests [0-9.]+ a ray, waves \d+, sorted \d+, turned \d+, pairs max \d+, "
                 r"passes \d+, halvings \d+\n"),
    "quadtree": ([], {**{f"{kind}/{row}": None for kind in KINDS for row in QUADTREE}, "faces": 6, "layers": 3, "bound_pixels": 0.25},
                 r"shadow"),
}


class Options(Case):
    def refused(self, *arguments, **variables):
        result = farlight(*arguments, "-o", self.folder / "%d.png", env={**os.environ, **variables})
        self.expect(result, 2)
        self.assertEqual(self.leftovers(), [])
        return result.stderr

    def test_each_wrong_value_is_reported_with_its_option_and_what_is_allowed(self):
        commands = (["render"], ["animate", "--frames", "1-2"], ["compare", "--tracers", "ldc,bvh"])
        for option, values, allowed in WRONG:
            for value, command in [(value, commands[0]) for value in values] + [(values[0], command) for command in commands[1:]]:
                said = self.refused(*command, bundled_scenes() / ROOM, f"{option}={value}")
                self.assertIn(option, said)
                self.assertIn(allowed, said, (option, value, command))

    def test_options_that_contradict_each_other_are_refused(self):
        for options, words in CONTRADICTORY:
            said = self.refused("render", bundled_scenes() / ROOM, *options)
            for word in words:
                self.assertIn(word, said)
        dry = ["animate", bundled_scenes() / ROOM, "--frames", "1-2", "--dry-run"]
        self.assertIn("FARLIGHT_", self.refused(*dry, FARLIGHT_DEPTH="3", FARLIGHT_BOUNCES="2"))
        self.expect(farlight(*dry, "--bounces", "2", "--depth", "2", "-o", "%d.png"), 0)
        self.expect(farlight(*dry, "--bounces", "2", "-o", "%d.png", env={**os.environ, "FARLIGHT_DEPTH": "3"}), 0)

    def test_every_tracer_and_setting_is_offered_everywhere_and_refused_by_its_variable(self):
        listed = tracers()
        self.assertEqual([tracer["name"] for tracer in listed], ["bvh", "naive", "reference", "ldc", "abuffer", "rayspace", "quadtree"])
        text = self.expect(farlight("tracers"), 0).stdout
        schema = json.loads((BIN / "shot.schema.json").read_text())["properties"]
        manual = (BIN / "man/farlight.1").read_text()
        helps = {command: self.expect(farlight(command, "--help"), 0).stdout for command in ("render", "animate")}
        for tracer in listed:
            self.assertIn(f"{tracer['name']}: {tracer['doc']}", text)
        for name, option in ((setting["name"], setting["option"]) for tracer in listed for setting in tracer["settings"]):
            variable = "FARLIGHT_" + name.upper()
            with self.subTest(setting=name):
                self.assertIn(option, text)
                self.assertIn(name, schema)
                self.assertIn(f".It Fl -{option[2:]} ", manual)
                for said in helps.values():
                    self.assertIn(option + "=", said)
                self.assertIn(variable, self.refused("render", "x.glb", **{variable: "nonsense"}))
        for name, value in (("AO_RAYS", "0"), ("AO_DISTANCE", "x"), ("BRDF", "x"), ("LAYER_OPACITY", "2")):
            self.assertIn(f"FARLIGHT_{name}: ", self.refused("render", "x.glb", **{f"FARLIGHT_{name}": value}))
        self.assertNotIn("@SETTINGS@", schema)
        self.assertNotIn("@TRACERS@", manual)

    def test_the_shell_completes_options_and_their_values(self):
        rows = [("_farlight", "farlight " + words, wanted) for words, wanted in (
            ("tra", ["tracers"]), ("render --ldc-f", ["--ldc-form"]), ("render --ldc-form pa", ["paper"]),
            ("render --abuffer-voxels 12", ["128"]), ("render --tracer nai", ["naive"]), ("render --metadata f", ["full"]))]
        rows += [("_farlight_program", words, wanted) for words, wanted in (
            ("farlightd --key", ["--key-file"]), ("farlightd --device s", ["software"]), ("farlightd --log-level d", ["debug"]),
            ("farlight-view --tracer nai", ["naive"]), ("farlight-view --headl", ["--headless"]),
            ("farlight-import --env", ["--environment", "--environment-rotation"]), ("farlight-import --va", ["--variant"]),
            ("farlight-export --full", ["--full-metadata"]), ("farlight-video --fo", ["--folder"]))]
        script = f"source {farlight_test.ROOT}/client/cli/completion.bash\n" + "".join(
            f"COMP_WORDS=({BIN}/{words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); COMPREPLY=(); {function}; echo \"${{COMPREPLY[@]}}\"\n"
            for function, words, _ in rows)
        lines = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True).stdout.splitlines()
        self.assertEqual([(words, line.split()) for (_, words, _), line in zip(rows, lines, strict=True)],
                         [(words, wanted) for _, words, wanted in rows])


class Structures(OneDaemon):
    def render(self, *options, model=ROOM, name="x.png", **more):
        return self.expect(farlight("render", bundled_scenes() / model, "-o", self.folder / name, *SMALL, *options, **more), 0)

    def frame(self, *options, **more):
        return frames_of(self.render(*options, "--timings=json", **more))[0]

    def test_a_frame_and_the_table_of_timings_describe_the_structure(self):
        for tracer, (options, rows, line) in STRUCTURES.items():
            with self.subTest(tracer=tracer):
                options = ["--tracer", tracer, "--primary", "trace", *options]
                frame = self.frame(*options)
                self.assertEqual((frame["tracer"], frame["warnings"]), (tracer, []))
                said = frame["structure"]
                self.assertLessEqual(set(rows), set(said))
                self.assertEqual({name: said[name] for name, value in rows.items() if value is not None},
                                 {name: value for name, value in rows.items() if value is not None})
                self.assertRegex(self.render(*options, "--timings").stdout, line)
                if tracer == "quadtree":
                    self.assertTrue(all(0 <= said[f"{kind}/{row}"] <= 1 for kind in KINDS for row in QUADTREE), said)

    @long_test
    def test_figures_follow_the_options(self):
        """The box is the same; a cell or two of it may be a margin."""
        for tracer, prefix in (("ldc", "static/"), ("abuffer", "")):
            coarse, fine = (self.frame("--tracer", tracer, f"--{tracer}-resolution", resolution)["structure"]
                            for resolution in ("128", "512"))
            self.assertAlmostEqual(coarse[prefix + "cell_metres"] / fine[prefix + "cell_metres"], 4, delta=0.1, msg=tracer)
        fast, paper = (self.frame("--tracer", "rayspace", "--rayspace-form", form)["structure"] for form in ("fast", "paper"))
        self.assertEqual(paper["shadow/sorted"], 0)
        self.assertGreater(paper["shadow/cone_tests_per_ray"], fast["shadow/cone_tests_per_ray"])  # it is flat
        said = self.frame("--stereo", "0.1", "--quadtree-layers", "2")["structure"]
        self.assertEqual((said["faces"], said["layers"]), (1, 2))
        self.assertIn("views/unknown_per_ray", said)
        self.frame("--tracer", "ldc", "--metadata", "stable", name="x.exr")
        self.assertIn("farlight/structure/static/cell_metres", farlight_test.exr_attributes(self.folder / "x.exr"))

    @long_test
    def test_the_viewers_overlay_has_a_line_for_each_kind_of_wave(self):
        (self.folder / "replay.json").write_text(json.dumps([{"wait": "rest", "samples": 1}, {"state": "rest"}]))
        result = self.expect(farlight("view", bundled_scenes() / ROOM, "--replay", self.folder / "replay.json", "--headless",
                                      *SMALL, "--tracer", "rayspace"), 0)
        said = json.loads(result.stdout.splitlines()[0])["structure"]
        self.assertRegex("\n".join(said), r"(?m)^shadow: cone tests [0-9.]+ a ray, .*, halvings \d+$")

    def animate(self, model, *options, status=0):
        return self.expect(farlight("animate", bundled_scenes() / model, *SMALL, "-o", self.folder / "%d.png", "--timings=json",
                                    *options), status)

    def test_what_stands_still_is_built_once_and_what_moves_is_built_anew(self):
        ride = ["--clip", "ride", "--frames", "1-3", "--fps", "8"]
        ldc = ["--tracer", "ldc", "--ldc-resolution", "128"]
        abuffer = ["--tracer", "abuffer", "--abuffer-resolution", "128", "--abuffer-voxels", "16"]
        built = [{part for part in ("static", "dynamic") if frame["structure"][f"{part}/built"]}
                 for frame in frames_of(self.animate(CAROUSEL, *ride, *ldc))]
        # What moves is known from the first frame in which it does.
        self.assertIn("static", built[0])
        self.assertEqual(built[2], {"dynamic"})
        for model, options, wanted in ((CAROUSEL, ride, [True] * 3), (TEAPOT, ["--orbit", "--frames", "1-3"], [True, False, False])):
            built = [frame["structure"]["built"] for frame in frames_of(self.animate(model, *options, *abuffer))]
            self.assertEqual(built, wanted, model)

    def test_what_moves_while_the_shutter_is_open_is_refused_by_tracers_that_sample(self):
        for tracer in ("ldc", "abuffer"):
            said = self.animate(CAROUSEL, "--clip", "ride", "--frames", "1-2", "--shutter", "0.5", "--tracer", tracer, status=1).stderr
            for word in ("shutter", tracer, "another tracer"):
                self.assertIn(word, said)
        self.assertEqual(self.leftovers(), [])

    def test_limits_are_reported_with_their_remedy(self):
        limits = {"FARLIGHT_LIMITS_LDC_LAYERS": "1", "FARLIGHT_MEMORY_LDC": "4M", "FARLIGHT_MEMORY_ABUFFER": "1M"}
        with Daemon(environment={**os.environ, **limits}) as daemon:
            def tried(status, *options):
                return self.expect(farlight("render", bundled_scenes() / TEAPOT, "-o", self.folder / "x.png", *SMALL, *options,
                                            "--timings=json", "--server", daemon.address), status)
            result = tried(0, "--tracer", "ldc", "--ldc-resolution", "128")
            frame, = frames_of(result)
            said, (warning,) = frame["structure"], frame["warnings"]
            self.assertEqual(said["static/layers_kept"], 1)
            self.assertGreater(said["static/layers_needed"], 1)
            self.assertGreater(said["static/samples_lost"], 0)
            self.assertIn(f"warning: frame 0: {warning}", result.stderr)
            for words in ("the static cube has 1 of ", f"{said['static/samples_lost']} samples", "limits.ldc_layers"):
                self.assertIn(words, warning)
            (self.folder / "x.png").unlink()
            for options, words in ((["--tracer", "ldc", "--ldc-resolution", "1024"],
                                    ["no room for one layer", "take a lower resolution, or allow it more memory"]),
                                   (["--tracer", "abuffer"], ["memory.abuffer", "lower"])):
                result = tried(1, *options)
                for word in words:
                    self.assertIn(word, result.stderr)
        self.assertEqual(self.leftovers(), [])


class Layers(OneDaemon):
    """Pictures that are made from the depth layers of `quadtree`."""

    def render(self, name, *options):
        path = self.folder / name
        result = self.expect(farlight("render", bundled_scenes() / ROOM, "-o", path, *SMALL, "--timings=json", *options), 0)
        return path, frames_of(result)[0]

    def test_what_is_unknown_is_marked_in_the_picture(self):
        """Eyes far beyond the picture's margin, so that there is much that the key view has not seen; and rays of mirrors and glass, of
        which a sample sends on one of either kind, so that two unknown ones mark the same pixel at most."""
        layers = ["--quadtree-layers", "1", "--layers", "beauty,unknown"]
        path, frame = self.render("pair.exr", "--stereo", "1", "--quadtree-radius", "1", *layers)
        marks = read_exr(path)[2]["unknown.Y"]
        self.assertGreater(sum(marks), 0)
        # Whole samples of one a pixel; the row is of single precision.
        self.assertAlmostEqual(sum(marks) / len(marks), frame["structure"]["views/unknown_per_ray"], 6)
        path, frame = self.render("glass.exr", "--tracer", "quadtree", "--depth", "1", *layers)
        share = sum(frame["structure"][f"secondary/unknown_{where}_per_ray"] for where in ("behind", "outside"))
        unknown, marks = round(share * frame["secondary_rays"]), read_exr(path)[2]["unknown.Y"]
        marked = sum(mark > 0 for mark in marks)
        self.assertGreater(marked, 10)
        self.assertTrue(marked <= unknown <= 2 * marked, (marked, unknown))
        # By how much they count: glass mirrors a part of the light, and lets the rest through.
        self.assertTrue(all(0 <= mark <= 1 for mark in marks))
        self.assertTrue(any(0 < mark < 0.5 for mark in marks))
        for options in (["--stereo", "1", "--views", "rays"], ["--depth", "1"]):
            self.assertEqual(set(read_exr(self.render("rays.exr", *options, *layers[2:])[0])[2]["unknown.Y"]), {0})

    def test_a_picture_that_is_mostly_unknown_is_warned_of(self):
        """Its eyes are outside the room, or look away from what was rendered; once, however many frames there are."""
        for command, options, remedy in (
                ("render", ["--stereo", "1000"], "--views rays"), ("render", ["--stereo", "0.065"], None),
                ("render", ["--aperture", "100", "--focus", "3", "--lens", "quadtree"], "--lens rays"),
                ("animate", ["--eye", "0,1,0", "--look-at", "0,1,-1", "--orbit", "--frames", "1-3", "--upsample", "3"],
                 "a smaller --upsample")):
            result = self.expect(farlight(command, bundled_scenes() / ROOM, "-o", self.folder / "%d.png", *SMALL, *options), 0)
            self.assertEqual(result.stderr.count("no depth layer shows"), 0 if remedy is None else 1, result.stderr)
            self.assertIn(remedy or "", result.stderr)

    def animate(self, folder, *options):
        (self.folder / folder).mkdir(exist_ok=True)
        self.expect(farlight("animate", bundled_scenes() / ROOM, *SMALL, "--orbit", "--frames", "1-9", "--upsample", "4", "-o",
                             self.folder / folder / "%d.png", *options), 0)
        return {int(path.stem): path.read_bytes() for path in (self.folder / folder).iterdir()}

    def test_frames_between_those_that_are_rendered_are_the_same_however_the_range_is_divided(self):
        whole = self.animate("whole")
        self.assertEqual(sorted(whole), list(range(1, 10)))
        self.assertEqual(len(set(whole.values())), 9)  # each has a camera of its own
        # Frames alone, as after an end in the middle, or on another machine of a farm.
        for frame in (3, 5, 8):
            (self.folder / "whole" / f"{frame}.png").unlink()
        resumed = self.animate("whole", "--resume")
        for part in range(1, 4):
            parts = self.animate("parts", "--shard", f"{part}/3")
        for got in (resumed, parts):
            self.assertEqual({frame for frame in whole if got.get(frame) != whole[frame]}, set())

    def test_a_shot_names_the_same_settings(self):
        (self.folder / "shot.json").write_text(json.dumps({
            "model": str(bundled_scenes() / ROOM), "frames": "1-3", "size": [48, 36], "integrator": "whitted",
            "stereo": 0.065, "views": "quadtree", "quadtree_layers": 2, "quadtree_pixels": 0.5, "upsample": 2,
            "output": "%d.png"}))
        self.expect(farlight("animate", "--script", self.folder / "shot.json"), 0)
        self.assertEqual([read_png(self.folder / f"{frame}.png")[:2] for frame in (1, 2, 3)], [(96, 36)] * 3)
        field, frame = self.render("field.png", "--light-field", "3x2", "--baseline", "0.05")
        self.assertEqual(read_png(field)[:2], (3 * 48, 2 * 36))
        self.assertIn("views/unknown_per_ray", frame["structure"])


if __name__ == "__main__":
    farlight_test.unittest.main()
