# SPDX-License-Identifier: MIT
"""Clouds that EPT and Potree have cut into many files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hybridreg.io import read_points

ROWS = np.random.default_rng(0).uniform(-20.0, 20.0, (500, 4)).astype("<f4")
ROWS[:, 3] = np.abs(ROWS[:, 3])


def placed(folder: Path, *names: str) -> Path:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(ROWS.tobytes() if name.endswith(".bin") else b"{}")
    return folder / names[0]


@pytest.mark.parametrize(
    "names, words",
    [
        (("ept-data/2-1-0-3.laz", "ept.json"), "EPT.*pdal translate"),
        (("ept-data/0-0-0-0.bin", "ept.json"), "EPT.*pdal translate"),
        (("octree.bin", "hierarchy.bin", "metadata.json"), "Potree.*it was made of"),
        (("data/r/r.bin", "cloud.js"), "Potree 1.*it was made of"),
        (("data/r/04512/r0451230.las", "cloud.js"), "Potree 1.*it was made of"),
    ],
)
def test_a_folder_of_pieces_and_a_piece_are_refused(
    names: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    piece = placed(tmp_path, *names)
    with pytest.raises(IsADirectoryError, match=f"in pieces \\({words}"):
        read_points(tmp_path)
    with pytest.raises(ValueError, match=f"one file of a cloud in pieces \\({words}"):
        read_points(piece)


@pytest.mark.parametrize("name", ["octree.bin", "r.bin", "r0.bin", "0-0-0-0.bin"])
def test_files_of_such_names_alone_are_read(name: str, tmp_path: Path) -> None:
    np.testing.assert_array_equal(read_points(placed(tmp_path, name)), ROWS[:, :3])
