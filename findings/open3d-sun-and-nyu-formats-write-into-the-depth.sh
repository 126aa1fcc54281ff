#!/usr/bin/env bash
# Open3D 0.20.0's `RGBDImage.create_from_sun_format` and `create_from_nyu_format` decode the depth in the image that they are given:
# a second call on the same image decodes what is decoded already. 2 m of the SUN data set become 0.25 m, then nothing; 0.63 m of
# NYU become nothing, then 0.32 m. The three other kinds (TUM, Redwood, colour and depth) leave their input as it is. Nothing is
# said, and a cloud of the second call is of one piece: all of it is eight times as near.
#
# Guess before it was run: the same call on the same image gives the same depths (noted after a first odd output).
# For whom it matters: whoever makes two images of one depth, as with grey values for odometry and with colours for a model
# (`convert_rgb_to_intensity`), unprojects the depth itself as well, keeps images in memory over epochs, or runs a notebook's cell again.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "open3d==0.20.0" "numpy<2.5" "libusb-package"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
import ctypes

import libusb_package  # open3d's wheel links against libusb without bringing it

ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
from importlib.metadata import version

import numpy as np
import open3d as o3d

RAW = {"sun": 16000, "nyu": 0x1402, "tum": 10000, "redwood": 2000}  # as each data set's files hold a depth
colour = o3d.geometry.Image(np.zeros((4, 4, 3), np.uint8))
print("open3d", version("open3d"), "numpy", np.__version__)
changed = set()
for kind, raw in RAW.items():
    depth = o3d.geometry.Image(np.full((4, 4), raw, np.uint16))
    create = getattr(o3d.geometry.RGBDImage, f"create_from_{kind}_format")
    metres = [float(np.asarray(create(colour, depth).depth)[0, 0]) for _ in range(3)]
    print(f"  {kind}: one image three times: {', '.join(f'{each:.3f}' for each in metres)} m")
    if metres[1] != metres[0]:
        changed.add(kind)
assert changed == {"sun", "nyu"}, "open3d no longer does this"
print("Open3D's SUN and NYU formats write into the depth")
PYTHON
