#!/usr/bin/env bash
# trimesh 5.2.0 reads the positions of a glTF file as they are stored. Whole numbers that the file says stand for fractions
# (`normalized`, as in files that are quantized for the web) stay whole: a cloud 20 m wide becomes one of 1311 km. Of positions
# that are stored apart (`sparse`) it reads the base alone, here zeros: half of the points lie at the origin. It says
# nothing. Whole numbers under the scale of a node, without `normalized`, are read right.
#
# Guess before it was run: both are part of glTF 2.0 itself, so both are applied, or the file is refused.
# For whom it matters: whoever compares a model from the web with a scan. The first fault is a factor, which looks like a
# wrong unit; store positions as floats, all in one place.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "trimesh==5.2.0" "numpy<2.5"
"$folder/env/bin/python" - <<'PYTHON'
import io
import json
import struct
from importlib.metadata import version

import numpy as np
import trimesh

truth = np.random.default_rng(0).uniform(0.0, 20.0, (1000, 3))


def read(accessor, parts, scale=1.0, stride=None):
    """The points of a GLB file of one cloud, by trimesh."""
    body, views = b"", []
    for part in parts:
        views.append({"buffer": 0, "byteOffset": len(body), "byteLength": len(part)})
        body += part
    if stride:
        views[0]["byteStride"] = stride
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "scale": [scale] * 3}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 0}]}],
        "accessors": [{"count": 1000, "type": "VEC3", **accessor}],
        "bufferViews": views,
        "buffers": [{"byteLength": len(body)}],
    }
    if stride:
        document["extensionsUsed"] = document["extensionsRequired"] = ["KHR_mesh_quantization"]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    glb = struct.pack("<4s2I", b"glTF", 2, 28 + len(text) + len(body))
    glb += struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(body), b"BIN\0") + body
    return trimesh.load(io.BytesIO(glb), file_type="glb", process=False).dump()[0].vertices


whole = np.zeros((1000, 4), "<u2")  # rows begin at multiples of four bytes
whole[:, :3] = np.round(truth / 20.0 * 65535)
floats = truth.astype("<f4")
base = floats.copy()
base[::2] = 0.0
apart = {
    "count": 500,
    "indices": {"bufferView": 1, "componentType": 5123},
    "values": {"bufferView": 2},
}
rows = np.arange(0, 1000, 2).astype("<u2").tobytes()
clouds = {
    "floats": read({"bufferView": 0, "componentType": 5126}, [floats.tobytes()]),
    "whole numbers": read({"bufferView": 0, "componentType": 5123}, [whole.tobytes()], 20.0 / 65535, 8),
    "normalized": read({"bufferView": 0, "componentType": 5123, "normalized": True}, [whole.tobytes()], 20.0, 8),
    "sparse": read(
        {"bufferView": 0, "componentType": 5126, "sparse": apart}, [base.tobytes(), rows, floats[::2].tobytes()]
    ),
}
print("trimesh", version("trimesh"), "numpy", np.__version__)
for kind, points in clouds.items():
    print(f"  {kind}: up to {points.max():.1f} m, {(points == 0.0).all(axis=1).sum()} points at the origin")
for kind in ("floats", "whole numbers"):
    assert np.allclose(clouds[kind], truth, atol=1e-3)
assert np.allclose(clouds["normalized"], 65535.0 * truth, rtol=1e-2, atol=20.0), "trimesh no longer does this"
assert not clouds["sparse"][::2].any() and np.allclose(clouds["sparse"][1::2], truth[1::2], atol=1e-5), (
    "trimesh no longer does this"
)
print("what is normalized stays whole, what is stored apart is left out")
PYTHON
