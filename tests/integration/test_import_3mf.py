# SPDX-License-Identifier: MIT
"""Reading 3MF: colours and materials of triangles, components, units, and what is said of broken files."""
import io
import unittest
import zipfile

import importer
from importer import SET_MATERIAL, SET_MESH, SET_NODE

RELATIONS = ('<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Id="rel1" '
             'Type="http://schemas.openxmlformats.org/package/2006/relationships/metadata/thumbnail" Target="/t.png"/>'
             '<Relationship Target="/3D/main.model" Id="rel0" '
             'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>')
VERTICES = "".join(f'<vertex x="{x}" y="{y}" z="0"/>' for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
ITEM = '<build><item objectid="1"/></build>'


def triangles(first="", second=""):
    return f'<triangle v1="0" v2="1" v3="2" {first}/><triangle v1="0" v2="2" v3="3" {second}/>'


def quad(faces=None, number=1, more=""):
    return (f'<object id="{number}" name="quad" {more}><mesh><vertices>{VERTICES}</vertices>'
            f"<triangles>{faces or triangles()}</triangles></mesh></object>")


def model(resources, build=ITEM, unit="meter"):
    return (f'<?xml version="1.0" encoding="UTF-8"?>\n<model unit="{unit}" xmlns:m="m" xmlns:p="p"><resources>{resources}</resources>'
            f"{build}</model>")


def package(main, **others):
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("_rels/.rels", RELATIONS)
        packed.writestr("3D/main.model", main)
        for name, text in others.items():
            packed.writestr(f"3D/{name}.model", text)
    return archive.getvalue()


COLOURS = '<m:colorgroup id="2"><m:color color="#FF0000"/><m:color color="#808080FF"/><m:color color="#0000FF"/></m:colorgroup>'
BASES = ('<basematerials id="5"><base name="PLA" displaycolor="#FFFFFF"/><base name="Steel" displaycolor="#80808080"/></basematerials>')


class ThreeMf(importer.Written):
    def read(self, main, status=0, **others):
        return self.import_text("model.3mf", package(main, **others), status)

    def colours(self, result):
        """Of the corners of the only mesh, triangle after triangle."""
        mesh, = result.of(SET_MESH)
        values = [value // 257 for value in result.colours(mesh)]
        return [tuple(values[i * 4:i * 4 + 3]) for i in result.integers(mesh["arrays"][1])]

    def names(self, result):
        materials = {one["id"]: one["name"] for one in result.of(SET_MATERIAL)}
        mesh, = result.of(SET_MESH)
        return [(materials[number], first, count) for first, count, number in mesh["ranges"]]

    def test_triangles_and_corners_have_the_colours_of_a_group(self):
        result = self.read(model(COLOURS + quad(triangles('pid="2" p1="0"', 'pid="2" p1="0" p2="1" p3="2"'))))
        red, grey, blue = (255, 0, 0), (55, 55, 55), (0, 0, 255)
        self.assertEqual(self.colours(result), [red, red, red, red, grey, blue])
        mesh, = result.of(SET_MESH)
        self.assertEqual(mesh["vertices"], 5, "a corner of two colours is two vertices")
        material, = result.of(SET_MATERIAL)
        self.assertEqual(material["base"], (1, 1, 1, 1))

    def test_an_object_has_a_colour_for_triangles_without(self):
        result = self.read(model(COLOURS + quad(triangles("", 'pid="2" p1="2"'), more='pid="2" pindex="0"')))
        self.assertEqual(self.colours(result), [(255, 0, 0)] * 3 + [(0, 0, 255)] * 3)

    def test_base_materials_are_materials(self):
        result = self.read(model(BASES + quad(triangles('p1="1"', 'pid="5" p1="0"'), more='pid="5" pindex="0"')))
        self.assertEqual(sorted(name for name, _, count in self.names(result) if count == 1), ["PLA", "Steel"])
        steel, = (one for one in result.of(SET_MATERIAL) if one["name"] == "Steel")
        for channel, wanted in zip(steel["base"], (0.2159, 0.2159, 0.2159, 0.502)):
            self.assertAlmostEqual(channel, wanted, 3)

    def test_what_is_not_read_is_told_and_grey(self):
        for element in ("m:texture2dgroup", "m:compositematerials", "m:multiproperties"):
            with self.subTest(element):
                result = self.read(model(f'<{element} id="7"/>' + quad(triangles('pid="7" p1="0"'))))
                self.assertIn("textures and mixtures of 3MF files are not supported", result.text())
                self.assertEqual(self.names(result), [("default", 0, 2)])

    def test_components_share_their_mesh_and_stand_where_they_are_put(self):
        """One in the same file and one of another, in inches; the archive's axis z is up, ours is y."""
        parts = ('<object id="8"><components><component objectid="1" transform="0 1 0 -1 0 0 0 0 1 10 20 30"/>'
                 '<component objectid="3" p:path="/3D/other.model"/></components></object>')
        result = self.read(model(quad() + parts, '<build><item objectid="8" transform="2 0 0 0 2 0 0 0 2 0 0 0"/><item objectid="1"/>'
                                 "</build>", "inch"), other=model(quad(number=3), ""))
        nodes = {node["id"]: node for node in result.of(SET_NODE)}
        meshes = {mesh["id"]: mesh for mesh in result.of(SET_MESH)}
        self.assertEqual(len(meshes), 2)
        found = []
        for node in nodes.values():
            if node["kind"] != 1:
                continue
            point = (1, 0, 0)
            while node:
                m = node["matrix"]
                point = tuple(sum(m[row * 4 + i] * point[i] for i in range(3)) + m[row * 4 + 3] for row in range(3))
                node = nodes.get(node["parent"])
            found.append(tuple(round(x / 0.0254, 4) + 0.0 for x in point))
        self.assertEqual(sorted(found), [(1, 0, 0), (2, 0, 0), (20, 60, -42)])

    def test_faults_say_what_is_wrong(self):
        itself = '<object id="1"><components><component objectid="1"/></components></object>'
        for text, expected in (
                (model(quad(), ""), "the 3MF file builds nothing: it has no item"),
                (model(itself), "has itself as a component"),
                (model(quad(triangles()).replace('v3="3"', 'v3="4"')), "a triangle has the vertex 4, but there are 4"),
                (model(quad()).replace('x="1"', 'x="one"'), "'one' is no number of 'x'"),
                (model(quad()).replace('v1="0"', 'v1="-1"'), "'-1' is no number of 'v1'"),
                (model(COLOURS.replace("#FF0000", "red") + quad()), "'red' is no colour such as #FF8000"),
                (model(quad())[:-20], "line 2: the 3MF file cannot be read: unclosed token"),
                (model(quad()).replace("<model ", '<!DOCTYPE m [<!ENTITY a "b">]><model ', 1), "must not have a DTD")):
            with self.subTest(expected):
                self.assertIn(expected, self.read(text, 1).text())

    def test_an_object_that_is_not_there_is_told(self):
        result = self.read(model(quad(), '<build><item objectid="1"/><item objectid="9"/></build>'))
        self.assertIn("the object 9 does not exist", result.text())

    def test_broken_archives_are_refused(self):
        whole = package(model(quad()))
        at = whole.index(b"3D/main.model") + len(b"3D/main.model")
        for name, data, expected in (
                ("checksum.3mf", self.with_other_checksum(whole), "checksum of '3D/main.model' is wrong"),
                ("bytes.3mf", whole[:at] + bytes(40) + whole[at + 40:], "the 3MF file cannot be read: "),
                ("elsewhere.3mf", whole.replace(b"3D/main.model", b"3D/main.modem"), "there is no model in it")):
            with self.subTest(name):
                self.assertIn(expected, self.import_text(name, data, 1).text())

    @staticmethod
    def with_other_checksum(whole):
        """Of the model, in the directory and in its own head."""
        out = bytearray(whole)
        for signature, name_at, crc_at in ((b"PK\3\4", 30, 14), (b"PK\1\2", 46, 16)):
            at = whole.find(signature)
            while at >= 0:
                if whole[at + name_at:].startswith(b"3D/main.model"):
                    out[at + crc_at] ^= 1
                at = whole.find(signature, at + 1)
        return bytes(out)


if __name__ == "__main__":
    unittest.main()
