# SPDX-License-Identifier: MIT
"""trimesh's scenes and meshes have a unit: clouds are read in metres, and what a refusal says to give is in metres."""

from __future__ import annotations

import numpy as np
import pytest

from hybridreg.cloud import PointCloud

trimesh = pytest.importorskip("trimesh")

P = np.random.default_rng(0).uniform(-4.0, 4.0, (200, 3))


def _cloud(metres: float, unit: str | None) -> trimesh.PointCloud:
    cloud = trimesh.PointCloud(P / metres)
    cloud.units = unit
    return cloud


def test_a_scene_of_clouds_is_read_in_its_unit() -> None:
    with pytest.warns(UserWarning, match=r"its unit is 0\.001 m"):
        read = PointCloud.of(trimesh.Scene([_cloud(1e-3, "mm")]))
    np.testing.assert_allclose(read.points + read.offset, P, rtol=0, atol=1e-9)
    read = PointCloud.of(trimesh.Scene([_cloud(1.0, None)]))
    np.testing.assert_allclose(read.points + read.offset, P, rtol=0, atol=1e-9)
    with pytest.raises(ValueError, match=r"differ: 0\.001 m, 1 m"):
        PointCloud.of(trimesh.Scene([_cloud(1e-3, "mm"), _cloud(1.0, "m")]))


@pytest.mark.parametrize("scene", [False, True])
@pytest.mark.parametrize("unit, metres", [("mm", 1e-3), ("inches", 0.0254), ("m", 1.0), (None, 1.0)])
def test_the_cure_for_a_mesh_is_in_metres(unit: str | None, metres: float, scene: bool) -> None:
    # As trimesh reads 3MF files: the sampled points are an array, which had lost the unit.
    box = trimesh.creation.box(np.array([4.0, 3.0, 2.0]) / metres)
    box.units = unit
    x = trimesh.Scene([box]) if scene else box
    with pytest.raises(ValueError, match="cloud; sample its surface") as refused:
        PointCloud.of(x)
    call = str(refused.value).split(": " if scene else "surface, ")[-1].split(", or")[0]
    read = PointCloud.of(eval(call, {"x": x}))
    np.testing.assert_allclose(np.ptp(read.points, axis=0), [4.0, 3.0, 2.0], rtol=0, atol=1e-6)
