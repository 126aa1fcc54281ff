# SPDX-License-Identifier: MIT
"""Two flat 2-D scans are registered as the walls and the floor that they tell of."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import hybridreg as hr
from hybridreg.data.hard import is_right, sample
from hybridreg.flat_scans import raised
from hybridreg.geometry import se3
from hybridreg.pair import Pair

Array = NDArray[np.float64]
# Of the kind's even seeds, which no measurement uses.
SEEDS = (400, 418, 440)


@pytest.mark.parametrize("seed", SEEDS)
def test_scans_of_one_room_are_right_and_ok(seed: int) -> None:
    one = sample("flat", seed)

    result = hr.register(one.source, one.target)

    assert result.verdict == "ok", result.reasons
    assert is_right(one, result.transformation)
    assert any("flat 2-D scans" in note for note in result.notes)
    # In their plane, as both scans are.
    assert abs(result.transformation[2, 3]) < 0.02
    assert result.transformation[2, 2] > np.cos(np.radians(0.5))


@pytest.mark.parametrize(("here", "there"), [(400, 418), (534, 536)])
def test_scans_of_different_rooms_are_not_ok(here: int, there: int) -> None:
    assert hr.register(sample("flat", here).source, sample("flat", there).target).verdict != "ok"


def test_walls_that_are_seen_through_are_told() -> None:
    result = hr.register(sample("flat", 500).source, sample("flat", 502).target)

    assert result.verdict == "doubtful"
    assert "saw through" in result.reasons[0]
    assert "of the walls" in result.reasons[0]


@pytest.mark.parametrize("seen", ["nowhere", "two places"])
def test_a_flat_map_is_raised_too(seen: str) -> None:
    one = sample("flat", SEEDS[1])
    T = one.truths[0]
    fused = np.concatenate([one.target, se3.apply(T, one.source)[::2]])
    rows = (np.arange(len(fused)) >= len(one.target)).astype(np.int64)
    viewpoint = "none" if seen == "nowhere" else (np.stack([np.zeros(3), T[:3, 3]]), rows)

    result = hr.register(one.source, fused, target_viewpoint=viewpoint)

    assert result.verdict == "ok", result.reasons
    assert is_right(one, result.transformation)


def test_a_scanner_that_was_tilted_gives_the_same_pose() -> None:
    one = sample("flat", SEEDS[0])
    turn = se3.from_rt(se3.rotation_about(np.radians([20.0, 10.0, 0.0])), np.zeros(3))

    result = hr.register(se3.apply(turn, one.source), one.target)

    assert result.verdict == "ok", result.reasons
    assert is_right(one, result.transformation @ turn)


def test_the_scans_own_points_come_first() -> None:
    one = sample("flat", SEEDS[0])
    pair = Pair.of(one.source, one.target)

    up = raised(pair)

    assert np.array_equal(up.source.points[: len(one.source)], pair.source.points)
    assert np.array_equal(up.target.viewpoint, np.zeros(3))
    heights = up.source.points[:, 2]
    # Walls from the floor to as far above the sensor.
    assert heights.max() > 0.2
    assert heights.min() == pytest.approx(-heights.max(), rel=0.1)


def _solid(points: Array) -> Array:
    return points + np.array([0.0, 0.0, 1.0]) * np.random.default_rng(0).uniform(0.0, 2.0, (len(points), 1))


@pytest.mark.parametrize("which", ["one solid", "both solid", "sensor over the plane"])
def test_anything_else_stays_as_it_is(which: str) -> None:
    one = sample("flat", SEEDS[0])
    source, target = one.source, one.target
    if which == "one solid":
        source = _solid(source)
    if which == "both solid":
        source, target = _solid(source), _solid(target)
    if which == "sensor over the plane":
        source, target = source - [0.0, 0.0, 1.5], target - [0.0, 0.0, 1.5]
    here = (0.0, 0.0, 0.0)

    pair = Pair.of(source, target, source_viewpoint=here, target_viewpoint=here)

    assert raised(pair) is pair
