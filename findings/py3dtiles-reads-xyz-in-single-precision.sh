#!/usr/bin/env bash
# py3dtiles 12.1.1 converts the same map points from PLY to a micrometre and from XYZ text with errors of up to a quarter of
# a metre: it keeps the numbers of text in single precision before it takes the middle away, so that northings lie half a
# metre apart. The tiles look as precise as others, with a transform in double precision. Nothing is said.
#
# Guess before it was run: millimetres, whatever the format, as the tiles are relative to a transform.
# For whom it matters: whoever publishes a map, or a registered cloud, through text: walls become sheets half a metre apart.
# Convert LAS or PLY with doubles instead, or take a round offset away first and add it to the root's transform.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "py3dtiles==12.1.1" "plyfile==1.1.5" "numpy<2.5" "scipy<1.18"
cd "$folder"
cat > convert.py <<'PYTHON'
from importlib.metadata import version
from pathlib import Path

import numpy as np
from plyfile import PlyData, PlyElement
from py3dtiles.convert import convert
from py3dtiles.tileset import TileSet
from scipy.spatial import cKDTree


def points_of(tile, folder, outer):
    """The points of all leaves in the outer frame."""
    pose = outer if tile.transform is None else outer @ tile.transform
    if tile.children:
        return [part for child in tile.children for part in points_of(child, folder, pose)]
    table = tile.get_or_fetch_content(folder).body.feature_table.body
    return [np.asarray(table.position, np.float64).reshape(-1, 3) @ pose[:3, :3].T + pose[:3, 3]]


if __name__ == "__main__":
    spread = np.random.default_rng(0).uniform(0.0, 20.0, (2000, 3)).round(3)
    points = spread + [500_000.0, 5_400_000.0, 100.0]
    table = np.zeros(len(points), [(axis, "f8") for axis in "xyz"])
    table["x"], table["y"], table["z"] = points.T
    PlyData([PlyElement.describe(table, "vertex")]).write("map.ply")
    np.savetxt("map.xyz", points, fmt="%.3f")
    print("py3dtiles", version("py3dtiles"), "numpy", np.__version__)
    off = {}
    for name in ("map.ply", "map.xyz"):
        folder = Path(f"tiles-{name}")
        convert(name, outfolder=str(folder), jobs=1, verbose=-1)
        root = TileSet.from_file(folder / "tileset.json").root_tile
        found = np.vstack(points_of(root, folder, np.eye(4)))
        off[name] = float(cKDTree(found).query(points)[0].max())
        print(f"  {name}: {len(found)} of {len(points)} points in the tiles, the farthest {off[name]:.6f} m off")
        assert len(found) == len(points)
    assert off["map.ply"] < 1e-4
    assert 0.2 < off["map.xyz"] < 0.5, "py3dtiles no longer does this"
    print("text costs a quarter of a metre")
PYTHON
HOME="$folder" "$folder/env/bin/python" convert.py | tr '\r' '\n' | grep -v "%"
