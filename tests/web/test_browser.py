#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""farlight-web's page in headless Chromium: make web-test.

Usage: FARLIGHT_BIN=BUILD_FOLDER test_browser.py. Prints what it has measured.
"""
import pathlib
import sys
import tempfile
import time
import unittest

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parent), str(pathlib.Path(__file__).resolve().parents[1] / "integration")]

import json  # noqa: E402

from browser import Browser  # noqa: E402
from farlight_test import bundled_scenes, farlight  # noqa: E402
from test_serve import Serving  # noqa: E402
from web_client import Gateway  # noqa: E402

NAME, WIDTH, HEIGHT, SAMPLES = "scene", 360, 270, 64
PSNR_DB = 32  # JPEG of quality 90 has about 38 dB; a neighbouring camera has below 25
DATASET = "document.getElementById('picture')?.dataset"


class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="farlight-web-")))
        cls.address = f"unix:{cls.folder}/s"
        cls.serving = cls.serve()
        cls.serving.__enter__()
        cls.addClassCleanup(lambda: cls.serving.__exit__())
        cls.gateway = cls.enterClassContext(Gateway("--server", cls.address, "--scene", NAME, "--allow-edit"))
        cls.browser = cls.enterClassContext(Browser())

    @classmethod
    def serve(cls):
        return Serving(bundled_scenes() / "carousel.glb", "--listen", cls.address, "--name", NAME, "--quiet")

    def open(self, fragment="", link=None):
        page = self.browser.open((link or self.gateway.link) + fragment, WIDTH, HEIGHT)
        self.addCleanup(page.close)
        page.wait(f"{DATASET}.frame")
        return page

    def choose(self, page, name, value):
        page.value(f"(() => {{ const one = document.getElementById('{name}'); one.value = '{value}'; "
                   "one.dispatchEvent(new Event('change')); })()")

    def rest(self, page, samples=SAMPLES):
        self.choose(page, "integrator", "whitted")
        page.wait(f"Number({DATASET}.samples) >= {samples} && {DATASET}.moving === 'false' && {DATASET}.integrator === 'whitted'")

    def psnr(self, page, *options):
        shown, rendered = self.folder / "shown.png", self.folder / "rendered.png"
        shown.write_bytes(page.picture())
        result = farlight("render", "--server", self.address, "--scene", NAME, "--size", f"{WIDTH}x{HEIGHT}", "--samples", SAMPLES,
                          "--integrator", "whitted", "-o", rendered, "-q", *options)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(farlight("compare", rendered, shown, "--json", "--ignore-alpha").stdout)["psnr"]

    def drag(self, page):
        before = page.value(f"delete {DATASET}.latency, {DATASET}.look")
        page.drag(WIDTH // 2, HEIGHT // 2, 60, -20)
        page.wait(f"{DATASET}.look !== '{before}' && {DATASET}.latency")

    def test_picture_is_what_render_makes(self):
        page = self.open()
        self.rest(page)
        psnr = self.psnr(page)
        print(f"picture of the page and of farlight render: {psnr:.1f} dB")
        self.assertGreater(psnr, PSNR_DB)
        self.assertEqual(page.faults, [])

    def test_drag_wheel_and_touch_move_the_camera(self):
        page = self.open()
        latencies, encodings = [], set()
        for _ in range(8):
            self.drag(page)
            latencies.append(float(page.shown()["latency"]))
            encodings.add(page.shown()["encoding"])
        latencies.sort()
        print(f"input to picture: median {latencies[4]:.0f} ms, worst {latencies[-1]:.0f} ms of 8 drags; {encodings}")
        before = page.shown()["look"]
        page.mouse("mouseWheel", WIDTH // 2, HEIGHT // 2, deltaX=0, deltaY=200)
        page.wait(f"{DATASET}.look !== '{before}'")
        before = page.wait(f"{DATASET}.look")
        for i in range(6):
            page.call("Input.dispatchTouchEvent", type="touchMove" if i > 0 else "touchStart",
                      touchPoints=[{"x": 150 - 8 * i, "y": 150, "id": 1}, {"x": 210 + 8 * i, "y": 150, "id": 2}])
        page.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        page.wait(f"Number({DATASET}.look) > {before}")
        page.wait(f"{DATASET}.moving === 'false' && {DATASET}.encoding === 'jpeg'")  # refined at rest
        self.assertEqual(page.faults, [])

    def test_h264_is_decoded_while_it_moves(self):
        page = self.open()
        if not page.value("'VideoDecoder' in window && "
                          "VideoDecoder.isConfigSupported({codec: 'avc1.640033'}).then((it) => it.supported)"):
            self.skipTest("this Chromium decodes no H.264")
        page.value(f"window.seen = new Set(); new MutationObserver(() => seen.add({DATASET}.encoding))"
                   ".observe(document.getElementById('picture'), {attributes: true})")
        self.drag(page)
        self.drag(page)
        page.wait("seen.has('h264')")
        self.assertEqual(page.faults, [])

    def test_shared_link_shows_the_same_and_others_their_own(self):
        page = self.open()
        self.drag(page)
        page.value("document.getElementById('share').click()")
        other, own = self.open(page.wait("location.hash")), self.open()
        files = []
        for name, one in (("page", page), ("other", other), ("own", own)):
            self.rest(one, samples=4)
            files.append(self.folder / f"{name}.png")
            files[-1].write_bytes(one.picture())
        alike, unlike = (json.loads(farlight("compare", files[1], file, "--json").stdout)["psnr"] for file in (files[0], files[2]))
        print(f"views of one link: {alike} dB, and of another camera: {unlike:.1f} dB")
        # They are alike but for the number of samples, at edges.
        self.assertTrue(alike is None or alike > unlike + 6, (alike, unlike))

    def test_clip_plays_and_pauses(self):
        page = self.open()
        page.value("document.getElementById('play').click()")
        first = int(page.wait(f"{DATASET}.look"))
        page.wait(f"Number({DATASET}.look) > {first + 3}")
        page.value("document.getElementById('play').click()")
        page.wait(f"{DATASET}.moving === 'false'")
        page.value("document.getElementById('stages').click()")
        self.assertGreater(page.value("document.querySelectorAll('#timeline rect').length"), 3)
        self.assertEqual(page.faults, [])

    def test_errors_of_the_tracer_are_shown_with_their_figures(self):
        page = self.open()
        self.choose(page, "tracer", "abuffer")
        self.choose(page, "integrator", "raycast")  # what takes least
        page.wait(f"{DATASET}.tracer === 'abuffer'")
        page.value("document.getElementById('compare').click()")
        page.wait(f"{DATASET}.compared === 'abuffer'")
        coloured = page.value("(() => { const map = document.getElementById('errors'); const {data} = "
                              "map.getContext('2d').getImageData(0, 0, map.width, map.height); let count = 0; "
                              "for (let i = 0; i < data.length; i += 4) count += data[i] > 40; return count / (map.width * map.height); })()")
        said = page.value("document.getElementById('errors-figures').innerText")
        print(f"errors of abuffer: {coloured:.2%} of the pixels; {' '.join(said.split())}")
        # A tracer of samples errs somewhere, and is right nearly everywhere.
        self.assertGreater(coloured, 0)
        self.assertLess(coloured, 0.5)
        self.drag(page)  # another picture has other errors
        page.wait(f"{DATASET}.compared === undefined || {DATASET}.moving === 'true'")
        page.wait(f"{DATASET}.compared === 'abuffer'")
        # The first hits of the exact tracer are the reference's, but for rays at edges.
        self.choose(page, "tracer", "bvh")
        page.wait(f"{DATASET}.compared === 'bvh'")
        said = page.value("document.querySelectorAll('#errors-table tbody tr')[1].textContent")
        differ = page.value("document.querySelectorAll('#errors-table tbody tr')[1].cells[2].textContent")
        self.assertIn("primary", said)
        self.assertLess(float(differ.split()[0]), 0.01, said)
        self.choose(page, "tracer", "reference")
        page.wait("document.getElementById('errors-state').textContent.includes('itself')")
        self.assertEqual(page.faults, [])

    def test_change_is_seen_by_another_viewer_and_undone(self):
        looker, editor = self.open(), self.open(link=self.gateway.edit_link)
        for page, may_edit in ((looker, False), (editor, True)):
            page.wait(f"document.getElementById('right').hidden !== {str(may_edit).lower()}")
        self.assertTrue(looker.value("document.getElementById('editing').hidden"))
        editor.wait("!document.getElementById('editing').hidden && document.getElementById('edit-fields').children.length > 0")
        self.choose(editor, "edit-kind", "environment")
        editor.wait("document.getElementById('field-rotation-0') !== null")
        revision = looker.shown()["revision"]
        before = editor.value("document.getElementById('field-rotation-0').value")
        self.choose(editor, "field-rotation-0", "77")
        editor.wait("!document.getElementById('edit-undo').disabled")
        looker.call("Page.bringToFront")
        looker.wait(f"{DATASET}.revision !== '{revision}'")
        revision = looker.shown()["revision"]
        editor.value("document.getElementById('edit-undo').click()")
        looker.wait(f"{DATASET}.revision !== '{revision}'")
        editor.call("Page.bringToFront")
        value = "document.getElementById('field-rotation-0').value"
        editor.wait(f"{value} === '{before}' && !document.getElementById('edit-redo').disabled")
        for key, shown in (("y", "77"), ("z", before)):
            editor.value("document.getElementById('picture').focus()")
            editor.call("Input.dispatchKeyEvent", type="keyDown", key=key, modifiers=2)  # Control
            editor.call("Input.dispatchKeyEvent", type="keyUp", key=key, modifiers=2)
            editor.wait(f"Number({value}) === {shown}")
        # What cannot be is said, and the field shows what is.
        self.choose(editor, "field-rotation-0", "1e9")
        editor.wait("document.getElementById('edit-state').textContent.includes('rotation')")
        self.assertEqual((looker.faults, editor.faults), ([], []))

    def test_a_page_without_a_picture_says_that_the_first_one_is_rendered(self):
        page = self.open()
        page.call("Page.addScriptToEvaluateOnNewDocument", source="""window.said = [];
            document.addEventListener('DOMContentLoaded', () => {
                const status = document.getElementById('status');
                new MutationObserver(() => said.push(status.textContent)).observe(status, {childList: true});
            });""")
        page.call("Page.reload")
        page.wait(f"{DATASET}?.frame && said.length > 1 && said")
        self.assertEqual(page.value("said"), ["the first picture is being rendered", ""])

    def test_colours_are_shown_as_the_scene_keeps_them(self):
        model = self.folder / "kept.nff"  # its colours are a display's values
        model.write_text("b 0 0 0\nv\nfrom 0 0 4\nat 0 0 0\nup 0 1 0\nangle 45\nhither 0.01\nresolution 64 64\nl 4 3 2\n"
                         "f 1 0.8 0.2 1 0 1 0 1\ns 0 0 0 1\n")
        with Gateway(model, "--allow-edit") as gateway:
            page = self.open(link=gateway.edit_link)
            colour = "document.getElementById('field-base_colour-0')"
            page.wait(f"{colour} !== null")
            self.assertEqual(page.value(f"{colour}.value"), "#ffcc33")
            self.choose(page, "field-base_colour-0", "#336699")
            page.wait("!document.getElementById('edit-undo').disabled")
            self.choose(page, "edit-kind", "environment")
            self.choose(page, "edit-kind", "material")
            page.wait(f"{colour}?.value === '#336699'")
            self.assertEqual(page.faults, [])

    def test_everything_has_a_name_and_keys_reach_it(self):
        page = self.open(link=self.gateway.edit_link)
        page.value("document.getElementById('panel').hidden && document.getElementById('open').click()")
        page.wait("document.getElementById('edit-fields').children.length > 0")
        nameless = page.value("[...document.querySelectorAll('button, input, select, canvas, section, aside')].filter((one) => "
                              "!(one.getAttribute('aria-label') || one.textContent.trim() && one.matches('button') || "
                              "one.labels && one.labels.length)).map((one) => one.id)")
        self.assertEqual(nameless, [])
        page.value("document.getElementById('picture').focus()")
        before = page.value(f"{DATASET}.look")
        for key in ("ArrowLeft", "Home"):
            page.call("Input.dispatchKeyEvent", type="keyDown", key=key)
            page.call("Input.dispatchKeyEvent", type="keyUp", key=key)
        page.wait(f"{DATASET}.look !== '{before}'")
        page.call("Input.dispatchKeyEvent", type="keyDown", key="Escape")
        self.assertTrue(page.value("document.getElementById('panel').hidden && document.activeElement.id === 'open'"))
        self.assertEqual(page.faults, [])

    def test_files_that_change_are_shown_and_what_is_chosen_stays(self):
        model = self.folder / "model.glb"
        model.write_bytes((bundled_scenes() / "carousel.glb").read_bytes())
        with Gateway(model, "--watch", "--allow-edit") as gateway:
            page = self.open(link=gateway.edit_link)
            self.choose(page, "tracer", "abuffer")
            self.choose(page, "edit-kind", "material")
            page.wait("document.getElementById('edit-fields').children.length > 0")
            self.drag(page)
            page.wait(f"{DATASET}.tracer === 'abuffer' && {DATASET}.moving === 'false'")
            shown = page.shown()
            model.write_bytes((bundled_scenes() / "teapot.glb").read_bytes())
            page.wait(f"{DATASET}.revision !== '{shown['revision']}' && document.getElementById('clips').hidden")
            self.assertEqual({name: page.shown()[name] for name in ("look", "tracer")},
                             {name: shown[name] for name in ("look", "tracer")}, "camera and tracer stay")
            materials = "[...document.getElementById('edit-object').options].map((one) => one.textContent).join()"
            page.wait(f"{materials} === '{self.names(bundled_scenes() / 'teapot.glb')}'")
            self.assertEqual(page.status(), "")
            self.assertEqual(page.faults, [])

    def test_clip_that_is_gone_is_named_once_and_not_asked_for_again(self):
        model = self.folder / "clips.glb"
        model.write_bytes((bundled_scenes() / "carousel.glb").read_bytes())
        with Gateway(model, "--watch") as gateway:
            page, linked = self.open(link=gateway.link), self.open("#clip=4000000000", link=gateway.link)
            linked.wait("document.getElementById('status').textContent.includes('clip is gone')")
            page.call("Page.bringToFront")
            page.value("""(() => {
                window.asked = [], window.said = [];
                const send = WebSocket.prototype.send, status = document.getElementById('status');
                WebSocket.prototype.send = function (text) {
                    const show = JSON.parse(text).show;
                    if (show) asked.push(show.clip);
                    return send.call(this, text);
                };
                new MutationObserver(() => said.push(status.textContent)).observe(status, {childList: true});
            })()""")
            page.value("document.getElementById('play').click()")
            page.wait("asked.includes(1)")
            model.write_bytes((bundled_scenes() / "teapot.glb").read_bytes())
            page.wait(f"said.some((text) => text.includes('clip is gone')) && {DATASET}.revision === '2' && {DATASET}.moving === 'false'")
            asked = page.value("asked")
            self.assertEqual((asked.count(1), asked[-1]), (1, 0), "only when it was chosen")
            self.assertEqual(page.value("said.filter((text) => text.includes('clip is gone')).length"), 1)
            self.assertEqual(page.value("document.getElementById('play').textContent"), "Play")
            self.assertEqual((page.faults, linked.faults), ([], []))

    @staticmethod
    def names(model):
        """Of the materials of a GLB file, with commas between them."""
        data = model.read_bytes()
        return ",".join(one["name"] for one in json.loads(data[20:20 + int.from_bytes(data[12:16], "little")])["materials"])

    def test_page_comes_back_with_the_daemon(self):
        page = self.open()
        self.drag(page)
        cls = type(self)
        self.serving.stop()
        page.wait("document.getElementById('status').classList.contains('lost')")
        self.serving.__exit__()
        cls.serving = self.serve()
        cls.serving.__enter__()
        begin = time.monotonic()
        page.wait("!document.getElementById('status').classList.contains('lost')")
        print(f"back {time.monotonic() - begin:.1f} s after the daemon")


if __name__ == "__main__":
    unittest.main(verbosity=2)
