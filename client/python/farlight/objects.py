# SPDX-License-Identifier: MIT
"""A scene at its client: objects by kind and number, each stored as the message that makes it. No connection: clients send the
changes since the last time; a new connection gets everything."""
from __future__ import annotations

import collections
import copy
import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from . import fields, messages
from .blobs import blob_hash
from .errors import InvalidValue
from .fields import Bytes, Message, takes
from .messages import NodeKind, ObjectKind, Sharing


class Object(NamedTuple):
    """An object of a scene: its kind, and its number among objects of that kind."""
    kind: ObjectKind
    number: int

    def __repr__(self) -> str:
        return f"<{self.kind.word} {self.number}>"


ENVIRONMENT = Object(ObjectKind.ENVIRONMENT, 1)  # part of every scene
ATTACHED_FROM = 1 << 20  # first identifier of new objects in a scene that other clients have made
KINDS: dict[type[Message], ObjectKind] = {
    messages.SetNode: ObjectKind.NODE, messages.SetMesh: ObjectKind.MESH, messages.SetSpheres: ObjectKind.SPHERES,
    messages.SetMaterial: ObjectKind.MATERIAL, messages.SetTexture: ObjectKind.TEXTURE,
    messages.SetLight: ObjectKind.LIGHT, messages.SetCamera: ObjectKind.CAMERA, messages.SetDisc: ObjectKind.DISC,
    messages.SetSkin: ObjectKind.SKIN, messages.SetClip: ObjectKind.CLIP, messages.SetChannel: ObjectKind.CHANNEL,
    messages.SetEnvironment: ObjectKind.ENVIRONMENT,
}
SHOWN = {ObjectKind.MESH: NodeKind.MESH, ObjectKind.SPHERES: NodeKind.SPHERES, ObjectKind.LIGHT: NodeKind.LIGHT,
         ObjectKind.CAMERA: NodeKind.CAMERA}


@dataclass(frozen=True, eq=False)
class Names:
    """Names of the objects of a scene at the time of sending: entries as from Client.objects()."""
    nodes: dict[int, messages.ObjectEntry]
    materials: dict[int, messages.ObjectEntry]

    @classmethod
    def of(cls, nodes: Iterable[messages.ObjectEntry], materials: Iterable[messages.ObjectEntry]) -> Names:
        """Makes names from lists of objects."""
        return cls({one.object: one for one in nodes}, {one.object: one for one in materials})

    def called(self, name: str) -> tuple[set[int], set[int]]:
        """The numbers of the nodes with this name and of all nodes below them; if there is none, of the materials."""
        nodes = self.below({number for number, entry in self.nodes.items() if entry.name == name})
        return nodes, set() if nodes else {number for number, entry in self.materials.items() if entry.name == name}

    def below(self, nodes: set[int]) -> set[int]:
        """Adds all nodes below these nodes."""
        children: dict[int, list[int]] = {}
        for number, entry in self.nodes.items():
            children.setdefault(entry.parent, []).append(number)
        found, added = set(nodes), list(nodes)
        while added:
            new = set(children.get(added.pop(), ())) - found
            found |= new
            added += new
        return found


def kind_of(kind: ObjectKind | str) -> ObjectKind:
    """Converts an object kind or its word."""
    try:
        return ObjectKind(ObjectKind.of(kind))
    except ValueError as why:
        raise InvalidValue(str(why), field="kind") from None


def _check_names(kind: type[Message], given: Iterable[str], known: Sequence[str]) -> None:
    """Raises InvalidValue for an unknown name, and suggests similar names, else lists all."""
    for name in given:
        if name not in known:
            like = difflib.get_close_matches(name, known)
            raise InvalidValue("there is no such keyword", field=f"{kind.NAME}.{name}",
                               remedy=f"did you mean {' or '.join(like)}?" if like else f"there are {', '.join(known)}")


def make(kind: type[Message], values: dict[str, Any]) -> Any:
    """Makes a message with these values; raises InvalidValue for an unknown field."""
    _check_names(kind, values, kind.names())
    return kind(**values)


def _changeable(edit: Message) -> list[str]:
    """Lists the keywords of change(): every field except the object's own number, which would make another object."""
    lit = isinstance(edit, (messages.SetLight, messages.SetEnvironment))
    return [name for name in edit.names() if edit.NAME != f"set_{name}"] + ["intensity"] * lit


def _with_intensity(edit: Message, values: dict[str, Any]) -> dict[str, Any]:
    """Replaces `intensity` of lights and of the environment, the largest number of their colour, as in `farlight view`."""
    if "intensity" not in values:
        return values
    assert isinstance(edit, (messages.SetLight, messages.SetEnvironment))
    colour = [float(one) for one in values.get("colour", edit.colour)]
    largest, intensity = max(colour, default=0), float(values["intensity"])
    made = [one / largest * intensity for one in colour] if largest > 0 else [intensity] * 3
    return {**{name: value for name, value in values.items() if name != "intensity"}, "colour": made}


class Objects:
    """Objects by number, with the version of the scene that set each."""

    def __init__(self, name: str, sharing: Sharing | str) -> None:
        try:
            self.sharing = Sharing(Sharing.of(sharing))
        except ValueError as why:
            raise InvalidValue(str(why), field="scene_open.sharing") from None
        if not isinstance(name, str):
            raise InvalidValue(f"{name!r:.80} is no text", field="scene_open.name")
        self.name, self.is_attached = name, False
        self.version = 0  # counts changes
        self.notes: list[str] = []  # notes of an import
        self._objects: dict[Object, tuple[int, Message, bytes]] = {}  # version, message, and its encoding
        self._made: dict[Object, int] = {}  # version that made the object
        self._removed: dict[Object, tuple[int, int]] = {}  # versions that made and removed the object
        self._numbers: dict[ObjectKind, int] = {}
        self._blobs: dict[bytes, Bytes] = {}

    def __repr__(self) -> str:
        counts = collections.Counter(key.kind.word for key in self._objects)
        listed = ", ".join(f"{word}: {count}" for word, count in counts.items()) or "empty"
        return f"<farlight.Scene {self.name + ' ' if self.name else ''}{listed}>"

    def __contains__(self, thing: object) -> bool:
        return thing in self._objects

    def set(self, edit: Message) -> Object:
        """Creates or replaces an object by its message, whose blobs were registered by blob(). An equal message changes
        nothing."""
        kind = KINDS.get(type(edit))
        if kind is None:
            raise InvalidValue("is no edit of an object", field=getattr(edit, "NAME", "edit"))
        encoded = fields.encode(edit)
        key = ENVIRONMENT if kind == ObjectKind.ENVIRONMENT else Object(kind, getattr(edit, edit.FIELDS[0].name))
        if key in self._objects and self._objects[key][2] == encoded:
            return key  # unchanged: nothing to send
        self.version += 1
        self._objects[key] = (self.version, copy.copy(edit), encoded)
        self._made.setdefault(key, self._removed[key][0] if key in self._removed else self.version)
        self._removed.pop(key, None)
        self._numbers[key.kind] = max(self._numbers.get(key.kind, 0), key.number)
        return key

    def check(self, thing: Object, kinds: Iterable[ObjectKind], field: str) -> int:
        """The number of an argument; raises InvalidValue if it is not an object of these kinds or not of this scene."""
        if not isinstance(thing, Object) or thing.kind not in kinds:
            wanted = "object" if kinds is ObjectKind else " or ".join(kind.word for kind in kinds)
            raise InvalidValue(f"{thing!r:.80} is no {wanted} of the scene", field=field,
                               remedy="give a result of an add_ function, find() or objects()")
        if thing not in self._objects and not self.is_attached and thing != ENVIRONMENT:
            raise InvalidValue(f"{thing.kind.word} {thing.number} is not in this scene", field=field)
        return thing.number

    def get(self, thing: Object) -> Any:
        """A copy of the object's message; use change() to change the object."""
        self.check(thing, ObjectKind, "object")
        if thing in self._objects:
            return copy.copy(self._objects[thing][1])
        if self.is_attached:
            raise InvalidValue(f"other clients' changes of {thing.kind.word} {thing.number} are unknown here", field="object",
                               remedy="read() it with the client, and set() the result")
        return messages.SetEnvironment()

    @takes(messages.change_keywords)
    def change(self, thing: Object, **values: Any) -> None:
        """Changes some fields of an object: change(steel, roughness=0.2), change(farlight.ENVIRONMENT, rotation=1). Lights and
        the environment also have `intensity`: the largest of the colour's numbers. Type checkers know the fields of all kinds
        of objects, but not which kind this one is."""
        edit = self.get(thing)
        _check_names(type(edit), values, _changeable(edit))
        try:
            values = _with_intensity(edit, values)
        except (TypeError, ValueError):
            raise InvalidValue("intensity and colour must be numbers", field=f"{edit.NAME}.intensity") from None
        self.set(replace(edit, **values))

    def shown(self, node: Object) -> Object | None:
        """The object that a node shows: change(shown(light), colour=(9, 9, 9))."""
        self.check(node, (ObjectKind.NODE,), "node")
        edit = self.get(node)
        kind = next((kind for kind, shows in SHOWN.items() if shows == edit.kind), None)
        return None if kind is None else Object(kind, edit.object)

    def remove(self, thing: Object) -> None:
        """Removes an object, and with a node all nodes below it, as at the daemon; the commit fails if a remaining node uses
        it."""
        self.check(thing, [kind for kind in ObjectKind if kind != ObjectKind.ENVIRONMENT], "object")
        children: dict[int, list[Object]] = {}
        if thing.kind == ObjectKind.NODE:
            for key, (_, edit, _) in self._objects.items():
                if isinstance(edit, messages.SetNode):
                    children.setdefault(edit.parent, []).append(key)
        below = [thing]
        for one in below:
            below += children.pop(one.number, ())
        for one in reversed(below):  # children before their parents
            self.version += 1
            # An object that was not set here is another client's, and older than the first version.
            self._removed[one] = (self._made.pop(one, 0), self.version)
            self._objects.pop(one, None)

    def find(self, kind: ObjectKind | str, name: str) -> list[Object]:
        """Finds the objects with this name; objects from a file have the file's names."""
        wanted = kind_of(kind)
        return [key for key, (_, edit, _) in self._objects.items()
                if key.kind == wanted and getattr(edit, "name", None) == name]

    def objects(self, kind: ObjectKind | str) -> list[Object]:
        """Lists all objects of a kind."""
        wanted = kind_of(kind)
        return [key for key in self._objects if key.kind == wanted]

    def blob(self, data: Bytes) -> messages.BlobRef:
        """Stores the bytes, and returns the reference to them."""
        try:
            view = memoryview(data).cast("B")
        except TypeError:
            raise InvalidValue(f"{data!r:.80} are no contiguous bytes", field="blob") from None
        name = blob_hash(view)
        self._blobs[name] = view
        return messages.BlobRef(len(view), name)

    def blob_bytes(self, reference: messages.BlobRef) -> Bytes:
        """The stored bytes of a reference."""
        return self._blobs[reference.hash]

    def _next(self, kind: ObjectKind) -> int:
        self._numbers[kind] = self._numbers.get(kind, ATTACHED_FROM if self.is_attached else 0) + 1
        return self._numbers[kind]

    # ---- for clients

    def names(self) -> Names:
        """The current names."""
        entries: dict[ObjectKind, list[messages.ObjectEntry]] = {ObjectKind.NODE: [], ObjectKind.MATERIAL: []}
        for key, (_, edit, _) in self._objects.items():
            if isinstance(edit, messages.SetNode):
                entries[key.kind].append(messages.ObjectEntry(key.number, edit.parent, edit.kind, edit.object, edit.name))
            elif isinstance(edit, messages.SetMaterial):
                entries[key.kind].append(messages.ObjectEntry(key.number, name=edit.name))
        return Names.of(entries[ObjectKind.NODE], entries[ObjectKind.MATERIAL])

    def edits_since(self, version: int) -> list[Message]:
        """Makes the edits that turn the scene at this version into the current one."""
        gone = sorted((at, thing) for thing, (made, at) in self._removed.items() if made <= version < at)
        edits: list[Message] = [messages.Remove(thing.kind, thing.number) for _, thing in gone]
        named = {one.hash for _, edit, _ in self._objects.values() for one in getattr(edit, "arrays", ())}
        self._blobs = {name: data for name, data in self._blobs.items() if name in named}
        return edits + [edit for at, edit, _ in sorted(self._objects.values(), key=lambda one: one[0]) if at > version]

    def blobs_of(self, edits: Iterable[Message]) -> dict[bytes, Bytes]:
        """The blobs that the edits refer to, by hash."""
        named = (one for edit in edits for one in getattr(edit, "arrays", ()) if one.size_bytes)
        return {one.hash: self._blobs[one.hash] for one in named}
