# SPDX-License-Identifier: MIT
"""The unit that a mesh file names in a comment."""

from __future__ import annotations

import struct
import warnings
from pathlib import Path

import numpy as np
import pytest

from hybridreg.io import read_points

pytest.importorskip("trimesh")

P = np.random.default_rng(0).uniform(-4.0, 4.0, (60, 3)).round(3)
LINES = [" ".join(f"{value * 1000:.0f}" for value in row) for row in P]
VERTICES = "".join(f"v {line}\n" for line in LINES)


@pytest.mark.parametrize(
    "name, text",
    [
        ("a.obj", f"# units: mm\n{VERTICES}"),
        ("a.obj", f"# 3ds Max Wavefront OBJ Exporter\n# File units = millimeters\n{VERTICES}"),
        ("a.obj", f"# Exported by SketchUp\n# File units = millimeters\n{VERTICES}"),
        ("a.off", "OFF\n# unit: mm\n60 0 0\n" + "\n".join(LINES) + "\n"),
    ],
)
def test_clouds(name: str, text: str, tmp_path: Path) -> None:
    # They were a thousand times too large, without a word.
    (tmp_path / name).write_text(text)
    with pytest.warns(UserWarning, match=r"its unit is 0\.001 m; it was read in metres"):
        np.testing.assert_allclose(read_points(tmp_path / name), P, atol=1e-9)


@pytest.mark.parametrize(
    "title, largest", [("all values in mm", 2.0), ("UNITS=mm", 2.0), ("Exported from Blender-5.0", 2000.0)]
)
@pytest.mark.parametrize("binary", [True, False])
def test_the_title_of_an_stl(title: str, largest: float, binary: bool, tmp_path: Path) -> None:
    corners = np.array([[0, 0, 0], [2000, 0, 0], [0, 2000, 0]], np.float32)
    if binary:
        data = (
            title.encode().ljust(80, b"\0") + struct.pack("<I", 1) + bytes(12) + corners.tobytes() + bytes(2)
        )
    else:
        rows = "".join(f"vertex {' '.join(map(str, row))}\n" for row in corners.tolist())
        data = f"solid {title}\nfacet normal 0 0 1\nouter loop\n{rows}endloop\nendfacet\nendsolid\n".encode()
    (tmp_path / "a.stl").write_bytes(data)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore" if largest == 2.0 else "error")
        found = read_points(tmp_path / "a.stl")
    assert 0.95 * largest < found.max() <= largest
