# SPDX-License-Identifier: MIT
"""The add-on in Blender: pictures beside Cycles' of the same scene, sent messages, and failures.

Run by `make blender-test`. Pictures are compared by the means of 8 x 6 parts. With Lambert's surfaces both engines compute the same
light: they differ by noise, 0.5 % of a part's mean at these samples, and by the filter at the edges of small things. The models of
materials and lights differ as follows:
- Cycles scatters all light below a mirroring surface, farlight the part that the surface lets through: plastic is 3 % darker here, up
  to 8 % at grazing angles; fur is 1.4 % darker. Fully rough plastic is Lambert's here and Burley's there: 1 %.
- Cycles' GGX (without Multiscatter) loses 12 % of the light of rough metal, half at a roughness of 1; its Filter Glossy loses a third
  below glass.
- Between texels, Cycles interpolates sRGB's numbers, farlight light: hard edges are lighter here. Cycles darkens bumps that face a
  light by 10 % more than their surface.
- Light passes straight through glass here: from hardly a shadow to half more light behind it than by Cycles' caustics. Spots are sums
  of four cones: 1 % on average, 3 % at a soft edge.
"""
import contextlib
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest
import unittest.mock

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BUILD = os.path.abspath(sys.argv[sys.argv.index("--") + 1])
sys.path[:0] = [str(HERE), f"{BUILD}/python", str(ROOT / "client/blender"), str(ROOT / "tests/integration")]

import bpy  # pylint: disable=wrong-import-position
import numpy as np  # pylint: disable=wrong-import-position
import farlight  # pylint: disable=wrong-import-position
from farlight import fields  # pylint: disable=wrong-import-position
import farlight_blender  # pylint: disable=wrong-import-position
from farlight_blender import bake, engine, mirror, session  # pylint: disable=wrong-import-position
from farlight_test import read_exr  # pylint: disable=wrong-import-position
import scenes  # pylint: disable=wrong-import-position
from scenes import (add_light, ball, blocks, cube, diffuse, empty, grid, hairs, image, load, material, mixture,  # pylint: disable=wrong-import-position
                    procedural, put, render, textured, without_surface)

GROUND = (0.8, 0.5, 0.3, 1)
DARK = 0.05  # parts that are darker are compared as if they were of this light


class Case(unittest.TestCase):
    def assert_like_cycles(self, mean, worst, samples=128):
        """mean: of the relative differences of all parts and colours; worst: of one."""
        ours, theirs = (blocks(render(*which)) for which in (("FARLIGHT",), ("CYCLES", samples)))
        apart = np.abs(ours - theirs) / np.maximum(theirs, DARK)
        self.assertLess(apart.mean(), mean, f"mean difference {apart.mean():.4f}, worst {apart.max():.3f}")
        self.assertLess(apart.max(), worst, f"part {np.unravel_index(apart.argmax(), apart.shape)}")

    def keys(self, owner, path, first, last):
        for frame, value in ((1, first), (3, last)):
            setattr(owner, path, value)
            owner.keyframe_insert(path, frame=frame)
        action = (owner.id_data.animation_data or owner.animation_data).action
        for curve in action.fcurves:
            for point in curve.keyframe_points:
                point.interpolation = "LINEAR"

    @contextlib.contextmanager
    def asked(self, is_stopped):
        """In place of Blender's own answer to the question whether the user has cancelled."""
        frames = session.Session.frames
        with unittest.mock.patch.object(session.Session, "frames", lambda this, scene, camera, _, **values:
                                        frames(this, scene, camera, is_stopped, **values)):
            yield


class Lights(Case):
    def ground(self, world=(0, 0, 0)):
        empty(world)
        grid("ground", 20, diffuse(GROUND))
        ball("ball", diffuse((0.8, 0.8, 0.8, 1)))

    def test_a_ball_of_light_has_the_power_that_it_has_in_cycles(self):
        self.ground()
        add_light("POINT", 500, (2, -2, 4), shadow_soft_size=0.2)
        self.assert_like_cycles(0.01, 0.05)

    def test_a_sun_has_the_irradiance_that_it_has_in_cycles(self):
        self.ground()
        add_light("SUN", 3, turn=(0.5, 0.3, 0), angle=0)
        self.assert_like_cycles(0.01, 0.05)

    def test_a_sun_with_a_disc_has_the_shadows_that_it_has_in_cycles(self):
        self.ground()
        bpy.data.objects["ball"].location.z = 3
        add_light("SUN", 3, turn=(0.5, 0.3, 0), angle=0.5)
        self.assert_like_cycles(0.01, 0.05)

    def test_a_spot_has_the_cone_that_it_has_in_cycles(self):
        self.ground()
        add_light("SPOT", 800, (0, 0, 6), shadow_soft_size=0, spot_size=1.0, spot_blend=0.5)
        # The sum of cones is within 1.2 % of Blender's on average, and 4 % of full light at the edge.
        self.assert_like_cycles(0.02, 0.08)

    def test_a_wide_spot_is_weaker_at_its_edge_as_in_cycles(self):
        self.ground()
        add_light("SPOT", 800, (0, 0, 4), shadow_soft_size=0, spot_size=2.4, spot_blend=0.15)
        self.assert_like_cycles(0.02, 0.08)

    def test_a_panel_has_the_power_that_it_has_in_cycles(self):
        self.ground()
        add_light("AREA", 500, (2, -1, 4), (0, 0.5, 0), shape="RECTANGLE", size=2, size_y=1)
        self.assert_like_cycles(0.01, 0.05)

    def test_the_world_lights_and_is_seen(self):
        self.ground((0.5, 0.6, 0.8))
        self.assert_like_cycles(0.01, 0.05)

    def test_an_image_of_the_world_is_where_cycles_has_it(self):
        scene = empty()
        ball("mirror", material(Metallic=1, Roughness=0, Base_Color=(1, 1, 1, 1)), radius=1.6)
        sky = np.ones((32, 64, 4))
        sky[..., 0], sky[..., 1] = np.linspace(0, 2, 64)[None], np.linspace(1, 0, 32)[:, None]
        sky[:, 10:14, :3] = (0, 0, 3)
        tree = scene.world.node_tree
        node, mapping, place = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexEnvironment", "Mapping", "TexCoord"))
        node.image = image("sky.exr", sky, "Linear", is_float=True)
        mapping.inputs["Rotation"].default_value = (0, 0, 0.7)
        tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
        tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
        tree.links.new(node.outputs["Color"], tree.nodes["Background"].inputs["Color"])
        self.assert_like_cycles(0.01, 0.05)


class Cameras(Case):
    def thing(self):
        scene = empty((0.5, 0.5, 0.5))
        grid("ground", 20, diffuse(GROUND))
        ball("ball", diffuse((0.9, 0.1, 0.1, 1)))
        return scene

    def test_a_shifted_camera(self):
        camera = self.thing().camera.data
        camera.shift_x, camera.shift_y = 0.25, -0.125  # whole pixels
        self.assert_like_cycles(0.01, 0.05)

    def test_a_shifted_orthographic_camera(self):
        camera = self.thing().camera.data
        camera.type, camera.ortho_scale, camera.shift_x = "ORTHO", 7, 0.125
        self.assert_like_cycles(0.01, 0.05)

    def test_depth_of_field(self):
        camera = self.thing().camera.data
        camera.dof.use_dof, camera.dof.focus_distance, camera.dof.aperture_fstop = True, 5, 0.1
        self.assert_like_cycles(0.01, 0.05)

    def test_a_part_of_the_picture_is_that_part(self):
        scene = self.thing()
        scene.farlight.denoise = "off"
        whole = render()
        scene.render.use_border, scene.render.use_crop_to_border = True, True
        scene.render.border_min_x, scene.render.border_max_x, scene.render.border_min_y, scene.render.border_max_y = 0.25, 0.75, 0.5, 1
        part = render()
        self.assertEqual(part.shape, (36, 48, 4))
        np.testing.assert_array_equal(part, whole[:36, 24:72])

    def test_a_transparent_film(self):
        scene = self.thing()
        bpy.data.objects.remove(bpy.data.objects["ground"])
        scene.render.film_transparent = True
        self.assert_like_cycles(0.01, 0.05)


class Things(Case):
    def test_instances_modifiers_and_text(self):
        empty((0.5, 0.5, 0.5))
        part, ground = ball("ball", diffuse((0.9, 0.1, 0.1, 1)), (0, 0, 0), 0.3), grid("ground", 8, diffuse(GROUND))
        finer = ground.modifiers.new("finer", "SUBSURF")
        finer.levels = finer.render_levels = 2
        finer.subdivision_type = "SIMPLE"
        part.parent, ground.instance_type = ground, "VERTS"
        text = bpy.data.curves.new("text", "FONT")
        text.body, text.extrude = "Ab", 0.2
        text.materials.append(diffuse((0.1, 0.1, 0.9, 1)))
        put("text", text, (0, -2, 1), (1.2, 0, 0))
        self.assert_like_cycles(0.01, 0.05)
        made = next(iter(mirror._mirrors.values())).scene
        self.assertEqual(len(made.objects("mesh")), 3, "the balls are one mesh")
        self.assertEqual(len(made.objects("node")), 25 + 2 + 2)  # and the root, and the camera

    def test_materials_of_faces_and_colours_of_corners(self):
        empty((0.5, 0.5, 0.5))
        thing = ball("ball", diffuse((0.9, 0.1, 0.1, 1)), radius=1.5)
        thing.data.materials.append(diffuse((0.1, 0.1, 0.9, 1)))
        count = len(thing.data.polygons)
        thing.data.polygons.foreach_set("material_index", np.arange(count) // 7 % 2)
        painted = diffuse((1, 1, 1, 1))
        tree = painted.node_tree
        node = tree.nodes.new("ShaderNodeVertexColor")
        node.layer_name = "paint"
        tree.links.new(node.outputs["Color"], scenes.shader(painted).inputs["Color"])
        ground = grid("ground", 20, painted)
        ground.data.color_attributes.new("paint", "FLOAT_COLOR", "CORNER").data.foreach_set(
            "color", (1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1, 1, 1, 1, 1))
        self.assert_like_cycles(0.01, 0.05)

    def balls(self, *materials):
        """In a row, all with the same light."""
        scene = empty((0.6, 0.6, 0.6))
        scene.farlight.clamp = 0
        grid("ground", 20, diffuse(GROUND))
        for place, values in enumerate(materials):
            made = material(f"material {place}", **values)
            scenes.shader(made).distribution = "MULTI_GGX"  # with the light that facets give each other, as here
            ball(f"ball {place}", made, (2 * (2 * place - len(materials) + 1), 0, 1), 1)
        return scene

    def panel(self):
        add_light("AREA", 300, (2, -2, 5), (0.3, 0.3, 0), shape="SQUARE", size=2)

    def test_metal_alpha_and_emission(self):
        self.balls({"Metallic": 1, "Roughness": 0.3, "Base_Color": (0.9, 0.7, 0.3, 1)},
                   {"Base_Color": (0.1, 0.6, 0.1, 1), "Alpha": 0.5, "Specular": 0.0},
                   {"Emission": (1, 0.5, 0.1, 1), "Emission_Strength": 2, "Base_Color": (0, 0, 0, 1), "Specular": 0.0})
        self.panel()
        self.assert_like_cycles(0.01, 0.05)

    def test_plastic_and_varnish(self):
        self.balls({"Base_Color": (0.2, 0.3, 0.8, 1), "Roughness": 0.2, "Specular": 0.9},
                   {"Base_Color": (0.6, 0.05, 0.05, 1), "Clearcoat": 1, "Roughness": 0.6})
        self.panel()
        # Cycles 3.x scatters all light below a mirroring surface, and not what that lets through: to 8 % at grazing angles.
        self.assert_like_cycles(0.03, 0.12)

    def test_glass_below_the_sky(self):
        # Without lights: theirs go straight through glass here, and make caustics in Cycles. What of the sky is seen through the
        # ball from below it is 7 % more here.
        self.balls({"Transmission": 1, "Roughness": 0, "IOR": 1.45, "Base_Color": (1, 1, 1, 1)})
        self.assert_like_cycles(0.02, 0.1)

    def from_above(self):
        scene = empty()
        scene.camera.location, scene.camera.rotation_euler = (0, 0, 8), (0, 0, 0)
        row, column = np.mgrid[:64, :64] / 64
        return row, column, np.ones((64, 64, 4))

    def test_textures(self):
        row, column, tiles = self.from_above()
        tiles[..., 0], tiles[..., 1], tiles[..., 2] = column, row, ((column * 4).astype(int) + (row * 4).astype(int)) % 2
        # Between texels of sRGB Cycles takes the mean of sRGB's numbers, here it is that of light: each is seen without the other.
        for x, space, interpolation in ((-2, "sRGB", "Closest"), (2, "Non-Color", "Linear")):
            tiled = diffuse((1, 1, 1, 1))
            node = textured(tiled, "Color", image(f"{space}.png", tiles, space), interpolation)
            tree = tiled.node_tree
            mapping, coordinates = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("Mapping", "UVMap"))
            for name, value in (("Scale", (2, 1.5, 1)), ("Rotation", (0, 0, 0.4)), ("Location", (0.1, 0.2, 0))):
                mapping.inputs[name].default_value = value
            tree.links.new(coordinates.outputs["UV"], mapping.inputs["Vector"])
            tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
            grid("ground", 4, tiled, (x, 0, 0))
        add_light("SUN", 3, turn=(0.8, 0.5, 0), angle=0)
        self.assert_like_cycles(0.01, 0.05)

    def test_a_normal_map(self):
        row, column, bumps = self.from_above()
        bumps[..., 0], bumps[..., 1] = 0.5 + 0.15 * np.sin(column * 12), 0.5 + 0.2 * np.cos(row * 9)
        bumpy = diffuse(GROUND)
        node, tree = textured(bumpy, "Normal", image("bumps.png", bumps, "Non-Color")), bumpy.node_tree
        normals = tree.nodes.new("ShaderNodeNormalMap")
        tree.links.new(node.outputs["Color"], normals.inputs["Color"])
        tree.links.new(normals.outputs["Normal"], scenes.shader(bumpy).inputs["Normal"])
        grid("ground", 8, bumpy)
        # Lit and seen from above: Cycles darkens bumps by 10 % that face a light more than their surface does, and bends normals
        # whose mirror images lie below it.
        add_light("SUN", 3, angle=0)
        self.assert_like_cycles(0.01, 0.05)

    def test_textures_of_metal(self):
        row, column, ramp = self.from_above()
        bpy.context.scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.3, 0.4, 0.5, 1)
        ramp[..., :3] = column[..., None]
        steel, flat = material("steel"), ramp.copy()
        flat[..., :3] = (row[..., None] * 2).astype(int)
        scenes.shader(steel).distribution, scenes.shader(steel).inputs["Specular"].default_value = "MULTI_GGX", 0
        textured(steel, "Roughness", image("ramp.png", ramp, "Non-Color"))
        textured(steel, "Metallic", image("flat.png", flat, "Non-Color"))
        grid("ground", 8, steel)
        add_light("SUN", 3, turn=(0.8, 0.5, 0), angle=0)
        self.assert_like_cycles(0.015, 0.1)  # the mirrored sun lies between two textures' halves, 6 % of its part

    def told(self):
        """What is said of the picture."""
        with unittest.mock.patch.object(engine.FarlightEngine, "_warn") as told:
            self.picture = render()
        return [one.args[0] for one in told.call_args_list]

    def test_what_is_not_known_is_told(self):
        empty((0.5, 0.5, 0.5))
        odd = material("odd")
        tree = odd.node_tree
        node = tree.nodes.new("ShaderNodeWireframe")
        tree.links.new(node.outputs[0], tree.nodes["Principled BSDF"].inputs["Base Color"])
        grid("ground", 8, odd)
        self.assertIn("odd: Base Color comes from the unsupported node Wireframe: its own value is used", self.told())
        self.assertIn("odd: Base Color comes from the unsupported node Wireframe: its own value is used", self.told(), "again")

    def test_procedural_textures_are_baked_and_are_those_of_cycles(self):
        self.from_above()
        ramped = procedural("Noise", "Fac", Scale=3)
        tree = ramped.node_tree
        ramp, noise = tree.nodes.new("ShaderNodeValToRGB"), tree.nodes["Noise Texture"]
        for element, place, colour in zip(ramp.color_ramp.elements, (0.4, 0.6), ((0.8, 0.1, 0, 1), (0, 0.2, 0.7, 1))):
            element.position, element.color = place, colour
        tree.links.new(noise.outputs["Fac"], ramp.inputs["Fac"])
        tree.links.new(ramp.outputs["Color"], scenes.shader(ramped).inputs["Color"])
        for place, made in enumerate((ramped, procedural("Voronoi", Scale=3), procedural("Checker", Scale=4, Color1=(0.9, 0.1, 0.1, 1)),
                                      procedural("Gradient"), procedural("Wave", Scale=1, Distortion=2), procedural("Noise", Scale=2))):
            made.name = f"made {place}"
            grid(f"square {place}", 1.9, made, (2 * (place % 3) - 2, 2 * (place // 3) - 1, 0))
        add_light("SUN", 3, turn=(0.8, 0.5, 0), angle=0)
        self.assert_like_cycles(0.01, 0.05)
        with unittest.mock.patch.object(bake.Surface, "picture") as baked:
            self.assertEqual(self.told(), [f"made {place}: the result of its nodes is baked into pictures of 1024 x 1024 texels" for place in range(6)])
        baked.assert_not_called()  # nothing has changed

    def test_a_checker_is_baked_for_each_mesh_that_has_it(self):
        empty((0.5, 0.5, 0.5))
        tiles = procedural("Checker", Scale=8, Color1=(0.9, 0.9, 0.9, 1), Color2=(0.1, 0.1, 0.1, 1))
        grid("ground", 12, tiles)
        cube("cube", tiles, (1.5, 0, 0.8))
        self.assert_like_cycles(0.01, 0.1)  # squares of three pixels: texels at the edges of a face are wider than the filter

    def test_a_checker_on_a_ball_has_the_colours_where_cycles_has_them(self):
        empty((0.5, 0.5, 0.5))
        ball("ball", procedural("Checker", Scale=3, Color1=(0.9, 0.1, 0.1, 1), Color2=(0.1, 0.1, 0.9, 1)), radius=1.8)
        self.assert_like_cycles(0.01, 0.05)

    def test_a_mesh_without_a_uv_map_has_the_mean_of_a_procedural_texture(self):
        self.from_above()
        bare = grid("bare", 4, procedural("Checker", Scale=8, Color1=(0.8, 0.2, 0, 1), Color2=(0, 0.4, 0.6, 1)))
        bare.data.uv_layers.remove(bare.data.uv_layers[0])
        add_light("SUN", math.pi, angle=0)
        self.assertIn("diffuse: a mesh without a UV map has the mean of its nodes' result", self.told())
        np.testing.assert_allclose(self.picture[36, 48, :3], (0.4, 0.3, 0.3), atol=0.02)  # three deviations of 4096 samples

    def test_bumps_of_noise(self):
        self.from_above()
        bumpy = material("bumpy", Specular=0.0, Roughness=1.0)
        tree = bumpy.node_tree
        noise, bump = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeBump")
        noise.inputs["Scale"].default_value, bump.inputs["Distance"].default_value = 3, 0.3
        tree.links.new(noise.outputs["Fac"], bump.inputs["Height"])
        tree.links.new(bump.outputs["Normal"], scenes.shader(bumpy).inputs["Normal"])
        grid("ground", 5, bumpy)
        add_light("SUN", 3, turn=(0.6, 0, 0), angle=0)
        self.assert_like_cycles(0.015, 0.05)  # fully rough plastic: 1 %

    def row(self, *materials):
        scene = self.balls()
        scene.camera.location, scene.camera.rotation_euler, scene.camera.data.lens = (0, -13, 3.5), (1.37, 0, 0), 60
        for place, made in enumerate(materials):
            ball(f"ball {place}", made(), (2.2 * (place - 1), 0, 1), 1)  # made here, as an empty scene has no materials
        self.panel()

    RED, BLUE, GREEN = (0.8, 0.1, 0.05, 1), (0.05, 0.1, 0.8, 1), (0.2, 0.6, 0.2, 1)

    def test_mixed_shaders(self):
        red, white = ("BsdfDiffuse", {"Color": self.RED}), ("BsdfGlossy", {"Color": (1, 1, 1, 1), "Roughness": 0.3})
        metal = ("BsdfPrincipled", {"Base Color": self.BLUE, "Roughness": 0.4, "Metallic": 1.0})
        for case in ((("Mix", red, white, 0.2), ("Mix", ("BsdfPrincipled", {"Base Color": self.RED, "Roughness": 0.4}), metal, 0.5),
                      ("Mix", ("BsdfTransparent", {}), ("BsdfDiffuse", {"Color": self.BLUE}), 0.6)),
                     (("Add", ("Emission", {"Color": self.GREEN, "Strength": 0.5}), red, None), ("Mix", red, white, "Fresnel"),
                      ("Mix", red, ("BsdfTranslucent", {"Color": self.BLUE}), 0.5))):
            with self.subTest(case):
                self.row(*(lambda one=one: mixture(one[0], *one[1:3], share=one[3]) for one in case))
                # Transparent's specks, of 64 samples, are 4 % of a part.
                self.assert_like_cycles(0.015, 0.08)

    def test_a_mask_mixes_two_materials(self):
        self.from_above()
        made = mixture("Mix", ("BsdfDiffuse", {"Color": self.RED}), ("BsdfDiffuse", {"Color": self.BLUE}))
        procedural("Checker", "Fac", made, "Fac", Scale=4)
        cut = mixture("Mix", ("BsdfTransparent", {}), ("BsdfDiffuse", {"Color": self.GREEN}))
        procedural("Checker", "Fac", cut, "Fac", Scale=4)
        grid("mixed", 3, made, (-1.6, 0, 0))
        grid("cut", 3, cut, (1.6, 0, 0))
        add_light("SUN", 3, turn=(0.8, 0.5, 0), angle=0)
        self.assert_like_cycles(0.01, 0.05)

    def test_what_cannot_be_mixed_is_told(self):
        empty((0.5, 0.5, 0.5))
        grid("ground", 8, mixture("Mix", ("BsdfDiffuse", {"Color": self.RED}), ("BsdfToon", {}), share=0.5))
        ball("ball", mixture("Add", ("BsdfPrincipled", {}), ("BsdfGlass", {})))
        self.assertEqual(sorted(self.told()), ["mixture.001: Add Shader adds Principled and Glass: Principled alone is shown",
                                               "mixture: the node Toon BSDF is unsupported and is left out of Mix Shader"])

    def paint(self):
        """A group that is Lambert's, of a colour that it darkens."""
        tree, start, end = scenes.group("paint", {"Colour": "Color", "Share": "Float"}, {"Shader": "Shader"})
        lambert, darker = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeMixRGB")
        darker.blend_type, darker.inputs["Color2"].default_value = "MULTIPLY", (0.5, 0.5, 0.5, 1)
        tree.links.new(start.outputs["Colour"], darker.inputs["Color1"])
        tree.links.new(start.outputs["Share"], darker.inputs["Fac"])
        tree.links.new(darker.outputs[0], lambert.inputs["Color"])
        tree.links.new(lambert.outputs[0], end.inputs["Shader"])
        return tree

    def two_coats(self, paint):
        """A group of two nodes of another one, mixed by a number from without that crosses a reroute."""
        tree, start, end = scenes.group("coats", {"Share": "Float", "Colour": "Color"}, {"Shader": "Shader"})
        mix, bend = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("NodeReroute")
        first = scenes.use_group(tree, paint, Share=0.0)
        tree.links.new(start.outputs["Colour"], first.inputs["Colour"])
        tree.links.new(first.outputs[0], mix.inputs[1])
        tree.links.new(scenes.use_group(tree, paint, Colour=self.GREEN, Share=1.0).outputs[0], mix.inputs[2])
        tree.links.new(start.outputs["Share"], bend.inputs[0])
        tree.links.new(bend.outputs[0], mix.inputs["Fac"])
        tree.links.new(mix.outputs[0], end.inputs["Shader"])
        return tree

    def grouped(self, tree, **values):
        made = diffuse((1, 1, 1, 1))
        node = scenes.use_group(made.node_tree, tree, **values)
        made.node_tree.links.new(node.outputs[0], made.node_tree.nodes["Material Output"].inputs["Surface"])
        return made

    def test_shaders_in_groups_and_in_groups_within_them(self):
        self.row(lambda: self.grouped(self.paint(), Colour=self.RED, Share=0.5),
                 lambda: self.grouped(bpy.data.node_groups["paint"], Colour=self.BLUE, Share=0.0),
                 lambda: self.grouped(self.two_coats(bpy.data.node_groups["paint"]), Colour=self.BLUE, Share=0.4))
        self.assert_like_cycles(0.01, 0.05)
        self.assertEqual(self.told(), [])

    def tiles(self):
        """A group whose number is a texture's scale."""
        tree, start, end = scenes.group("tiles", {"Scale": "Float", "Colour": "Color"}, {"Fac": "Float", "Colour": "Color"})
        checker = tree.nodes.new("ShaderNodeTexChecker")
        for name, to in (("Scale", "Scale"), ("Colour", "Color1")):
            tree.links.new(start.outputs[name], checker.inputs[to])
        for name, to in (("Fac", "Fac"), ("Color", "Colour")):
            tree.links.new(checker.outputs[name], end.inputs[to])
        return tree

    def test_textures_in_a_group_are_baked_with_the_values_that_each_of_its_nodes_has(self):
        self.from_above()
        tree, made = self.tiles(), mixture("Mix", ("BsdfDiffuse", {}), ("BsdfDiffuse", {"Color": self.BLUE}))
        links, mix = made.node_tree.links, scenes.shader(made)
        wide, narrow = (scenes.use_group(made.node_tree, tree, Scale=scale, Colour=self.RED) for scale in (2, 4))
        links.new(wide.outputs["Colour"], mix.inputs[1].links[0].from_node.inputs["Color"])
        links.new(narrow.outputs["Fac"], mix.inputs["Fac"])
        grid("ground", 4, made)
        add_light("SUN", 3, turn=(0.8, 0.5, 0), angle=0)
        self.assert_like_cycles(0.01, 0.05)
        narrow.inputs["Scale"].default_value = 8  # of one node of the group
        self.assert_like_cycles(0.01, 0.05)
        tree.nodes["Checker Texture"].inputs["Color2"].default_value = self.GREEN  # within the group
        self.assert_like_cycles(0.01, 0.05)

    def test_muted_nodes_and_links_hand_on_what_they_do_in_cycles(self):
        def muted_mix():
            made = diffuse(self.RED)
            mix = made.node_tree.nodes.new("ShaderNodeMixRGB")
            mix.mute, mix.inputs["Color1"].default_value = True, self.GREEN
            made.node_tree.links.new(mix.outputs[0], scenes.shader(made).inputs["Color"])
            colour = made.node_tree.nodes.new("ShaderNodeRGB")
            colour.outputs[0].default_value = self.BLUE
            made.node_tree.links.new(colour.outputs[0], mix.inputs["Color1"])
            return made

        def muted_link():
            made = procedural("Noise", of=diffuse(self.RED))
            made.node_tree.links[-1].is_muted = True
            return made

        def muted_group():
            made = diffuse((1, 1, 1, 1))
            node = scenes.use_group(made.node_tree, self.tiles(), Colour=self.GREEN)
            node.mute = True
            made.node_tree.links.new(node.outputs["Colour"], scenes.shader(made).inputs["Color"])
            return made

        def loose_reroute():
            made = diffuse(self.RED)
            made.node_tree.links.new(made.node_tree.nodes.new("NodeReroute").outputs[0], scenes.shader(made).inputs["Color"])
            return made
        for row in ((muted_mix, muted_link, muted_group), (loose_reroute,)):
            with self.subTest(row):
                self.row(*row)
                self.assert_like_cycles(0.01, 0.05)

    def test_sheen_is_as_strong_as_in_cycles(self):
        self.row(*(lambda one=one: material("cloth", Base_Color=one, Specular=0.0, Roughness=1.0, Sheen=1.0, Sheen_Tint=0.0)
                   for one in ((0.1, 0.1, 0.3, 1), (0.5, 0.1, 0.1, 1), (0.02, 0.02, 0.02, 1))))
        # Cycles' sends back most of what comes from behind the surface's horizon, fibres less: 0.2 of a dark ball's rim.
        self.assert_like_cycles(0.03, 0.25)

    def test_a_volume_alone_has_no_surface(self):
        empty((0.6, 0.6, 0.6))
        grid("ground", 20, diffuse(GROUND))
        bare = render()
        fog = cube("fog", without_surface("Scatter"))
        self.assertEqual(self.told(), ["volume: its volume is not drawn: render it with Cycles"])
        np.testing.assert_array_equal(self.picture, bare)
        bpy.data.objects.remove(fog)
        cube("blue air", without_surface("Absorption", Color=(0.2, 0.6, 0.9, 1), Density=1))
        # What is seen through the ground's shadow is off by the thickness that shadow rays take.
        self.assert_like_cycles(0.05, 0.3)

    def test_what_is_not_drawn_is_told_once(self):
        empty((0.5, 0.5, 0.5))
        foggy = material("foggy", Subsurface=0.5)
        tree = foggy.node_tree
        tree.links.new(tree.nodes.new("ShaderNodeVolumeScatter").outputs[0], tree.nodes["Material Output"].inputs["Volume"])
        ground = grid("ground", 8, foggy)
        ground.modifiers.new("sparks", "PARTICLE_SYSTEM")
        ground.particle_systems[0].settings.render_type = "HALO"
        put("cloud", bpy.data.volumes.new("cloud"))
        put("bald", bpy.data.hair_curves.new("bald"))
        with unittest.mock.patch.object(engine.FarlightEngine, "_warn") as told:
            render()
        self.assertEqual(sorted(one.args[0] for one in told.call_args_list), [
            "cloud: volumes are not drawn: make a surface of it (modifier Volume to Mesh) or render it with Cycles",
            "foggy: Subsurface is left out", "foggy: its volume is not drawn: render it with Cycles",
            "ground: the halos of sparks are not drawn: render them as objects"])


class Strands(Case):
    """Beside Cycles' round hairs, which it calls thick. Here they are tubes with six sides, lit as if they were round: where one
    side lies in the shadow of itself fur is darker, by 1.4 % on average and 11 % of the part that has it the most."""

    def setUp(self):
        bpy.context.scene.cycles_curves.shape = "THICK"

    def fur(self, **values):
        scene = empty((0.6, 0.6, 0.6))
        grid("ground", 20, diffuse(GROUND))
        thing = ball("ball", diffuse((0.8, 0.8, 0.8, 1)), (0, 0, 1.2))
        thing.data.materials.append(diffuse((0.7, 0.35, 0.1, 1)))
        values = {"hair_length": 0.6, "material": 2, "radius_scale": 0.08, "brownian_factor": 0.05, **values}
        hairs(thing, 300, **values)
        add_light("SUN", 2, turn=(0.5, 0.3, 0), angle=0.1)
        return scene, thing

    def test_hairs_of_particles_have_the_thickness_and_the_texture_of_their_roots(self):
        _, thing = self.fur(child_type="SIMPLE", rendered_child_count=3, shape=-0.4, tip_radius=0.3, use_close_tip=False)
        halves = np.ones((8, 8, 4))
        halves[:, :4, 1:3], halves[:, 4:, :2] = 0.1, 0.1
        textured(thing.data.materials[1], "Color", image("halves.png", halves, "Non-Color"), "Closest")
        self.assert_like_cycles(0.025, 0.15)

    def test_hairs_of_instances_and_of_what_is_hidden(self):
        scene, thing = self.fur()
        group = bpy.data.collections.new("group")
        thing.users_collection[0].objects.unlink(thing)
        group.objects.link(thing)
        for place in ((-1.5, 0, 0), (2, 1, 0)):
            both = put("both", None, place, scale=(0.6, 0.6, 0.8))
            both.instance_type, both.instance_collection = "COLLECTION", group
        bald = ball("hidden", None, (0, -3, 0), 0.5)
        hairs(bald, 100, hair_length=0.5, radius_scale=0.1)
        bald.show_instancer_for_render = False
        self.assert_like_cycles(0.025, 0.15)
        self.assertEqual(len(next(iter(mirror._mirrors.values())).scene.objects("mesh")), 4, "the fur is stored once")

    def test_curves_and_points_that_move(self):
        scene = empty((0.6, 0.6, 0.6))
        grid("ground", 20, diffuse(GROUND))
        made = scenes.bow_and_points("bow", (-1.5, 0, 0))
        scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1
        for frame, x in ((1, -2), (3, 0)):
            made.location.x = x
            made.keyframe_insert("location", frame=frame)
        scene.frame_set(2)
        self.assert_like_cycles(0.02, 0.1)
        self.assertEqual(len(next(iter(mirror._mirrors.values())).scene.objects("spheres")), 1)

    def test_hairs_that_bend_while_the_shutter_is_open(self):
        scene = empty((0.6, 0.6, 0.6))
        grid("ground", 20, diffuse(GROUND))
        thing = grid("field", 3, diffuse((0.1, 0.6, 0.1, 1)), (0, 0, 1))
        hairs(thing, 60, hair_length=1, radius_scale=0.2, render_step=3, shape=0)
        thing.shape_key_add(name="rest")
        bowl = thing.shape_key_add(name="bowl")  # turns the hairs with their roots, these by 4 degrees each frame
        for point in bowl.data:
            point.co.z = 1.4 * point.co.x
        scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1
        for frame, value in ((1, -1), (3, 1)):
            bowl.slider_min = -1
            bowl.value = value
            bowl.keyframe_insert("value", frame=frame)
        scene.frame_set(2)
        self.assert_like_cycles(0.02, 0.1)
        blurred = render()
        scene.render.use_motion_blur = False
        self.assertGreater(np.abs(blocks(render()) - blocks(blurred)).max(), 0.05)

    def test_curves_that_bend_while_the_shutter_is_open(self):
        scene = empty((0.6, 0.6, 0.6))
        grid("ground", 20, diffuse(GROUND))
        made = scenes.bow_and_points("bow", (-1.5, 0, 0))
        curve = next(node for node in made.modifiers[0].node_group.nodes if node.bl_idname == "GeometryNodeCurvePrimitiveBezierSegment")
        for frame, x in ((1, -1), (3, 3)):
            for name, place in (("End", (x, 0, 2.2)), ("End Handle", (x / 2, 0, 1.5))):
                curve.inputs[name].default_value = place
                curve.inputs[name].keyframe_insert("default_value", frame=frame)
        scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1
        scene.frame_set(2)
        self.assert_like_cycles(0.01, 0.05)

    def test_what_does_not_bend_with_the_shutter_is_told(self):
        scene = empty()
        nodes = scenes.bow_and_points("bow").modifiers[0].node_group.nodes
        scene.farlight.samples, scene.render.use_motion_blur = 1, True
        for kind, key, values, told in (
                ("MeshLine", "Offset", ((0.2, 0, 0), (1, 0, 0)), "its points move in it while the shutter is open, and are drawn where they are at "
                 "the frame's time"),
                ("ResampleCurve", "Count", (5, 50), "its points differ in number from time to time: its motion leaves out how it deforms")):
            value = next(node for node in nodes if node.bl_idname == f"GeometryNode{kind}").inputs[key]
            for frame, value.default_value in zip((1, 3), values):
                value.keyframe_insert("default_value", frame=frame)
            scene.frame_set(2)
            with self.subTest(kind), unittest.mock.patch.object(engine.FarlightEngine, "_warn") as warned:
                render()
                self.assertIn(f"bow: {told}", [one.args[0] for one in warned.call_args_list])

    def test_hairs_of_an_object_that_moves_are_not_sent_again(self):
        scene, thing = self.fur()
        scene.farlight.samples = 1
        render()
        only = session._sessions[None, None]
        before = only.wait(only._client.stats()).clients[0].bulk_bytes
        thing.location.x += 0.7
        render()
        self.assertEqual(only.wait(only._client.stats()).clients[0].bulk_bytes, before)


class Motion(Case):
    """Keys 2 frames apart, seen halfway with the shutter open for one frame: half of what the keys say."""

    def thing(self):
        scene = empty((0.5, 0.5, 0.5))
        scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1
        scene.frame_set(2)
        grid("ground", 20, diffuse(GROUND))
        return scene, ball("ball", diffuse((0.9, 0.1, 0.1, 1)))

    def test_things_that_move_and_rotate(self):
        _, thing = self.thing()
        self.keys(thing, "location", (-2, 0, 1), (2, 1, 1))
        bar = grid("bar", 3, diffuse((0.1, 0.1, 0.9, 1)), (0, 2, 2))
        self.keys(bar, "rotation_euler", (1, 0, 0), (1, 2, 0))
        self.assert_like_cycles(0.01, 0.05)

    def soft(self):
        scene, thing = self.thing()
        thing.location.z = 1.5
        thing.shape_key_add(name="rest")
        wide = thing.shape_key_add(name="wide")
        for point in wide.data:
            point.co.x *= 2.5
        self.keys(wide, "value", 0, 1)
        return scene, thing

    def test_instances_of_what_deforms(self):
        _, thing = self.soft()
        put("other", thing.data, (0, 3, 2))
        self.assert_like_cycles(0.01, 0.05)

    def test_a_camera_that_moves(self):
        scene, _ = self.thing()
        self.keys(scene.camera, "location", (-1, -8, 3), (1, -8, 3))
        self.keys(scene.camera, "rotation_euler", (1.2, 0, 0.2), (1.2, 0.1, -0.2))
        self.assert_like_cycles(0.01, 0.05)

    def test_a_light_that_moves_is_in_the_middle_of_each_step(self):
        scene, _ = self.thing()  # Cycles blurs no lights: it renders the steps one by one
        scene.farlight.samples, scene.farlight.motion_steps = 64, 4
        self.keys(add_light("POINT", 500, shadow_soft_size=0.2), "location", (-3, -1, 4), (3, -1, 4))
        ours = blocks(render())
        scene.render.use_motion_blur = False
        theirs = np.zeros_like(ours)
        for part in (0.625, 0.875, 1.125, 1.375):
            scene.frame_set(1 + int(part), subframe=part % 1)
            theirs += blocks(render("CYCLES", 32)) / 4
        apart = np.abs(ours - theirs) / np.maximum(theirs, DARK)
        self.assertLess(apart.mean(), 0.01)
        self.assertLess(apart.max(), 0.05)

    def test_the_shutter_opens_when_blender_says(self):
        scene, thing = self.thing()
        scene.render.motion_blur_shutter = 0.02
        self.keys(thing, "location", (-2, 0, 1), (2, 0, 1))

        def middle():
            red = render()
            return np.average(np.arange(scenes.WIDTH), weights=np.clip(red[..., 0] - 2 * red[..., 1], 0, None).sum(axis=0))
        shifts = {}
        for place in ("START", "CENTER", "END"):
            scene.cycles.motion_blur_position = place
            scene.render.motion_blur_shutter = 0.5
            shifts[place] = middle()
        # A quarter of the 4 metres between the keys lies between neighbours, as half a frame is open.
        self.assertGreater(shifts["START"], shifts["CENTER"] + 2)
        self.assertGreater(shifts["CENTER"], shifts["END"] + 2)

    def test_the_same_motion_is_the_same_picture_and_is_not_sent_again(self):
        scene, _ = self.soft()
        first = render()
        made = next(iter(mirror._mirrors.values())).scene
        version = made.version
        np.testing.assert_array_equal(render(), first)
        self.assertEqual(made.version, version)
        scene.render.use_motion_blur = False
        self.assertGreater(np.abs(blocks(render()) - blocks(first)).max(), 0.01)  # five times the noise
        self.assertEqual(made.objects("clip") + made.objects("channel"), [])


class Settings(Case):
    def test_indirect_light_is_clamped_by_the_samples_unless_a_value_is_chosen(self):
        scene = empty()
        grid("ground", 20, diffuse(GROUND))
        ball("shining", material(Base_Color=(0, 0, 0, 1), Emission=(1, 1, 1, 1), Emission_Strength=20000), (0, 0, 1), 0.05)
        scene.farlight.denoise, chosen = "off", scene.farlight

        def picture(samples, clamp=None):
            chosen.samples, chosen.use_auto_clamp = samples, clamp is None
            chosen.clamp = 3 if clamp is None else clamp
            return render()
        for samples, clamp in ((8, 1.25), (32, 5), (96, 10)):
            with self.subTest(samples):
                for other in (3, 1.25 * clamp):
                    self.assertGreater(np.abs(picture(samples) - picture(samples, other)).max(), 0.01, f"{other} has no effect")
                np.testing.assert_array_equal(picture(samples), picture(samples, clamp))


class Passes(Case):
    def passes(self, engine, *names):
        """As the compositor has them."""
        scene = bpy.context.scene
        scene.render.engine = engine
        scene.use_nodes = True
        tree = scene.node_tree
        source = tree.nodes["Render Layers"]
        bpy.context.view_layer.update_render_passes()
        files = tree.nodes.new("CompositorNodeOutputFile")
        files.base_path = scenes.FOLDER.name
        files.format.file_format, files.format.color_depth = "OPEN_EXR", "32"
        files.file_slots.clear()
        for name in names:
            files.file_slots.new(name)
            tree.links.new(source.outputs[name], files.inputs[name])
        render(engine)
        tree.nodes.remove(files)
        scene.use_nodes = False
        return [load(pathlib.Path(scenes.FOLDER.name) / f"{name}0001.exr") for name in names]

    def test_depth_normal_and_albedo_arrive_in_the_compositor(self):
        scene = empty((0.5, 0.5, 0.5))
        scene.camera.location, scene.camera.rotation_euler = (0, 0, 8), (0, 0, 0)
        grid("ground", 4, diffuse((0.6, 0.3, 0.1, 1)), turn=(0.3, 0, 0))
        layer = bpy.context.view_layer
        layer.use_pass_z = layer.use_pass_normal = scene.farlight.use_pass_albedo = True
        depth, normal, albedo = self.passes("FARLIGHT", "Depth", "Normal", "Denoising Albedo")
        self.assertAlmostEqual(float(depth[36, 48, 0]), 8, delta=0.05)  # half a pixel of a slope
        self.assertEqual(float(depth[0, 0, 0]), 1e10)
        np.testing.assert_allclose(normal[36, 48, :3], (0, -math.sin(0.3), math.cos(0.3)), atol=1e-3)
        np.testing.assert_allclose(albedo[36, 48, :3], (0.6, 0.3, 0.1), atol=1e-3)

    def test_light_groups_are_passes_that_add_up_and_are_those_of_cycles(self):
        scene = empty((0.3, 0.3, 0.3))
        grid("ground", 20, diffuse(GROUND))
        ball("ball", diffuse((0.8, 0.8, 0.8, 1)))
        add_light("POINT", 500, (2, -2, 4), shadow_soft_size=0.2).lightgroup = "lamp"
        scene.world.lightgroup = "sky"
        scene.farlight.denoise = "off"
        layer = bpy.context.view_layer
        for name in ("lamp", "sky"):
            layer.lightgroups.add(name=name)
        names = ("Combined_lamp", "Combined_sky", "Image")
        found = {engine: [blocks(one[..., :3]) for one in self.passes(engine, *names)] for engine in ("FARLIGHT", "CYCLES")}
        lamp, sky, whole = found["FARLIGHT"]
        np.testing.assert_allclose(lamp + sky, whole, rtol=1e-4)
        for ours, theirs in zip(found["FARLIGHT"], found["CYCLES"]):
            self.assertLess((np.abs(ours - theirs) / np.maximum(theirs, DARK)).mean(), 0.02)

    def vectors(self, engine):
        """Height x width x 4, from a file: sockets of the compositor have three numbers."""
        width, height, channels = read_exr(scenes.rendered(engine, 16, "OPEN_EXR_MULTILAYER"))
        return np.stack([np.reshape(channels[f"ViewLayer.Vector.{axis}"], (height, width)) for axis in "XYZW"], axis=-1)

    def test_vectors_are_those_of_cycles(self):
        scene = empty((0.5, 0.5, 0.5))
        scene.frame_set(2)
        grid("ground", 8, diffuse(GROUND))
        thing = ball("ball", diffuse((0.9, 0.1, 0.1, 1)))
        thing.shape_key_add(name="rest")
        wide = thing.shape_key_add(name="wide")
        for point in wide.data:
            point.co.x *= 1.5
        self.keys(thing, "location", (-1, 0, 1), (1, 0.5, 1.5))
        self.keys(wide, "value", 0, 1)
        self.keys(scene.camera, "location", (-0.5, -8, 3), (1, -8, 3.5))
        self.keys(scene.camera, "rotation_euler", (1.2, 0, 0.1), (1.22, 0.1, -0.1))
        scene.camera.data.shift_x = 0.25
        without = render()
        bpy.context.view_layer.use_pass_vector = True
        ours, theirs = self.vectors("FARLIGHT"), self.vectors("CYCLES")
        np.testing.assert_allclose(render(), without, rtol=1e-6)
        for axis in range(4):
            self.assertGreater(np.abs(theirs[..., axis]).mean(), 1)
            # Cycles' is the mean of a pixel's samples, ours that of its first one: on edges, 2 % of all, these are of two surfaces.
            apart = np.sort(np.abs(ours - theirs)[..., axis], axis=None)
            self.assertLess(apart[:len(apart) * 95 // 100].mean(), 0.01, "pixels")
        scene.render.use_motion_blur = True
        _, _, channels = read_exr(scenes.rendered("FARLIGHT", 16, "OPEN_EXR_MULTILAYER"))
        self.assertEqual([name for name in channels if "Vector" in name], [])


class Sending(Case):
    """What the daemon receives, by its own count."""

    def received(self):
        only = session._sessions[None, None]
        stats = only.wait(only._client.stats())
        return stats.clients[0].received_bytes, stats.clients[0].bulk_bytes, only

    def moving(self):
        scene = empty((0.5, 0.5, 0.5))
        scene.farlight.samples = 1
        grid("ground", 20, diffuse(GROUND))
        thing = ball("ball", diffuse((0.9, 0.1, 0.1, 1)))
        for frame, x in ((1, -1), (3, 1)):
            thing.location.x = x
            thing.keyframe_insert("location", frame=frame)
        soft = grid("cloth", 3, diffuse((0.1, 0.1, 0.9, 1)), (0, 0, 2))
        soft.shape_key_add(name="rest")
        soft.shape_key_add(name="bent").data[0].co.z = 1
        return scene, thing, soft

    def test_the_same_scene_is_not_sent_again(self):
        self.moving()
        first = render()
        version = next(iter(mirror._mirrors.values())).scene.version
        before, bulk, _ = self.received()
        again = render()
        after, bulk_after, _ = self.received()
        np.testing.assert_array_equal(first, again)
        self.assertEqual(bulk_after, bulk)
        self.assertEqual(next(iter(mirror._mirrors.values())).scene.version, version)
        self.assertLess(after - before, 2000)  # a job, its cancel and credit

    def test_an_animation_sends_what_moves_alone(self):
        scene, _, soft = self.moving()
        render()
        before, bulk, _ = self.received()
        scene.frame_set(2)
        first = render()
        after, bulk_after, _ = self.received()
        self.assertEqual(bulk_after, bulk, "a ball that moves is a transform")
        self.assertLess(after - before, 3000)
        soft.data.shape_keys.key_blocks["bent"].value = 1
        second = render()
        self.assertEqual(self.received()[1] - bulk_after, 4 * (12 + 12), "positions and normals of four corners")
        self.assertGreater(np.abs(blocks(first) - blocks(second)).max(), 0.02)

    def test_an_animation_is_one_connection_and_its_frames_differ(self):
        scene, _, _ = self.moving()
        render()
        core = session._sessions[None, None]._client._core
        scene.frame_start, scene.frame_end = 1, 3
        scene.render.filepath = str(pathlib.Path(scenes.FOLDER.name) / "frame")
        bpy.ops.render.render(animation=True)
        pictures = [blocks(load(pathlib.Path(scenes.FOLDER.name) / f"frame{number:04}.exr")) for number in (1, 2, 3)]
        self.assertIs(session._sessions[None, None]._client._core, core)
        for one, next_one in zip(pictures, pictures[1:]):
            self.assertGreater(np.abs(one - next_one).max(), 0.05)

    def test_names_of_files_and_what_is_not_rendered_are_not_sent(self):
        empty()
        picture = image("secret.png", np.ones((4, 4, 4)))
        seen = diffuse((1, 1, 1, 1))
        seen.name = "seen material"
        textured(seen, "Color", picture)
        self.assertEqual(picture.name, "secret.png", "Blender's name of an image is its file's")
        thing = grid("seen object", 4, seen)
        thing["secret"] = "secret"
        grid("secret object", 1, material("secret material")).hide_render = True
        bpy.data.texts.new("secret text").write("secret")
        render()
        made = next(iter(mirror._mirrors.values())).scene
        sent = b"".join(bytes(fields.encode(edit)) for edit in made.edits_since(0))
        for word in ("seen object", "seen material"):
            self.assertIn(word.encode(), sent)
        for word in ("secret", scenes.FOLDER.name):
            self.assertNotIn(word.encode(), sent)

    def test_what_is_removed_is_gone(self):
        _, thing, _ = self.moving()
        render()
        bpy.data.objects.remove(thing)
        with_nothing = render()
        made = next(iter(mirror._mirrors.values())).scene
        self.assertEqual(made.find("node", "ball"), [])
        self.assertLess((with_nothing[..., 0] - with_nothing[..., 1]).max(), 0.3)  # of the ground; the ball is redder


class Trouble(Case):
    def test_a_job_that_is_cancelled_ends_at_the_daemon_too(self):
        scene = empty((0.5, 0.5, 0.5))
        grid("ground", 20, diffuse(GROUND))
        render()
        scene.farlight.samples = scene.farlight.step_samples = 65536
        start = time.monotonic()
        with self.asked(lambda: time.monotonic() > start + 1):
            render()
        self.assertLess(time.monotonic() - start, 60)  # all samples take longer
        only = session._sessions[None, None]
        self.assertEqual(only.wait(only._client.stats()).jobs, 0)
        scene.farlight.samples, scene.farlight.step_samples = 16, 16
        self.assertGreater(render()[..., :3].mean(), 0.1)

    def test_a_daemon_that_goes_away_is_told_and_the_next_render_finds_a_new_one(self):
        scene = empty((0.5, 0.5, 0.5))
        grid("ground", 20, diffuse(GROUND))
        first = render()
        link = session._sessions[None, None]._client._link
        scene.farlight.samples = scene.farlight.step_samples = 65536
        start = time.monotonic()

        def kill():
            if time.monotonic() > start + 1 and link.process.poll() is None:
                link.process.kill()
            return False
        with self.asked(kill), self.assertRaisesRegex(RuntimeError, "farlight: farlightd: the daemon closed the connection: farlightd was ended by signal 9"):
            render()
        scene.farlight.samples, scene.farlight.step_samples = 64, 32
        np.testing.assert_array_equal(render(), first)

    def test_an_address_without_a_daemon(self):
        scene = empty()
        scene.farlight.server = "unix:/nowhere/socket"
        with self.assertRaisesRegex(RuntimeError, "farlight: unix:/nowhere/socket: no daemon can be reached: No such file"):
            render()

    def test_a_scene_without_a_camera(self):
        scene = empty()
        bpy.data.objects.remove(scene.camera)
        with self.assertRaises(RuntimeError):
            render()


# The other host is this one. It has no words but those that ssh and a shell have.
SSH = """#!/bin/sh
test "$1 $2" = "-T --" || exit 2
case $3 in
there) shift 3; exec "$@" ;;
bare) echo "bash: line 1: $4: command not found" >&2; exit 127 ;;
refusing) echo "ssh: connect to host $3 port 22: Connection refused" >&2; exit 255 ;;
*) echo "ssh: Could not resolve hostname $3: Name or service not known" >&2; exit 255 ;;
esac
"""


class Elsewhere(Case):
    """A daemon with a socket, here or behind ssh."""

    def setUp(self):
        programs, folder = os.environ["FARLIGHT_LIBEXEC"], pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (folder / "ssh").write_text(SSH)
        (folder / "ssh").chmod(0o755)
        self.enterContext(unittest.mock.patch.dict(os.environ, {"PATH": f"{folder}:{programs}:{os.environ['PATH']}"}))
        self.path = folder / "socket"
        daemon = self.enterContext(subprocess.Popen([f"{programs}/farlightd", "--listen", f"unix:{self.path}"], stdout=subprocess.PIPE))
        self.addCleanup(daemon.kill)
        self.addCleanup(session.close_all)
        self.assertIn(b"READY", daemon.stdout.readline())
        self.scene = empty((0.5, 0.5, 0.5))
        grid("ground", 20, diffuse(GROUND))

    def render_by(self, server):
        self.scene.farlight.server = server
        return render()

    def test_a_daemon_makes_the_same_picture_of_ones_own_behind_a_socket_and_behind_ssh(self):
        own = render()
        for server in (f"unix:{self.path}", f"ssh:there:{self.path}"):
            np.testing.assert_array_equal(self.render_by(server), own)
        link = session._sessions[f"ssh:there:{self.path}", None]._client._link
        self.assertEqual(pathlib.Path(link.process.args[0]).name, "ssh")
        session.close_all()
        self.assertIsNotNone(link.process.poll(), "ssh has not ended")

    def test_an_ssh_that_fails_is_named_with_its_reason_and_what_to_try(self):
        usual = "unix:/run/farlight/farlight.sock"
        for server, at, words in (("ssh:nowhere", usual, "ssh ended with status 255: Could not resolve hostname nowhere: Name or service "),
                                  ("ssh:refusing", usual, "ssh ended with status 255: connect to host refusing port 22: Connection ref"),
                                  ("ssh:bare", usual, "ssh ended with status 127: bash: line 1: farlight: command not found; "),
                                  ("ssh:there:/no/socket", "unix:/no/socket", "ssh ended with status 75: farlight: unix:/no/socket: cannot reach "
                                   "a daemon: No such file or directory")):
            with self.subTest(server), self.assertRaises(RuntimeError) as raised:
                self.render_by(server)
            told, host = str(raised.exception), server.split(":")[1]
            self.assertIn(f"farlight: {server}: no daemon can be reached: {words}", told)
            self.assertIn(f"; try 'ssh {host} farlight ping --count 1 --server {at}' in a terminal", told)
        for server in ("ssh:", "ssh:-oProxyCommand=x", "ssh:there:/a;b"):
            with self.subTest(server), self.assertRaisesRegex(RuntimeError, r"is not ssh:HOST\[:SOCKET\]"):
                self.render_by(server)

    def test_an_ssh_that_ends_within_a_frame_leaves_what_has_come_and_the_next_render_connects_again(self):
        server = f"ssh:there:{self.path}"
        first = self.render_by(server)
        process = session._sessions[server, None]._client._link.process
        self.scene.farlight.samples = 65536

        def kill():
            if written.call_count >= 2 and process.poll() is None:
                process.kill()
            return False
        with unittest.mock.patch.object(engine, "_write", wraps=engine._write) as written, self.asked(kill), \
                self.assertRaises(RuntimeError) as raised:
            render()
        self.assertIn(f"farlight: {server}: the daemon closed the connection", str(raised.exception))
        self.assertIn(": ssh was ended by signal 9; render again, which connects again and sends everything", str(raised.exception))
        left = pathlib.Path(scenes.FOLDER.name) / "left.exr"
        bpy.data.images["Render Result"].save_render(str(left))
        np.testing.assert_allclose(blocks(load(left)), blocks(first), atol=0.02)  # noise of 64 samples is less than 0.01
        with farlight.connect(f"unix:{self.path}") as beside:
            until = time.monotonic() + 60
            while beside.stats().jobs and time.monotonic() < until:
                time.sleep(0.05)
            self.assertEqual(beside.stats().jobs, 0, "the job goes on without a client")
        self.scene.farlight.samples = 64
        np.testing.assert_array_equal(render(), first)


def main():
    os.environ["FARLIGHT_LIBEXEC"] = BUILD
    names = sys.argv[sys.argv.index("--") + 2:]
    farlight_blender.register()
    loader = unittest.TestLoader()
    loader.testNamePatterns = [f"*{name}*" for name in names] or None
    result = unittest.TextTestRunner(stream=sys.stderr, verbosity=2).run(loader.loadTestsFromModule(sys.modules[__name__]))
    farlight_blender.unregister()
    sys.exit(not result.wasSuccessful())


if __name__ == "__main__":
    main()
