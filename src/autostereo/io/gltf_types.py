"""Types of the JSON entries that a glTF file is made of (glTF 2.0 Specification, section 5)."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from ..errors import FileError

OF_OBJECTS = {"nodes", "scenes", "meshes", "accessors", "bufferViews", "buffers", "materials", "textures", "images"}
OF_OBJECTS |= {"primitives"}
OF_NUMBERS = {"matrix", "translation", "rotation", "scale", "baseColorFactor"}
LISTS = OF_OBJECTS | OF_NUMBERS | {"children", "extensionsRequired"}
WHOLE = {"scene", "mesh", "mode", "material", "componentType", "count", "byteOffset", "byteLength", "byteStride"}
WHOLE |= {"buffer", "bufferView", "texCoord", "index", "source"}
TEXTS = {"version", "uri", "type"}
OBJECTS = {"asset", "attributes", "sparse", "values", "pbrMetallicRoughness", "baseColorTexture", "extensions"}
# what is never drawn, and what other rules hold for
SKIPPED = {"extras", "extensions", "animations", "skins", "cameras", "samplers", "targets"}


def check_types(tree: dict[str, Any], path: object) -> None:
    """Raise FileError for the first entry of another type than glTF gives it; the message says where and which."""
    for where, expected, found in _wrong(tree, ""):
        text = json.dumps(found)
        text = text if len(text) <= 40 else text[:37] + "..."
        raise FileError(f"{path}: is not valid glTF: {where}: expected {expected}, found {text}")


def _whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _wrong(tree: dict[str, Any], at: str) -> Iterator[tuple[str, str, object]]:
    """Entries of an object that have another type: place, expected type, value."""
    for key, value in tree.items():
        where = f"{at}.{key}" if at else key
        indices = key == "children" or (key == "nodes" and at != "")  # a scene's nodes are indices
        if key in LISTS and not isinstance(value, list):
            yield where, "a list", value
        elif key in WHOLE and not _whole(value):
            yield where, "a whole number", value
        elif key in TEXTS and not isinstance(value, str):
            yield where, "a text", value
        elif key in OBJECTS and not isinstance(value, dict):
            yield where, "an object", value
        elif key in LISTS:
            for k, item in enumerate(value):
                place = f"{where}[{k}]"
                if indices and not _whole(item):
                    yield place, "a whole number", item
                elif key in OF_NUMBERS and not _number(item):
                    yield place, "a number", item
                elif key in OF_OBJECTS and not indices:
                    if isinstance(item, dict):
                        yield from _wrong(item, place)
                    else:
                        yield place, "an object", item
        elif key == "attributes":
            yield from ((f"{where}.{name}", "a whole number", x) for name, x in value.items() if not _whole(x))
        elif key not in SKIPPED and isinstance(value, dict):
            yield from _wrong(value, where)
