#!/usr/bin/env bash
# gtsam 4.3.0's `noiseModel.Gaussian.Information` and `Gaussian.Covariance`, given a matrix of which one triangle alone is filled, keep
# the diagonal and drop the rest, whichever triangle it is, without a word. g2o's files hold the upper triangle, and so do many results
# that are kept small.
#
# Guess before it was run: the other half is filled in, or the matrix is refused as not symmetric.
# For whom it matters: whoever reads `.g2o` lines or tables of 21 numbers into `M[numpy.triu_indices(6)]` and hands M on: a corridor at
# 45 degrees, known across and not along, becomes as well known along as across. Add `numpy.triu(M, 1).T`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "gtsam==4.3.0" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import gtsam
import numpy as np

turn = gtsam.Rot3.Rz(np.radians(45.0)).matrix()
full = np.diag([1e6, 1e6, 1e6, 0.0, 0.0, 0.0])
full[3:, 3:] = turn @ np.diag([1.0, 1e4, 1e4]) @ turn.T  # known to a metre along, to a centimetre across
along, across = np.r_[0, 0, 0, turn[:, 0]], np.r_[0, 0, 0, turn[:, 1]]
print("gtsam", version("gtsam"), "numpy", np.__version__)
found = {}
for name, part in (("full", full), ("upper triangle", np.triu(full)), ("lower triangle", np.tril(full))):
    model = gtsam.noiseModel.Gaussian.Information(part)
    sigmas = [1.0 / np.linalg.norm(model.whiten(step)) for step in (along, across)]
    covariance = np.linalg.inv(full)
    spread = gtsam.noiseModel.Gaussian.Covariance(
        {"full": covariance, "upper triangle": np.triu(covariance), "lower triangle": np.tril(covariance)}[name]
    )
    found[name] = (*sigmas, *(1.0 / np.linalg.norm(spread.whiten(step)) for step in (along, across)))
    words = "along {:.3f} m, across {:.3f} m; of the covariance {:.3f} m, {:.3f} m".format(*found[name])
    print(f"  {name}: {words}")
assert np.allclose(found["full"], [1.0, 0.01, 1.0, 0.01], rtol=1e-3)
for name in ("upper triangle", "lower triangle"):
    assert np.allclose(found[name][0], found[name][1]) and found[name][0] < 0.02, "gtsam now fills or refuses a triangle"
    assert np.allclose(found[name][2], found[name][3]) and found[name][2] > 0.5
print("the diagonal is all that is kept")
PYTHON
