# SPDX-License-Identifier: MIT
"""Open3D reads what we write, and we read what Open3D writes."""

from __future__ import annotations

import numpy as np
import pytest

from hybridreg.io import read_points, write_points
from hybridreg.runtime.open3d import load_open3d

try:
    o3d = load_open3d()
except ImportError as error:
    pytest.skip(str(error), allow_module_level=True)


@pytest.fixture(scope="module")
def street():
    """Points with a regular part, so that LZF finds something to copy."""
    rng = np.random.default_rng(3)
    return np.vstack([rng.normal(0, 20, size=(3000, 3)), np.tile([1.5, -2.25, 0.5], (3000, 1))])


def open3d_cloud(points):
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.colors = o3d.utility.Vector3dVector(np.full(points.shape, 0.5))
    cloud.normals = o3d.utility.Vector3dVector(np.tile([0.0, 0.0, 1.0], (len(points), 1)))
    return cloud


@pytest.mark.parametrize("ending", ["ply", "pcd"])
@pytest.mark.parametrize("ascii", [False, True])
@pytest.mark.parametrize("compressed", [False, True])
def test_we_read_open3d(tmp_path, street, ending, ascii, compressed):
    path = tmp_path / f"a.{ending}"
    assert o3d.io.write_point_cloud(str(path), open3d_cloud(street), write_ascii=ascii, compressed=compressed)
    ours, theirs = read_points(path), np.asarray(o3d.io.read_point_cloud(str(path)).points)
    np.testing.assert_array_equal(ours, theirs)
    np.testing.assert_allclose(ours, street, atol=1e-4)  # Open3D writes six digits to an ascii PLY


@pytest.mark.parametrize("ending", ["ply", "pcd", "npz"])
@pytest.mark.parametrize("kind", ["float32", "float64", "int32"])
def test_we_read_open3d_tensors(tmp_path, street, ending, kind):
    points = street.astype(kind)
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(points))
    path = tmp_path / f"a.{ending}"
    if not o3d.t.io.write_point_cloud(str(path), cloud):
        pytest.skip(f"Open3D does not write {kind} to .{ending}")
    if ending == "npz":
        with np.load(path) as archive:
            assert "positions" in archive
    np.testing.assert_array_equal(read_points(path), points)


def test_we_read_a_mesh_as_its_vertices(tmp_path):
    mesh = o3d.geometry.TriangleMesh.create_box()
    o3d.io.write_triangle_mesh(str(tmp_path / "a.ply"), mesh)
    np.testing.assert_array_equal(read_points(tmp_path / "a.ply"), np.asarray(mesh.vertices))


@pytest.mark.parametrize("ending", ["xyz", "xyzn", "pts"])
def test_text_formats(tmp_path, street, ending):
    path = tmp_path / f"a.{ending}"
    assert o3d.io.write_point_cloud(str(path), open3d_cloud(street))
    text = path.rename(tmp_path / "a.txt")
    np.testing.assert_allclose(read_points(text), street, atol=1e-6)


@pytest.mark.parametrize("ending", ["ply", "pcd"])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_open3d_reads_us(tmp_path, street, utm_cloud, ending, dtype):
    path = tmp_path / f"a.{ending}"
    for points in (street, utm_cloud):
        write_points(path, points, dtype=dtype)
        theirs = o3d.t.io.read_point_cloud(str(path)).point.positions.numpy()
        np.testing.assert_array_equal(theirs, points.astype(dtype))


@pytest.mark.parametrize("ending", ["ply", "pcd"])
def test_open3d_reads_our_defaults(tmp_path, street, ending):
    # Its older reader takes the coordinates of a float64 PCD for zeros, which is why that is not our default.
    write_points(tmp_path / f"a.{ending}", street)
    theirs = np.asarray(o3d.io.read_point_cloud(str(tmp_path / f"a.{ending}")).points)
    np.testing.assert_allclose(theirs, street, atol=1e-5)
    assert np.abs(theirs).max() > 50
