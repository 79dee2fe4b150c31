#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What farlight-import makes of AFF: every statement, keys as curves over time, included files and images, and what it
says of files that are broken."""
import math
import unittest

import importer
from farlight_test import SHARED_SCENES, Case, daemon_pose, long_test, needs_shared_scenes

VIEW = "v\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 40\nhither 0.01\nresolution 8 8\n"
TRIANGLE = "p 3\n0 0 0\n1 0 0\n0 1 0\n"
PPM = b"P6\n2 2\n255\n" + bytes((255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255))
LIGHT, CAMERA = 3, 4  # kinds of nodes


def hermite(t0, t1, a, leaving, coming, b, t):
    """A cubic of two values and two derivatives by time."""
    d, s = t1 - t0, (t - t0) / (t1 - t0)
    return ((2 * s**3 - 3 * s**2 + 1) * a + (s**3 - 2 * s**2 + s) * d * leaving +
            (3 * s**2 - 2 * s**3) * b + (s**3 - s**2) * d * coming)


class Written(importer.Written):
    def setUp(self):
        super().setUp()
        self.folder = self.folder / "aff"  # beside which others may be
        self.folder.mkdir()

    def run_text(self, text, status=0, **options):
        return self.import_text("model.aff", text, status, **options)

    def positions(self, result, mesh):
        """Of each triangle its three corners, rounded."""
        values = [round(x, 5) + 0 for x in result.floats(mesh["arrays"][0])]
        corners = result.integers(mesh["arrays"][1])
        return [tuple(values[c * 3:c * 3 + 3]) for c in corners]

    def channels(self, result):
        """Without what stays as it is, and with one list of values for each key."""
        found = {}
        for name, (kind, times, values) in result.channels().items():
            width = len(values) // len(times)
            if len(times) > 1 or kind != importer.STEP:
                found[name] = kind, times, [values[at:at + width] for at in range(0, len(values), width)]
        return found

    def node(self, result, name):
        found, = (node for node in result.of(importer.SET_NODE) if node["name"] == name)
        return found

    def assert_near(self, got, wanted, places=5):
        self.assertEqual(len(got), len(wanted))
        for a, b in zip(got, wanted):
            self.assertAlmostEqual(a, b, places)

    # ---- what NFF has, and materials

    def test_statements_of_nff_are_read_as_there(self):
        text = VIEW + "b 0.1 0.2 0.3\nl 0 3 4 1 0.5 0\nf 1 0 0 0.5 0.5 3 0 0\ns 0 0 0 1\nc 0 0 0 1\n0 2 0 0.5\n" + TRIANGLE
        ours = self.run_text(text)
        theirs = importer.import_file(str(self.write("model.nff", text)))
        for kind in (importer.SET_MATERIAL, importer.SET_MESH, importer.SET_SPHERES, importer.SET_LIGHT,
                     importer.SET_CAMERA, importer.SET_ENVIRONMENT, importer.SET_NODE):
            self.assertEqual(ours.of(kind), theirs.of(kind))

    def test_statements_may_share_a_line(self):
        result = self.run_text("f 1 0 0 s 0 0 0 1 l 0 0 5 l 0 5 0 1 1 1 xs 1 1 1 0 0 1 0 5 0 0 { f 0 1 0 p 3 0 0 0 1 0 0 0 1 0 }")
        self.assertEqual([material["base"][:3] for material in result.of(importer.SET_MATERIAL)], [(1, 0, 0), (0, 1, 0)])
        self.assertEqual((len(result.of(importer.SET_LIGHT)), len(result.of(importer.SET_SPHERES))), (2, 1))
        self.assertEqual(self.positions(result, result.of(importer.SET_MESH)[0])[0], (5, 0, 0))

    def test_three_colours_become_base_colour_mirror_and_emission(self):
        result = self.run_text("fm 0.1 0.2 0.3 0.3 0.2 0.1 0.1 0.2 0 20 0 0 % a comment\n" + TRIANGLE +
                               "fm 0.1 0.1 0.1 0.2 0.1 0 0 0 0 20 0.75 1.25 # another\n" + TRIANGLE + "am 2 1 0.5\n")
        mirror, glass = result.of(importer.SET_MATERIAL)
        self.assert_near(mirror["base"], (0.3 / 0.9, 0.2 / 0.8, 0.1, 1))
        self.assert_near([0.04 * factor for factor in mirror["specular"][1:]], (0.5, 1, 0))
        self.assertAlmostEqual(mirror["specular"][0], 0.2)
        self.assertEqual((mirror["metallic"], mirror["roughness"], mirror["double_sided"]), (0, 0, 1))
        self.assert_near(mirror["emission"], (0.2, 0.2, 0.15))
        self.assertEqual((glass["transmission"], glass["ior"], glass["metallic"]), (0.75, 1.25, 0))
        self.assert_near(glass["base"], (1, 0.5, 0, 1))
        self.assertEqual((glass["specular"][0], glass["thin_walled"]), (0, 0))

    def test_ambient_light_is_white_if_nothing_is_said(self):
        material, = self.run_text("fm 0.1 0.2 0.3 1 1 1 0 0 0 1 0 1\n" + TRIANGLE).of(importer.SET_MATERIAL)
        self.assert_near(material["emission"], (0.1, 0.2, 0.3))

    # ---- triangles

    MESH = ("m\nvertices 4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\nnormals 2\n0 0 3\n0 3 3\ntexturecoords 4 a.ppm\n0 0\n1 0\n1 1\n0 1\n"
            "triangles 2\n0 1 2 0 0 0 0 1 2\n0 2 3 0 0 1 0 2 3\n")

    def test_an_indexed_mesh_shares_corners_that_are_alike(self):
        self.write("a.ppm", PPM)
        result = self.run_text(self.MESH)
        mesh, = result.of(importer.SET_MESH)
        self.assertEqual((mesh["triangles"], mesh["vertices"]), (2, 4))
        self.assertEqual(self.positions(result, mesh),
                         [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 0, 0), (1, 1, 0), (0, 1, 0)])
        normals = result.floats(mesh["arrays"][2])
        self.assert_near(normals[:3] + normals[9:], (0, 0, 1, 0, 0.5**0.5, 0.5**0.5))
        self.assertEqual(result.floats(mesh["arrays"][4]), [0, 0, 1, 0, 1, 1, 0, 1])
        texture, = result.of(importer.SET_TEXTURE)
        material, = result.of(importer.SET_MATERIAL)
        self.assertEqual(result.data(texture["arrays"][0])[:8], b"\xff\0\0\xff\0\xff\0\xff", "rows from the top")
        self.assertEqual((texture["wrap"], texture["format"]), ((0, 0), 0))
        lit = self.run_text("l 0 0 5\n" + self.MESH)
        self.assertEqual(lit.of(importer.SET_TEXTURE)[0]["format"], 1, "where light is display values, texels are as they are")
        self.assertEqual([e["display_values"] for e in lit.of(importer.SET_ENVIRONMENT)], [1], "also without a background")
        self.assertEqual([use["texture"] for use in material["textures"]], [texture["id"], 0, 0, 0, texture["id"]])

    def test_a_corner_with_another_normal_is_another_vertex_and_a_mesh_without_normals_is_flat(self):
        for text, vertices, normals in (
                ("m vertices 3 0 0 0 1 0 0 0 1 0 normals 2 0 0 1 0 1 0 triangles 2\n0 1 2 0 0 0\n0 1 2 1 0 0\n", 4, None),
                ("m vertices 4 0 0 0 1 0 0 0 1 0 0 0 1 triangles 2 0 1 2 0 3 1\n", 6, (0, 0, 1) * 3 + (0, 1, 0) * 3)):
            mesh, = (result := self.run_text(text)).of(importer.SET_MESH)
            self.assertEqual(mesh["vertices"], vertices)
            if normals:
                self.assert_near(result.floats(mesh["arrays"][2]), normals)

    def test_textured_triangles(self):
        self.write("a.ppm", PPM)
        result = self.run_text("fm 0 0 0 1 1 1 0 0 0 1 0 1\ntt a.ppm\n0 0 0 0 0\n1 0 0 2 0\n0 1 0 0 2\n"
                               "ttp a.ppm\n0 0 1 0 1 0 0 0\n1 0 1 0 1 0 1 0\n0 1 1 0 1 0 0 1\n" + TRIANGLE)
        mesh, = result.of(importer.SET_MESH)
        plain, textured = result.of(importer.SET_MATERIAL)
        self.assertEqual([(r[1], r[2]) for r in mesh["ranges"]], [(1, plain["id"]), (2, textured["id"])])
        self.assertEqual(result.floats(mesh["arrays"][4])[:6], [0, 0, 2, 0, 0, 2])
        self.assert_near(result.floats(mesh["arrays"][2])[:18], (0, 0, 1) * 3 + (0, 1, 0) * 3)
        self.assertEqual(len(result.of(importer.SET_TEXTURE)), 1, "one image, named twice")

    # ---- static transforms

    def test_static_transforms_scale_then_turn_then_move_from_the_inside(self):
        for text, wanted in (
                ("xs 2 1 1 0 0 2 90 10 20 30 {\n" + TRIANGLE + "}\n" + TRIANGLE,
                 [(10, 20, 30), (10, 22, 30), (9, 20, 30), (0, 0, 0), (1, 0, 0), (0, 1, 0)]),
                ("xs 1 1 1 0 0 1 90 0 0 0 { xs 1 1 1 0 1 0 0 5 0 0 {\n" + TRIANGLE + "} }\n", [(0, 5, 0), (0, 6, 0), (-1, 5, 0)])):
            result = self.run_text(text)
            self.assertEqual(self.positions(result, result.of(importer.SET_MESH)[0]), wanted)

    def test_normals_stay_across_faces_that_are_stretched(self):
        result = self.run_text("xs 1 4 1 0 0 1 0 0 0 0 {\npp 3\n1 0 0 1 1 0\n0 1 0 1 1 0\n0 1 1 1 1 0\n}\n")
        normal = result.floats(result.of(importer.SET_MESH)[0]["arrays"][2])[:3]
        self.assert_near(normal, (4 / 17**0.5, 1 / 17**0.5, 0))

    def test_what_is_mirrored_keeps_its_outside(self):
        result = self.run_text("xs -1 1 1 0 0 1 0 0 0 0 {\n" + TRIANGLE + "}\n")
        mesh, = result.of(importer.SET_MESH)
        self.assertEqual(self.positions(result, mesh), [(0, 0, 0), (0, 1, 0), (-1, 0, 0)], "counter-clockwise from +z")
        self.assert_near(result.floats(mesh["arrays"][2])[:3], (0, 0, 1))

    def test_spheres_scale_with_a_node_of_their_own_only_where_they_are_stretched(self):
        result = self.run_text("xs 2 2 2 0 1 0 30 1 0 0 { s 0 0 1 0.5 }\nxs 1 2 1 0 0 1 0 5 0 0 {\ns 0 0 0 1\ns 0 0 3 1\n}\n")
        even, uneven = result.of(importer.SET_SPHERES)
        self.assert_near(result.floats(even["arrays"][0]), (1 + 2 * math.sin(math.pi / 6), 0, 2 * math.cos(math.pi / 6), 1))
        self.assertEqual(result.floats(uneven["arrays"][0]), [0, 0, 0, 1, 0, 0, 3, 1])
        holder, = (node for node in result.of(importer.SET_NODE) if node["object"] == uneven["id"] and node["kind"] == 2)
        above, = (node for node in result.of(importer.SET_NODE) if node["id"] == holder["parent"])
        self.assertEqual(above["matrix"], (1, 0, 0, 5, 0, 2, 0, 0, 0, 0, 1, 0))

    # ---- keys

    def moving(self, keys, more=""):
        return "x thing {\n" + TRIANGLE + "}\nk thing {\n" + keys + "}\n" + more

    TRANSL = "transl 5\n0 0 0 0 0 0 0\n1 1 0 0 0.5 0.25 -0.5\n2 3 1 0 0 0 0\n3 2 1 0 0 0 0\n4 0 0 0 0 0 0\n"

    def test_positions_are_the_same_cubics(self):
        """Tangents as in tests/unit/import/spline.c, worked out from Kochanek and Bartels' formula."""
        kind, times, values = self.channels(self.run_text(self.moving(self.TRANSL)))["thing", importer.TRANSLATION]
        self.assertEqual((kind, times), (importer.CUBIC, [1, 2, 3]))
        self.assertEqual([value[3:6] for value in values], [[1, 0, 0], [3, 1, 0], [2, 1, 0]])
        self.assert_near([values[0][6], values[1][0], values[1][6], values[2][0]], (0.71875, 0.5, 0.5, -1.5))
        self.assertAlmostEqual(hermite(1, 2, 1, values[0][6], values[1][0], 3, 1.5), 2.02734375, 6)

    def test_the_animation_begins_at_time_0_of_the_clip_and_ends_with_it(self):
        result = self.run_text(self.moving(self.TRANSL, "a 0.5 6 12\n"))
        _, times, values = self.channels(result)["thing", importer.TRANSLATION]
        self.assertEqual(times, [0.5, 1.5, 2.5, 5.5])
        self.assertEqual((values[2][6:], values[3]), ([0] * 3, [0, 0, 0, 2, 1, 0, 0, 0, 0]), "held")
        self.assertEqual([(clip["name"], clip["duration"]) for clip in result.clips], [("animation", 5.5)])
        self.assertIn("12 frames in 5.5 s: --clip animation --clip-once --fps 2", result.text())

    def test_an_animation_that_ends_between_keys_is_cut_there(self):
        whole = self.channels(self.run_text(self.moving(self.TRANSL)))["thing", importer.TRANSLATION]
        cut = self.channels(self.run_text(self.moving(self.TRANSL, "a 0 1.75 2\n")))["thing", importer.TRANSLATION]
        self.assertEqual(cut[1], [1, 1.75])
        for t in (1.2, 1.5, 1.75):
            one = hermite(1, 2, whole[2][0][3], whole[2][0][6], whole[2][1][0], whole[2][1][3], t)
            other = hermite(1, 1.75, cut[2][0][3], cut[2][0][6], cut[2][1][0], cut[2][1][3], t)
            self.assertAlmostEqual(one, other, 5)

    def test_scales_and_visibility(self):
        result = self.run_text(self.moving(
            "scale 4\n0 1 1 1 0 0 0\n1 1 2 1 0 0 0\n2 3 1 1 0 0 0\n3 1 1 1 0 0 0\nvisibility 2\n0.5 0\n1.5 1\n"))
        found = self.channels(result)
        self.assertEqual([v[3:6] for v in found["thing", importer.SCALE][2]], [[1, 2, 1], [3, 1, 1]])
        self.assertEqual(found["thing", importer.HIDDEN], (importer.STEP, [0, 0.5, 1.5], [[0], [1], [0]]))
        self.assertEqual(self.node(result, "thing")["hidden"], 0)
        self.assertEqual(self.node(self.run_text(self.moving("visible 1\n0 0\n")), "thing")["hidden"], 1, "another word for it")

    def test_turns_go_as_squad_says(self):
        """About one axis, in degrees: tests/unit/import/spline.c has 15.3125 at a quarter and 37.5 in the middle."""
        result = self.run_text(self.moving("rot 4\n0 0 2 0 0 0 0 0\n1 0 2 0 0 0 0 0\n2 0 2 0 80 0 0 0\n3 0 2 0 120 0 0 0\n"))
        kind, times, values = self.channels(result)["thing", importer.ROTATION]
        self.assertEqual((kind, times[0], times[-1]), (importer.LINEAR, 1, 2))
        for t, degrees in ((1, 0), (1.25, 15.3125), (1.5, 37.5), (2, 80)):
            i = max(at for at in range(len(times) - 1) if times[at] <= t)
            share = (t - times[i]) / (times[i + 1] - times[i])
            a, b = (2 * math.degrees(math.atan2(q[1], q[3])) for q in values[i:i + 2])
            self.assertAlmostEqual(a + share * (b - a), degrees, delta=math.degrees(1e-4), msg="the importer's bound")

    def test_keys_at_one_time_are_a_jump(self):
        result = self.run_text(self.moving("transl 6\n0 0 0 0 0 0 0\n1 0 0 0 0 0 0\n2 0 0 0 0 0 0\n2 5 0 0 0 0 0\n"
                                           "3 5 0 0 0 0 0\n4 5 0 0 0 0 0\n"))
        _, times, values = self.channels(result)["thing", importer.TRANSLATION]
        self.assertEqual((times[1], [v[3] for v in values]), (2, [0, 0, 5, 5]))
        self.assertTrue(2 < times[2] < 2.000001)

    def test_keys_that_go_back_in_time_are_left_out(self):
        result = self.run_text(self.moving("transl 6\n0 0 0 0 0 0 0\n1 1 0 0 0 0 0\n2 2 0 0 0 0 0\n1.5 9 0 0 0 0 0\n"
                                           "3 3 0 0 0 0 0\n4 4 0 0 0 0 0\n"))
        self.assertEqual(self.channels(result)["thing", importer.TRANSLATION][1], [1, 2, 3])
        self.assertIn("line 12: keys that go back in time", result.text())

    def test_without_a_clip_things_are_where_the_animation_begins(self):
        result = self.run_text(self.moving(self.TRANSL, "a 2 3 5\n"))
        self.assert_near(self.node(result, "thing")["matrix"], (1, 0, 0, 3, 0, 1, 0, 1, 0, 0, 1, 0))

    def test_transforms_move_in_one_another(self):
        result = self.run_text("xs 1 1 1 0 1 0 0 1 2 3 {\nx outer {\nxs 2 2 2 0 1 0 0 0 0 0 {\nx inner {\n" + TRIANGLE +
                               "} } } }\nk outer { " + self.TRANSL + "}\nk inner { " + self.TRANSL + "}\nx outer {\n" +
                               TRIANGLE + "}\n")
        nodes = {node["id"]: node for node in result.of(importer.SET_NODE)}
        inner = self.node(result, "inner")
        scaled = nodes[inner["parent"]]
        outer = nodes[scaled["parent"]]
        self.assertEqual((scaled["matrix"][0], outer["name"]), (2, "outer"))
        self.assertEqual(nodes[outer["parent"]]["matrix"][3::4], (1, 2, 3))
        moved = [nodes[c["object"]]["name"] for c in result.of(importer.SET_CHANNEL)
                 if c["path"] == importer.TRANSLATION]
        self.assertEqual(sorted(moved), ["inner", "outer", "outer"], "both that have the name")

    def test_camera_and_lights_have_keys_by_name(self):
        result = self.run_text(VIEW + "la lamp 1 2 3 1 1 1\nl 0 0 1\n" + TRIANGLE + "k camera {\n" + self.TRANSL +
                               "rot 4\n0 0 1 0 0 0 0 0\n1 0 1 0 0 0 0 0\n2 0 1 0 90 0 0 0\n3 0 1 0 90 0 0 0\n}\n"
                               "k lamp {\n" + self.TRANSL + "}\nk nobody {\n" + self.TRANSL + "}\n")
        found = self.channels(result)
        self.assertEqual(set(found), {("view", importer.TRANSLATION), ("view", importer.ROTATION),
                                      ("light 1", importer.TRANSLATION)})
        self.assertEqual(self.node(result, "view")["matrix"], (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 5))
        self.assertIn("nothing is named 'nobody'", result.text())

    # ---- vertices that move

    def moving_triangle(self, z, times=(0, 1, 3)):
        rows = ["%g\n" % t + "".join("%d %d %g 0 %g 1\n" % (x, y, z + i, i) for x, y in ((0, 0), (1, 0), (0, 1)))
                for i, t in enumerate(times)]
        return "tpa %d\n" % len(times) + "".join(rows)

    def test_moving_triangles_are_morph_targets_that_follow_one_another(self):
        result = self.run_text("a 0 4 9\n" + self.moving_triangle(0) + self.moving_triangle(10))
        mesh, = result.of(importer.SET_MESH)
        self.assertEqual((mesh["triangles"], mesh["targets"]), (2, 2))
        self.assertEqual(result.floats(mesh["arrays"][9]), [0, 0, 1] * 6 + [0, 0, 2] * 6)
        self.assertEqual(result.floats(mesh["arrays"][10]), [0, 1, 0] * 6 + [0, 2, 0] * 6)
        self.assertEqual(self.channels(result)["moving triangles", importer.WEIGHTS],
                         (importer.LINEAR, [0, 1, 3, 4], [[0, 0], [1, 0], [0, 1], [0, 1]]))

    def test_moving_triangles_of_other_times_or_materials_are_other_meshes(self):
        result = self.run_text(self.moving_triangle(0) + self.moving_triangle(1, (0, 2)) + "f 1 0 0\n" +
                               self.moving_triangle(2))
        self.assertEqual([mesh["targets"] for mesh in result.of(importer.SET_MESH)], [2, 1, 2])
        self.assertEqual([mesh["ranges"][0][2] for mesh in result.of(importer.SET_MESH)], [2, 2, 1])  # 2: `default`

    def test_moving_triangles_are_placed_and_at_rest_as_the_animation_begins(self):
        result = self.run_text("a 2 3 2\nxs 1 1 1 0 1 0 0 0 0 100 {\n" + self.moving_triangle(0) + "}\n")
        mesh, = result.of(importer.SET_MESH)
        self.assertEqual(result.floats(mesh["arrays"][0])[:3], [0, 0, 100])
        self.assertEqual(self.node(result, "moving triangles")["weights"], [0.5, 0.5])

    # ---- other files

    def test_included_files_share_material_transform_and_names(self):
        self.write("colour.aff", "fm 0 0 0 1 0 0 0 0 0 1 0 1\n")
        self.write("parts/shape.aff", TRIANGLE)
        result = self.run_text("i 0 colour.aff\nxs 1 1 1 0 1 0 0 1 0 0 {\ni 0 parts/shape.aff\n}\ni 0 parts/shape.aff\n")
        mesh, = result.of(importer.SET_MESH)
        self.assertEqual(self.positions(result, mesh)[::3], [(1, 0, 0), (0, 0, 0)])
        self.assertEqual(result.of(importer.SET_MATERIAL)[0]["base"], (1, 0, 0, 1))

    def test_files_of_more_detail_than_wanted_are_skipped(self):
        self.write("fine.aff", TRIANGLE)
        result = self.run_text(TRIANGLE + "i 1 fine.aff\ni 2 missing.aff\nd 1\ni 1 fine.aff\n")
        self.assertEqual(result.of(importer.SET_MESH)[0]["triangles"], 2)

    def test_images_lie_in_the_folder_or_in_TextureFiles_beside_it(self):
        (self.folder.parent / "TextureFiles").mkdir()
        (self.folder.parent / "TextureFiles" / "a.ppm").write_bytes(PPM)
        (self.folder.parent / "b.ppm").write_bytes(PPM)
        result = self.run_text("tt a.ppm 0 0 0 0 0 1 0 0 1 0 0 1 0 0 1\ntt ../b.ppm 0 0 0 0 0 1 0 0 1 0 0 1 0 0 1\n")
        beside, outside = result.of(importer.SET_TEXTURE)
        self.assertEqual(result.data(beside["arrays"][0])[:4], b"\xff\0\0\xff")
        self.assertEqual(result.data(outside["arrays"][0])[:4], b"\xff\0\xff\xff", "magenta")
        self.assertIn("'../b.ppm' cannot be used: lies outside the model's folder", result.text())

    def test_a_link_named_TextureFiles_is_not_followed(self):
        (self.folder.parent / "private").mkdir()
        (self.folder.parent / "private" / "a.ppm").write_bytes(PPM)
        (self.folder.parent / "TextureFiles").symlink_to("private")
        result = self.run_text("tt a.ppm 0 0 0 0 0 1 0 0 1 0 0 1 0 0 1\n")
        self.assertIn("'a.ppm' cannot be used", result.text())

    def test_what_may_not_be_included_is_refused_by_name(self):
        self.write("secret.txt", "password\n")
        self.write(".hidden.aff", TRIANGLE)
        (self.folder.parent / "outside.aff").write_text(TRIANGLE, encoding="utf-8")
        for name, expected in (("secret.txt", "its name should end in .aff or .nff"),
                               (".hidden.aff", "is hidden"), ("../outside.aff", "lies outside the model's folder"),
                               ("/etc/passwd.aff", "lies outside"), ("missing.aff", "No such file")):
            with self.subTest(name):
                text = self.run_text("\ni 0 %s\n" % name, 1).text()
                self.assertIn(expected, text)
                self.assertIn("line 2", text)
                self.assertNotIn("password", text)

    def test_files_that_include_themselves_or_too_many_are_refused(self):
        self.write("a.aff", "i 0 b.aff\n")
        self.write("b.aff", "\ni 0 a.aff\n")
        self.assertIn("b.aff line 2: 'a.aff' includes itself", self.run_text("i 0 a.aff\n", 1).text())
        for number in range(40):
            self.write("deep%d.aff" % number, "i 0 deep%d.aff\n" % (number + 1))
        self.assertIn("more than 32 files include one another", self.run_text("i 0 deep0.aff\n", 1).text())
        for number in range(20):
            self.write("wide%d.aff" % number, "i 0 wide%d.aff\n" % (number + 1) * 10)
        self.write("wide20.aff", TRIANGLE)
        self.assertIn("65536 in all", self.run_text("i 0 wide0.aff\n", 1).text())

    # ---- faults

    def test_faults_name_file_line_and_what_is_allowed(self):
        rot = "rot 4\n0 0 1 0 0 0 0 0\n1 0 1 0 0 0 0 0\n2 0 1 0 0 0 0 0\n"
        for text, expected in (
                (TRIANGLE + "xs 1 1 1 0 0 1 0 0 0 0 {\n", "the file ends, but 1 '{' lack their '}'"),
                (TRIANGLE + "}\n", "line 5: a '}' that closes no '{'"), ("what\n", "line 1: 'what' is not a statement of AFF"),
                ("xs 1 1 1 0 0 1 0 0 0 0\np 3\n", "line 2: '{' should follow 'xs', but there is 'p'"),
                ("xs 1 1 1 0 0 1 0 0 nan 0 {\n", "'nan' is not an allowed number of 'xs'"),
                ("xs 1e9 1 1 0 0 1 0 0 0 0 {\n" * 2, "beyond 1e12"), ("x a {\n" * 65, "more than 64 transforms"),
                ("x %s {\n" % ("a" * 129), "a name of at most 128 characters"), ("x {\n", "needs a name"),
                ("k a {\ntransl 3\n", "line 2: 'transl' has 3; 4 to"), ("k a {\n" + rot, "rot needs 32 numbers, but the file ends before"),
                ("k a {\nspin 4\n", "'spin' is not a property of 'k'; transl, rot, scale and visibility are"),
                ("k a\ntransl", "'{' should follow 'k a'"), ("k a {\nvisibility 1\n0 0\nvisibility 1\n0 0\n}", "a second 'visibility'"),
                ("k a {\ntransl 4\n3 0 0 0 0 0 0\n2 0 0 0 0 0 0\n1 0 0 0 0 0 0\n0 0 0 0 0 0 0\n", "1 keys of 'transl' are in the order"),
                ("m vertices 1 0 0 0 triangles 1 0 0 1", "'a corner's vertex' has 1; 0 to 0 are allowed"),
                ("m vertices 1 0 0 0 triangles 1 0 0 -1", "'-1' is not a whole number"),
                ("m vertices 4000000 0 0 0", "vertices needs 12000000 numbers, but the file ends before"),
                ("m corners 3", "'m' begins with 'vertices', but there is 'corners'"),
                ("m vertices 1 0 0 0 faces 1", "'triangles' should follow, but there is 'faces'"),
                ("m vertices 1 0 0 0 triangles 99999999999", "'99999999999' is not a whole number of 'triangles'; 1 to"),
                ("tpa 0\n", "'tpa' has 0; 1 to 1025 are allowed"), ("tpa 1025\n", "'tpa' needs 19475 numbers"),
                (self.moving_triangle(0, (0, 0)), "time 0 of 'tpa' follows 0; times must ascend"),
                ("a 2 1 5\n", "the animation ends at 1, before it begins at 2"), ("a 0 1 0\n", "'a' has 0; 1 to"),
                ("fm 1 1 1\n", "where number 4 of 12 of 'fm' should be"), ("am 1 1", "of 'am'"), ("d\n", "the file ends within 'd'"),
                ("", "the file is empty"), ("am 1 1 1\n", "nothing that can be shown")):
            with self.subTest(expected):
                self.assertIn(expected, self.run_text(text, 1).text())

    def test_a_fault_of_an_included_file_names_it(self):
        self.write("part.aff", "% good\np 3\n0 0 0\n1 0 x 0 0 0 0\n")
        self.assertIn("part.aff line 4: 'x'", self.run_text("i 0 part.aff\n", 1).text())

    def test_many_normals_at_one_place_take_no_square_of_their_number(self):
        count = 60000
        text = ("m vertices 3 0 0 0 1 0 0 0 1 0 normals %d\n" % count + "0 0 1\n" * count + "triangles %d\n" % count +
                "".join("0 1 2 %d %d %d\n" % (i, i, i) for i in range(count)))
        result = self.run_text(text, seconds=5)
        self.assertEqual(result.of(importer.SET_MESH)[0]["vertices"], 3 * count)


class Posed(Case):
    def test_the_daemon_has_things_where_the_file_puts_them(self):
        """A triangle that is moved by 2, by 10 and turned by 90 degrees; one whose vertices are half-way, with normals that
        are as long as they are stated until then."""
        still = "0 0 0 0 0 0 0\n1 0 0 0 0 0 0\n2 0 2 0 0 0 0\n3 0 2 0 0 0 0\n4 0 2 0 0 0 0\n"
        text = ("a 1 3 9\nx outer { xs 1 1 1 0 0 1 0 10 0 0 { x inner { p 3\n0 0 0\n1 0 0\n0 1 0\n} } }\n"
                "k outer { rot 5\n0 0 0 1 0 0 0 0\n1 0 0 1 0 0 0 0\n2 0 0 1 90 0 0 0\n3 0 0 1 90 0 0 0\n4 0 0 1 90 0 0 0\n}\n"
                "k inner { transl 5\n" + still + "}\n"
                "tpa 2\n1\n0 0 0 3 0 0\n1 0 0 3 0 0\n0 1 0 3 0 0\n3\n0 0 4 0 4 0\n1 0 4 0 4 0\n0 1 4 0 4 0\n")
        model = self.folder / "model.aff"
        model.write_text(text, encoding="utf-8")
        corners, = daemon_pose(model, 0, [1])
        wanted = [(0, 0, 2, 0.6, 0.8, 0), (1, 0, 2, 0.6, 0.8, 0), (0, 1, 2, 0.6, 0.8, 0),
                  (-2, 10, 0, 0, 0, 1), (-2, 11, 0, 0, 0, 1), (-3, 10, 0, 0, 0, 1)]
        self.assertEqual(len(corners), 6)
        for (place, normal), want in zip(corners, wanted):
            for a, b in zip(place + normal, want):
                self.assertAlmostEqual(a, b, 5)


@long_test
@needs_shared_scenes
class Bart(unittest.TestCase):
    def test_published_scenes_have_what_is_stated_of_them(self):
        """Of the kitchen as many triangles as BART's paper states. The museum's file counts 10,143 polygons, of which 133 with more
        corners are 274 triangles; and 8 cones, of 64; 1024 move."""
        for name, triangles, seconds, more in (
                ("kitchen/aff/kitchen.aff", 110561, 20, {"lights": 6}),
                ("museum/aff/museum5.aff", 10143 - 133 + 274 + 8 * 64 + 1024, 6, {"textures": 5, "moving": (1024, 4)}),
                ("robot/aff/Robot.aff", 71708, 50, {"robots": 10})):
            with self.subTest(name):
                result = importer.import_file(str(SHARED_SCENES / "rayspace" / "bart" / name), seconds=30)
                self.assertEqual((result.status, result.faults, importer.inconsistencies(result)), (0, [], []), result.text())
                self.assertNotIn("image", result.text())
                meshes = result.of(importer.SET_MESH)
                self.assertEqual((sum(mesh["triangles"] for mesh in meshes), result.clips[0]["duration"]), (triangles, seconds))
                found = {"lights": len(result.of(importer.SET_LIGHT)), "textures": len(result.of(importer.SET_TEXTURE)),
                         "moving": (meshes[-1]["triangles"], meshes[-1]["targets"]),
                         "robots": sum(node["name"].startswith("robot_rot") for node in result.of(importer.SET_NODE))}
                self.assertEqual({key: found[key] for key in more}, more)


if __name__ == "__main__":
    unittest.main(verbosity=2)
