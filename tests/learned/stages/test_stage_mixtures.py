# SPDX-License-Identifier: MIT
"""Learned and classical stages in one pipeline, in every order that makes sense."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
import torch

import hybridreg as hr
from hybridreg import testing
from hybridreg.geometry import se3
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.matches import Correspondences, Overlap
from hybridreg.runtime.open3d import load_open3d
from hybridreg.scene import Scene

OVERLAPS = {"none": "none", "visibility": "visibility", "omp": hr.Omp(untrained=True)}
MATCHERS = {"vgam": hr.Vgam(untrained=True), "geotransformer": hr.GeoTransformer(untrained=True)}
Shifted = tuple[hr.Pair, np.ndarray]


def pipeline(**stages: object) -> hr.Pipeline:
    return hr.Pipeline(**{"voxel": 0.5, "refine": "none", **stages})


def _is_near(T: np.ndarray, truth: np.ndarray) -> bool:
    # Fine points of a metre's grid, two candidates each: a neighbour's match is off by decimetres, a fit to all
    # of them by centimetres.
    error = se3.inverse(truth) @ T
    return bool(se3.angle_deg(error[:3, :3]) < 0.5 and np.linalg.norm(error[:3, 3]) < 0.1)


@pytest.mark.parametrize("estimate", ["ransac", "lgr"])
@pytest.mark.parametrize("match", MATCHERS)
@pytest.mark.parametrize("overlap", OVERLAPS)
def test_every_mixture_finds_a_shift(shifted: Shifted, overlap: str, match: str, estimate: str) -> None:
    pair, truth = shifted
    pipe = pipeline(overlap=OVERLAPS[overlap], match=MATCHERS[match], estimate=estimate)
    result = pipe.run(pair)
    assert _is_near(result.transformation, truth)
    assert result.matches.group is not None
    assert result.verdict == "ok"


def test_svd_takes_the_matches_too(shifted: Shifted) -> None:
    trace = pipeline(match=MATCHERS["vgam"], estimate="svd").trace(shifted[0])
    right = np.linalg.norm(trace.matches.target - se3.apply(shifted[1], trace.matches.source), axis=1) < 0.01
    assert right.mean() > 0.3, "a pose from matches that are all wrong tests nothing"
    assert trace.estimated.found
    centre = np.median(shifted[0].source.points, axis=0)
    gap = se3.apply(trace.estimated.T, centre[None]) - se3.apply(shifted[1], centre[None])
    assert np.linalg.norm(gap) < 0.5, "the wrong ones lie all around"


def test_a_learned_mask_feeds_fpfh() -> None:
    try:
        load_open3d()
    except ImportError as error:
        pytest.skip(str(error))
    scene, _ = testing.sample_scene()
    overlap = hr.Omp(untrained=True)(scene)
    middle = float(np.median(np.concatenate([overlap.source, overlap.target])))
    found = hr.Fpfh(min_overlap=middle)(scene, overlap)
    assert len(found) > 20
    assert found.source_index is not None
    assert found.target_index is not None
    assert (overlap.source[found.source_index] > middle).all()
    assert (overlap.target[found.target_index] > middle).all()
    pipe = pipeline(overlap=hr.Omp(untrained=True), match=hr.Fpfh(), estimate="ransac")
    assert pipe.run(scene.pair).verdict == "ok"


@pytest.mark.parametrize("match", MATCHERS)
def test_a_given_mask_rules_the_matches(
    shifted: Shifted, make_weights: Callable[..., str], match: str
) -> None:
    class Half:
        def __call__(self, scene: Scene) -> Overlap:
            inside = scene.source.points[:, 0] > 4.0
            return Overlap(np.where(inside, 0.9, 0.1), np.ones(len(scene.target)))

    config = named_config("nano", omp=True, vgam=match == "vgam")
    assert config.omp is not None
    # The ladder would fill a mask of so few superpoints up again.
    config = dataclasses.replace(config, omp=dataclasses.replace(config.omp, min_kept=4))
    stage = type(MATCHERS[match])(weights=make_weights(config))
    found = pipeline(overlap=Half(), match=stage, estimate="lgr").trace(shifted[0]).matches
    everywhere = pipeline(match=stage, estimate="lgr").trace(shifted[0]).matches
    # Superpoints are 4 m apart: their patches may reach over the border by a diagonal.
    assert found.source[:, 0].min() > 4.0 - 4.0 * np.sqrt(2.0)
    assert everywhere.source[:, 0].min() < -4.0


def test_lgr_takes_matches_of_the_user(shifted: Shifted) -> None:
    scene, truth = testing.sample_scene()
    pair, _ = testing.sample_pair()
    mine = testing.true_matches(scene, truth)
    pipe = pipeline(match="given", estimate="lgr")
    assert np.allclose(pipe.run(pair, matches=mine).transformation, truth, atol=1e-6)
    with pytest.raises(ValueError, match=r"give the 120 matches a group"):
        pipe.run(pair, matches=dataclasses.replace(mine, group=None))


@pytest.mark.parametrize("match", MATCHERS)
def test_the_truth_is_nowhere_near(match: str) -> None:
    pair, truth = testing.sample_pair()
    pipe = pipeline(overlap=OVERLAPS["omp"], match=MATCHERS[match], estimate="lgr")
    results = []
    for T in (truth, se3.yaw(77.0)):
        labelled = hr.LabelledPair(pair=pair, T_target_source=T)
        results.append(pipe.run(labelled.pair))
    one, two = results
    assert np.array_equal(one.transformation, two.transformation)
    assert np.array_equal(one.matches.weight, two.matches.weight)


def test_threads_change_nothing_that_matters(shifted: Shifted) -> None:
    pipe = pipeline(overlap=OVERLAPS["omp"], match=MATCHERS["vgam"], estimate="lgr")
    before = torch.get_num_threads()
    traces = []
    try:
        for n in (1, 2):
            torch.set_num_threads(n)
            traces.append(pipe.trace(shifted[0]))
            assert torch.get_num_threads() == n, "the caller's number of threads was changed"
    finally:
        torch.set_num_threads(before)
    one, two = traces
    assert np.allclose(one.overlap.source, two.overlap.source, atol=1e-5)
    assert abs(len(one.matches) - len(two.matches)) <= 0.05 * len(one.matches)
    assert np.allclose(one.estimated.T, two.estimated.T, atol=1e-5)


def test_map_coordinates_reach_the_network_as_small_ones(shifted: Shifted) -> None:
    pair, truth = shifted
    far = np.array([4.4e5, 5.4e6, 200.0])
    moved = hr.Pair.of(pair.source.points + far, pair.target.points + far, pair.image)
    pipe = pipeline(match=MATCHERS["geotransformer"], estimate="lgr")
    T = pipe.run(moved).transformation
    back, there = se3.from_rt(np.eye(3), -far), se3.from_rt(np.eye(3), far)
    assert _is_near(back @ T @ there, truth)


def test_estimators_heed_the_spacing_of_the_matches() -> None:
    scene, truth = testing.sample_scene()
    good = testing.true_matches(scene, truth, n=60)
    rng = np.random.default_rng(0)
    rough = dataclasses.replace(good, target=good.target + rng.uniform(-0.6, 0.6, good.target.shape))
    for estimate in (hr.Lgr(), hr.Ransac(), hr.WeightedSvd()):
        told = dataclasses.replace(rough, spacing=2.0)
        few = estimate(scene, _right(rough, good, truth), np.random.default_rng(0)).inliers
        many = estimate(scene, _right(told, good, truth), np.random.default_rng(0)).inliers
        assert many.sum() > few.sum()


def _right(matches: Correspondences, good: Correspondences, truth: np.ndarray) -> Correspondences:
    keep = np.linalg.norm(good.target - se3.apply(truth, good.source), axis=1) < 0.01
    return dataclasses.replace(
        matches, **{k: getattr(matches, k)[keep] for k in ("source", "target", "weight", "group")}
    )
