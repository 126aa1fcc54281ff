#!/usr/bin/env bash
# trimesh 5.2.0's `registration.procrustes` takes weights. Translation and scale follow them; the rotation counts each point
# whose weight is not exactly 0 as much as any other. Its description says that the rotation is not optimal then; it may be
# any: matches that weigh a billionth, all wrong, turn the pose by half a turn, where with 0 it is right. And the scale is the
# ratio of the two spreads, not that of least squares: noise on the target alone makes the source larger.
#
# Guess before it was run: a weight of a billionth does what 0 does, and the scale is the one of least squares.
# For whom it matters: whoever gives the scores of matches as weights, or reweights by residuals in rounds. scipy's
# `Rotation.align_vectors` takes the same weights, about the weighted means, and is right.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "trimesh==5.2.0" "scipy==1.17.1" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from scipy.spatial.transform import Rotation
from trimesh.registration import procrustes

rng = np.random.default_rng(0)
R, t = Rotation.from_rotvec([0.2, -0.1, 0.4]), np.array([1.0, 2.0, 3.0])
source = rng.normal(size=(100, 3)) * [3.0, 2.0, 1.0]
target = R.apply(source) + t
turned = Rotation.from_euler("z", 180, degrees=True).apply(target[50:] - t) * 3.0 + t
target[50:] = turned  # half of the matches are wrong, and agree with each other


def off(rotation):
    return float(np.degrees((rotation * R.inv()).magnitude()))


def scipys(weights):
    a = source - np.average(source, axis=0, weights=weights)
    b = target - np.average(target, axis=0, weights=weights)
    return Rotation.align_vectors(b, a, weights=weights)[0]


print("trimesh", version("trimesh"), "scipy", version("scipy"), "numpy", np.__version__)
errors = {}
for weight in (0.0, 1e-9, 1e-3):
    weights = np.where(np.arange(100) < 50, 1.0, weight)
    T, _, _ = procrustes(source, target, weights=weights, reflection=False, scale=False)
    errors[weight] = off(Rotation.from_matrix(T[:3, :3]))
    print(f"  wrong matches weigh {weight:g}: rotation off by {errors[weight]:.2f} deg; scipy's by {off(scipys(weights)):.2f} deg")
    assert off(scipys(weights)) < 1.0
assert errors[0.0] < 1e-4 and min(errors[1e-9], errors[1e-3]) > 90.0, "trimesh no longer does this"

many = rng.normal(size=(20000, 3))
noisy = R.apply(many) + t + rng.normal(size=many.shape) * 0.75
T, _, cost = procrustes(many, noisy, reflection=False, scale=True)
scale = float(np.cbrt(np.linalg.det(T[:3, :3])))
_, _, rigid = procrustes(many, noisy, reflection=False, scale=False)
print(f"  noise on the target: scale {scale:.3f} (true 1), mean square {cost:.3f}; held at 1, {rigid:.3f}")
assert scale > 1.2 and cost > rigid, "trimesh no longer does this"
print("what weighs next to nothing turns the pose")
PYTHON
