# SPDX-License-Identifier: MIT
"""The figures in tests/bench/README.md: a section for each part, between comments that name it. A run replaces the
sections of the parts that it has measured; the others stay, each with its own date and machine."""
import pathlib
import re

PATH = pathlib.Path(__file__).with_name("README.md")


def markers(name):
    return f"<!-- {name}: begin -->", f"<!-- {name}: end -->"


def section(name, title, measured, text):
    """`measured`: where and when; `text`: tables of fixed width."""
    begin, end = markers(name)
    return f"{begin}\n### {title}\n\n{measured}\n\n```\n{text.strip()}\n```\n{end}"


def replaced(document, name, new):
    """`document` with the section of a part replaced, or added behind the last one."""
    begin, end = markers(name)
    pattern = re.compile(re.escape(begin) + ".*?" + re.escape(end), re.DOTALL)
    if pattern.search(document):
        return pattern.sub(lambda _: new, document)
    return document.rstrip("\n") + "\n\n" + new + "\n"


def measured_line(facts):
    where = "software GL" if facts["software"] else "GPU"
    return (f"Measured {facts['date'][:10]} at {facts['commit']}: {facts['device']} ({where}), {facts['processor']}, "
            f"{facts['processors']} processors.")


def write(facts, parts, path=PATH):
    """`parts`: (name, title, text) of what was measured."""
    document = path.read_text()
    for name, title, text in parts:
        document = replaced(document, name, section(name, title, measured_line(facts), text))
    path.write_text(document)
