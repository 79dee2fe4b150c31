# SPDX-License-Identifier: MIT
"""libfarlight as it is installed: found by pkg-config alone, its header in C and C++, its example, and a binding."""
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

from farlight_test import BIN, ROOT, Daemon, bundled_scenes, long_test, read_png

PREFIX = "/usr/local"


@unittest.skipIf(BIN.name in ("sanitize", "coverage", "fuzz"), "programs on such a library need its compiler flags")
class LibFarlight(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="farlight-library-")
        cls.work = pathlib.Path(cls.folder.name)
        cls.root = cls.work / "root"
        cls.installed = cls.root / PREFIX.lstrip("/")
        cls.make("install", cls.root)
        cls.environment = os.environ | {"PKG_CONFIG_PATH": str(cls.installed / "lib/pkgconfig"),
                                        "LD_LIBRARY_PATH": str(cls.installed / "lib"),
                                        "FARLIGHT_LIBEXEC": str(cls.installed / "bin")}

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @staticmethod
    def make(target, root):
        """What is built is installed as it is: other tests run it meanwhile."""
        subprocess.run(["make", "-s", "-o", "all", target, f"config={BIN.name}", f"DESTDIR={root}", f"PREFIX={PREFIX}"],
                       cwd=ROOT, check=True, stdout=subprocess.DEVNULL)

    def pkg_config(self, *arguments):
        result = subprocess.run(["pkg-config", "--define-prefix", *arguments, "farlight"], env=self.environment,
                                check=True, capture_output=True, text=True)
        return result.stdout.split()

    def compile(self, *command):
        result = subprocess.run(list(map(str, command)), cwd=self.work, capture_output=True, text=True, check=False)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        return result.stdout

    def render(self, program):
        """A bundled scene by a daemon, with the example."""
        picture = self.work / "picture.png"
        picture.unlink(missing_ok=True)
        with Daemon() as daemon:
            result = subprocess.run([program, bundled_scenes() / "cornell.glb", picture.name, daemon.address],
                                    cwd=self.work, env=self.environment, capture_output=True, text=True, check=False)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertEqual(result.stdout, "160x120, 4 samples\n")
        width, height, rows, _ = read_png(picture)
        self.assertEqual((width, height), (160, 120))
        self.assertGreater(len(set(b"".join(rows))), 64, "the picture shows the scene")

    def example(self, *flags):
        source = self.installed / "share/doc/farlight/examples/render.c"
        program = self.work / "render"
        self.compile("cc", "-std=c17", "-Wall", "-Wextra", "-pedantic", "-Werror", source, *flags, "-o", program)
        return program

    def test_the_example_is_built_by_pkg_config_alone_and_renders(self):
        self.render(self.example(*self.pkg_config("--cflags", "--libs")))

    @long_test
    def test_the_example_is_built_with_the_static_library(self):
        flags = self.pkg_config("--static", "--cflags", "--libs")
        archive = str(self.installed / "lib/libfarlight.a")
        self.render(self.example(*(archive if flag == "-lfarlight" else flag for flag in flags)))

    def test_the_header_is_plain_c_and_c_plus_plus(self):
        flags = ("-Wall", "-Wextra", "-pedantic", "-Werror", *self.pkg_config("--cflags"))
        for language, standard, compiler in (("c", "c17", "cc"), ("c++", "c++17", "c++")):
            source = self.work / f"alone.{language}"
            source.write_text("#include <farlight/client.h>\nint main(void) { return fl_bytes_per_pixel"
                              "(PROTOCOL_PIXEL_FORMAT_RGBA8) == 4 ? 0 : 1; }\n")
            self.compile(compiler, "-x", language, f"-std={standard}", *flags, "-c", source, "-o", "alone.o")

    def test_the_header_includes_nothing_but_itself_and_the_standard_library(self):
        included = set()
        for header in (self.installed / "include/farlight").rglob("*.*"):
            included |= set(re.findall(r"^#\s*include\s*([\"<]\S+)", header.read_text(), re.MULTILINE))
        others = {name for name in included if not name.startswith('"farlight/')}
        self.assertLessEqual(others, {"<stdbool.h>", "<stddef.h>", "<stdint.h>"})

    def headers(self):
        """All that are installed, as a program includes them."""
        folder = self.installed / "include"
        return "".join(f"#include <{path.relative_to(folder)}>\n" for path in sorted(folder.rglob("*.h")))

    def declared(self):
        """What the installed headers declare: functions as gcc lists them, and variables."""
        source, listing = self.work / "declared.c", self.work / "declared.txt"
        source.write_text(self.headers())
        self.compile("gcc", "-std=c17", "-aux-info", listing, *self.pkg_config("--cflags"), "-c", source,
                     "-o", self.work / "declared.o")
        ours = re.escape(str(self.installed / "include/farlight"))
        names = set(re.findall(rf"^/\* {ours}/\S+:\d+:NC \*/ extern [^;]*?\b(\w+) \(", listing.read_text(), re.M))
        for path in (self.installed / "include/farlight").rglob("*.h"):
            names |= set(re.findall(r"^extern [^;(]*?(\w+)(?:\[\])?;", path.read_text(), re.MULTILINE))
        return names

    def test_the_library_has_a_soname_and_exports_what_its_headers_declare(self):
        self.assertIn("[libfarlight.so.0]", self.compile("readelf", "-d", self.installed / "lib/libfarlight.so"))
        self.assertGreater(len(self.declared()), 150)
        self.assertEqual(self.exported(), self.declared())

    @long_test
    def test_a_program_can_use_each_of_them_with_either_library(self):
        source = self.work / "each.c"
        uses = ", ".join(f"(const void *)&{name}" for name in sorted(self.declared()))
        source.write_text(f"{self.headers()}const void *const volatile each[] = {{{uses}}};\n"
                          "int main(void) { return each[0] ? 0 : 1; }\n")
        archive = str(self.installed / "lib/libfarlight.a")
        static = [archive if flag == "-lfarlight" else flag for flag in self.pkg_config("--static", "--cflags", "--libs")]
        for flags in (self.pkg_config("--cflags", "--libs"), static):
            self.compile("cc", "-std=c17", "-Wall", "-Wextra", "-Werror", source, *flags, "-o", "each")
            result = subprocess.run([self.work / "each"], env=self.environment, check=False)
            self.assertEqual(result.returncode, 0)

    def test_the_static_library_has_the_same_names(self):
        listing = self.compile("nm", "-g", "--defined-only", self.installed / "lib/libfarlight.a")
        archived = {line.split()[-1] for line in listing.splitlines() if len(line.split()) == 3}
        self.assertEqual(archived, self.exported())

    def exported(self):
        listing = self.compile("nm", "-D", "--defined-only", self.installed / "lib/libfarlight.so")
        return {line.split()[-1].split("@")[0] for line in listing.splitlines()} - {"FARLIGHT_0"}

    def test_what_the_header_declares_is_exported_and_in_the_manual(self):
        header = (self.installed / "include/farlight/client.h").read_text()
        manual = (self.installed / "share/man/man3/libfarlight.3").read_text()
        declared = set(re.findall(r"^FL_API [^;(]*?\b(fl_\w+)\(", header, re.MULTILINE))
        self.assertGreater(len(declared), 50)
        self.assertEqual(declared - self.exported(), set())
        described = set(re.findall(r"^\.Fn (\w+)", manual, re.MULTILINE))
        self.assertEqual({name for name in self.exported() if name.startswith("fl_")} - described, set())

    @long_test
    def test_uninstall_leaves_no_file_but_the_configuration(self):
        root = self.work / "removed"
        self.make("install", root)
        self.make("uninstall", root)
        left = [str(path.relative_to(root)) for path in root.rglob("*") if path.is_symlink() or not path.is_dir()]
        self.assertEqual(left, ["etc/farlight/farlightd.conf"])


if __name__ == "__main__":
    unittest.main()
