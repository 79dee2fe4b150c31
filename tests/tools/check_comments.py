#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Comments that make sense alone, sources that say what they are, READMEs that are signposts.

Run from the root of the project. One line for each fault, and exit status 1. Faults are a comment that opens with a word whose subject is
elsewhere, a source without an opening line, and a README of more than README_LINES lines.

A comment is one /* .. */, or neighbouring lines of //, that hold at least one letter; the licence line is none. It opens
with its first word. The text of a row in a .def file counts as well: it becomes help, a man page and documents.
A source says what it is in a comment before its first code, set off from it: an include, a guard or an empty line follows.
For NAME.c the opening of a NAME.h in the same folder counts: what both are stands once.
"""
import pathlib
import re
import subprocess
import sys

FOLDERS = ("server", "protocol", "client", "shaders", "tests")
SOURCES = {".c", ".h", ".cpp", ".hpp", ".glsl", ".comp", ".vert", ".geom", ".frag", ".def"}
# "All-zero", "As-is" and the like are nouns.
OPENING = re.compile(r"(of|that|to|it|as|what|one|all|the same|likewise|so many)\b(?!-)", re.IGNORECASE)

README_LINES = 25
# The front page, and tables that are generated or long by nature.
LONG_READMES = {"README.md": 150, "server/README.md": 55, "tests/bench/README.md": 200}

TOKEN = re.compile(r'"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|/\*.*?\*/|//[^\n]*(?:\n[ \t]*//[^\n]*)*', re.DOTALL)
# The last argument of a row in a .def file, of several literals maybe.
DOC = re.compile(r'((?:"(?:\\.|[^"\\\n])*"\s*)+)\)')


def words_of(comment):
    """A comment's text without its marks and the licence."""
    lines = (re.sub(r"^\s*(//+[!<]?|/\*+|\*+(?!/))?\s?|\s*\*+/\s*$", "", line) for line in comment.splitlines())
    return " ".join(line.strip() for line in lines if "SPDX-License-Identifier" not in line).strip()


def comments_of(text):
    """(offset, words) of each comment."""
    for match in TOKEN.finditer(text):
        if match[0][0] == "/":
            words = words_of(match[0])
            if re.search("[A-Za-z]", words):
                yield match.start(), words


def docs_of(text):
    """(offset, words) of each text that ends a row."""
    for match in DOC.finditer(text):
        words = "".join(re.findall(r'"((?:\\.|[^"\\\n])*)"', match[1]))
        if re.search("[A-Za-z]{2}", words):
            yield match.start(), words


def opens(text):
    """Whether a source says what it is before its first code."""
    code = re.compile(r"^(?!#\s*(version|extension|ifndef FARLIGHT|define FARLIGHT_\w+$|pragma once)).*\S", re.MULTILINE)
    for start, _ in comments_of(text):
        if code.search(TOKEN.sub("", text[:start])):
            return False
        end = TOKEN.match(text, start).end()
        return re.match(r"[ \t]*\n(\s*\n|\s*#|\s*//|\s*/\*|\s*(namespace|extern)\b|\Z)", text[end:]) is not None
    return False


def source_faults():
    """A fault for each comment that opens so, and for each source that does not say what it is."""
    paths = sorted(path for folder in FOLDERS for path in pathlib.Path(folder).rglob("*") if path.suffix in SOURCES)
    texts = {path: path.read_text(encoding="utf-8") for path in paths}
    says = {path: opens(text) for path, text in texts.items()}
    for path, text in texts.items():
        for start, words in [*comments_of(text), *(docs_of(text) if path.suffix == ".def" else ())]:
            if OPENING.match(words):
                yield f"{path}:{text.count(chr(10), 0, start) + 1}: begin with the noun or the subject: {words[:80]}"
        headers = () if path.suffix not in (".c", ".cpp") else (path.with_suffix(".h"), path.with_suffix(".hpp"))
        if not says[path] and not any(says.get(header) for header in headers):
            yield f"{path}: does not open with a line that says what it is"


def readme_faults():
    """A fault for each README that is too long to be a signpost."""
    listed = subprocess.run(["git", "ls-files", "README.md", "*/README.md"], capture_output=True, text=True, check=False).stdout
    for path in filter(pathlib.Path.exists, map(pathlib.Path, listed.split())):
        lines, most = len(path.read_text(encoding="utf-8").splitlines()), LONG_READMES.get(str(path), README_LINES)
        if lines > most:
            yield f"{path}: {lines} lines, and at most {most} may be: the rest belongs where it is read"


def main():
    faults = [*source_faults(), *readme_faults()]
    for fault in faults:
        print(fault)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
