# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hybridreg.data.simulate.sensing.overlaps import overlap, thin
from hybridreg.geometry import se3


@given(st.integers(0, 10_000), st.floats(0.05, 2.0))
def test_thin_keeps_one_measured_point_of_each_cube(seed: int, voxel: float) -> None:
    points = np.random.default_rng(seed).normal(0, 3, (300, 3)).astype(np.float32)
    kept = thin(points, voxel)
    cells = {tuple(c) for c in np.floor(points / voxel).astype(int)}
    assert {tuple(c) for c in np.floor(kept / voxel).astype(int)} == cells
    assert len(kept) == len(cells)
    assert {p.tobytes() for p in kept} <= {p.tobytes() for p in points}


@given(st.integers(0, 10_000))
def test_overlap_is_the_share_within_reach_under_the_transform(seed: int) -> None:
    rng = np.random.default_rng(seed)
    target = rng.uniform(-5, 5, (200, 3))
    T = se3.from_rt(se3.random_rotation(rng), rng.normal(0, 5, 3))
    source = se3.apply(se3.inverse(T), target)
    far = rng.random(200) < 0.3
    source[far] += 100
    brute = (np.linalg.norm(se3.apply(T, source)[:, None] - target[None], axis=2).min(1) <= 0.5).mean()
    assert overlap(source, target, T) == pytest.approx(brute)
    assert overlap(source[far], target, T) == 0.0


def test_cubes_too_fine_to_number_are_refused() -> None:
    far = np.array([[0.0, 0, 0], [1e6, 1e6, 1e6]], np.float32)
    with pytest.raises(ValueError, match="voxel=0.0001 m is too fine"):
        thin(far, 0.0001)


def test_empty_clouds_share_nothing() -> None:
    assert overlap(np.zeros((0, 3)), np.zeros((5, 3)), np.eye(4)) == 0.0
    assert overlap(np.zeros((5, 3)), np.zeros((0, 3)), np.eye(4)) == 0.0
    assert thin(np.zeros((0, 3), np.float32), 0.25).shape == (0, 3)
