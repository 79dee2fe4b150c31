#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes messages.py, from the tables of protocol/, and version.py into a folder.

Usage: generate.py FOLDER. The C preprocessor ($CC or cc) reads the tables, as it does for the C side. A record or a
message becomes a dataclass with the defaults of the table, an enumeration an IntEnum. Fields of a record that a message
nests are attributes of the message's class. A method of the package that takes
fields of a message as keywords, and says so by @takes(messages.NAME_keywords), has a signature there with all of them.
"""
import ast
import keyword
import os
import pathlib
import re
import subprocess
import sys
import textwrap

ROOT = pathlib.Path(__file__).resolve().parents[2]
LETTERS = {"u8": "B", "u16": "H", "u32": "I", "u64": "Q"}
WIDTH = 120

# Each row of a table becomes a Python tuple. Arguments that are not strings in the table become strings.
ROWS = {
    "RECORD": "name, doc", "MESSAGE": "NAME, name, number, from, doc",
    "INT": "type, field, min, max, doc", "ENUM": "enum_name, field, doc", "REAL": "field, min, max, doc",
    "OPTION_INT": "type, field, min, max, default_value, unit, doc",
    "OPTION_REAL": "field, min, max, default_value, unit, doc", "REALS": "field, count, min, max, doc",
    "OPTION_REALS": "field, count, min, max, default_value, unit, doc", "NESTED": "record, field, doc",
    "BYTES": "field, count, doc", "STRING": "field, max, doc", "ARRAY": "record, field, max, doc",
    "BULK": "field, max, doc",
    "SETTING_WHOLE": "tracer, field, min, max, default_value, unit, doc",
    "SETTING_ONE_OF": "tracer, field, numbers, max, default_value, unit, doc",
    "SETTING_REAL": "tracer, field, min, max, default_value, unit, doc",
    "SETTING_CHOICE": "tracer, field, choices, doc",
    "ENUMERATION": "PREFIX, name, doc", "VALUE": "PREFIX, NAME, number, text, doc", "LIMIT": "type, name, doc",
}
STRINGS = {"doc", "unit", "text", "numbers"}

# Signatures: the message whose fields are keywords, and the fields that are no keywords, as the method sets or refuses them.
JOB = {"scene", "kind", "channel", "credit", "attachments", "parts", "margin", "hidden_layers"}
SIGNATURES = {
    "job": ("render", JOB), "view": ("render", JOB), "material": ("set_material", ()),
    "texture": ("set_texture", {"width", "height", "format", "arrays"}),
    "mesh": ("set_mesh", {"vertex_count", "triangle_count", "arrays", "ranges"}),
    "spheres": ("set_spheres", {"sphere_count", "arrays", "ranges"}),
    "disc": ("set_disc", {"centre_world", "normal_world"}), "light": ("set_light", ()), "camera": ("set_camera", {"fov_y"}),
    "node": ("set_node", {"kind", "object", "parent_from_node"}), "environment": ("set_environment", {"width", "height", "arrays"}),
}
FOR_ARRAYS = {"Sequence[float]": "Numbers", "Sequence[ClipUse]": "Sequence[ClipUse | Object]"}  # types that methods accept


def read(table, names):
    """Reads the rows of a table, each as a tuple that begins with its macro."""
    source = ""
    for name in names:
        arguments = ROWS[name].split(", ")
        values = [argument if argument in STRINGS else f"#{argument}" for argument in arguments]
        source += f"#define {name}({', '.join(arguments)}) (\"{name}\", {', '.join(values)}),\n"
    source += f'#include "protocol/{table}"\n'
    compiler = os.environ.get("CC", "cc").split()
    done = subprocess.run([*compiler, "-E", "-P", "-I", str(ROOT), "-xc", "-"], input=source, stdout=subprocess.PIPE,
                          text=True, check=True)
    return ast.literal_eval(f"[{done.stdout}]")


def camel(name):
    return "".join(word.capitalize() for word in name.split("_"))


def number(text):
    return int(float(text)) if "e" in text else int(text, 0)


def real(text):
    """A float of Python."""
    return text if set(text) & set(".e") else f"{text}.0"


def prose(text, indent):
    return textwrap.fill(text, WIDTH, initial_indent=indent, subsequent_indent=indent + "    ", break_on_hyphens=False,
                         break_long_words=False)


def docstring(text, fields=()):
    """Formats a docstring; `fields`: (name, doc)."""
    told = [(name, doc) for name, doc in fields if doc]
    text = text.replace("\\", "\\\\") or "See the table."
    first = prose(f'"""{text}' + ("" if told else '"""'), "    ").replace("        ", "    ")
    if not told:
        return first
    return "\n".join([first, ""] + [prose(f"{name}: {doc}", "    ") for name, doc in told] + ['    """'])


class Field:
    """A field: its descriptor, its Python type and default, and its doc."""

    def __init__(self, row):
        kind = row[0]
        self.row, self.doc = row, row[-1]
        getattr(self, kind.lower())(*row[1:-1])

    def make(self, name, descriptor, annotation, default):
        self.name = name + "_" * keyword.iskeyword(name)
        self.annotation, self.default = annotation, default
        self.descriptor = "_f." + descriptor.format(name=f'"{self.name}"')

    def keyword(self):
        """The type that a method accepts: words are checked, too."""
        word = self.annotation.removesuffix(" | str")
        return f"{word} | {word}Word" if word != self.annotation else FOR_ARRAYS.get(word, word)

    def int(self, type_, field, low, high, default=None, _unit=None):
        low, high = number(low), number(high)
        self.make(field, f'whole({{name}}, "{LETTERS[type_]}", {low}, {high})', "int", low if default is None else default)

    def option_int(self, *arguments):
        self.int(*arguments)

    def enum(self, enum_name, field):
        self.make(field, f"choice({{name}}, {camel(enum_name)})", f"{camel(enum_name)} | str", f"{camel(enum_name)}(0)")

    def real(self, field, low, high, default=None, _unit=None):
        start = default if default is not None else low if float(low) > 0 else "0"
        self.make(field, f"real({{name}}, {real(low)}, {real(high)})", "float", real(start))

    def option_real(self, *arguments):
        self.real(*arguments)

    def reals(self, field, count, low, high, default=None, _unit=None):
        start = ", ".join([real(default or (low if float(low) > 0 else "0"))] * int(count))
        self.make(field, f"real({{name}}, {real(low)}, {real(high)}, {count})", "Sequence[float]", f"({start})")

    def option_reals(self, *arguments):
        self.reals(*arguments)

    def nested(self, record, field):
        self.make(field, f"nested({{name}}, {camel(record)})", camel(record), f"{camel(record)}()")

    def bytes(self, field, count):
        self.make(field, f"exactly({{name}}, {count})", "bytes", f"bytes({count})")

    def string(self, field, high):
        self.make(field, f"text({{name}}, {high})", "str", '""')

    def array(self, record, field, high):
        self.make(field, f"array({{name}}, {camel(record)}, {high})", f"Sequence[{camel(record)}]", "()")

    def bulk(self, field, high):
        self.make(field, f"bulk({{name}}, {high})", "Bytes", 'b""')

    def setting_whole(self, tracer, field, low, high, _default, _unit):
        self.make(f"{tracer}_{field}", f'whole({{name}}, "I", {low}, {high}, zero=True)', "int", 0)

    def setting_one_of(self, tracer, field, numbers, high, _default, _unit):
        self.make(f"{tracer}_{field}", f'whole({{name}}, "I", 0, {high}, listed=(0, {numbers}))', "int", 0)

    def setting_real(self, tracer, field, low, high, default, _unit):
        zero = float(low) > 0
        self.make(f"{tracer}_{field}", f"real({{name}}, {real(low)}, {real(high)}, zero={zero})", "float",
                  "0.0" if zero else real(default))

    def setting_choice(self, tracer, field, choices):
        self.enum(choices, f"{tracer}_{field}")


def enumerations():
    lines, words = [], {}
    for row in read("words.def", ("ENUMERATION", "VALUE")):
        if row[0] == "ENUMERATION":
            lines += ["", "", f"class {camel(row[2])}(Word):", docstring(row[3] or row[2].replace("_", " ")), ""]
            listed = words[camel(row[2])] = []
        else:
            lines.append(f"    {row[2]} = {row[3]}" + (f"  # {row[5]}" if row[5] and len(row[5]) < 90 else ""))
            listed.append(row[2].lower().replace("_", "-"))
    lines += ["", ""]
    for name, listed in words.items():
        told = ", ".join(f'"{word}"' for word in listed)
        lines += textwrap.wrap(f"{name}Word = Literal[{told}]", WIDTH, subsequent_indent="    ", break_on_hyphens=False)
    return lines


def message_rows():
    """Yields each record or message: its row, and its fields."""
    groups = []
    for row in read("messages.def", [name for name in ROWS if name not in ("ENUMERATION", "VALUE", "LIMIT")]):
        if row[0] in ("RECORD", "MESSAGE"):
            groups.append((row, []))
        else:
            groups[-1][1].append(Field(row))
    return groups


def attributes(groups):
    """The fields of each record and message by its name, those of nested records among them."""
    found = {}
    for row, fields in groups:
        found[row[1] if row[0] == "RECORD" else row[2]] = [
            part for field in fields for part in (found[field.row[1]] if field.row[0] == "NESTED" else [field])]
    return found


def heads():
    """Finds the own arguments of the methods with @takes(messages.NAME_keywords), by NAME."""
    found = {}
    for path in sorted((ROOT / "client/python/farlight").glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            for decorator in getattr(node, "decorator_list", ()):
                match = re.fullmatch(r"takes\(messages\.(\w+)_keywords\)", ast.unparse(decorator))
                if match is None:
                    continue
                node.args.args[0].annotation, node.args.kwarg = ast.Name("Any"), None
                if found.setdefault(match[1], ast.dump(node.args)) != ast.dump(node.args):
                    sys.exit(f"{path.name}: {node.name} has other arguments than another method with {match[0]}")
                found[match[1] + " arguments"] = node.args
    return {name: found[f"{name} arguments"] for name in (*SIGNATURES, "change")}


def signature(name, head, keywords, doc):
    """Formats a signature; `keywords`: (name, type, default)."""
    said = ast.unparse(head) + ("" if head.kwonlyargs else ", *")
    lines = ["", "", f"def {name}_keywords("]
    lines += textwrap.wrap(f"{said},", WIDTH, initial_indent="    ", subsequent_indent="    ")
    lines += [f"    {field}: {kind} = {default}," for field, kind, default in keywords]
    return lines + [") -> None:", f'    """Keywords that {doc}."""']


def signatures(groups):
    fields = attributes(groups)
    lines = ["", "", "# What methods take: their own arguments, and fields of a message as keywords. Never called."]
    taken = heads()
    for name, (message, left_out) in SIGNATURES.items():
        own = {argument.arg for argument in taken[name].args + taken[name].kwonlyargs}
        # NEXT: the object's own number
        keywords = [(field.name, field.keyword(), "_f.NEXT" if message == f"set_{field.name}" else field.default)
                    for field in fields[message] if field.name not in own.union(left_out)]
        lines += signature(name, taken[name], keywords, f"{camel(message)} explains")
    return lines + signature("change", taken["change"], changes(fields), "the messages of objects explain")


def changes(fields):
    """Merges the fields of all kinds of objects: a name that several kinds have gets the types of all. An object keeps its
    number."""
    kinds = {"intensity": ["float"]}
    for message, listed in fields.items():
        for field in listed if message.startswith("set_") else ():
            if message != f"set_{field.name}" and field.keyword() not in kinds.setdefault(field.name, []):
                kinds[field.name].append(field.keyword())
    return [(name, " | ".join(types), "_f.KEPT") for name, types in kinds.items()]


def structs(groups):
    lines, known = [], attributes(groups)
    for row, fields in groups:
        lines += ["", "", "@dataclass"]
        name, doc = (row[1], row[2]) if row[0] == "RECORD" else (row[2], row[5])
        base = "Record" if row[0] == "RECORD" else "Message"
        lines += [f"class {camel(name)}({base}):", docstring(doc, [(field.name, field.doc) for field in known[name]])]
        if row[0] == "MESSAGE":
            lines += [f"    TYPE: ClassVar[int] = {row[3]}", f'    SENDER: ClassVar[str] = "{row[4].lower()}"']
        lines += [f'    NAME: ClassVar[str] = "{name}"', "    FIELDS: ClassVar[tuple[Field, ...]] = ("]
        lines += [f"        {field.descriptor}," for field in fields] + ["    )"]
        lines += [f"    {field.name}: {field.annotation} = {field.default}" for field in known[name]]
    names = [camel(row[2]) for row, _ in groups if row[0] == "MESSAGE"]
    lines += ["", "", "_ALL: tuple[type[Message], ...] = ("]
    lines += [textwrap.fill(", ".join(names) + ",", WIDTH, initial_indent="    ", subsequent_indent="    "), ")"]
    lines += ["MESSAGES = {each.TYPE: each for each in _ALL}"]
    return lines


def limits():
    lines = ["", "", "LIMITS = (  # that a daemon sends in the handshake, in their order: name, letter of struct, meaning"]
    lines += [f'    ("{name}", "{LETTERS[kind]}", {doc!r}),' for _, kind, name, doc in read("limits.def", ("LIMIT",))]
    return lines + [")"]


def messages():
    head = ["# SPDX-License-Identifier: MIT",
            '"""Every message of the protocol. Written by generate.py from the tables of protocol/: change those instead.',
            "", "Enumerations accept their words, too: Render(tracer=\"ldc\").", '"""',
            "from __future__ import annotations", "",
            "from collections.abc import Sequence", "from dataclasses import dataclass",
            "from typing import TYPE_CHECKING, Any, ClassVar, Literal", "",
            "from . import fields as _f", "from .fields import Bytes, Field, Message, Record, Word", "", "if TYPE_CHECKING:",
            "    from .arrays import Numbers", "    from .camera import CameraOf", "    from .frame import LayersOf",
            "    from .objects import Object", "    from .scene import MaterialsOf, Scene, Textures"]
    groups = message_rows()
    return "\n".join(head + enumerations() + structs(groups) + limits() + signatures(groups)) + "\n"


def version():
    number_ = re.search(r'FARLIGHT_VERSION "(.*)"', (ROOT / "protocol/version.h").read_text(encoding="utf-8"))[1]
    return f'# SPDX-License-Identifier: MIT\n"""The version of farlight that this package belongs to."""\nVERSION = "{number_}"\n'


def main():
    folder = pathlib.Path(sys.argv[1])
    (folder / "messages.py").write_text(messages(), encoding="utf-8")
    (folder / "version.py").write_text(version(), encoding="utf-8")


if __name__ == "__main__":
    main()
