# SPDX-License-Identifier: MIT
"""Weighted Procrustes and local-to-global registration."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hybridreg.learned.cross3dreg.config import LgrConfig
from hybridreg.learned.matching.local_to_global import local_to_global
from hybridreg.learned.matching.procrustes import apply_transform, weighted_procrustes


def pose(seed: int) -> torch.Tensor:
    """A random rigid motion, float64."""
    transform = np.eye(4)
    transform[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    transform[:3, 3] = np.random.default_rng(seed).uniform(-20, 20, 3)
    return torch.from_numpy(transform)


@settings(max_examples=40, deadline=None)
@given(st.integers(3, 30), st.integers(0, 10**6))
def test_exact_motion_is_recovered(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    source = torch.from_numpy(rng.normal(size=(n, 3)) * 5)
    weight = torch.from_numpy(rng.uniform(0.2, 1.0, n)) * 1e6  # so that the 1e-5 in the sum does not show
    found = weighted_procrustes(source, apply_transform(source, pose(seed)), weight)
    assert (apply_transform(source, found) - apply_transform(source, pose(seed))).norm(dim=1).max() < 1e-6


@pytest.mark.parametrize("kind", ["mirror", "collinear", "two", "one", "equal"])
def test_always_a_rotation(kind: str) -> None:
    source = torch.randn(12, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    target = source * torch.tensor([1.0, 1.0, -1.0]) if kind == "mirror" else apply_transform(source, pose(1))
    if kind == "collinear":
        source, target = source[:, :1] * torch.ones(3), target[:, :1] * torch.tensor([1.0, 2.0, 0.0])
    keep = {"two": 2, "one": 1}.get(kind, 12)
    source, target = source[:keep], target[:keep]
    if kind == "equal":
        source, target = source[:1].expand(12, 3), target[:1].expand(12, 3)
    found = weighted_procrustes(source, target, torch.ones(len(source), dtype=torch.float64))
    rotation = found[:3, :3]
    assert torch.allclose(rotation @ rotation.T, torch.eye(3, dtype=torch.float64), atol=1e-9)
    assert torch.det(rotation) == pytest.approx(1.0)


@pytest.mark.parametrize("weight", [0.0, float("nan"), float("inf")])
def test_useless_weights_give_the_identity(weight: float) -> None:
    source = torch.randn(5, 3)
    found = weighted_procrustes(source, source + 1, torch.full((5,), weight))
    assert torch.equal(found, torch.eye(4))


def grouped(seed: int, inlier_groups: int = 1, groups: int = 8):  # type: ignore[no-untyped-def]
    """Ten matches a group; in inlier groups they follow the pose, in the others nothing."""
    rng = np.random.default_rng(seed)
    source = torch.from_numpy(rng.uniform(-15, 15, (10 * groups, 3)))
    target = apply_transform(source, pose(seed))
    wrong = torch.arange(len(source)) >= 10 * inlier_groups
    target[wrong] = torch.from_numpy(rng.uniform(-30, 30, (int(wrong.sum()), 3)))
    return target, source, torch.arange(len(source)) // 10


@pytest.mark.parametrize("seed", range(5))
def test_one_good_group_of_many_is_enough(seed: int) -> None:
    target, source, group = grouped(seed, inlier_groups=2, groups=7)  # 29 % inliers
    order = torch.randperm(len(group), generator=torch.Generator().manual_seed(seed))
    weight = torch.ones(len(group), dtype=torch.float64)
    found = local_to_global(target[order], source[order], weight, group[order] * 7 - 3)
    assert torch.allclose(found.transform, pose(seed), atol=1e-4)
    assert found.inliers.sum() >= 20
    assert found.hypotheses == 7
    assert found.proposals.shape == (7, 4, 4)


def test_groups_too_small_to_propose() -> None:
    source = torch.randn(40, 3, dtype=torch.float64) * 8
    target = apply_transform(source, pose(2))
    found = local_to_global(target, source, torch.ones(40), torch.arange(40) // 2, LgrConfig(min_group=3))
    assert found.hypotheses == 0
    assert torch.allclose(found.transform, pose(2), atol=1e-4)


def test_turning_the_source_turns_the_pose() -> None:
    target, source, group = grouped(4, inlier_groups=3)
    weight = torch.ones(len(group), dtype=torch.float64)
    turn = pose(9)
    plain = local_to_global(target, source, weight, group).transform
    turned = local_to_global(target, apply_transform(source, turn), weight, group).transform
    assert torch.allclose(turned @ turn, plain, atol=1e-3)


def test_a_cap_on_voters_keeps_the_answer() -> None:
    target, source, group = grouped(5, inlier_groups=3)
    weight = torch.where(group < 3, 1.0, 0.3).double()
    capped = local_to_global(target, source, weight, group, LgrConfig(max_votes=25))
    assert torch.allclose(capped.transform, pose(5), atol=1e-4)


@pytest.mark.parametrize("lengths", [(0, 0, 0, 0), (3, 3, 3, 2)])
def test_lengths_are_checked(lengths: tuple[int, int, int, int]) -> None:
    p, q, w, g = lengths
    with pytest.raises(ValueError, match="one length"):
        local_to_global(torch.zeros(p, 3), torch.zeros(q, 3), torch.zeros(w), torch.zeros(g))


def test_a_proposal_that_no_match_agrees_with_is_kept() -> None:
    """A fit to no match would be the identity: that is where the clouds happen to lie, not a pose."""
    source = torch.tensor([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) * 10.0
    target = 2.0 * source + torch.tensor([100.0, 0.0, 0.0])
    found = local_to_global(target, source, torch.ones(4), torch.zeros(4, dtype=torch.int64))
    assert not bool(found.inliers.any())
    assert torch.allclose(found.transform, found.proposals[0])
    assert float(found.transform[:3, 3].norm()) > 50.0
