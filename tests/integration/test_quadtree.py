# SPDX-License-Identifier: MIT
"""The tracer `quadtree` as a person meets it: pictures made from depth layers, and what a frame says of them."""
import json

from farlight_test import OneDaemon, bundled_scenes, farlight, frames_of, read_exr, read_png

ROOM = "cornell.glb"
SMALL = ["--size", "48x36", "--integrator", "whitted", "--samples", "1"]
SHARES = ("behind_layer_1_per_ray", "behind_layer_2_per_ray", "unknown_behind_per_ray", "unknown_outside_per_ray")


class Quadtree(OneDaemon):
    def render(self, name, *options, model=ROOM):
        """Where the picture is, and the rows of its structure."""
        path = self.folder / name
        result = self.expect(farlight("render", bundled_scenes() / model, "-o", path, *SMALL, "--timings=json", *options), 0)
        return path, frames_of(result)[0]["structure"]

    def compare(self, picture, true):
        return json.loads(self.expect(farlight("compare", picture, true, "--json", "--ignore-alpha"), 0).stdout)

    def animate(self, folder, *options, status=0):
        (self.folder / folder).mkdir(exist_ok=True)
        return self.expect(farlight("animate", bundled_scenes() / ROOM, *SMALL, "--orbit", "--frames", "1-9", "-o",
                                    self.folder / folder / "%d.png", *options), status)

    def pictures(self, folder):
        return {int(path.stem): path.read_bytes() for path in (self.folder / folder).iterdir()}

    def test_a_pair_made_from_layers_is_near_the_true_pair(self):
        """Texels are filtered once more, and an edge may be a pixel from where it is: those are what differs."""
        eyes = ["--stereo", "0.065", "--size", "160x120"]
        pair, said = self.render("pair.png", *eyes)
        true, _ = self.render("true.png", *eyes, "--views", "rays")
        figures = self.compare(pair, true)
        self.assertGreaterEqual(figures["psnr"], 30)
        # Edges are some 800 of 38,400 pixels; most differ by more, and by two pixels across.
        self.assertLessEqual(figures["beyond"], 0.05)
        self.assertLessEqual(said["views/unknown_per_ray"], 0.001)

    def test_a_frame_states_what_its_rays_did_not_find(self):
        _, said = self.render("one.png", "--tracer", "quadtree", "--primary", "trace")
        for kind in ("primary", "secondary", "shadow"):
            for row in SHARES:
                self.assertTrue(0 <= said[f"{kind}/{row}"] <= 1, (kind, row, said))
        self.assertEqual((said["faces"], said["layers"], said["bound_pixels"]), (6, 3, 0.25))
        self.assertAlmostEqual(said["bound_radius_metres"], 0.15, 6)
        _, said = self.render("pair.png", "--stereo", "0.1", "--quadtree-layers", "2")
        self.assertEqual((said["faces"], said["layers"]), (1, 2))
        self.assertIn("views/unknown_per_ray", said)

    def test_what_is_unknown_is_marked_in_the_picture(self):
        """The eyes are far beyond the picture's margin, so there is much that the key view has not seen."""
        path, said = self.render("pair.exr", "--stereo", "1", "--quadtree-radius", "1", "--quadtree-layers", "1",
                                 "--layers", "beauty,unknown")
        _, _, channels = read_exr(path)
        marks = channels["unknown.Y"]
        self.assertGreater(sum(marks), 0)
        # Whole samples of one a pixel; the row is of single precision.
        self.assertAlmostEqual(sum(marks) / len(marks), said["views/unknown_per_ray"], 6)
        path, _ = self.render("rays.exr", "--stereo", "1", "--views", "rays", "--layers", "beauty,unknown")
        self.assertEqual(set(read_exr(path)[2]["unknown.Y"]), {0})

    def test_mirrored_and_refracted_rays_that_are_unknown_are_marked_in_the_picture(self):
        """A pixel's sample sends on one ray of either kind, so that two unknown ones mark the same pixel at most."""
        path = self.folder / "glass.exr"
        once = ["--layers", "beauty,unknown", "--depth", "1", "--quadtree-layers", "1", "--timings=json"]
        result = self.expect(farlight("render", bundled_scenes() / ROOM, "-o", path, *SMALL, *once, "--tracer", "quadtree"), 0)
        frame = frames_of(result)[0]
        share = sum(frame["structure"][f"secondary/unknown_{where}_per_ray"] for where in ("behind", "outside"))
        unknown = round(share * frame["secondary_rays"])
        marks = read_exr(path)[2]["unknown.Y"]
        marked = sum(mark > 0 for mark in marks)
        self.assertGreater(marked, 10)
        self.assertTrue(marked <= unknown <= 2 * marked, (marked, unknown))
        # By how much they count: glass mirrors a part of the light, and lets the rest through.
        self.assertTrue(all(0 <= mark <= 1 for mark in marks))
        self.assertTrue(any(0 < mark < 0.5 for mark in marks))
        self.expect(farlight("render", bundled_scenes() / ROOM, "-o", path, *SMALL, *once), 0)
        self.assertEqual(set(read_exr(path)[2]["unknown.Y"]), {0})

    def test_a_picture_that_is_mostly_unknown_is_warned_of(self):
        """Its eyes are outside the room, or look away from what was rendered."""
        for options, remedy in ((["--stereo", "1000"], "--views rays"), (["--stereo", "0.065"], None),
                                (["--aperture", "100", "--focus", "3", "--lens", "quadtree"], "--lens rays")):
            path = self.folder / "far.png"
            result = self.expect(farlight("render", bundled_scenes() / ROOM, "-o", path, *SMALL, *options), 0)
            self.assertEqual("no depth layer shows" in result.stderr, remedy is not None, result.stderr)
            self.assertIn(remedy or "", result.stderr)
        (self.folder / "far").mkdir()
        result = self.expect(farlight("animate", bundled_scenes() / ROOM, *SMALL, "--eye", "0,1,0", "--look-at", "0,1,-1",
                                      "--orbit", "--frames", "1-3", "--upsample", "3", "-o", self.folder / "far" / "%d.png"), 0)
        self.assertEqual(result.stderr.count("no depth layer shows"), 1)  # once, however many frames
        self.assertIn("a smaller --upsample", result.stderr)

    def test_light_fields_and_lenses_are_made_from_layers(self):
        field, said = self.render("field.png", "--light-field", "3x2", "--baseline", "0.05")
        self.assertEqual(read_png(field)[:2], (3 * 48, 2 * 36))
        self.assertIn("views/unknown_per_ray", said)
        lens = ["--aperture", "0.2", "--samples", "16"]
        blurred, said = self.render("lens.png", *lens, "--lens", "quadtree")
        self.assertIn("views/unknown_per_ray", said)
        true, _ = self.render("true.png", *lens)
        sharp, _ = self.render("sharp.png", "--samples", "16")
        self.assertGreater(self.compare(blurred, true)["psnr"], self.compare(sharp, true)["psnr"])

    def test_frames_between_those_that_are_rendered_are_made_from_layers(self):
        self.animate("whole", "--upsample", "4")
        whole = self.pictures("whole")
        self.assertEqual(sorted(whole), list(range(1, 10)))
        self.assertEqual(len(set(whole.values())), 9)  # each has a camera of its own
        # Each frame alone, as after an end in the middle or on another machine of a farm.
        for frame in (3, 5, 6, 8):
            (self.folder / "whole" / f"{frame}.png").unlink()
            self.animate("whole", "--upsample", "4", "--resume")
        for part in range(1, 4):
            self.animate("parts", "--upsample", "4", "--shard", f"{part}/3")
        for folder in ("whole", "parts"):
            self.assertEqual({frame for frame, data in self.pictures(folder).items() if data != whole[frame]}, set(), folder)

    def test_noise_of_views_at_rest_becomes_less(self):
        """As in a rendered picture of as many samples, 35 dB, but for what layers blur: 33.5 dB were there no noise. That of one
        sample leaves 14 dB."""
        eyes = ["--stereo", "0.065", "--integrator", "distributed"]
        (self.folder / "replay.json").write_text(json.dumps(
            [{"key": "o", "shift": True}, {"wait": "rest", "samples": 64}, {"screenshot": str(self.folder / "view.png")}]))
        self.expect(farlight("view", bundled_scenes() / ROOM, "--headless", "--replay", self.folder / "replay.json", "--size",
                             "160x90", "--samples", "64", *eyes), 0)
        true, rendered = (self.render(f"{samples}.png", *eyes, "--size", "80x90", "--samples", samples, "--seed", seed, "--views",
                                      "rays")[0] for samples, seed in (("256", "1"), ("64", "0")))
        blurred, error, error_rendered = 10 ** -3.3, *(10 ** (-self.compare(path, true)["psnr"] / 10)
                                                       for path in (self.folder / "view.png", rendered))
        self.assertLess(error, error_rendered + blurred)

    def test_a_shot_names_the_same_settings(self):
        (self.folder / "shot.json").write_text(json.dumps({
            "model": str(bundled_scenes() / ROOM), "frames": "1-3", "size": [48, 36], "integrator": "whitted",
            "stereo": 0.065, "views": "quadtree", "quadtree_layers": 2, "quadtree_pixels": 0.5, "upsample": 2,
            "output": "%d.png"}))
        self.expect(farlight("animate", "--script", self.folder / "shot.json"), 0)
        self.assertEqual([read_png(self.folder / f"{frame}.png")[:2] for frame in (1, 2, 3)], [(96, 36)] * 3)

    def test_the_viewer_states_what_is_unknown_as_the_camera_moves(self):
        held = [{"key": "w", "hold": 0.2}]
        (self.folder / "replay.json").write_text(json.dumps(
            [{"wait": "rest", "samples": 1}, {"key": "t", "shift": True}, {"wait": "rest", "samples": 1},
             {"state": "switched"}, *held, {"wait": "rest", "samples": 1}, {"state": "moved"}]))
        result = self.expect(farlight("view", bundled_scenes() / ROOM, "--headless", "--replay", self.folder / "replay.json",
                                      "--size", "96x54", "--samples", "1", "--integrator", "whitted"), 0)
        states = {state["state"]: state for state in map(json.loads, result.stdout.splitlines())}
        self.assertNotEqual(states["switched"]["eye"], states["moved"]["eye"])
        for state in states.values():
            self.assertEqual(state["tracer"], "quadtree")
            self.assertTrue(any(line.startswith("secondary: behind layer 1 ") and " unknown behind " in line
                                for line in state["structure"]), state)


if __name__ == "__main__":
    import unittest
    unittest.main()
