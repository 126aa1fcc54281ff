# SPDX-License-Identifier: MIT
"""Corners of a surface on a map grid that were rounded as they were stored: its points do not show it."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import hybridreg as hr

OFFSET = np.array([500_000.0, 5_400_000.0, 100.0])
SIDE = 30


def terrain(offset: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners (n, 3) and faces (m, 3)."""
    rng = np.random.default_rng(0)
    x, y = (each.ravel() * 0.7 for each in np.meshgrid(np.arange(SIDE), np.arange(SIDE)))
    corners = np.c_[x, y, 2.0 * np.sin(x / 5.0) + np.cos(y / 3.0)] + rng.uniform(0.0, 0.3, (SIDE**2, 3))
    k = np.arange(SIDE**2).reshape(SIDE, SIDE)
    low, right, up, both = (each.ravel() for each in (k[:-1, :-1], k[:-1, 1:], k[1:, :-1], k[1:, 1:]))
    return corners + offset, np.vstack([np.c_[low, right, both], np.c_[low, both, up]])


def obj(path: Path, corners: np.ndarray, faces: np.ndarray, digits: str) -> None:
    rows = [f"v {digits} {digits} {digits}" % tuple(each) for each in corners]
    path.write_text("\n".join([*rows, *(f"f {a} {b} {c}" for a, b, c in faces + 1)]) + "\n")


def told(path: Path) -> list[str]:
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        cloud = hr.read(path)
    assert len(cloud.points) == 200_000
    assert np.allclose((cloud.points + cloud.offset).mean(axis=0)[2], 100.0, atol=2.0)
    return [str(each.message) for each in seen]


@pytest.mark.parametrize("ending", ["stl", "glb"])
def test_surfaces_in_single_precision_are_told(ending: str, tmp_path: Path) -> None:
    # They were read as if they had been stored as they are, steps of half a metre and all.
    trimesh = pytest.importorskip("trimesh")
    path = tmp_path / f"map.{ending}"
    trimesh.Trimesh(*terrain(OFFSET), process=False).export(path)
    (words,) = told(path)
    assert words.startswith(
        f"{path}: its coordinates were kept in single precision far from the origin, 0.5 m apart"
    )
    trimesh.Trimesh(*terrain(OFFSET * [0.0, 0.0, 1.0]), process=False).export(path)  # the cure
    assert told(path) == []


@pytest.mark.parametrize(("digits", "apart"), [("%g", "10 m"), ("%.3f", ""), ("%.17g", "")])
def test_surfaces_of_six_digits_are_told(digits: str, apart: str, tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    path = tmp_path / "map.obj"
    obj(path, *terrain(OFFSET), digits)
    words = told(path)
    assert len(words) == bool(apart)
    assert all(f"written with six digits far from the origin, {apart} apart" in each for each in words)


@pytest.mark.parametrize(("kind", "many"), [("f4", 1), ("f8", 0)])
def test_surfaces_of_vtk_too(kind: str, many: int, tmp_path: Path) -> None:
    core, io = pytest.importorskip("vtkmodules.vtkCommonCore"), pytest.importorskip("vtkmodules.vtkIOXML")
    model = pytest.importorskip("vtkmodules.vtkCommonDataModel")
    convert = pytest.importorskip("vtkmodules.util.numpy_support").numpy_to_vtk
    corners, faces = terrain(OFFSET)
    points, cells, data = core.vtkPoints(), model.vtkCellArray(), model.vtkPolyData()
    points.SetData(convert(corners.astype(kind), deep=True))
    for face in faces:
        cells.InsertNextCell(3, face.tolist())
    data.SetPoints(points)
    data.SetPolys(cells)
    writer = io.vtkXMLPolyDataWriter()
    writer.SetFileName(str(tmp_path / "map.vtp"))
    writer.SetInputData(data)
    writer.Write()
    assert len(told(tmp_path / "map.vtp")) == many


def test_a_unit_is_told_once_and_counts_for_points_and_corners(tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    path = tmp_path / "part.obj"
    corners, faces = terrain(np.array([0.0, 0.0, 100.0]))
    obj(path, 1000.0 * corners, faces, "%.3f")
    path.write_text(f"# unit: mm\n{path.read_text()}")
    (words,) = told(path)
    assert "its unit is 0.001 m" in words


def test_a_grid_of_heights_as_a_surface_was_not_rounded(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    corners, faces = terrain(OFFSET)
    corners[:, :2] = np.round((corners[:, :2] - OFFSET[:2]) / 0.7) + OFFSET[:2]
    trimesh.Trimesh(corners, faces, process=False).export(tmp_path / "map.stl")
    assert told(tmp_path / "map.stl") == []
