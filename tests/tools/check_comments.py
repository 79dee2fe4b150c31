#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Comments that make sense alone: how many open with a word whose subject is elsewhere, and which sources do not say what
they are.

Usage: check_comments.py [--table | --rows | --list WORD.. | --unopened]. Run from the root of the project.
Without arguments: one line for each fault, and exit status 1. A fault is a room whose share of such openings, or whose
number of sources without an opening line, is above its row in AT_MOST.
--table prints the figures of all rooms, --rows AT_MOST as it would be today, --list the comments that open so in files whose
path begins with a WORD, --unopened the sources without an opening line.

A comment is one /* .. */, or neighbouring lines of //, that hold at least one letter; the licence line is none. It opens
with its first word. `(docs)` are the texts of rows in .def files, which become help, man pages and documents.
A source says what it is in a comment before its first code, set off from it: an include, a guard or an empty line follows.
For NAME.c the opening of a NAME.h in the same folder counts: what both are stands once.
"""
import collections
import math
import pathlib
import re
import sys

FOLDERS = ("server", "protocol", "client", "shaders")
SOURCES = {".c", ".h", ".cpp", ".hpp", ".glsl", ".comp", ".vert", ".geom", ".frag", ".def"}
# "All-zero", "As-is" and the like are nouns.
OPENING = re.compile(r"(of|that|to|it|as|what|one|all|the same|likewise|so many)\b(?!-)", re.IGNORECASE)

# Room: (percent of its comments, sources without an opening line). Figures only go down; 4 percent and 0 are the goal.
AT_MOST = {
    "client/cli": (4, 0),
    "client/edit": (4, 0),
    "client/helper": (4, 0),
    "client/import": (4, 0),
    "client/lib": (4, 0),
    "client/options": (4, 0),
    "client/output": (4, 0),
    "client/video": (4, 0),
    "client/viewer": (4, 0),
    "client/warp": (4, 0),
    "client/web": (4, 0),
    "protocol": (4, 0),
    "protocol (docs)": (4, 0),
    "protocol/common": (4, 0),
    "protocol/docs": (4, 0),
    "protocol/pixels": (4, 0),
    "protocol/sealed": (4, 0),
    "server": (4, 0),
    "server/base": (4, 0),
    "server/check": (4, 0),
    "server/encode": (4, 0),
    "server/engine": (4, 0),
    "server/front": (4, 0),
    "server/gpu": (4, 0),
    "server/gpu (docs)": (4, 0),
    "server/gpu_scene": (4, 0),
    "server/host_passes": (4, 0),
    "server/net": (4, 0),
    "server/render": (4, 0),
    "server/scene": (4, 0),
    "server/session": (4, 0),
    "server/store": (4, 0),
    "server/trace": (4, 0),
    "shaders/abuffer": (4, 0),
    "shaders/bvh": (4, 0),
    "shaders/common": (4, 0),
    "shaders/gpu_scene": (4, 0),
    "shaders/ldc": (4, 0),
    "shaders/naive": (4, 0),
    "shaders/quadtree": (4, 0),
    "shaders/raster": (4, 0),
    "shaders/rayspace": (4, 0),
    "shaders/render": (4, 0),
    "shaders/shared": (4, 0),
    "shaders/trace": (4, 0),
    "shaders/tree": (4, 0),
}
UNNAMED = (4, 0)  # a room that has no row

TOKEN = re.compile(r'"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|/\*.*?\*/|//[^\n]*(?:\n[ \t]*//[^\n]*)*', re.DOTALL)
# The last argument of a row in a .def file, of several literals maybe.
DOC = re.compile(r'((?:"(?:\\.|[^"\\\n])*"\s*)+)\)')


def words_of(comment):
    """A comment's text without its marks and the licence."""
    lines = (re.sub(r"^\s*(//+[!<]?|/\*+|\*+(?!/))?\s?|\s*\*+/\s*$", "", line) for line in comment.splitlines())
    return " ".join(line.strip() for line in lines if "SPDX-License-Identifier" not in line).strip()


def comments_of(text):
    """(offset, end, words) of each comment."""
    for match in TOKEN.finditer(text):
        if match[0][0] == "/":
            words = words_of(match[0])
            if re.search("[A-Za-z]", words):
                yield match.start(), match.end(), words


def docs_of(text):
    """(offset, end, words) of each text that ends a row."""
    for match in DOC.finditer(text):
        words = "".join(re.findall(r'"((?:\\.|[^"\\\n])*)"', match[1]))
        if re.search("[A-Za-z]{2}", words):
            yield match.start(), match.end(), words


def opens(text):
    """Whether a source says what it is before its first code."""
    code = re.compile(r"^(?!#\s*(version|extension|ifndef FARLIGHT|define FARLIGHT_\w+$|pragma once)).*\S", re.MULTILINE)
    for start, end, _ in comments_of(text):
        before = TOKEN.sub("", text[:start])
        if code.search(before):
            return False
        return re.match(r"[ \t]*\n(\s*\n|\s*#|\s*//|\s*/\*|\s*(namespace|extern)\b|\Z)", text[end:]) is not None
    return False


def room_of(path):
    """server/trace for server/trace/bvh/bvh.c; a file's own folder where it lies higher."""
    return "/".join(path.parts[:2]) if len(path.parts) > 2 else path.parts[0]


def read():
    """(found, counted, unopened, sources): openings found by room, numbers of comments, sources without an opening line."""
    found, counted = collections.defaultdict(list), collections.Counter()
    unopened, sources = collections.defaultdict(list), collections.Counter()
    paths = sorted(path for folder in FOLDERS for path in pathlib.Path(folder).rglob("*") if path.suffix in SOURCES)
    texts = {path: path.read_text(encoding="utf-8") for path in paths}
    says = {path: opens(text) for path, text in texts.items()}
    for path, text in texts.items():
        room = room_of(path)
        kinds = [(room, comments_of(text))] + [(f"{room} (docs)", docs_of(text))] * (path.suffix == ".def")
        for row, all_words in kinds:
            for start, _, words in all_words:
                counted[row] += 1
                if OPENING.match(words):
                    found[row].append((path, text.count("\n", 0, start) + 1, words))
        sources[room] += 1
        headers = () if path.suffix not in (".c", ".cpp") else (path.with_suffix(".h"), path.with_suffix(".hpp"))
        if not says[path] and not any(says.get(header) for header in headers):
            unopened[room].append(path)
    return found, counted, unopened, sources


def main(arguments):
    found, counted, unopened, sources = read()
    if "--list" in arguments:
        words = tuple(word for word in arguments if not word.startswith("--")) or FOLDERS
        for rows in found.values():
            for path, line, text in rows:
                if str(path).startswith(words):
                    print(f"{path}:{line}: {text[:110]}")
        return 0
    if "--unopened" in arguments:
        print("\n".join(str(path) for rows in unopened.values() for path in rows))
        return 0
    if "--table" in arguments:
        print("room                        comments   open so      %   sources   unopened")
        for row in sorted(counted):
            share = 100 * len(found[row]) / counted[row]
            print(f"{row:26} {counted[row]:9} {len(found[row]):9} {share:6.1f} {sources[row]:9} {len(unopened[row]):10}")
        number, total = sum(map(len, found.values())), sum(counted.values())
        print(f"{'all':26} {total:9} {number:9} {100 * number / total:6.1f} {sum(sources.values()):9} "
              f"{sum(map(len, unopened.values())):10}")
        return 0
    if "--rows" in arguments:
        for row in sorted(counted):
            print(f'    "{row}": ({max(4, math.ceil(100 * len(found[row]) / counted[row]))}, {len(unopened[row])}),')
        return 0
    failed = False
    for row in sorted(counted):
        percent, without = AT_MOST.get(row, UNNAMED)
        if 100 * len(found[row]) > percent * counted[row]:
            failed = True
            print(f"{row}: {len(found[row])} of {counted[row]} comments open with Of, That, To, It, As, What, One, All or the like, "
                  f"and at most {percent} % may: begin with the noun (check_comments.py --list {row.split()[0]})")
        if len(unopened[row]) > without:
            failed = True
            print(f"{row}: {len(unopened[row])} sources do not open with a line that says what they are, and at most {without} may: "
                  f"{', '.join(str(path) for path in unopened[row][:8])}")
    for row in sorted(AT_MOST.keys() - counted.keys()):
        failed = True
        print(f"{row}: AT_MOST has a row for a room without comments")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
