#!/usr/bin/env bash
# torch_geometric 2.8.1 turns the positions of a cloud by `RandomRotate`, `RandomFlip` and `LinearTransformation` and leaves its normals where they
# were, without a word; its `NormalizeRotation` turns both. A PPF, which no rotation changes, changes by up to a quarter turn after
# `RandomRotate`. `PointPairFeatures` looks for the normals under another name (`norm`) than `NormalizeRotation` (`normal`).
#
# Guess before it was run: normals are turned with the points, and PPF are the same after a rotation.
# For whom it matters: whoever trains features for registration on turned clouds with normals: the network sees normals of another cloud, and
# learns to leave them aside or the orientation of its data. Turn `data.normal` by the same matrix, or estimate normals afterwards.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "torch==2.13.0" "torch_geometric==2.8.1" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import torch
from torch_geometric.data import Data
from torch_geometric.transforms import Compose, LinearTransformation, NormalizeRotation, PointPairFeatures, RandomFlip, RandomRotate

torch.manual_seed(0)
normals = torch.nn.functional.normalize(torch.randn(500, 3), dim=1)  # of a ball: they point away from its middle
edges = torch.randint(0, 500, (2, 2000))
edges = edges[:, edges[0] != edges[1]]
quarter = torch.tensor([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def ball():
    return Data(pos=10.0 * normals, normal=normals.clone(), norm=normals.clone(), edge_index=edges)


def leaning(data):
    """Degrees between the normals and the directions away from the middle, the mean."""
    along = (torch.nn.functional.normalize(data.pos, dim=1) * data.normal).sum(dim=1).clamp(-1.0, 1.0)
    return float(torch.rad2deg(torch.arccos(along.abs())).mean())


print("torch_geometric", version("torch_geometric"), "torch", version("torch"))
assert leaning(ball()) < 0.1
for transform in (RandomRotate((90, 90), axis=2), RandomFlip(0, p=1.0), LinearTransformation(quarter), NormalizeRotation()):
    lean = leaning(transform(ball()))
    print(f"  {type(transform).__name__}: normals lean by {lean:.1f} degrees on average")
    kept = isinstance(transform, NormalizeRotation)
    assert (lean < 0.5) if kept else (lean > 20.0), "normals are turned otherwise now"
before = PointPairFeatures()(ball()).edge_attr
after = Compose([RandomRotate((90, 90), axis=2), PointPairFeatures()])(ball()).edge_attr
change = (after - before).abs().max(dim=0).values
print(f"  PPF after a quarter turn change by up to {[round(float(each), 2) for each in change]} (metres, radians)")
assert change[0] < 1e-4 and change[1:3].max() > 1.0, "PPF stay now"
bare = Data(pos=normals, normal=normals, edge_index=edges)
try:
    PointPairFeatures()(bare)
except AttributeError as error:
    print(f"  PointPairFeatures of a cloud with `normal`: {error}")
else:
    raise AssertionError("it now finds them")
print("points are turned, and normals are not")
PYTHON
