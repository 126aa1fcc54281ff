# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_places import Made

from hybridreg.evidence import views
from hybridreg.geometry import se3
from hybridreg.geometry.main_axes import balanced, main_axes
from hybridreg.search.settle import settle


@given(st.integers(0, 2**32 - 1))
def test_axes_lie_along_floor_and_walls_though_all_are_equally_common(seed: int) -> None:
    rng = np.random.default_rng(seed)
    R = se3.random_rotation(rng)
    normals = np.repeat(np.eye(3), 400, axis=0) + rng.normal(0.0, 0.05, (1200, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    axes = main_axes(normals[:600] @ R.T, normals[600:] @ R.T)
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-9)
    assert np.abs(axes @ R).max(axis=0) == pytest.approx(np.ones(3), abs=1e-3)


def test_the_commonest_direction_comes_first() -> None:
    normals = np.repeat(np.eye(3), [100, 700, 300], axis=0)
    assert np.abs(main_axes(normals)).argmax(axis=1).tolist() == [1, 2, 0]


def test_a_balanced_sample_of_a_field_is_two_thirds_what_stands_on_it() -> None:
    normals = np.repeat(np.eye(3), [400, 9000, 600], axis=0)
    rows = balanced(normals, 1200)
    assert len(np.unique(rows)) == len(rows) == 1200
    for part in (rows, rows[::3]):
        assert normals[part].mean(axis=0) == pytest.approx(np.full(3, 1 / 3), abs=0.05)


def test_what_is_rare_is_taken_whole() -> None:
    normals = np.repeat(np.eye(3), [10, 9000, 90], axis=0)
    rows = balanced(normals, 1200)
    assert np.bincount(np.argmax(normals[rows], axis=1), minlength=3).tolist() == [10, 1100, 90]
    assert len(balanced(normals[:5], 1200)) == 5


@pytest.mark.parametrize("wide", [False, True])
def test_a_pose_near_the_truth_settles_there(crossing: Made, wide: bool) -> None:
    off = se3.from_rt(se3.yaw(3.0)[:3, :3], np.array([0.5, -0.4, 0.1])) @ crossing.truth
    T = settle(views.of(crossing.scene), off, wide=wide)
    error = se3.inverse(crossing.truth) @ T
    assert se3.angle_deg(error[:3, :3]) < 0.5
    assert np.linalg.norm(error[:3, 3]) < 0.15
