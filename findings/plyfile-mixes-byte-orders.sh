#!/usr/bin/env bash
# plyfile 1.1.5 writes a file with two byte orders where `byte_order=">"` is asked for and an element has a list and plain
# numbers: the header says big endian, the lists are so, and every plain number beside them is little endian. Points come
# back as numbers of 1e-41 or 1e-319, from plyfile itself as well. Elements without a list and text are right.
#
# Guess before it was run: what the header says, for every property.
# For whom it matters: whoever keeps with each point the images or clusters that it was seen in, as structure from motion
# does, or a number with each face, and writes big endian, for Java or as the file came. `PlyData.read` keeps the order of
# the file that it read, so that reading and writing such a file spoils it. Set `byte_order = "<"` before `write`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "plyfile==1.1.5" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from plyfile import PlyData, PlyElement

points = np.array([[1.0, 10.0, 0.5], [2.0, 20.0, 0.5], [3.0, 30.0, 0.5]])


def cloud(with_lists):
    fields = [("images", object)] if with_lists else []
    table = np.zeros(len(points), fields + [(axis, "f4") for axis in "xyz"])
    for k, axis in enumerate("xyz"):
        table[axis] = points[:, k]
    if with_lists:
        for k in range(len(points)):
            table["images"][k] = np.arange(k + 1, dtype="i4")
    return PlyElement.describe(table, "vertex", val_types={"images": "i4"} if with_lists else {})


print("plyfile", version("plyfile"), "numpy", np.__version__)
right = {}
for with_lists in (False, True):
    for order in "<>":
        PlyData([cloud(with_lists)], byte_order=order).write("cloud.ply")
        back = PlyData.read("cloud.ply")["vertex"]
        right[with_lists, order] = bool(np.array_equal(np.column_stack([back[axis] for axis in "xyz"]), points))
        same = not with_lists or list(back["images"][2]) == [0, 1, 2]
        print(f"  order {order}, lists {with_lists}: x of the first point {back['x'][0]:g}, lists as given: {same}")
        assert same
assert right[False, "<"] and right[False, ">"] and right[True, "<"]
assert not right[True, ">"], "plyfile no longer does this"
print("one file, two byte orders")
PYTHON
