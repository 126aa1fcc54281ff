#!/usr/bin/env bash
# kiss_matcher 1.0.2's `estimate` returns a rotation, a translation and `valid`. Of clouds of two different rooms `valid` is
# True for a third of the pairs, mostly with one to five final inliers of some two thousand matches, where two clouds of one
# room have hundreds: it is True as soon as a single match is left. A pose takes three at least.
# `get_num_final_inliers()` of the matcher, not of what it returned, tells most of them apart.
#
# Guess before it was run: `valid` is False where too few matches support the pose.
# For whom it matters: whoever takes `valid` for a success, as for loop closures or for placing a scan in a map: a false loop
# bends a whole trajectory.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "kiss_matcher==1.0.2" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import kiss_matcher
import numpy as np


def room(seed):
    """A floor with twelve blocks on it, of sizes and at places of their own."""
    rng = np.random.default_rng(seed)
    length, width = rng.uniform(15.0, 30.0, 2)
    axes = np.eye(3)

    def face(corner, u, v, count):
        share = rng.uniform(0.0, 1.0, (count, 2))
        return corner + share[:, :1] * u + share[:, 1:] * v

    faces = [face(np.zeros(3), length * axes[0], width * axes[1], 10000)]
    for _ in range(12):
        corner = np.array([rng.uniform(0.0, length), rng.uniform(0.0, width), 0.0])
        size = rng.uniform(0.5, 3.0, 3)[:, None] * axes
        faces += [face(corner + size[2], size[0], size[1], 500), face(corner, size[0], size[2], 500)]
        faces += [face(corner, size[1], size[2], 500)]
    points = np.vstack(faces)
    return points + rng.normal(0.0, 0.01, points.shape)


def matched(source, target):
    matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(0.3))
    solution = matcher.estimate(source.astype(np.float32), target.astype(np.float32))
    return solution.valid, matcher.get_num_final_inliers(), len(matcher.get_initial_correspondences())


print("kiss_matcher", version("kiss_matcher"), "numpy", np.__version__)
valid, inliers, matches = matched(room(0), room(0)[::-1] + [1.0, 2.0, 0.0])
print(f"  one room: valid {valid}, {inliers} inliers of {matches} matches")
assert valid and inliers > 100, "kiss_matcher no longer aligns a room with itself"
strangers = [matched(room(2 * k), room(2 * k + 1)) for k in range(16)]
for _, inliers, matches in (each for each in strangers if each[0]):
    print(f"  two different rooms: valid True, {inliers} inliers of {matches} matches")
assert sum(1 for each in strangers if each[0] and each[1] < 3) >= 2, "kiss_matcher no longer does this"
print("valid for one inlier")
PYTHON
