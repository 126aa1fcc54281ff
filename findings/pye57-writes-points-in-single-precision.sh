#!/usr/bin/env bash
# pye57 0.4.19's `write_scan_raw` stores Cartesian coordinates in single precision, also where it is given doubles and the
# format has a type for them: on a map grid points come back up to a quarter of a metre off, as doubles. Where the pose of
# the scan (`translation`) holds the large part, they come back to a micrometre.
#
# Guess before it was run: doubles, as its arrays are and as it reads them.
# For whom it matters: whoever writes surveyed or registered clouds to E57 with it. Take a round offset away first, give it
# as `translation`, and read with `read_scan`, which applies the pose; other programs do so too.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pye57==0.4.19" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pye57

offset = np.array([500_000.0, 5_400_000.0, 100.0])
points = np.random.default_rng(0).uniform(0.0, 20.0, (1000, 3)) + offset


def there_and_back(local, **pose):
    """The points that a scan of these holds, in the frame of its file."""
    file = pye57.E57("scan.e57", mode="w")
    file.write_scan_raw({f"cartesian{axis}": column for axis, column in zip("XYZ", local.T)}, **pose)
    file.close()
    file = pye57.E57("scan.e57")
    held = file.read_scan(0, ignore_missing_fields=True)
    file.close()
    return np.column_stack([held[f"cartesian{axis}"] for axis in "XYZ"])


plain = there_and_back(points)
posed = there_and_back(points - offset, rotation=np.array([1.0, 0.0, 0.0, 0.0]), translation=offset)
off = {name: float(np.abs(found - points).max()) for name, found in (("plain", plain), ("posed", posed))}
print("pye57", version("pye57"), "numpy", np.__version__)
print(f"  as they are ({points.dtype} given, {plain.dtype} read): up to {off['plain']:.6f} m off")
print(f"  with the offset as the scan's translation: up to {off['posed']:.6f} m off")
assert off["posed"] < 1e-5
assert 0.2 < off["plain"] < 0.5, "pye57 no longer does this"
print("doubles go in, and floats are kept")
PYTHON
