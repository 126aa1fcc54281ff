#!/usr/bin/env bash
# trimesh 5.2.0's `registration.icp` hands its keywords to `procrustes`, where `scale` and `reflection` are True by default:
# its result is a similarity, and may be a mirror image. Where the source reaches farther than the target, the scale falls
# from step to step, as a smaller source lies nearer to the target: begun at the true pose it ends at 0.69 of the size, at
# a twentieth of the rigid pose's cost. `scale=False, reflection=False` gives a rigid pose.
#
# Guess before it was run: a rigid motion, as every other library's ICP gives; from the true pose it hardly moves.
# For whom it matters: whoever takes the matrix for a pose; its upper left block is not a rotation.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "trimesh==5.2.0" "numpy<2.5" "scipy<1.18"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import trimesh

rng = np.random.default_rng(0)


def yard(n, far):
    """Points on two walls, the ground and a post, up to `far` metres from the corner."""
    u, v = rng.uniform(0, far, n), rng.uniform(0, 5, n)
    ground = np.c_[u, rng.uniform(0, far, n), 0 * u]
    parts = [np.c_[u, 0 * u, v], np.c_[0 * u, u, v], ground, np.c_[5 + 0 * u, 5 + v, v]]
    return np.choose(rng.integers(0, 4, n)[:, None], parts)


target, source = yard(4000, 20.0), yard(4000, 30.0)
print("trimesh", version("trimesh"), "from the true pose, the identity:")
scales = []
for keywords in ({}, {"scale": False, "reflection": False}):
    T, _, cost = trimesh.registration.icp(source, target, max_iterations=200, **keywords)
    scales.append(np.cbrt(np.linalg.det(T[:3, :3])))
    print(f"  icp(source, target, {keywords or 'as it is'}): scale {scales[-1]:.2f}, cost {cost:.2f}")
assert scales[0] < 0.8 and abs(scales[1] - 1.0) < 1e-6, "trimesh no longer does this"
PYTHON
