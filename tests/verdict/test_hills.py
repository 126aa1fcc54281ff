# SPDX-License-Identifier: MIT
"""Rolling ground without anything upright: a right pose is not "failed" for want of walls; two places are not "ok"."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import hybridreg as hr
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.evidence import one_surface, views
from hybridreg.evidence.evidence import Evidence
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.geometry import se3
from hybridreg.pair import Pair

Array = NDArray[np.float64]
_RANGES = np.arange(2.0, 60.0, 0.1)


def height(x: Array, y: Array, seed: int) -> Array:
    """Hills of some metres, some ten metres wide, with waves of a decimetre on them."""
    rng = np.random.default_rng([seed, 4])
    total = np.zeros_like(x)
    for size, width, n in ((1.3, 0.16, 6), (0.04, 1.5, 8)):
        for _ in range(n):
            a, b, phase = rng.normal(0.0, width), rng.normal(0.0, width), rng.uniform(0.0, 6.28)
            total = total + size * np.sin(a * x + b * y + phase)
    return total


def scan(x: float, y: float, yaw_deg: float, beams: int, seed: int) -> tuple[Array, Array]:
    """Points (n, 3) of a spinning sensor 1.8 m over the hills, and its pose (4, 4)."""
    origin = np.array([x, y, float(height(np.array(x), np.array(y), seed)) + 1.8])
    T = se3.from_rt(se3.yaw(yaw_deg)[:3, :3], origin)
    azimuth, elevation = np.meshgrid(
        np.radians(np.arange(0.0, 360.0, 1.0)), np.radians(np.linspace(-25.0, 10.0, beams)), indexing="ij"
    )
    rays = np.stack(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=-1
    ).reshape(-1, 3)
    points = []
    for part in np.array_split(rays @ T[:3, :3].T, 40):
        along = origin + part[:, None, :] * _RANGES[:, None]
        under = along[..., 2] < height(along[..., 0], along[..., 1], seed)
        hit = under.any(axis=1)
        points.append(along[hit, under[hit].argmax(axis=1)])
    world = np.concatenate(points)
    noise = np.random.default_rng(seed).normal(0.0, 0.015, world.shape)
    return se3.apply(se3.inverse(T), world) + noise, T


def test_a_right_pose_on_hills_has_not_failed() -> None:
    source, T_source = scan(0.0, 0.0, 40.0, 32, 3)
    target, T_target = scan(7.0, 3.0, -70.0, 24, 3)
    result = hr.register(source, target)
    off = se3.inverse(se3.inverse(T_target) @ T_source) @ result.transformation
    assert np.linalg.norm(off[:3, 3]) < 0.3
    assert result.verdict != "failed"


def test_hills_of_two_places_are_not_ok() -> None:
    source, _ = scan(0.0, 0.0, 40.0, 32, 1)
    target, _ = scan(7.0, 3.0, -70.0, 24, 2)
    assert hr.register(source, target).verdict == "failed"


def strip(x: float, y: float, wide: float, seed: int, noise: float) -> Array:
    """Points (n, 3) of an area around x, y, measured from the air."""
    rng = np.random.default_rng(seed)
    at = rng.uniform(-1.0, 1.0, (15_000, 2)) * [wide, 25.0] + [x, y]
    heights = 0.4 * height(at[:, 0] / 1.6, at[:, 1] / 1.6, 7 if seed < 10 else 8)
    points: Array = np.c_[at, heights] + rng.normal(0.0, noise, (len(at), 3))
    return points


def test_strips_of_gentle_hills_have_failed_only_where_they_are_laid_wrong() -> None:
    T = se3.from_rt(se3.yaw(100.0)[:3, :3], np.array([30.0, -20.0, -5.0]))
    source, target = se3.apply(T, strip(0.0, 0.0, 40.0, 1, 0.05)), strip(20.0, 8.0, 40.0, 2, 0.02)
    right = hr.register(source, target, preset="verify", init=se3.inverse(T))
    assert right.verdict != "failed"
    aside = se3.about(np.zeros(3), np.eye(3), np.array([5.0, 0.0, 0.0])) @ se3.inverse(T)
    wrong = hr.register(source, target, preset="verify", init=aside)
    assert wrong.verdict == "failed"


def test_a_surface_holds_a_pose_that_nothing_contradicts() -> None:
    source, T_source = scan(0.0, 0.0, 40.0, 32, 3)
    target, T_target = scan(7.0, 3.0, -70.0, 24, 3)
    truth = se3.inverse(T_target) @ T_source
    level = np.c_[np.random.default_rng(0).uniform(-30.0, 30.0, (20_000, 2)), np.zeros(20_000)]
    both = views.of(VoxelGrid(voxel=0.5)(Pair.of(source, target)))
    flat = views.of(VoxelGrid(voxel=0.5)(Pair.of(level, level)))
    at, anywhere = (
        PoseEvidence(both, truth),
        PoseEvidence(flat, se3.about(np.zeros(3), np.eye(3), [3.0, 2.0, 0.0])),
    )
    fine = Evidence(**_FACTS)
    assert one_surface.holds(at, fine, 0.5)
    assert not one_surface.holds(anywhere, fine, 0.5)
    for against in (
        {"agreement_most": 0.7}, {"looked_through": 0.05}, {"visible_source": 0.05}, {"overturned": 1.0},
    ):  # fmt: skip
        assert not one_surface.holds(at, replace(fine, **against), 0.5)


_FACTS = {
    "agreement_least": 0.0, "agreement_middle": 0.0, "agreement_most": 0.95, "looked_least": 0.0,
    "looked_through": 0.0, "looked_through_source": 0.0, "looked_through_target": 0.0, "agreement_rare": 0.0,
    "looked_through_rare": 0.0, "agreed_rare": 0.0, "through_rare": 0.0, "relief_cells": 0.0,
    "relief_correlation": 0.0, "weakest": 0.0, "found_by": 1.0, "matched": 0.0, "closeness": 0.0, "overturned": 0.0,
    "visible_source": 0.6, "visible_target": 0.6,
}  # fmt: skip
