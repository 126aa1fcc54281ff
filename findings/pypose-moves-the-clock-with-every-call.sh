#!/usr/bin/env bash
# pypose 0.9.5's `metric.ape` and `metric.rpe` take the `offset` of the second clock in seconds, and write it into the stamps that they are
# given: those of the longer trajectory, or of the reference where both are as long, if they are doubles. Each call moves the clock once
# more. Where the first call has an error of 0, the same call again pairs poses that are half a second apart, and a third one a second.
#
# Guess before it was run: the same number from each call (noted after the code was read).
# For whom it matters: whoever asks for the absolute and the relative error, for metres and degrees, or for several offsets, of one pair of
# trajectories: only the first answer is right, and poses that find a partner by chance say nothing. Pass `stamps.clone()`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "torch==2.13.0" "pypose==0.9.5" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pypose
import torch
from scipy.spatial.transform import Rotation

OFFSET = 0.5  # seconds; five poses
stamps = np.arange(200) * 0.1 + 1000.0
turns = Rotation.from_euler("z", np.linspace(0.0, 2.0, 200)[:, None])
places = np.cumsum(0.5 * turns.as_matrix()[:, :, 0], axis=0)
poses = pypose.SE3(torch.tensor(np.c_[places, turns.as_quat()]))
true, seen = torch.tensor(stamps), torch.tensor(stamps - OFFSET)
print(*(f"{each} {version(each)}" for each in ("pypose", "torch", "numpy")))
errors = []
for number in range(3):
    errors.append(float(pypose.metric.ape(true, poses, seen, poses, offset=OFFSET, otype="RMSE")))
    print(f"  call {number + 1}: {errors[-1]:.2f} m; now the reference begins at {float(true[0]):.1f} s, of 1000.0")
cloned = [float(pypose.metric.ape(torch.tensor(stamps), poses, seen, poses, offset=OFFSET, otype="RMSE")) for _ in range(2)]
print(f"  with stamps made anew for each call: {cloned[0]:.2f} m, {cloned[1]:.2f} m")
assert errors[0] < 1e-9 and max(cloned) < 1e-9
assert errors[1] > 1.0 and errors[2] > errors[1] and abs(float(true[0]) - 998.5) < 1e-6, "pypose now leaves the stamps alone"
print("the clock moves with every call")
PYTHON
