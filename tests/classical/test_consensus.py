# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest
from made_matches import planted, random_pose

from hybridreg.classical import hypotheses
from hybridreg.classical.pose_modes import modes
from hybridreg.geometry import se3
from hybridreg.geometry.consensus import Consensus, distances
from hybridreg.matches import Correspondences


def consensus_of(matches: Correspondences, max_distance: float = 0.3) -> Consensus:
    return Consensus(matches.source, matches.target, matches.weight, max_distance)


@pytest.mark.parametrize("offset", [0.0, 5_000.0])
def test_counts_are_those_of_the_residuals(offset: float) -> None:
    matches, T, _ = planted(0, n=3000)
    moved = Correspondences.of(matches.source + offset, matches.target - offset)
    rng = np.random.default_rng(1)
    nudged = np.array([se3.exp(rng.normal(0, 0.004, 6)) @ T for _ in range(300)])
    undo = se3.from_rt(np.eye(3), np.full(3, -offset))
    poses = undo @ nudged @ undo
    direct = [
        np.count_nonzero(np.linalg.norm(se3.apply(P, moved.source) - moved.target, axis=1) < 0.3)
        for P in poses
    ]
    assert max(direct) > 500
    assert min(direct) < 400
    # float32 may decide otherwise for a match at the very threshold.
    np.testing.assert_allclose(consensus_of(moved).counts(poses), direct, atol=3)


def test_a_threshold_too_fine_for_float32_is_counted_in_float64() -> None:
    matches, T, true = planted(0, noise=1e-5)
    fine = consensus_of(matches, max_distance=1e-4)
    assert fine.counts(T[None])[0] == pytest.approx(true.sum(), abs=1)


def test_counts_of_no_poses_and_of_no_matches() -> None:
    assert consensus_of(planted(0)[0]).counts(np.zeros((0, 4, 4))).shape == (0,)
    assert consensus_of(planted(0, n=1)[0]).counts(np.eye(4)[None]).tolist() == [0]


def test_refit_reaches_the_matches_that_a_rough_pose_misses() -> None:
    matches, T, true = planted(2, noise=0.08)
    consensus = consensus_of(matches)
    rough = consensus.support(se3.exp(np.array([0.008, -0.006, 0.007, 0.05, -0.05, 0.05])) @ T)
    refined = consensus.refit(rough)
    assert rough.n_inliers < 0.8 * true.sum()
    assert refined.n_inliers > 0.95 * true.sum()


def test_rigid_keeps_true_samples_and_drops_repeated_matches() -> None:
    matches, _, true = planted(3, noise=0.0)
    rows = np.flatnonzero(true)
    samples = np.array([[rows[0], rows[1], rows[2]], [rows[0], rows[0], rows[2]]])
    kept = hypotheses.rigid(samples, matches.source, matches.target, 0.9, shortest=0.1)
    assert kept.tolist() == [samples[0].tolist()]


def test_rigid_bounds_every_edge() -> None:
    matches, _, _ = planted(4, inlier_ratio=0.1)
    rng = np.random.default_rng(0)
    samples = hypotheses.draw(20_000, 4, matches.weight, rng)
    kept = hypotheses.rigid(samples, matches.source, matches.target, 0.9, shortest=0.3)
    assert 0 < len(kept) < 0.01 * len(samples)
    for i in range(4):
        for j in range(i):
            a = np.linalg.norm(matches.source[kept[:, i]] - matches.source[kept[:, j]], axis=1)
            b = np.linalg.norm(matches.target[kept[:, i]] - matches.target[kept[:, j]], axis=1)
            assert (np.minimum(a, b) >= 0.9 * np.maximum(a, b) - 1e-12).all()


def test_draw_follows_the_weights() -> None:
    weight = np.array([0.0, 1.0, 3.0, 0.0])
    rows = hypotheses.draw(40_000, 3, weight, np.random.default_rng(0))
    share = np.bincount(rows.ravel(), minlength=4) / rows.size
    np.testing.assert_allclose(share, [0.0, 0.25, 0.75, 0.0], atol=0.01)


def test_distances_are_measured_where_the_points_are() -> None:
    # A turn by 3 degrees about a centre a kilometre off: a translation of 52 m, and the points stay.
    centre = np.array([1000.0, 0.0, 0.0])
    turn = se3.from_rt(np.eye(3), centre) @ se3.yaw(3.0) @ se3.from_rt(np.eye(3), -centre)
    degrees, metres = distances(turn[None], np.eye(4), centre)
    assert degrees[0] == pytest.approx(3.0)
    assert metres[0] == pytest.approx(0.0, abs=1e-9)


def test_modes_finds_two_answers_once_each() -> None:
    rng = np.random.default_rng(5)
    first, second = random_pose(rng), random_pose(rng)
    source = rng.uniform(-20, 20, (500, 3))
    target = np.where(np.arange(500)[:, None] < 300, se3.apply(first, source), se3.apply(second, source))
    consensus = Consensus(source, target, np.ones(500), 0.3)
    poses = np.array([se3.exp(rng.normal(0, 0.003, 6)) @ T for T in (first, second) for _ in range(40)])
    found = modes(consensus, poses, consensus.counts(poses), refit=True, share=0.5)
    assert [one.n_inliers for one in found] == [300, 200]
    np.testing.assert_allclose(found[1].T, second, atol=1e-6)
    assert len(modes(consensus, poses, consensus.counts(poses), refit=True, share=0.7)) == 1
