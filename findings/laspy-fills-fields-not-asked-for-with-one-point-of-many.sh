#!/usr/bin/env bash
# laspy 2.7.0's `decompression_selection` leaves fields of a LAZ file (point formats from 6 on) out to save time. They are in the result all
# the same: every point has the value of the first one of its chunk of 50,000. Without z a hill is a stair of level steps at heights
# that occur; without the times, a strip of four minutes has five of them. Both backends, lazrs 0.8.2 and laszip 0.3.0, do so. In
# point formats below 6 the selection is ignored, as its description says; what becomes of the rest it does not say.
#
# Guess before it was run: zeros in what was not asked for, or no such field.
# For whom it matters: whoever reads x, y and z of large tiles quickly and later takes the times (for the poses of a drive), the intensities
# or the classes of the same object: they look like data, and not like nothing. Select all that will be used.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "laspy==2.7.0" "lazrs==0.8.2" "laszip==0.3.0" "numpy<2.5"
cd "$folder"
OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
import io
from importlib.metadata import version

import laspy
import numpy as np

COUNT = 240_000
rng = np.random.default_rng(0)
x = np.linspace(0.0, 1000.0, COUNT)
files = {}
for number in (3, 7):
    header = laspy.LasHeader(version="1.4", point_format=number)
    header.scales = [0.001] * 3
    tile = laspy.LasData(header)
    tile.xyz = np.c_[x, rng.uniform(0.0, 10.0, COUNT), 100.0 + 0.1 * x]
    tile.gps_time = np.arange(COUNT) / 1000.0
    tile.classification = rng.integers(1, 7, COUNT)
    packed = io.BytesIO()
    tile.write(packed, do_compress=True)
    files[number] = packed.getvalue()
print(*(f"{each} {version(each)}" for each in ("laspy", "lazrs", "laszip", "numpy")))
few = laspy.DecompressionSelection.base()
found = {}
for number, data in files.items():
    for backend in (laspy.LazBackend.Lazrs, laspy.LazBackend.Laszip):
        with laspy.open(io.BytesIO(data), laz_backend=backend, decompression_selection=few) as reader:
            read = reader.read()
        z, times, classes = (np.unique(np.asarray(read[name])) for name in ("z", "gps_time", "classification"))
        found[number, backend] = (len(z), len(times))
        print(f"  point format {number}, {backend.name}, x and y asked for: {len(z)} heights, {len(times)} times, classes {classes}")
        if number == 7:
            print(f"    heights {np.round(z, 3)}, times {times}")
            assert np.allclose(times, [0.0, 50.0, 100.0, 150.0, 200.0]), "laspy no longer does this"
            assert len(z) == 5 and z.min() >= 100.0 and len(classes) <= 5
        else:
            assert len(times) == COUNT
        assert np.allclose(read.x, x, atol=0.001)
print("one point's value stands for fifty thousand")
PYTHON
