# SPDX-License-Identifier: MIT
"""Ground that repeats is alike at wrong poses too, and speaks for none of them."""

from __future__ import annotations

import numpy as np
import pytest
from made_fields import field_pair

import hybridreg as hr
from hybridreg.data.hard import is_right, sample
from hybridreg.evidence import views
from hybridreg.evidence.agreement import compare
from hybridreg.evidence.relief_repeats import beyond, repeats
from hybridreg.geometry import se3
from hybridreg.geometry.ground_relief import Alike, Relief
from hybridreg.pair import Pair


def relief(heights: np.ndarray) -> Relief:
    """A square map of some heights, NaN where the ground is unknown."""
    return Relief(
        places=np.zeros((0, 3)),
        heights=np.zeros(0),
        grid=heights,
        floor=heights,
        T_level_cloud=np.eye(4),
        cell=0.5,
    )


def smooth(n: int, seed: int) -> np.ndarray:
    from scipy.ndimage import gaussian_filter

    return gaussian_filter(np.random.default_rng(seed).normal(size=(n, n)), 1.0)


X, Y = np.meshgrid(np.arange(60.0), np.arange(60.0), indexing="ij")


@pytest.mark.parametrize(
    "waves",
    [
        np.sin(0.7 * X),
        np.sin(0.7 * X) + np.sin(0.9 * Y + 1.0),
        np.sin(0.5 * X) * np.sin(0.5 * Y),
        np.abs(X % 12 - 6) - 3,
    ],
    ids=["furrows", "crossed", "bumps", "ridges"],
)
def test_waves_repeat(waves: np.ndarray) -> None:
    noisy = waves + 0.2 * waves.std() * np.random.default_rng(0).normal(size=waves.shape)
    assert repeats(relief(noisy)) > 0.8
    holes = np.where(np.hypot(X - 30, Y - 30) < 28, noisy, np.nan)
    holes[25:32, 10:40] = np.nan
    assert repeats(relief(holes)) > 0.75


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("n", [12, 30, 90])
def test_bumps_of_no_order_do_not(n: int, seed: int) -> None:
    assert repeats(relief(smooth(n, seed))) < 0.25


def test_a_ground_that_looks_alike_after_half_a_turn_repeats() -> None:
    half = smooth(50, 1)
    assert repeats(relief(half + half[::-1, ::-1])) > 0.9


def test_of_no_ground_nothing_is_known() -> None:
    assert repeats(relief(np.full((20, 20), np.nan))) == 0.0
    assert repeats(relief(np.zeros((20, 20)))) == 0.0


def test_what_goes_beyond() -> None:
    assert beyond(Alike(500.0, 0.8), 0.0) == Alike(500.0, 0.8)
    assert beyond(Alike(500.0, 0.8), 0.9) == Alike(500.0, 0.0)
    assert beyond(Alike(500.0, -0.8), 0.9) == Alike(500.0, -0.8)
    more = beyond(Alike(500.0, 0.9), 0.6)
    # Nats are the difference between those of both correlations.
    assert more.information == pytest.approx(Alike(500.0, 0.9).information - Alike(500.0, 0.6).information)


def test_a_field_of_furrows_speaks_for_no_pose_and_one_of_bumps_for_the_right_one() -> None:
    pair, truth = field_pair()
    assert compare(views.of(hr.VoxelGrid()(pair)), truth).relief.information > 30.0

    def furrowed(points: np.ndarray, T: np.ndarray) -> np.ndarray:
        there = se3.apply(T, points)
        return se3.apply(se3.inverse(T), there + 0.05 * np.sin(1.3 * there[:, :1]) * [0.0, 0.0, 1.0])

    source, target = furrowed(pair.source.points, truth), furrowed(pair.target.points, np.eye(4))
    both = views.of(hr.VoxelGrid()(Pair.of(source, target)))
    beside = se3.from_rt(np.eye(3), np.array([2.0 * np.pi / 1.3, 0.0, 0.0])) @ truth
    assert compare(both, beside).relief.information < 30.0


@pytest.mark.parametrize("seed", [471, 477])
def test_parts_of_a_map_on_waves_come_to_lie_where_their_walls_do(seed: int) -> None:
    made = sample("merged", seed)  # by the waves alone, half a turn or 20 m off
    assert is_right(made, hr.register(made.source, made.target).transformation)
