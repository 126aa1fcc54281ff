#!/usr/bin/env bash
# simpleitk 2.5.7's `LandmarkBasedTransformInitializer` takes a weight for each pair of landmarks, for any transform. It
# heeds them for an `AffineTransform` alone. For a rigid one and a similarity they are left out without a word: landmarks of
# weight 0 count as much as all others.
#
# Guess before it was run: landmarks of weight 0 have no part in the transform, whichever it is.
# For whom it matters: whoever lays two scans on each other by weighted targets or matches, rigidly: what was found to be
# wrong and given the weight 0 moves the pose by metres. Leave such pairs out; for other weights use another solver, such as
# scipy's `Rotation.align_vectors` about the weighted means.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "simpleitk==2.5.7" "scipy==1.17.1" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import SimpleITK as sitk
from scipy.spatial.transform import Rotation

rng = np.random.default_rng(0)
here = rng.uniform(-10.0, 10.0, (20, 3))
there = Rotation.from_euler("ZYX", [30.0, 10.0, -5.0], degrees=True).apply(here) + [5.0, -2.0, 0.5]
there[10:] += 5.0  # half of the pairs are wrong
weights = [1.0] * 10 + [0.0] * 10


def off(transform, rows, *more):
    """How far the first ten, which are right, lie from their partners."""
    start = (here[:rows].ravel().tolist(), there[:rows].ravel().tolist())
    found = sitk.LandmarkBasedTransformInitializer(transform, *start, *more)
    return max(float(np.linalg.norm(found.TransformPoint(p) - q)) for p, q in zip(here[:10].tolist(), there[:10]))


KINDS = {"rigid": sitk.VersorRigid3DTransform, "similarity": sitk.Similarity3DTransform, "affine": lambda: sitk.AffineTransform(3)}
print("simpleitk", version("simpleitk"), "numpy", np.__version__)
errors = {}
for name, kind in KINDS.items():
    errors[name] = off(kind(), 20), off(kind(), 20, weights), off(kind(), 10)
    print("  {}: all pairs {:.3f}, wrong ones weigh 0 {:.3f}, left out {:.3f}".format(name, *errors[name]))
    assert errors[name][2] < 1e-6 < 1.0 < errors[name][0]
for name in ("rigid", "similarity"):
    assert errors[name][1] == errors[name][0], "simpleitk now heeds them"
assert errors["affine"][1] < 1e-6
print("weights count for an affine transform alone")
PYTHON
