# SPDX-License-Identifier: MIT
"""An augmented pair is the same pair elsewhere: its targets are what they would be if they were computed anew."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from training_runs import MakeRecipe

from hybridreg.learned.cross3dreg.targets import compute_targets
from hybridreg.learned.matching.procrustes import apply_transform
from hybridreg.learned.training.data.augmentation import Augmentation, draw_motions, relight
from hybridreg.learned.training.data.pair_source import open_source
from hybridreg.learned.training.data.prepared import PreparedPair, true_partners
from hybridreg.learned.training.data.samples import augment, undisturbed
from hybridreg.learned.training.recipe import Recipe

STILL = Augmentation(jitter=0.0, light=0.0)


@pytest.fixture(scope="module")
def recipe(make_recipe: MakeRecipe) -> Recipe:
    return make_recipe()


@pytest.fixture(scope="module")
def prepared(recipe: Recipe, cache: Path) -> PreparedPair:
    """One pair as the cache holds it."""
    return open_source(recipe.data.train[0], recipe, cache).load(0)


@pytest.mark.parametrize("rotation", ["yaw", "full"])
def test_cached_targets_equal_those_of_the_moved_pair(
    prepared: PreparedPair, recipe: Recipe, rotation: str
) -> None:
    how = replace(STILL, rotation=rotation)
    sample = augment(prepared, 0, how, None, np.random.default_rng(1))
    anew = compute_targets(sample.batch.pyramid, sample.targets.transform, recipe.network)
    kept = {(int(t), int(s)): float(o) for t, s, o in zip(*pairs_of(sample.targets), strict=True)}
    found = {(int(t), int(s)): float(o) for t, s, o in zip(*pairs_of(anew), strict=True)}
    # A point on a radius may fall to either side after a turn in float32.
    odd = {pair for pair in kept.keys() | found.keys() if abs(kept.get(pair, 0) - found.get(pair, 0)) > 1e-4}
    assert len(odd) <= 0.02 * len(kept)
    assert len(kept) > 50
    agree = [torch.equal(a, b) for a, b in zip(masks_of(sample.targets), masks_of(anew), strict=True)]
    assert agree == [True, True]
    stage = recipe.network.backbone.fine_stage - 1
    radius = recipe.infonce.partner * recipe.network.backbone.voxel
    partners = true_partners(sample.batch.pyramid.clouds(stage), sample.targets.transform, radius)
    for before, after in zip(sample.partners, partners, strict=True):
        assert float((before == after).float().mean()) > 0.995
        assert float((before >= 0).float().mean()) > 0.3


def pairs_of(targets):  # type: ignore[no-untyped-def]
    return targets.target, targets.source, targets.overlap


def masks_of(targets):  # type: ignore[no-untyped-def]
    return targets.mask_target, targets.mask_source


@pytest.mark.parametrize("clouds", ["both", "one"])
@pytest.mark.parametrize("rotation", ["yaw", "full", "none"])
def test_the_new_truth_carries_source_points_to_where_they_belong(
    prepared: PreparedPair, clouds: str, rotation: str
) -> None:
    how = replace(STILL, rotation=rotation, clouds=clouds)
    rng = np.random.default_rng(5)
    motions = draw_motions(how, np.random.default_rng(5))
    sample = augment(prepared, 0, how, None, rng)
    for stage in range(prepared.pyramid.stages):
        old, new = prepared.pyramid.clouds(stage), sample.batch.pyramid.clouds(stage)
        # Through the old truth and the target's motion, or through the new clouds and the new truth.
        expected = apply_transform(
            apply_transform(old[1], prepared.targets.transform), torch.from_numpy(motions[0]).float()
        )
        assert torch.allclose(apply_transform(new[1], sample.targets.transform), expected, atol=1e-4)
    turned = [not np.allclose(motion[:3, :3], np.eye(3)) for motion in motions]
    assert sum(turned) == (0 if rotation == "none" else 2 if clouds == "both" else 1)


def test_no_index_and_no_distance_changes(prepared: PreparedPair) -> None:
    sample = augment(prepared, 0, STILL, None, np.random.default_rng(2))
    old, new = prepared.pyramid, sample.batch.pyramid
    for name in ("neighbors", "subsampling", "upsampling"):
        for before, after in zip(getattr(old, name), getattr(new, name), strict=True):
            assert torch.equal(before, after)
    for before, after in zip(old.clouds(2), new.clouds(2), strict=True):
        assert torch.allclose(torch.pdist(before.double()), torch.pdist(after.double()), atol=1e-4)
    assert not torch.allclose(old.points[0], new.points[0], atol=1.0)


def test_yaw_tilts_little_and_covers_the_circle() -> None:
    rng = np.random.default_rng(0)
    drawn = [draw_motions(Augmentation(), rng)[0] for _ in range(400)]
    tilt = np.degrees(np.arccos([T[2, 2] for T in drawn]))
    heading = np.degrees([np.arctan2(T[1, 0], T[0, 0]) for T in drawn])
    assert tilt.max() < 5.0 * np.sqrt(2.0) + 0.1
    assert tilt.max() > 5.0
    assert np.histogram(heading, bins=8, range=(-180, 180))[0].min() > 25
    assert np.abs([T[:3, 3] for T in drawn]).max() <= 2.0


def test_jitter_stays_within_its_width(prepared: PreparedPair) -> None:
    how = Augmentation(rotation="none", shift=0.0, jitter=0.02)
    moved = augment(prepared, 0, how, None, np.random.default_rng(0)).batch.pyramid.points[0]
    apart = (moved - prepared.pyramid.points[0]).abs()
    assert 0.015 < float(apart.max()) <= 0.02 + 1e-5


def test_light_changes_an_image_and_not_its_geometry(recipe: Recipe) -> None:
    image = np.zeros((12, 20, 3), np.uint8)
    image[3:7, 5:15] = (200, 120, 60)
    changed = relight(image, 0.4, np.random.default_rng(3))
    assert (changed.shape, changed.dtype) == (image.shape, image.dtype)
    assert not np.array_equal(changed, image)
    # Pixels that were alike stay alike, so that no edge moved: no crop, no flip, no turn.
    assert len(np.unique(changed.reshape(-1, 3), axis=0)) == 2
    inside = changed[3:7, 5:15].reshape(-1, 3)
    assert (inside == inside[0]).all()
    assert (inside[0] != changed[0, 0]).any()
    assert relight(image, 0.0, np.random.default_rng(3)) is image


def test_validation_sees_the_pair_as_it_is(prepared: PreparedPair, recipe: Recipe) -> None:
    sample = undisturbed(prepared, recipe.network.image)
    assert all(
        torch.equal(a, b) for a, b in zip(prepared.pyramid.points, sample.batch.pyramid.points, strict=True)
    )
    assert torch.equal(sample.targets.transform, prepared.targets.transform)


@pytest.mark.parametrize("scale", [(1.2, 0.8), (0.0, 1.0), (1.0,)])
def test_an_impossible_scale_is_refused(scale: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match=r"augmentation.scale=.*lowest and the highest factor"):
        Augmentation(scale=scale)
