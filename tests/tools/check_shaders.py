#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""All variants of all shaders against glslangValidator: what only one driver accepts is found without the others.

A program's text is made as server/gpu/program_source.c makes it. The defines that a program may have are those that
its files ask for; each is tried alone, all and none together, for every choice that is not on or off (CHOICES).
Exit status 1 and the compiler's lines for each program that does not pass. What a compiler takes and a device may take
amiss is refused by name (HAZARDS). Run from the root of the project; needs glslang-tools.
"""
import itertools
import os
import pathlib
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

BATCH = 40  # programs in one run of the compiler
END_OF_FILE = "end_of_file_"  # a name that separates what the preprocessor writes of one file from that of the next
SHADERS = pathlib.Path("shaders")
# Program -> its stages, and the defines of which it has one combination always.
TRACERS = [{"TRAVERSE": '"naive/traverse.glsl"', "PACKET_RAYS": "1", **parts}
           for parts in ({}, {"NAIVE_PARTS": "1"})] + [
    {"TRAVERSE": '"bvh/traverse.glsl"', "PACKET_RAYS": packet, **bounds}
    for packet in ("1", "8")
    for bounds in ({"BVH_PACKED": "1"}, {})] + [
    {"TRAVERSE": '"bvh/traverse.glsl"', "PACKET_RAYS": "2", "BVH_SPHERES": "1"}] + [
    {"TRAVERSE": '"ldc/traverse.glsl"', "LDC_CUBES": cubes, "PACKET_RAYS": "1", **way}
    for cubes in "12" for way in ({"LDC_CELLS": "1"}, {}, {"LDC_TOLERANCE": "1"})] + [
    {"TRAVERSE": '"rayspace/traverse.glsl"', "PACKET_RAYS": "1"},
    {"TRAVERSE": '"quadtree/traverse.glsl"', "PACKET_RAYS": "1"}] + [
    {"TRAVERSE": '"abuffer/traverse.glsl"', "PACKET_RAYS": "1", **search}
    for search in ({}, {"ABUFFER_PARITY": "1"})]
CHOICES = {
    "trace/wave.comp": [TRACERS, [{}, {"ANY_HIT": "1"}]],
    "tree/refit_write.comp": [[{"BVH_PACKED": "1"}, {}, {"BVH_SPHERES": "1"}], [{}, {"BVH_ONE_ORDER": "1"}]],
    "rayspace/leaves.comp": [[{"LEAVES_" + stage: "1"} for stage in "TEST RANK SETTLE".split()]],
    "abuffer/voxels.comp": [[{"VOXELS_" + stage: "1"} for stage in "JUDGE REACH_X REACH_Y REACH_Z".split()]],
    "ldc/cells.comp": [[{"CELLS_" + stage: "1"} for stage in
                        "LIST BLOCKS PLACE MARK COUNT FILL FURTHER SORT REACH_X REACH_Y REACH_Z".split()]],
    "render/gather_views.comp": [[{}, {"MARK": "1"}, {"KEPT": "1"}], [{}, {"EYES": "1"}],
                                 [{"KEY_LAYERS": number} for number in "123"]],
    "render/ground.comp": [[{way: "1"} for way in "EVERY_LIGHT ONE_LIGHT OPEN".split()]],
    **{program: [[{}, {"TONE_MAP": "0u"}, {"TONE_MAP": "1u"}]] for program in
       ("render/resolve.comp", "render/resolve_ycbcr.comp")},
    "quadtree/eyes.comp": [[{"QUADTREE_LAYERS": number} for number in "123"]],
    "raster/view.vert": [[{"PRIMITIVE_KIND": kind, "HAS_SPHERES": "1"} for kind in "012"],
                         [{}, {"HAS_LAYERS": "1"}, {"K_BUFFER": "2"}, {"K_BUFFER": "3"}]],
    "ldc/build.frag": [[{"PRIMITIVE_KIND": "0"}, {"PRIMITIVE_KIND": "1", "HAS_SPHERES": "1"}],
                       [{"BUILD_PASS": number} for number in "012"]],
    "abuffer/build.frag": [[{"PRIMITIVE_KIND": "0", "ALL_IMAGES": "1"},
                            {"PRIMITIVE_KIND": "1", "HAS_SPHERES": "1", "ALL_IMAGES": "1"}], [{}, {"WITHOUT_STEEP": "1"}]],
}
# Defines that come only with others.
WITH = {"BVH_DEFORMS_IN_SHUTTER": ("BVH_DEFORMS", "HAS_MOTION"), "BVH_RESUMES": ("BVH_BUDGET",),
        "HAS_ANISOTROPY_MAP": ("HAS_ANISOTROPY",), "LIGHT_GROUPS": ("LIGHT_LAYERS",)}
# Defines that never come with others: tracers that know the scene as the shutter opens refuse rays with times.
WITHOUT = {f'"{tracer}/traverse.glsl"': ("HAS_MOTION",) for tracer in ("ldc", "abuffer", "quadtree")}
# Of a sample a pixel, without a lens and other layers of the picture.
WITHOUT |= {what: ("HAS_UNKNOWN", "HAS_LENS") for what in ("MARK", "KEPT")}
WITHOUT["EYES"] = ("HAS_LENS",)  # these need rays
# And in programs of a folder, but for some: what moves is met by tracers, and shaded where it was met; emitters alone are
# looked for. Light is noted where it is shaded and gathered.
WITHOUT_IN = {"render": ("HAS_MOTION", "LIGHT_LAYERS", "LIGHT_GROUPS")}
MAY_MOVE = ("render/path.comp", "render/distributed.comp", "render/ground.comp", "render/wireframe.comp")
NOTES_LIGHT = ("render/path.comp", "render/distributed.comp", "render/ground.comp", "render/gather.comp")
IN_ALL_THE_SAME = {"HAS_MOTION": MAY_MOVE, "LIGHT_LAYERS": NOTES_LIGHT, "LIGHT_GROUPS": NOTES_LIGHT}
STAGES = {"raster/view.vert": ["raster/view.vert", "raster/view.frag"],
          "ldc/build.frag": ["raster/draw.vert", "raster/draw.geom", "ldc/build.frag"],
          "abuffer/build.frag": ["raster/draw.vert", "raster/draw.geom", "abuffer/build.frag"]}
# What a stage declares, and the limit that is asked of a driver for it (server/gpu/limits.def); none: nothing is there.
LIMITS = pathlib.Path("server/gpu/limits.def")
LIMIT = re.compile(r"^LIMIT\((\w+), +(\d+),", re.MULTILINE)
COUNTED = {
    "storage blocks": (re.compile(r"\bbuffer\s+\w+\s*\{"),
                       {".comp": "MAX_COMPUTE_SHADER_STORAGE_BLOCKS", ".vert": "MAX_VERTEX_SHADER_STORAGE_BLOCKS",
                        ".frag": "MAX_FRAGMENT_SHADER_STORAGE_BLOCKS"}),
    "uniform blocks": (re.compile(r"\buniform\s+\w+\s*\{"),  # OpenGL promises each stage as many
                       {stage: "MAX_COMPUTE_UNIFORM_BLOCKS" for stage in (".comp", ".vert", ".geom", ".frag")}),
    "samplers": (re.compile(r"\buniform\s+[iu]?sampler\w+\s+\w+"),
                 {".comp": "MAX_COMPUTE_TEXTURE_IMAGE_UNITS", ".vert": "MAX_VERTEX_TEXTURE_IMAGE_UNITS",
                  ".geom": "MAX_GEOMETRY_TEXTURE_IMAGE_UNITS", ".frag": "MAX_TEXTURE_IMAGE_UNITS"}),
    "images": (re.compile(r"\buniform\s+(?:\w+\s+)*?[iu]?image\w+\s+\w+"),
               {".comp": "MAX_COMPUTE_IMAGE_UNIFORMS", ".frag": "MAX_FRAGMENT_IMAGE_UNIFORMS"}),
    "colours": (re.compile(r"\bout\s+\w+\s+\w+\s*;"), {".frag": None}),
}
STORAGE_POINT = re.compile(r"\bbinding\s*=\s*(\d+)\s*\)[^;{}()]*\bbuffer\s+\w+\s*\{")
POINTS_LIMIT = "MAX_SHADER_STORAGE_BUFFER_BINDINGS"
WRITTEN, WRITTEN_LIMIT = ("storage blocks", "images", "colours"), "MAX_COMBINED_SHADER_OUTPUT_RESOURCES"

# What GLSL allows and this project does not: of the text of a file without comments.
HAZARDS = [
    (re.compile(r"\bbool\s+\w+\s*\[|\bbool\s*\[\s*\w*\s*\]"),
     "an array of bool, over which Mesa's zink fails: take the bits of a uint"),
    (re.compile(r"\bu?intBitsToFloat\(\s*(?:\w+\.)*"
                r"\w*(?:words|bits|index|material|primitive|instance|flags|count|number)\s*\)"),
     "an integer in a float, whose bits a device may change: carry floats in integers instead"),
]
# Functions whose values several programs must agree on to the bit: what they compute with more than one rounding is
# `precise`, in a statement of its own, as a compiler may fuse a product and a sum in one program and not in another.
PRECISE = {
    "common/affine.glsl": ("affine_point", "affine_vector", "affine_covector"),
    "common/intersect.glsl": ("intersect_triangle",),
    "raster/fragment.glsl": ("triangle_depth_cells", "chord_of_sphere", "intersection_of"),
}
ROUNDS = re.compile(r"^[ \t]*(?:return|\w+|(?:float|vec[234])[ \t]+\w+)[ \t]*=?[^;=\n]*"
                    r"(?:\*[^;]*[-+]|[-+][^;]*\*|\b(?:dot|cross)\()[^;]*;", re.MULTILINE)
WRITES_POSITION = re.compile(r"\bgl_Position\s*=")
INVARIANT_POSITION = re.compile(r"\binvariant\s+gl_Position\s*;")

DIRECTIVE = re.compile(r"^[ \t]*#[ \t]*(include|version)\b[ \t]*(.*?)[ \t]*$")
QUOTED = re.compile(r'^"([^"]*)"')
ASKED = re.compile(r"^[ \t]*#[ \t]*(?:ifdef[ \t]+(\w+)|(?:el)?if\b(.*))", re.MULTILINE)
OWN = re.compile(r"^[ \t]*#[ \t]*define[ \t]+(\w+)", re.MULTILINE)
UNIFORM = re.compile(r"^[ \t]*uniform (\w+) ([^;]*);", re.MULTILINE)
DEFINED = re.compile(r"\bdefined[ \t]*\(?[ \t]*(\w+)")


def file_of(path):
    return SHADERS / path


def expand(path, defines, files):
    """The lines of a file with everything that it includes; `files` grows by the files' names."""
    if path in files:
        return [""]
    files.append(path)
    number = files.index(path)
    lines = [f"#line 1 {number}"]
    for i, line in enumerate(file_of(path).read_text().splitlines(), 1):
        found = DIRECTIVE.match(line)
        if not found:
            lines.append(line)
        elif found[1] == "version" or found[2].startswith("<"):
            lines.append("")
        else:
            quoted = QUOTED.match(found[2]) or QUOTED.match(defines.get(found[2].split()[0], ""))
            if not quoted:
                sys.exit(f"{path}:{i}: #include names no file")
            lines += expand(quoted[1], defines, files) + [f"#line {i + 1} {number}"]
    return lines


def text_of(path, defines):
    files = []
    head = ["#version 450 core"]
    head += [f"#define {name} {value}" for name, value in defines.items() if not value.startswith('"')]
    return "\n".join(head + expand(path, defines, files)) + "\n", files


def with_block(texts):
    """The uniforms of a program's stages in one block, and copies of them, as server/gpu/uniforms.c has them."""
    members = {(kind, name.strip()): None for text in texts for kind, names in UNIFORM.findall(text)
               for name in names.split(",")}
    copies = "#define UNIFORMS_AT_START " in texts[0]
    copied = [member for member in members if copies and "[" not in member[1]]
    block = "".join(f"{kind} at_start({kind} v) {{ return v; }} "
                    for kind in "bool uint int float vec2 vec3 vec4".split() if copies)
    if members:
        block += "layout(std140, binding = 2) uniform pass_block {" + " ".join(
            f"{kind} {name}{'_in_block' if (kind, name) in copied else ''};" for kind, name in members) + "}; "
    block += " ".join(f"{kind} {name} = at_start({name}_in_block);" for kind, name in copied)
    texts = [UNIFORM.sub("", text) for text in texts]
    return [text.replace("#line 1 0\n", block + "\n#line 1 0\n", 1) for text in texts]


def optional_defines(paths, chosen, all_chosen):
    """What the files ask for and the host may set or not."""
    names = set()
    for path in paths:
        text, _ = text_of(path, chosen)
        for ifdef, condition in ASKED.findall(text):
            names.update([ifdef] if ifdef else DEFINED.findall(condition))
        names.difference_update(OWN.findall(text))
    return sorted(name for name in names if name not in all_chosen and not name.startswith("GL_"))


def variants(program):
    stages = STAGES.get(program, [program])
    combinations = [{name: value for part in parts for name, value in part.items()}
                    for parts in itertools.product(*CHOICES.get(program, [[{}]]))]
    all_chosen = {name for combination in combinations for name in combination}
    for chosen in combinations:
        never = [name for one in chosen for name in WITHOUT.get(one, ()) + WITHOUT.get(chosen[one], ())] + [
            name for name in WITHOUT_IN.get(program.split("/")[0], ()) if program not in IN_ALL_THE_SAME[name]]
        optional = [name for name in optional_defines(stages, chosen, all_chosen) if name not in never]
        for on in [[], optional] + [[name] for name in optional if len(optional) > 1]:
            if on or on is not optional:
                on = [*on, *(other for name in on for other in WITH.get(name, ()))]
                yield stages, {**chosen, **{name: "1" for name in on}}


def run(arguments):
    done = subprocess.run(["glslangValidator", *arguments], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def complaints_in(log, files_of, programs):
    """Lines of a log, in which `0:12` stands for a file of the stage that was named last and its line."""
    complaints, files, program = [], [], ""
    for line in log.splitlines():
        files, program = files_of.get(line.strip(), files), programs.get(line.strip(), program)
        if re.match("ERROR|WARNING", line):
            line = re.sub(r"^(\w+: )(\d+):", lambda m: f"{m[1]}{files[int(m[2])] if files else '?'}:", line)
            complaints.append(f"{program}: {line}")
    return complaints


def declared(paths):
    """Of each file the numbers of COUNTED and its storage blocks' points, once the preprocessor is through with it."""
    parts = run(["-E", *paths])[1].split(END_OF_FILE)
    return [({what: len(pattern.findall(part)) for what, (pattern, _) in COUNTED.items()},
             [int(point) for point in STORAGE_POINT.findall(part)]) for part in parts[:len(paths)]]


def needs_of(paths, files):
    """What the programs ask of a driver: (limit, number, of which file). The colours of a stage before the last are none."""
    needs, written = [], {}
    for path, (counts, points) in zip(paths, files):
        suffix, program = pathlib.Path(path).suffix, pathlib.Path(path).stem
        needs += [(POINTS_LIMIT, 1 + max(points), path)] if points else []
        for what, count in counts.items():
            limits = COUNTED[what][1]
            if count and suffix in limits and limits[suffix]:
                needs.append((limits[suffix], count, path))
            elif count and what != "colours":
                needs.append((f"{what} in {suffix}", count, path))
            if what in WRITTEN and suffix in (".comp", ".frag"):
                written[program] = (written.get(program, (0, path))[0] + count, path)
    return needs + [(WRITTEN_LIMIT, *of_program) for of_program in written.values()]


def complaints_of(batch):
    """What is wrong with these programs, and the most that they need of each limit. Many in one run: most of the compiler's
    time is its start. Programs of several stages are linked as well, each by itself."""
    complaints, files_of, programs, needed = [], {}, {}, {}
    limits = {name: int(maximum) for name, maximum in LIMIT.findall(LIMITS.read_text())}
    with tempfile.TemporaryDirectory() as folder:
        for number, (stages, defines) in enumerate(batch):
            shown = " ".join(f"{name}={value}" for name, value in defines.items())
            expanded = [text_of(stage, defines) for stage in stages]
            for stage, text, (_, names) in zip(stages, with_block([text for text, _ in expanded]), expanded):
                path = os.path.join(folder, f"variant{number}" + pathlib.Path(stage).suffix)
                pathlib.Path(path).write_text(f"{text}\nstruct {END_OF_FILE} {{ int unused; }};\n")
                files_of[path], programs[path] = names, f"{stages[0]} [{shown}]"
        files = declared(files_of)
        complaints += [f"{programs[path]}: two storage blocks have one binding, or one has none: {points}"
                       for path, (counts, points) in zip(files_of, files)
                       if not len(set(points)) == len(points) == counts["storage blocks"]]
        for limit, count, path in needs_of(files_of, files):
            needed[limit] = max(count, needed.get(limit, 0))
            if count > limits.get(limit, 0):
                complaints.append(f"{programs[path]}: needs {count} of {limit}; {LIMITS} asks for {limits.get(limit, 0)}")
        linked = [[path for path in files_of if path.startswith(os.path.join(folder, f"variant{number}."))]
                  for number, (stages, _) in enumerate(batch) if len(stages) > 1]
        alone = [path for path in files_of if not any(path in paths for paths in linked)]
        for arguments in [*([alone] if alone else []), *(["-l", *paths] for paths in linked)]:
            status, log = run(arguments)
            found = complaints_in(log, files_of, programs)
            complaints += found if found or status == 0 else [log]
    return complaints, needed


def hazards_of(path):
    text = re.sub(r"//[^\n]*|/\*.*?\*/", lambda m: "\n" * m[0].count("\n"), path.read_text(), flags=re.DOTALL)
    complaints = [(text[:found.start()].count("\n") + 1, why) for pattern, why in HAZARDS
                  for found in pattern.finditer(text)]
    position = WRITES_POSITION.search(text)
    if position and not INVARIANT_POSITION.search(text):
        complaints.append((text[:position.start()].count("\n") + 1,
                           "gl_Position is not invariant: programs with this stage may cover different pixels"))
    name = next((name for name in PRECISE if path.match("shaders/" + name)), None)
    for function in PRECISE.get(name, ()):
        begin = re.search(rf"^\w+ {function}\([^;{{]*\)\s*{{", text, re.MULTILINE).end()
        for found in ROUNDS.finditer(text, begin, text.index("\n}", begin)):
            complaints.append((text[:found.start()].count("\n") + 1,
                               f"{function} is not precise here, and programs must agree on it"))
    return [f"{path}:{line}: {why}" for line, why in sorted(complaints)]


def main():
    stages = {stage for program, stages in STAGES.items() for stage in stages if stage != program}
    found = sorted(str(path.relative_to(SHADERS)) for suffix in ("comp", "vert", "frag") for path in SHADERS.rglob("*." + suffix))
    found = [program for program in found if program not in stages]
    all_variants = [variant for program in found for variant in variants(program)]
    batches = [all_variants[i:i + BATCH] for i in range(0, len(all_variants), BATCH)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(complaints_of, batches))
    complaints = [line for lines, _ in results for line in lines]
    needed = {limit: max(one.get(limit, 0) for _, one in results) for _, of in results for limit in of}
    complaints += [f"{LIMITS}: asks for {asked} of {limit}, of which programs need {needed[limit]}"
                   for limit, asked in LIMIT.findall(LIMITS.read_text()) if needed.get(limit, int(asked)) < int(asked)]
    complaints += [line for suffix in ("comp", "vert", "geom", "frag", "glsl")
                   for path in sorted(SHADERS.rglob("*." + suffix)) for line in hazards_of(path)]
    print("\n".join(complaints), end="\n" if complaints else "")
    print(f"{len(all_variants)} variants of {len(found)} programs, {len(complaints)} complaints", file=sys.stderr)
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
