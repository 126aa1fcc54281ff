#!/usr/bin/env bash
# einit 0.1.0 promises a start for ICP from two clouds ("Ellipsoid ICP initialization"). It takes the principal axes of both, and chooses their
# signs by the distances from each point to the point of the same number. For clouds whose points stand in another order, as those of
# two scans do, the choice is chance: about half of its matrices are mirrors (determinant -1), which no sensor can have moved by,
# and few are right. Where the points stand in one order, all are. Nothing is said, and its words ask for no order.
#
# Guess before it was run: a rotation, right to some degrees, whatever the order of the points (noted after a glance at its source).
# For whom it matters: whoever hands its matrix to an ICP, OpenCV's among them, or to a registration as a start: a mirrored start stays
# mirrored. Try the four signs without a mirror, and keep the one whose nearest points lie closest.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "einit==0.1.0" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
import inspect
from importlib.metadata import version

import numpy as np
from einit import ellipsoid_init_icp
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

COUNT = 60
SIGNS = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])


def thing(rng):
    """A long box with two others on it, alike at no turn."""
    boxes = ((1500, [0, 0, 0], [6, 3, 1]), (400, [0, 0, 1], [1, 1, 2.5]), (200, [4, 2, 1], [5, 3, 1.5]))
    return np.vstack([rng.uniform(low, high, (count, 3)) for count, low, high in boxes])


def turned(pose, true):
    """Degrees between a pose and the true one, or none for a mirror."""
    if np.linalg.det(pose[:3, :3]) < 0.0:
        return None
    return np.degrees((Rotation.from_matrix(pose[:3, :3]) * true.inv()).magnitude())


def by_nearest(source, target):
    """Its axes, with the signs whose nearest points lie closest."""
    tree, centre = cKDTree(target), source.mean(axis=0)
    first = ellipsoid_init_icp(source, target)
    axes = np.linalg.eigh((source - centre).T @ (source - centre))[1]
    mirror = np.sign(np.linalg.det(first[:3, :3]))
    best = None
    for signs in mirror * SIGNS:
        pose = np.eye(4)
        pose[:3, :3] = first[:3, :3] @ axes @ np.diag(signs) @ axes.T
        pose[:3, 3] = target.mean(axis=0) - pose[:3, :3] @ centre
        error = tree.query(source @ pose[:3, :3].T + pose[:3, 3])[0].mean()
        if best is None or error < best[0]:
            best = error, pose
    return best[1]


print("einit", version("einit"), "scipy", version("scipy"), "numpy", np.__version__)
words = inspect.getdoc(ellipsoid_init_icp)
assert "order" not in words and "correspond" not in words
found = {"one order": [], "another order": [], "another order, signs by nearest points": []}
for seed in range(COUNT):
    rng = np.random.default_rng(seed)
    true, source = Rotation.random(random_state=seed), thing(rng)
    target = true.apply(source) + rng.uniform(-5.0, 5.0, 3)
    shuffled = target[rng.permutation(len(target))]
    for name, pose in zip(
        found, (ellipsoid_init_icp(source, target), ellipsoid_init_icp(source, shuffled), by_nearest(source, shuffled)), strict=True
    ):
        found[name].append(turned(pose, true))
for name, each in found.items():
    mirrors, right = each.count(None), sum(angle is not None and angle < 5.0 for angle in each)
    print(f"  points in {name}: {right} of {COUNT} starts right, {mirrors} mirrors")
    if name == "another order":
        assert mirrors > COUNT // 4 and right < COUNT // 2, "it now leaves the order of the points aside"
    else:
        assert right == COUNT
print("clouds of another order are mirrored")
PYTHON
