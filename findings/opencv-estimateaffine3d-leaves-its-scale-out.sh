#!/usr/bin/env bash
# OpenCV 5.0.0's `estimateAffine3D(source, target, force_rotation=True)` returns a matrix and a scale. The matrix is the
# rotation beside a translation that holds only with the scale, which is always estimated: alone it is neither the similarity
# nor the rigid pose. Noise of a centimetre makes a scale of 0.9999, and in a map's grid (UTM northings are millions of
# metres) the matrix is then hundreds of metres off. Without `force_rotation` the "rotation" may be a mirror image.
#
# Guess before it was run: the matrix has the scale in it, or is the rigid pose where the scale is not asked for.
# For whom it matters: whoever aligns matched points or control points by it, and takes the matrix for a pose. Near the origin, with
# points that fit, nothing shows. The other call of the name, with a threshold, is a RANSAC for a full affine map.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "opencv-python-headless==5.0.0.93" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
import cv2
import numpy as np

rng = np.random.default_rng(0)
source = rng.uniform(-5.0, 5.0, (50, 3))
c, s = np.cos(np.radians(30.0)), np.sin(np.radians(30.0))
R, t = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.array([1.0, 2.0, 3.0])


def off(a, b, force=True):
    """Farthest that the matrix alone, and with its scale, leaves points from their partners."""
    matrix, scale = cv2.estimateAffine3D(a, b, force_rotation=force)
    turned = a @ matrix[:, :3].T
    alone, scaled = (float(np.abs(each + matrix[:, 3] - b).max()) for each in (turned, scale * turned))
    return scale, alone, scaled, float(np.linalg.det(matrix[:, :3]))


UTM = np.array([5e5, 5e6, 100.0])
noisy = source @ R.T + t + rng.normal(0.0, 0.01, source.shape)
cases = {
    "twice as large": (source, 2.0 * source @ R.T + t),
    "a centimetre of noise": (source, noisy),
    "the same in UTM": (source + UTM, noisy + UTM),
}
print("opencv", cv2.__version__, "numpy", np.__version__)
found = {}
for name, (a, b) in cases.items():
    found[name] = scale, alone, scaled, _ = off(a, b)
    print(f"  {name}: scale {scale:.5f}; the matrix alone {alone:.2f} m off, with the scale {scaled:.2f} m")
mirrored = off(source, source * [1.0, 1.0, -1.0], force=False)[3]
print(f"  without force_rotation, of a mirror image: the determinant is {mirrored:.0f}")
assert found["twice as large"][1] > 5.0 and found["twice as large"][2] < 1e-9, "opencv's matrix now has the scale in it"
assert found["a centimetre of noise"][1] < 0.1, "opencv no longer does this"
assert found["the same in UTM"][1] > 50.0 and found["the same in UTM"][2] < 0.1, "opencv no longer estimates a scale"
assert mirrored < 0.0, "opencv now gives a rotation"
print("estimateAffine3D leaves its scale out")
PYTHON
