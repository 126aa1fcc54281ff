# SPDX-License-Identifier: MIT
"""Whether `trimesh` reads the positions of a glTF file as the file means them."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from hybridreg.io.faults import fault
from hybridreg.io.structured import parse_json

_MAGIC = b"glTF"
_HEAD = struct.Struct(
    "<4s2I2I"
)  # magic, version, length of the file; length and type of the first chunk, the JSON
_DRACO = "KHR_draco_mesh_compression"
_INSTANCES = "EXT_mesh_gpu_instancing"
_MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")


def check_positions(path: Path, name: str) -> None:
    """Refuse a `.glb` or `.gltf` file whose positions `trimesh` would give as other numbers (trimesh 5.2.0).

    Of an accessor (glTF 2.0, section 3.6.2) it leaves out `normalized`: whole numbers that stand for 0 to 1 stay up to
    65535. It leaves out `sparse`: what is stored apart stays zero. Compressed positions are zeros where it lacks the
    decoder. Of the instances of a mesh that stand in one node it gives one.

    Raises
    ------
    ValueError
        Such positions, with how to store others. A damaged file is left to `trimesh`.
    """
    try:
        document = _document(path, name)
        accessors = list(_accessors(document))
        required = {str(each) for each in document.get("extensionsRequired", ())}
        used = {str(each) for each in document.get("extensionsUsed", ())}
    except (ValueError, LookupError, TypeError, AttributeError, struct.error):
        return
    packed = next((each for each in _MESHOPT if each in required), None)
    if packed is None and _DRACO in required and find_spec("DracoPy") is None:
        raise fault(
            name, f"is compressed by {_DRACO}", "pip install DracoPy, or export it without compression"
        )
    if packed is not None:
        raise fault(name, f"is compressed by {packed}", "export it without compression")
    if _INSTANCES in used:
        problem = f"places copies of a surface by {_INSTANCES}"
        raise fault(name, problem, "export it without instances, each copy as a node of its own")
    if any(each.get("normalized") for each in accessors):
        problem = "its positions are whole numbers that stand for fractions (normalized)"
        raise fault(name, problem, "export it without quantization, with positions as floats")
    if any("sparse" in each for each in accessors):
        raise fault(
            name, "some of its positions are stored apart (sparse)", "export it with all in one place"
        )


def _document(path: Path, name: str) -> Any:
    with open(path, "rb") as file:
        head = file.read(_HEAD.size)
        if not head.startswith(_MAGIC):
            return parse_json((head + file.read()).decode("utf-8-sig"), name)
        return parse_json(file.read(_HEAD.unpack(head)[3]).decode("utf-8"), name)


def _accessors(document: Any) -> Iterator[Any]:
    """The accessor of every primitive's positions."""
    for mesh in document.get("meshes", ()):
        for primitive in mesh["primitives"]:
            if "POSITION" in primitive["attributes"]:
                yield document["accessors"][primitive["attributes"]["POSITION"]]
