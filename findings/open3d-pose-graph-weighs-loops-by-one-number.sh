#!/usr/bin/env bash
# Open3D 0.20.0's global optimisation of a pose graph keeps or drops a loop closure by holding its weighted residual
# against one entry of its 6x6 information, the last (the number of matched points in matrices of Open3D's own making),
# and without `reference_node` it moves the first node too.
#
# Guess before it was run: the matrix counts as a whole, so that a loop whose information is small along z alone, where
# nothing disagrees, stays; and the first node keeps its pose.
# For whom it matters: whoever fills the information with something else than Open3D's function for it (a covariance's
# inverse, a confidence), or reads the poses as those in the first cloud's frame.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "open3d==0.20.0" "libusb-package"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import ctypes
from importlib.metadata import version

import libusb_package
import numpy as np

ctypes.CDLL(libusb_package.get_library_path(), mode=ctypes.RTLD_GLOBAL)
import open3d as o3d

registration = o3d.pipelines.registration


def shift(x, y=0.0):
    T = np.eye(4)
    T[:2, 3] = x, y
    return T


def optimised(diagonal, **reference):
    """Four clouds in a row, a metre apart, and a loop that says 0.6 m sideways at the end; all else agrees."""
    graph = registration.PoseGraph()
    information = np.diag(diagonal)
    for x in range(4):
        graph.nodes.append(registration.PoseGraphNode(shift(x)))
    for x in range(3):
        graph.edges.append(registration.PoseGraphEdge(x + 1, x, shift(1.0), information, uncertain=False))
    graph.edges.append(registration.PoseGraphEdge(3, 0, shift(3.0, 0.6), information, uncertain=True))
    registration.global_optimization(
        graph,
        registration.GlobalOptimizationLevenbergMarquardt(),
        registration.GlobalOptimizationConvergenceCriteria(),
        registration.GlobalOptimizationOption(
            max_correspondence_distance=1.0, edge_prune_threshold=0.25, **reference
        ),
    )
    return np.array([node.pose for node in graph.nodes]), len(graph.edges) == 4


print("open3d", version("open3d"))
one = [1.0] * 6
kept = {}
for words, diagonal in (
    ("all ones", one),
    ("all a hundredth", [0.01] * 6),
    ("a hundredth along y, where the loop disagrees", [1, 1, 1, 1, 0.01, 1]),
    ("a hundredth in the last entry, along z", [1, 1, 1, 1, 1, 0.01]),
):
    poses, kept[words] = optimised(diagonal, reference_node=0)
    print(f"  information {words}: loop {'kept' if kept[words] else 'dropped'}, last cloud {poses[3, 1, 3]:.3f} m sideways")
first = float(np.abs(optimised(one)[0][0] - np.eye(4)).max())
print(f"  without reference_node the first cloud's pose changes by up to {first:.3f}")
assert list(kept.values()) == [True, True, True, False], "open3d no longer does this"
assert first > 0.01, "open3d no longer does this"
PYTHON
