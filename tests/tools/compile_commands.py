#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""How each source is compiled, from make's own rules; and clang over all of them.

Usage: make -nB V=1 all tests | compile_commands.py >compile_commands.json
       compile_commands.py --syntax | --tidy [PART_OF_A_PATH ..]    reads compile_commands.json
--syntax has clang check each source with our warnings as errors, without making code of it: what only one compiler
accepts is found at a tenth of the price of a build. --tidy runs clang-tidy with the checks of .clang-tidy.
Both use all processors, print what is wrong, and exit with 1 if something is. Run from the root of the project.
"""
import concurrent.futures
import json
import os
import pathlib
import shlex
import subprocess
import sys

COMMANDS = pathlib.Path("compile_commands.json")
WRAPPERS = {"ccache", "distcc"}


def from_make(lines):
    """An entry for each source; of one that is compiled several times, the first."""
    entries = {}
    for line in lines:
        words = shlex.split(line) if " -c " in line else []
        while words and os.path.basename(words[0]) in WRAPPERS:
            del words[0]
        if "-c" not in words[:-1] or "-o" not in words:
            continue
        source = words[words.index("-c") + 1]
        if source.endswith((".c", ".cpp")) and not source.startswith("build/"):
            entries.setdefault(source, {"directory": os.getcwd(), "file": source, "arguments": words,
                                        "output": words[words.index("-o") + 1]})
    return [entries[source] for source in sorted(entries)]


def syntax(entry):
    words = entry["arguments"]
    at = words.index("-o")
    words = [word for word in words[:at] + words[at + 2:] if word not in {"-c", "-MMD", "-MP"}]
    compiler = "clang++" if entry["file"].endswith(".cpp") else "clang"
    return [compiler, *words[1:], "-fsyntax-only"]


def tidy(entry):
    return ["clang-tidy", "--quiet", "-p", ".", entry["file"]]


def check(entry, command_of):
    """What a tool says of a source; empty where all is well."""
    try:
        done = subprocess.run(command_of(entry), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                              errors="replace", check=False)
    except FileNotFoundError as error:
        sys.exit(f"{error.filename} is missing: make lint-packages installs it")
    # clang-tidy counts on standard error what it suppresses; what it finds is on standard output.
    text = done.stdout if command_of is tidy and done.stdout.strip() else done.stdout + done.stderr
    return text.strip() if done.returncode or done.stdout.strip() else ""


def check_all(command_of, parts):
    entries = [entry for entry in json.loads(COMMANDS.read_text())
               if not parts or any(part in entry["file"] for part in parts)]
    with concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        texts = list(pool.map(lambda entry: check(entry, command_of), entries))
    wrong = [text for text in texts if text]
    print(*wrong, f"{command_of.__name__}: {len(entries)} sources, {len(wrong)} with faults", sep="\n")
    return 1 if wrong else 0


def main():
    if sys.argv[1:2] in (["--syntax"], ["--tidy"]):
        return check_all(syntax if sys.argv[1] == "--syntax" else tidy, sys.argv[2:])
    json.dump(from_make(sys.stdin), sys.stdout, indent=1)
    print()
    return 0


if __name__ == "__main__":
    sys.exit(main())
