#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What farlight-import makes of the formats that it reads through Assimp: one quad in all of them, colours, materials, cameras,
lights, skins, morph targets, clips and points, and what it says of files that are broken."""
import io
import math
import os
import struct
import unittest
import zipfile

import importer
from farlight_test import LONG, SHARED_SCENES, Case, daemon_pose, needs_shared_scenes
from importer import (SET_CAMERA, SET_LIGHT, SET_MATERIAL, SET_MESH, SET_NODE, SET_SKIN, SET_SPHERES, SET_TEXTURE)

RED, GREEN, BLUE = (255, 0, 0), (0, 255, 0), (0, 0, 255)
CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
PPM = b"P6\n2 2\n255\n" + bytes((255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255))


def ply(corners=CORNERS, faces=((0, 1, 2, 3),), colours=None, form="ascii"):
    head = f"ply\nformat {form} 1.0\nelement vertex {len(corners)}\n" + "".join(f"property float {c}\n" for c in "xyz")
    if colours:
        head += "".join(f"property uchar {c}\n" for c in ("red", "green", "blue"))
    if faces:
        head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\n"
    head += "end_header\n"
    if form == "ascii":
        rows = [" ".join(map(str, tuple(place) + (tuple(colours[i]) if colours else ()))) for i, place in enumerate(corners)]
        return head + "".join(row + "\n" for row in rows + [" ".join(map(str, (len(face), *face))) for face in faces or ()])
    order = "<" if "little" in form else ">"
    body = b"".join(struct.pack(order + "3f", *place) + bytes(colours[i] if colours else ()) for i, place in enumerate(corners))
    return head.encode() + body + b"".join(struct.pack(f"{order}B{len(face)}i", len(face), *face) for face in faces or ())


def triangles_of(corners):
    return ((corners[0], corners[1], corners[2]), (corners[0], corners[2], corners[3]))


def stl_text(corners):
    facets = "".join("facet normal 0 0 1\nouter loop\n" + "".join("vertex %g %g %g\n" % place for place in triangle) +
                     "endloop\nendfacet\n" for triangle in triangles_of(corners))
    return f"solid quad\n{facets}endsolid quad\n"


def stl_bytes(corners):
    facets = [struct.pack("<12fH", 0, 0, 1, *(x for place in triangle for x in place), 0) for triangle in triangles_of(corners)]
    return b"\0" * 80 + struct.pack("<I", len(facets)) + b"".join(facets)


def off(corners=CORNERS):
    return f"OFF\n{len(corners)} 1 0\n" + "".join("%g %g %g\n" % place for place in corners) + \
        " ".join(map(str, (len(corners), *range(len(corners))))) + "\n"


def ac3d(corners):
    return ("AC3Db\nMATERIAL \"red\" rgb 1 0 0 amb 0.2 0.2 0.2 emis 0 0 0 spec 0.5 0.5 0.5 shi 10 trans 0\nOBJECT world\nkids 1\n"
            "OBJECT poly\nname \"quad\"\nnumvert 4\n" + "".join("%g %g %g\n" % place for place in corners) +
            "numsurf 1\nSURF 0x20\nmat 0\nrefs 4\n0 0 0\n1 1 0\n2 1 1\n3 0 1\nkids 0\n")


def x3d(corners):
    points = " ".join("%g %g %g" % place for place in corners)
    return ("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<X3D profile=\"Interchange\" version=\"3.3\"><Scene><Shape><Appearance>"
            "<Material diffuseColor=\"1 0 0\"/></Appearance><IndexedFaceSet coordIndex=\"0 1 2 3 -1\"><Coordinate point=\"" +
            points + "\"/></IndexedFaceSet></Shape></Scene></X3D>")


def three_mf(corners):
    vertices = "".join("<vertex x=\"%g\" y=\"%g\" z=\"%g\"/>" % place for place in corners)
    model = ("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"millimeter\" xmlns="
             "\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\"><resources><object id=\"1\" type=\"model\"><mesh>"
             f"<vertices>{vertices}</vertices><triangles><triangle v1=\"0\" v2=\"1\" v3=\"2\"/><triangle v1=\"0\" v2=\"2\" v3=\"3\"/>"
             "</triangles></mesh></object></resources><build><item objectid=\"1\"/></build></model>")
    relation = ("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Relationships xmlns="
                "\"http://schemas.openxmlformats.org/package/2006/relationships\"><Relationship Target=\"/3D/3dmodel.model\" Id="
                "\"rel0\" Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>")
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("_rels/.rels", relation)
        packed.writestr("3D/3dmodel.model", model)
    return archive.getvalue()


def three_ds(corners, colour=None):
    def chunk(number, *parts):
        body = b"".join(parts)
        return struct.pack("<HI", number, 6 + len(body)) + body

    vertices = struct.pack("<H", len(corners)) + b"".join(struct.pack("<3f", *place) for place in corners)
    faces = struct.pack("<9H", 2, 0, 1, 2, 7, 0, 2, 3, 7)
    paint, used = b"", b""
    if colour:
        paint = chunk(0xafff, chunk(0xa000, b"paint\0"), chunk(0xa020, chunk(0x0011, bytes(colour))))
        used = chunk(0x4130, b"paint\0", struct.pack("<3H", 2, 0, 1))
    mesh = chunk(0x4100, chunk(0x4110, vertices), chunk(0x4120, faces, used))
    return chunk(0x4d4d, chunk(0x0002, struct.pack("<I", 3)), chunk(0x3d3d, paint, chunk(0x4000, b"quad\0", mesh)))


def source(name, values, stride, kind="float"):
    word = "Name_array" if kind == "name" else "float_array"
    parameters = "XYZ" if stride == 3 else "ST" if stride == 2 else ("TRANSFORM",) if stride == 16 else "X"
    return (f'<source id="{name}"><{word} id="{name}a" count="{len(values)}">{" ".join(map(str, values))}</{word}><technique_common>'
            f'<accessor source="#{name}a" count="{len(values) // stride}" stride="{stride}">' +
            "".join(f'<param name="{parameter}" type="{"float4x4" if stride == 16 else kind}"/>' for parameter in parameters) +
            "</accessor></technique_common></source>")


def dae(nodes, libraries="", corners=CORNERS, unit=1, up="Y_UP", effect=""):
    """A quad g of the material m, and what else is asked for."""
    effect = effect or "<phong><diffuse><color>1 0 0 1</color></diffuse><shininess><float>16</float></shininess></phong>"
    mesh = (f'<mesh>{source("p", [x for place in corners for x in place], 3)}<vertices id="v"><input semantic="POSITION" '
            'source="#p"/></vertices><polylist material="s" count="1"><input semantic="VERTEX" source="#v" offset="0"/>'
            "<vcount>4</vcount><p>0 1 2 3</p></polylist></mesh>")
    return ('<?xml version="1.0"?>\n<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>'
            f'<unit meter="{unit}" name="u"/><up_axis>{up}</up_axis></asset>{libraries}<library_effects><effect id="e"><profile_COMMON>'
            f'<technique sid="c">{effect}</technique></profile_COMMON></effect></library_effects><library_materials>'
            '<material id="m" name="red"><instance_effect url="#e"/></material></library_materials><library_geometries>'
            f'<geometry id="g" name="g">{mesh}</geometry></library_geometries><library_visual_scenes><visual_scene id="s">{nodes}'
            '</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>')


BOUND = ('<bind_material><technique_common><instance_material symbol="s" target="#m"/></technique_common></bind_material>')
QUAD = f'<node id="quad" name="quad"><instance_geometry url="#g">{BOUND}</instance_geometry></node>'


def fbx(corners, settings="", more=""):
    numbers = ",".join("%g" % x for place in corners for x in place)
    return ("; FBX 7.3.0 project file\nFBXHeaderExtension:  {\nFBXHeaderVersion: 1003\nFBXVersion: 7300\n}\n"
            f"GlobalSettings:  {{\nVersion: 1000\nProperties70:  {{\n{settings}}}\n}}\n"
            f'Objects:  {{\nGeometry: 10, "Geometry::quad", "Mesh" {{\nVertices: *12 {{\na: {numbers}\n}}\n'
            "PolygonVertexIndex: *4 {\na: 0,1,2,-4\n}\nGeometryVersion: 124\n"
            'LayerElementMaterial: 0 {\nVersion: 101\nName: ""\nMappingInformationType: "AllSame"\n'
            'ReferenceInformationType: "IndexToDirect"\nMaterials: *1 {\na: 0\n}\n}\nLayer: 0 {\nVersion: 100\nLayerElement:  {\n'
            'Type: "LayerElementMaterial"\nTypedIndex: 0\n}\n}\n}\n'
            'Model: 20, "Model::quad", "Mesh" {\nVersion: 232\n}\nMaterial: 30, "Material::red", "" {\nVersion: 102\n'
            'ShadingModel: "phong"\nProperties70:  {\nP: "DiffuseColor", "Color", "", "A",1,0,0\n}\n}\n' + more +
            '}\nConnections:  {\nC: "OO",20,0\nC: "OO",10,20\nC: "OO",30,20\n}\n')


def axes(up, up_sign, front, front_sign, unit):
    names = ("UpAxis", up), ("UpAxisSign", up_sign), ("FrontAxis", front), ("FrontAxisSign", front_sign), ("CoordAxis", 0), \
        ("CoordAxisSign", 1)
    return "".join(f'P: "{name}", "int", "Integer", "",{value}\n' for name, value in names) + \
        f'P: "UnitScaleFactor", "double", "Number", "",{unit}\n'


def scaled(factor, turn=lambda x, y, z: (x, y, z)):
    return [turn(*(x * factor for x in place)) for place in CORNERS]


def z_up(x, y, z):
    """What is (x, y, z) where y is up."""
    return (x, -z, y)


def place(matrix, point):
    return tuple(sum(matrix[row * 4 + i] * point[i] for i in range(3)) + matrix[row * 4 + 3] for row in range(3))


def world(result, node):
    """The node's matrices, from its own to the root's."""
    nodes = {one["id"]: one for one in result.of(SET_NODE)}
    chain = [node["matrix"]]
    while node["parent"]:
        node = nodes[node["parent"]]
        chain.append(node["matrix"])
    return chain


def in_world(result, node, point):
    for matrix in world(result, node):
        point = place(matrix, point)
    return point


class Formats(importer.Written):
    def triangles(self, result):
        """Of all shown meshes: corners in the world, each triangle beginning with its least corner."""
        meshes, found = {mesh["id"]: mesh for mesh in result.of(SET_MESH)}, []
        for node in result.of(SET_NODE):
            if node["kind"] != 1:
                continue
            mesh = meshes[node["object"]]
            values, corners = result.floats(mesh["arrays"][0]), result.integers(mesh["arrays"][1])
            places = [tuple(round(x, 4) + 0.0 for x in in_world(result, node, values[c * 3:c * 3 + 3])) for c in corners]
            for at in range(0, len(places), 3):
                three = places[at:at + 3]
                least = three.index(min(three))
                found.append(tuple(three[least:] + three[:least]))
        return sorted(found)

    def assert_near(self, got, wanted, places=4):
        self.assertEqual(len(got), len(wanted))
        for a, b in zip(got, wanted):
            self.assertAlmostEqual(a, b, places)

    def test_all_formats_hold_the_same_quad(self):
        """Whatever its axes, its unit and its form."""
        wanted = self.triangles(self.import_text("model.obj", "".join("v %g %g %g\n" % place for place in CORNERS) + "f 1 2 3 4\n"))
        self.assertEqual(len(wanted), 2)
        upright = [z_up(*place) for place in CORNERS]
        for name, model in (
                ("text.ply", ply()), ("little.ply", ply(form="binary_little_endian")), ("big.ply", ply(form="binary_big_endian")),
                ("text.stl", stl_text(upright)), ("bytes.STL", stl_bytes(upright)), ("model.off", off()), ("model.ac", ac3d(CORNERS)),
                ("model.x3d", x3d(CORNERS)), ("model.3mf", three_mf(scaled(1000, z_up))), ("model.3ds", three_ds(upright)),
                ("metres.dae", dae(QUAD)), ("cm.dae", dae(QUAD, corners=scaled(100, z_up), unit=0.01, up="Z_UP")),
                ("x.dae", dae(QUAD, corners=[(y, -x, z) for x, y, z in CORNERS], up="X_UP")),
                ("cm.fbx", fbx(scaled(100), axes(1, 1, 2, 1, 1))), ("metres.fbx", fbx(CORNERS, axes(1, 1, 2, 1, 100))),
                ("max.fbx", fbx(scaled(100, z_up), axes(2, 1, 1, -1, 1)))):
            with self.subTest(name):
                self.assertEqual(self.triangles(self.import_text(name, model)), wanted)

    def test_colours_of_3ds_are_srgb(self):
        """Its chunk 0x0011 is gamma-corrected; 0x0012 beside it is linear."""
        material, = self.import_text("model.3ds", three_ds(CORNERS, (255, 128, 0))).of(SET_MATERIAL)
        self.assert_near(material["base"], (1, 0.2159, 0, 1))

    def test_what_has_neither_normals_nor_material_is_flat_and_light_grey(self):
        for name, model in (("model.ply", ply()), ("model.stl", stl_text(CORNERS)), ("model.off", off())):
            (mesh,), (material,) = (result := self.import_text(name, model)).of(SET_MESH), result.of(SET_MATERIAL)
            self.assertEqual(mesh["vertices"], 4, f"{name}: the corners that triangles share are one")
            self.assertTrue(len(mesh["arrays"]) < 3 or mesh["arrays"][2][0] == 0, name)
            self.assertEqual((material["name"], round(material["base"][0], 6)), ("default", 0.6), name)

    def test_colours_of_vertices_are_srgb(self):
        result = self.import_text("model.ply", ply(colours=(RED, GREEN, BLUE, (128, 128, 128))))
        mesh, = result.of(SET_MESH)
        full = 65535
        self.assertEqual(result.colours(mesh), [full, 0, 0, full, 0, full, 0, full, 0, 0, full, full, 14146, 14146, 14146, full],
                         "128 of 255 is 0.21586 of the light")
        self.assertEqual(result.of(SET_MATERIAL), [], "they are shown as they are")

    def test_dark_colours_of_vertices_stay_apart(self):
        """All 256 of sRGB: a step of the darkest is 20 of 65535. Those that bytes of linear light hold are sent as bytes."""
        result = self.import_text("model.ply", ply([(i, i % 3, 0) for i in range(256)], ((0, 1, 2),), [(i, i, i) for i in range(256)]))
        values = result.colours(result.of(SET_MESH)[0])[::4]
        self.assertEqual(values[:3], [0, 20, 40])
        self.assertEqual(len(set(values)), 256)
        result = self.import_text("model.ply", ply(colours=(RED, GREEN, BLUE, (255, 255, 0))))
        self.assertEqual(len(result.data(result.of(SET_MESH)[0]["arrays"][6])), 16)

    # ---- points

    def test_points_are_spheres(self):
        """On a grid a sphere's radius is the grid's step, so that no ray passes between them; colours are palette entries."""
        grid = [(x * 0.5, 0, z * 0.5) for x in range(8) for z in range(8)]
        result = self.import_text("model.ply", ply(grid, (), [RED if x < 2 else BLUE for x, _, _ in grid]))
        spheres, = result.of(SET_SPHERES)
        values = result.floats(spheres["arrays"][0])
        materials = {material["id"]: material["base"][:3] for material in result.of(SET_MATERIAL)}
        self.assertEqual((spheres["count"], set(values[3::4])), (64, {0.5}))
        shown = {}
        for first, count, material in spheres["ranges"]:
            for at in range(first, first + count):
                shown[tuple(values[at * 4:at * 4 + 3])] = materials[material]
        self.assertEqual(shown, {place: (1, 0, 0) if place[0] < 2 else (0, 0, 1) for place in grid})
        given = importer.import_file(str(self.folder / "model.ply"), "--point-size", "0.25")
        self.assertEqual(set(given.floats(given.of(SET_SPHERES)[0]["arrays"][0])[3::4]), {0.125})

    def test_many_colours_of_points_are_few(self):
        """4096 materials at most, and none further than half a step of 1/15 from the point's colour."""
        colours = [(i * 7 % 256, i * 13 % 256, i * 29 % 256) for i in range(6000)]
        result = self.import_text("model.ply", ply([(i, 0, 0) for i in range(6000)], (), colours))
        spheres, = result.of(SET_SPHERES)
        materials = {material["id"]: material["base"] for material in result.of(SET_MATERIAL)}
        self.assertLessEqual(len(materials), 4097)
        values = result.floats(spheres["arrays"][0])
        for first, count, material in spheres["ranges"]:
            encoded = [12.92 * x if x <= 0.0031308 else 1.055 * x ** (1 / 2.4) - 0.055 for x in materials[material][:3]]
            for at in range(first, first + count):
                for got, wanted in zip(encoded, colours[int(values[at * 4])]):
                    self.assertLessEqual(abs(got - wanted / 255), 1 / 15 + 1e-4)

    # ---- materials and images

    def test_materials(self):
        red, = self.import_text("model.dae", dae(QUAD)).of(SET_MATERIAL)
        self.assertEqual((red["name"], red["base"], red["metallic"]), ("red", (1, 0, 0, 1), 0))
        self.assertAlmostEqual(red["roughness"], math.sqrt(2 / 18), 5, "as wide as Phong's highlight of 16")
        for name, model in (("model.fbx", fbx(CORNERS)), ("model.ac", ac3d(CORNERS)), ("model.x3d", x3d(CORNERS))):
            with self.subTest(name):
                mesh, = (result := self.import_text(name, model)).of(SET_MESH)
                used = {one["id"]: one for one in result.of(SET_MATERIAL)}[mesh["ranges"][0][2]]
                self.assert_near(used["base"], (1, 0, 0, 1))

    def test_images_beside_the_model(self):
        """By the path that the model has, or else by the name alone; never outside the folder."""
        image = ('<library_images><image id="i" name="i"><init_from>%s</init_from></image></library_images>')
        effect = ('<phong><diffuse><texture texture="t" texcoord="u"/></diffuse></phong>')
        parameters = ('<newparam sid="f"><surface type="2D"><init_from>i</init_from></surface></newparam><newparam sid="t"><sampler2D>'
                      "<source>f</source></sampler2D></newparam>")
        self.write("model/red.ppm", PPM)
        self.write("secret.ppm", PPM)
        self.write("model/.hidden/red2.ppm", PPM)
        for path, found in (("red.ppm", True), ("C:\\art\\red.ppm", True), ("textures/red.ppm", True), ("../secret.ppm", False),
                            (".hidden/red2.ppm", False)):
            with self.subTest(path):
                text = dae(QUAD, image % path, effect=effect).replace('<technique sid="c">', parameters + '<technique sid="c">')
                result = self.import_text("model/model.dae", text)
                texture, = result.of(SET_TEXTURE)
                texels = result.data(texture["arrays"][0])
                self.assertEqual(texels[:3] == bytes(RED), found, result.text())
                self.assertEqual("cannot be used" in result.text(), not found)

    def test_a_texture_uses_the_coordinates_that_the_material_says(self):
        """The colour those of set 1, the emission those of set 0; without the first no mesh has set 1."""
        images = "".join(f'<image id="{name}" name="{name}"><init_from>red.ppm</init_from></image>' for name in "ij")
        parameters = "".join(f'<newparam sid="f{i}"><surface type="2D"><init_from>{i}</init_from></surface></newparam><newparam sid='
                             f'"t{i}"><sampler2D><source>f{i}</source></sampler2D></newparam>' for i in "ij")
        coordinates = "".join(source(f"uv{n}", values, 2) for n, values in ((0, [0, 0, 1, 0, 1, 1, 0, 1]), (1, [0.25] * 8)))
        inputs = "".join(f'<input semantic="TEXCOORD" source="#uv{n}" offset="0" set="{n}"/>' for n in (0, 1))
        bound = BOUND.replace('target="#m"/>', 'target="#m">' + "".join(
            f'<bind_vertex_input semantic="U{n}" input_semantic="TEXCOORD" input_set="{n}"/>' for n in (0, 1)) + "</instance_material>")
        self.write("red.ppm", PPM)
        for effect, sets in (
                ('<phong><emission><texture texture="tj" texcoord="U0"/></emission><diffuse><texture texture="ti" texcoord="U1"/>'
                 "</diffuse></phong>", (1, 0)),
                ('<phong><diffuse><texture texture="ti" texcoord="U0"/></diffuse></phong>', (0, None))):
            with self.subTest(sets):
                text = dae(QUAD.replace(BOUND, bound), f"<library_images>{images}</library_images>", effect=effect)
                for before, more in (('<technique sid="c">', parameters), ('<vertices id="v">', coordinates), ("<vcount>", inputs)):
                    text = text.replace(before, more + before)
                result = self.import_text("model.dae", text)
                (material,), (mesh,) = result.of(SET_MATERIAL), result.of(SET_MESH)
                uses = {at: use["texcoord"] for at, use in enumerate(material["textures"]) if use["texture"]}
                self.assertEqual((uses[0], uses.get(4)), sets, result.text())
                self.assertEqual(result.floats(mesh["arrays"][4])[2:4], [1, 1], "v runs downwards here")
                self.assertEqual(len(mesh["arrays"]) > 5 and mesh["arrays"][5][0] > 0, sets[0] == 1)
                if sets[0] == 1:
                    self.assertEqual(result.floats(mesh["arrays"][5]), [0.25, 0.75] * 4)

    # ---- cameras and lights

    def test_camera_and_lights(self):
        libraries = ('<library_cameras><camera id="cam"><optics><technique_common><perspective><xfov>60</xfov><aspect_ratio>1.5'
                     "</aspect_ratio><znear>2</znear><zfar>100</zfar></perspective></technique_common></optics></camera></library_cameras>"
                     '<library_lights><light id="sun"><technique_common><directional><color>1 0.5 0.25</color></directional>'
                     '</technique_common></light><light id="lamp"><technique_common><point><color>1 1 1</color><constant_attenuation>0'
                     "</constant_attenuation><quadratic_attenuation>0.25</quadratic_attenuation></point></technique_common></light>"
                     "</library_lights>")
        nodes = ('<node id="eye" name="eye"><translate>0 0 5</translate><instance_camera url="#cam"/></node><node id="day" name="day">'
                 '<instance_light url="#sun"/></node><node id="night" name="night"><instance_light url="#lamp"/></node>')
        result = self.import_text("model.dae", dae(QUAD + nodes, libraries, unit=0.1))
        camera, = result.of(SET_CAMERA)
        self.assertAlmostEqual(camera["fov_y"], 2 * math.atan(math.tan(math.radians(30)) / 1.5), 5)
        self.assertAlmostEqual(camera["near"], 0.2, 6)
        eye = next(node for node in result.of(SET_NODE) if node["kind"] == 4)
        self.assert_near(in_world(result, eye, (0, 0, 0)), (0, 0, 0.5))
        self.assert_near(in_world(result, eye, (0, 0, -1)), (0, 0, 0.4))
        lights = {light["name"]: light for light in result.of(SET_LIGHT)}
        sun, lamp = lights["day"], lights["night"]
        self.assert_near(sun["colour"], [math.pi * x for x in (1, 0.5, 0.25)])
        # 0.25 d^2 of units is 25 d^2 of metres: at 1 m a white surface shows 1 / 25.
        self.assert_near(lamp["colour"], [math.pi / 25] * 3)

    # ---- what moves

    CONTROLLER = ('<library_controllers><controller id="c"><skin source="#g"><bind_shape_matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1'
                  "</bind_shape_matrix>" + source("j", ["low", "high"], 1, "name") +
                  source("b", [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1, 0, 0, 0, 0, 1], 16) +
                  source("w", [1, 0.25, 0.75], 1) +
                  '<joints><input semantic="JOINT" source="#j"/><input semantic="INV_BIND_MATRIX" source="#b"/></joints>'
                  '<vertex_weights count="4"><input semantic="JOINT" source="#j" offset="0"/><input semantic="WEIGHT" source="#w" '
                  'offset="1"/><vcount>1 1 2 2</vcount><v>0 0 0 0 0 1 1 2 0 1 1 2</v></vertex_weights></skin></controller>'
                  "</library_controllers>")
    BONES = ('<node id="low" sid="low" name="low" type="JOINT"><node id="high" sid="high" name="high" type="JOINT"><translate sid="t">0 1 0'
             f'</translate></node></node><node id="quad" name="quad"><instance_controller url="#c"><skeleton>#low</skeleton>{BOUND}'
             "</instance_controller></node>")
    CLIP = ('<library_animations><animation id="a" name="lift">' + source("t", [0, 2], 1) + source("o", [0, 1, 0, 0, 5, 0], 3) +
            source("i", ["LINEAR", "LINEAR"], 1, "name") +
            '<sampler id="h"><input semantic="INPUT" source="#t"/><input semantic="OUTPUT" source="#o"/><input semantic="INTERPOLATION" '
            'source="#i"/></sampler><channel source="#h" target="high/t"/></animation></library_animations>')

    def test_skin_and_clip(self):
        """The upper corners follow the joint, which rises by 4, with three quarters of their weight."""
        text = dae(self.BONES, self.CONTROLLER + self.CLIP)
        result = self.import_text("model.dae", text)
        skin, = result.of(SET_SKIN)
        self.assertEqual(skin["joints"], 2)
        self.assertEqual([(clip["channels"], round(clip["duration"], 4)) for clip in result.clips], [(3, 2)])
        at_rest, risen = daemon_pose(self.folder / "model.dae", 0, (0, 2))
        self.assertEqual(sorted({tuple(round(x, 4) + 0.0 for x in place) for place, _ in at_rest}), sorted(map(tuple, CORNERS)))
        self.assertEqual(sorted({tuple(round(x, 4) + 0.0 for x in place) for place, _ in risen}),
                         [(0, 0, 0), (0, 4, 0), (1, 0, 0), (1, 4, 0)])

    def test_a_mesh_of_collada_is_shown_without_its_morph_targets(self):
        morph = ('<library_controllers><!-- <controller> --><controller id="k"><!-- <skin> --><morph source="#g" method="NORMALIZED">'
                 '<source id="mt"><IDREF_array id="mta" count="1">g</IDREF_array></source><targets>'
                 '<input semantic="MORPH_TARGET" source="#mt"/></targets></morph></controller></library_controllers>')
        nodes = (f'<node id="quad" name="quad"><instance_controller url="#k">{BOUND}</instance_controller></node>'
                 '<node id="bare" name="bare"><instance_controller url=\'#k\'/></node>')
        result = self.import_text("model.dae", dae(nodes, morph))
        quad = self.triangles(self.import_text("plain.dae", dae(QUAD)))
        self.assertEqual(self.triangles(result), sorted(quad + quad), "of both nodes")
        self.assertIn("morph targets of COLLADA files are not read", result.text())

    def test_morph_targets_and_their_clip(self):
        """A quad of an FBX file that is lifted along z by 1 as the weight of its target grows in two seconds."""
        second = 46186158000  # in its ticks
        more = ('Geometry: 11, "Geometry::up", "Shape" {\nVersion: 100\nIndexes: *4 {\na: 0,1,2,3\n}\nVertices: *12 {\n'
                "a: 0,0,1,0,0,1,0,0,1,0,0,1\n}\nNormals: *12 {\na: 0,0,0,0,0,0,0,0,0,0,0,0\n}\n}\n"
                'Deformer: 12, "Deformer::", "BlendShape" {\nVersion: 100\n}\n'
                'Deformer: 13, "SubDeformer::up", "BlendShapeChannel" {\nVersion: 100\nDeformPercent: 0\nFullWeights: *1 {\na: 100\n}\n}\n'
                f'AnimationStack: 40, "AnimStack::lift", "" {{\nProperties70:  {{\nP: "LocalStop", "KTime", "Time", "",{2 * second}\n}}\n}}\n'
                'AnimationLayer: 41, "AnimLayer::base", "" {\n}\n'
                'AnimationCurveNode: 42, "AnimCurveNode::DeformPercent", "" {\nProperties70:  {\n'
                'P: "d|DeformPercent", "Number", "", "A",0\n}\n}\n'
                'AnimationCurve: 43, "AnimCurve::", "" {\nDefault: 0\nKeyVer: 4008\n'
                f"KeyTime: *2 {{\na: 0,{2 * second}\n}}\nKeyValueFloat: *2 {{\na: 0,100\n}}\n}}\n")
        links = ('C: "OO",12,10\nC: "OO",13,12\nC: "OO",11,13\nC: "OO",41,40\nC: "OO",42,41\nC: "OP",42,13, "DeformPercent"\n'
                 'C: "OP",43,42, "d|DeformPercent"\n')
        text = fbx(CORNERS, axes(1, 1, 2, 1, 100), more).replace('C: "OO",20,0\n', 'C: "OO",20,0\n' + links)
        result = self.import_text("model.fbx", text)
        mesh, = result.of(SET_MESH)
        self.assertEqual((mesh["targets"], mesh["weights"]), (1, [0]))
        self.assert_near(result.floats(mesh["arrays"][9]), [0, 0, 1] * 4)
        self.assertEqual([(clip["name"], clip["channels"], round(clip["duration"], 3)) for clip in result.clips], [("lift", 1, 2)])
        at_rest, half, lifted = daemon_pose(self.folder / "model.fbx", 0, (0, 1, 2))
        self.assertEqual([{round(place[2], 3) for place, _ in pose} for pose in (at_rest, half, lifted)], [{0}, {0.5}, {1}])

    # ---- faults

    def test_faults_say_what_is_wrong(self):
        for name, model, expected in (
                ("model.xyz", "1 2 3\n", "unknown format .xyz; known are .gltf, .glb, .obj, .nff, .3mf, .3ds, .ac, .dae, .fbx"),
                ("passwd", "root:x:0\n", "unknown format (no ending, unknown first bytes); known are .gltf"),
                ("model.ply", "no head\n", "begins with the line 'ply'"), ("model.stl", "", "the file is empty"),
                ("endless.ply", ply().replace("end_header", "comment"), "line 10: '0 0 0' is no statement"),
                ("cut.ply", ply()[:150], "does not end within 150 bytes"),
                ("word.ply", ply().replace("float z", "flow z"), "line 6: 'property flow z' is no statement"),
                ("many.ply", ply().replace("vertex 4", "vertex 4000000000").replace("float x", "float q"), "it is cut off, and its first elements are no"),
                ("short.stl", stl_bytes(CORNERS)[:120], "is cut off before the end of the first"),
                ("corners.ply", ply([(math.cos(i), math.sin(i), 0) for i in range(70000)], (range(70000),)).replace(
                    "list uchar", "list uint"), "a polygon of 70000 corners; 3 to 65536 are allowed"),
                ("corners.off", off([(math.cos(i), math.sin(i), 0) for i in range(70000)]), "up to 4000 are allowed"),
                ("deep.dae", dae('<node>' * 300 + QUAD + '</node>' * 300), "nodes are nested more than 254 deep"),
                ("deeper.dae", dae("<node>" * 100000 + QUAD + "</node>" * 100000), "elements are nested more than 2000 deep"),
                ("old.fbx", fbx(CORNERS).replace("7300", "6100"), "version 6.1, but only 7.1 (FBX 2011) and newer are read: write it"),
                ("corner.ply", ply(faces=((0, 1, 200000000),)), "a face has the vertex 200000000, but there are 4"),
                ("cube.x", "xof 0303txt 0032\nMesh {\n", "it is a DirectX file (version 3.3, txt), which is not read: write it"),
                ("cube.blend", "BLENDER-v300", "it is a scene of Blender, which is not read: write it as glTF in Blender"),
                ("models.zip", three_mf(CORNERS).replace(b"_rels/.rels", b"model.gltfs"), "without a 3MF model, which is not read: unpack"),
                ("broken.3mf", three_mf(CORNERS)[:-30], "the 3MF file cannot be read: ")):
            with self.subTest(name):
                result = self.import_text(name, model, 1)
                self.assertIn(expected, result.text())
                self.assertEqual(len(result.errors()), 1)

    @unittest.skipIf(importer.SLOWER > 1, "sanitizers do not run within so little memory")
    def test_too_little_memory_is_said(self):
        model = ply([(0, 0, 0)], (), form="binary_little_endian").replace(b"vertex 1\n", b"vertex 1000000\n") + bytes(12 * 999999)
        self.assertIn("more memory than a model may have", self.import_text("model.ply", model, 1, memory=64 << 20).text())


REFUSED = {"blender_279_ball_6100_ascii.fbx": "FBX file of version 6.1", "cameras.dae": "nothing that can be shown"}


@needs_shared_scenes
class Published(Case):
    def test_published_files_are_read(self):
        paths = sorted(path for kind in ("3mf", "dae", "fbx", "ply", "stl")
                       for path in sorted((SHARED_SCENES / "formats" / kind).iterdir())[::1 if LONG else 8])
        for path, result in importer.import_files([str(path) for path in paths]):
            with self.subTest(path):
                expected = REFUSED.get(os.path.basename(path))
                self.assertEqual((result.status, result.faults), (1 if expected else 0, []), result.text())
                self.assertEqual(importer.inconsistencies(result), [])
                self.assertIn(expected or "", result.text())


if __name__ == "__main__":
    unittest.main()
