# SPDX-License-Identifier: MIT
"""Spherical voxels, frames and patches."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from hybridreg.geometry import se3
from hybridreg.learned.vrhcf.batch import make_batch
from hybridreg.learned.vrhcf.config import named_config
from hybridreg.learned.vrhcf.keypoint_patches import build_patches
from hybridreg.learned.vrhcf.spherical_voxels import counts, spherical, voxels
from hybridreg.learned.vrhcf.upright_frames import reference_axes, upright_rotations

GRID = (5, 8, 4)


def at(radius: float, azimuth: float, polar: float) -> torch.Tensor:
    return torch.tensor([[[radius, azimuth, polar]]])


@pytest.mark.parametrize(
    ("place", "total"),
    [
        ((0.5, 1.0, 1.0), 1.0),
        ((0.0, math.pi, 0.0), 1.0),  # the keypoint itself
        ((0.05, 6.2, 3.1), 1.0),  # the innermost half cell, and a pole
        ((0.95, 3.0, 1.5), 0.75),  # half way into the outermost half cell: a quarter is lost
        ((1.0, 3.0, 1.5), 0.5),
        ((1.01, 3.0, 1.5), 0.0),
    ],
)
def test_a_point_weighs_one_but_at_the_rim(place: tuple[float, float, float], total: float) -> None:
    assert float(voxels(at(*place), 1.0, GRID).sum()) == pytest.approx(total, abs=1e-5)


def test_a_point_in_the_middle_of_a_cell_is_in_it_alone() -> None:
    place = at(0.3, (2 + 0.5) * 2 * math.pi / 8, (1 + 0.5) * math.pi / 4)
    spread = voxels(place, 1.0, GRID)[0]
    assert float(spread[1, 2, 1]) == pytest.approx(1.0, abs=1e-5)
    assert torch.equal(counts(place, 1.0, GRID)[0].nonzero(), torch.tensor([[1, 2, 1]]))


def test_azimuth_goes_around_and_the_poles_do_not() -> None:
    seam = voxels(at(0.3, 0.0, math.pi * 3 / 8), 1.0, GRID)[0]
    assert float(seam[1, 0, 1]) == pytest.approx(0.5, abs=1e-5)
    assert float(seam[1, 7, 1]) == pytest.approx(0.5, abs=1e-5)
    pole = voxels(at(0.3, (2 + 0.5) * 2 * math.pi / 8, 0.01), 1.0, GRID)[0]
    assert float(pole[1, 2, 0]) == pytest.approx(1.0, abs=1e-5)


def test_a_quarter_turn_about_the_axis_rolls_the_azimuth() -> None:
    points = torch.from_numpy(np.random.default_rng(0).normal(size=(3, 60, 3)) * 0.3).float()
    R = torch.from_numpy(se3.rotation_about(np.array([0, 0, math.pi / 2]))).float()
    one, two = (voxels(spherical(p), 1.0, GRID) for p in (points, points @ R.T))
    assert torch.allclose(one.roll(2, dims=2), two, atol=1e-4)


def test_frames_stand_upright_and_face_the_origin() -> None:
    rng = np.random.default_rng(0)
    flat = rng.normal(size=(20, 50, 3)) * [1.0, 1.0, 0.05]
    R = np.array([se3.random_rotation(rng) for _ in range(20)])
    patches = torch.from_numpy(np.einsum("nij,nkj->nki", R, flat))
    keypoints = torch.from_numpy(rng.normal(size=(20, 3)) * 10)
    axes = reference_axes(patches, keypoints)
    assert ((axes * keypoints).sum(1) <= 0).all()
    turned = upright_rotations(axes, "right", 4)
    up = torch.tensor([0.0, 0.0, 1.0], dtype=axes.dtype)
    assert torch.allclose((axes[:, None] @ turned)[:, 0], up.expand_as(axes), atol=1e-6)
    assert torch.allclose(
        turned.transpose(1, 2) @ turned, torch.eye(3, dtype=axes.dtype).expand(20, 3, 3), atol=1e-6
    )


@pytest.mark.parametrize(("n", "wrong"), [(3, 3), (4, 0), (7, 3), (8, 0), (2, 0), (11, 3)])
def test_a_rest_of_three_gets_wrong_frames_as_released(n: int, wrong: int) -> None:
    axes = torch.nn.functional.normalize(torch.randn(n, 3, generator=torch.Generator().manual_seed(1)), dim=1)
    apart = (upright_rotations(axes, "released", 4) - upright_rotations(axes, "right", 4)).abs().amax((1, 2))
    assert (apart < 1e-5).sum() == n - wrong
    assert (apart[n - wrong :] > 1e-3).all()


def test_an_axis_straight_down_gets_half_a_turn_only_where_that_is_asked_for() -> None:
    down = torch.tensor([[0.0, 0.0, -1.0]])
    assert torch.allclose((down @ upright_rotations(down, "right", 4)[0])[0], -down[0])
    assert torch.allclose(upright_rotations(down, "released", 4)[0], torch.eye(3))
    assert torch.allclose(upright_rotations(-down, "right", 4)[0], torch.eye(3))


def test_patches_have_one_size_and_end_with_the_keypoint() -> None:
    points = np.random.default_rng(0).uniform(-1, 1, (400, 3)).astype(np.float32)
    rows = np.array([0, 17, 399])
    patches = build_patches(points, rows, 0.5, 30, np.random.default_rng(0))
    assert patches.shape == (3, 30, 3)
    assert np.array_equal(patches[:, -1], points[rows])
    assert (np.linalg.norm(patches - points[rows][:, None], axis=2) <= 0.5 + 1e-6).all()
    assert np.array_equal(patches, build_patches(points, rows, 0.5, 30, np.random.default_rng(0)))
    alone = build_patches(points[:1], np.array([0]), 0.5, 5, np.random.default_rng(0))
    assert np.array_equal(alone[0], np.repeat(points[:1], 5, axis=0))
    # 40 points repeated to 130: each three times, ten of them a fourth time, before the keypoint takes the last row.
    few = build_patches(points[:40], np.array([3]), 9.0, 130, np.random.default_rng(0))[0, :-1]
    times = np.unique(few, axis=0, return_counts=True)[1]
    assert len(times) == 40
    assert set(times) <= {2, 3, 4}


def test_bad_clouds_are_told() -> None:
    good, config = np.random.default_rng(0).normal(size=(20, 3)), named_config("nano")
    with pytest.raises(ValueError, match=r"source: SphereNet needs .* got shape \(0, 3\)"):
        make_batch(good, good[:0], config)
    bad = good.copy()
    bad[3] = np.inf
    with pytest.raises(ValueError, match="target: 1 of 20 points are not finite"):
        make_batch(bad, good, config)
