# SPDX-License-Identifier: MIT
"""Points that both clouds hold to the last bit draw the pose, and are told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hybridreg as hr
from hybridreg.data.loaders.folder import load_pair
from hybridreg.geometry import se3
from hybridreg.pair import Pair
from hybridreg.verdict.shared_points import shared_points


def clouds() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    return rng.uniform(-20.0, 20.0, (4000, 3)), rng.uniform(-20.0, 20.0, (5000, 3))


@pytest.mark.parametrize("share", [0.05, 0.3])
def test_the_share_is_told_where_the_pose_lays_them_on_themselves(share: float) -> None:
    source, target = clouds()
    n = int(share * len(source))
    source[-n:] = target[-n:]
    near = se3.from_rt(np.eye(3), np.array([0.1, 0.0, 0.0]))
    assert f"{share:.0%} of the source's points" in shared_points(Pair.of(source, target), near, 0.5)
    away = se3.from_rt(np.eye(3), np.array([3.0, 0.0, 0.0]))
    assert shared_points(Pair.of(source, target), away, 0.5) == ""
    assert f"{share:.0%}" in shared_points(
        Pair.of(source + [5e5, 5e6, 0.0], target + [5e5, 5e6, 0.0]), near, 0.5
    )


def test_two_scans_share_none_and_a_scan_may_lie_whole_in_its_map() -> None:
    source, target = clouds()
    assert shared_points(Pair.of(source, target), np.eye(4), 0.5) == ""
    assert shared_points(Pair.of(target[:3000], target), np.eye(4), 0.5) == ""
    rounded = np.round(source, 1), np.round(target, 1)  # many coordinates are alike, no points
    assert shared_points(Pair.of(*rounded), np.eye(4), 0.5) == ""


@pytest.mark.parametrize("name", ["kitti-odo-5-to-0", "sustech-970-to-965"])
def test_what_a_buffer_left_behind_is_no_ok(real_data: Path, name: str) -> None:
    pair = load_pair(real_data / name).pair
    left = load_pair(real_data / "kitti-city-20-to-0").pair.target.points
    source, target = pair.source.points, pair.target.points
    left = left[: int(0.4 * len(source))]
    result = hr.register(np.concatenate([source, left]), np.concatenate([target, left]))
    assert result.verdict != "ok" or np.linalg.norm(result.transformation[:3, 3]) > 0.5


def test_a_result_is_not_changed_behind_its_verdict() -> None:
    source, _ = clouds()
    result = hr.register(source, source[:3000], preset="verify", init=np.eye(4))
    with pytest.raises(ValueError, match="read-only"):
        result.transformation[:3, 3] += 5.0
    with pytest.raises(ValueError, match="read-only"):
        result.covariance[0, 0] = 0.0
    found = hr.register_all([source, source[:3000]], preset="verify")
    with pytest.raises(ValueError, match="read-only"):
        found.poses[0] = 0.0
