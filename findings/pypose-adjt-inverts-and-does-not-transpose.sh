#!/usr/bin/env bash
# pypose 0.9.5's `AdjT` has a T behind the name of the adjoint, and no description. For a pose it gives the adjoint of the inverse pose,
# Ad(X)^-1 p, and not Ad(X)^T p. For rotations the two are the same; for poses they differ by the lever arm, here by more than the
# numbers are large. `Adj` and `Jinvp` are as in the books.
#
# Guess before it was run: the transposed adjoint, times the vector.
# For whom it matters: whoever moves gradients or forces from one frame to the other, where the transpose belongs: a Gauss-Newton step
# goes elsewhere, and still goes somewhere. Take `X.Adj(pypose.se3(e))` of the unit vectors e for columns, and transpose.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "torch==2.13.0" "pypose==0.9.5" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pypose
import torch


def largest(difference):
    return float(difference.abs().max())


def adjoint(X, size):
    """Column by column, of what `Adj` gives for each unit vector."""
    kind = pypose.se3 if size == 6 else pypose.so3
    return torch.stack([X.Adj(kind(each)).tensor() for each in torch.eye(size, dtype=torch.float64)], dim=1)


print(*(f"{each} {version(each)}" for each in ("pypose", "torch", "numpy")))
twist = torch.tensor([0.5, -1.0, 2.0, 0.3, 0.4, 1.0], dtype=torch.float64)
found = {}
for name, X, size in (("a pose", pypose.se3(twist).Exp(), 6), ("a rotation", pypose.so3(twist[3:]).Exp(), 3)):
    Ad = adjoint(X, size)
    p = torch.linspace(-1.0, 1.0, size, dtype=torch.float64)
    kind = pypose.se3 if size == 6 else pypose.so3
    told = X.AdjT(kind(p)).tensor()
    found[name] = (largest(told - Ad.T @ p), largest(told - torch.linalg.solve(Ad, p)))
    print(f"  of {name}: off the transposed by {found[name][0]:.3f}, off the inverse by {found[name][1]:.3f}; {p.norm():.2f} long")
print("  its description:", pypose.AdjT.__doc__)
assert max(found["a rotation"]) < 1e-9 and found["a pose"][1] < 1e-9
assert found["a pose"][0] > 0.1 and np.isfinite(found["a pose"][0]), "pypose now transposes"
print("the T is an inverse")
PYTHON
