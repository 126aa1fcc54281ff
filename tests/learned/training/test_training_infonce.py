# SPDX-License-Identifier: MIT
"""InfoNCE against a double loop, and what it does where there is nothing to learn."""

from __future__ import annotations

import math

import pytest
import torch
from torch import Tensor
from torch.nn import functional as F

from hybridreg.learned.losses.infonce_loss import InfoNceConfig, infonce

VOXEL = 0.5


def example(n: int = 20, m: int = 30) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Anchors, candidates, their positions, and partners of all anchors but a few."""
    generator = torch.Generator().manual_seed(0)
    anchors = torch.randn(n, 8, generator=generator, dtype=torch.float64)
    candidates = torch.randn(m, 8, generator=generator, dtype=torch.float64)
    points = 6.0 * torch.rand(m, 3, generator=generator, dtype=torch.float64)
    partner = torch.randint(0, m, (n,), generator=generator)
    partner[::5] = -1
    return anchors.requires_grad_(), candidates.requires_grad_(), points, partner


def by_hand(
    anchors: Tensor, candidates: Tensor, points: Tensor, partner: Tensor, config: InfoNceConfig
) -> tuple[float, float]:
    """Loss and hits, one anchor and one candidate at a time."""
    anchors, candidates = anchors.detach(), candidates.detach()
    losses, hits = [], []
    for i, true in enumerate(partner.tolist()):
        if true < 0:
            continue
        scores, far = [], []
        for j in range(len(candidates)):
            cosine = float(F.cosine_similarity(anchors[i], candidates[j], dim=0))
            scores.append(cosine / config.temperature)
            far.append(math.dist(points[true].tolist(), points[j].tolist()) >= config.exclusion * VOXEL)
        total = sum(math.exp(s) for j, s in enumerate(scores) if far[j] or j == true)
        losses.append(math.log(total) - scores[true])
        hits.append(not far[scores.index(max(scores))])
    return sum(losses) / len(losses), sum(hits) / len(hits)


@pytest.mark.parametrize("exclusion", [0.0, 3.0, 6.0, 100.0])
def test_equals_a_double_loop(exclusion: float) -> None:
    config = InfoNceConfig(exclusion=exclusion)
    case = example()
    found = infonce(*case, config, VOXEL, torch.Generator())
    loss, hits = by_hand(*case, config)
    assert found.loss.item() == pytest.approx(loss, abs=1e-9)
    # Without a zone the partner itself is not nearer than its edge: nothing can be hit.
    assert float(found.hits) == pytest.approx(hits, abs=1e-6)


def test_the_zone_takes_negatives_away() -> None:
    case = example()
    losses = [
        infonce(*case, InfoNceConfig(exclusion=zone), VOXEL, torch.Generator()).loss.item()
        for zone in (0.0, 3.0, 6.0, 100.0)
    ]
    assert losses == sorted(losses, reverse=True)
    assert losses[0] > losses[2] > losses[3] == pytest.approx(0.0, abs=1e-9)


def test_no_gradient_reaches_what_the_zone_left_out() -> None:
    anchors, candidates, points, _ = example(n=1)
    partner = torch.tensor([4])
    infonce(anchors, candidates, points, partner, InfoNceConfig(), VOXEL, torch.Generator()).loss.backward()
    near = (points - points[4]).norm(dim=1) < 3.0 * VOXEL
    near[4] = False
    assert near.any()
    moved = candidates.grad.norm(dim=1) > 0  # type: ignore[union-attr]
    assert not moved[near].any()
    assert moved[~near].all()


def test_without_a_partner_the_loss_is_zero_and_keeps_the_graph() -> None:
    anchors, candidates, points, partner = example()
    found = infonce(
        anchors, candidates, points, torch.full_like(partner, -1), InfoNceConfig(), VOXEL, torch.Generator()
    )
    found.loss.backward()
    assert (float(found.loss), float(found.hits)) == (0.0, 0.0)
    for features in (anchors, candidates):
        assert features.grad is not None
        assert not features.grad.any()


def test_the_length_of_features_does_not_matter() -> None:
    anchors, candidates, points, partner = example()
    config = InfoNceConfig(anchors=5)

    def loss(*features: Tensor) -> float:
        generator = torch.Generator().manual_seed(1)
        return float(infonce(*features, points, partner, config, VOXEL, generator).loss)

    assert loss(3.0 * anchors, 0.2 * candidates) == pytest.approx(loss(anchors, candidates), abs=1e-9)


def test_at_most_so_many_anchors_are_drawn_and_the_generator_decides() -> None:
    case = example()

    def loss(seed: int) -> float:
        generator = torch.Generator().manual_seed(seed)
        found = infonce(*case, InfoNceConfig(anchors=1), VOXEL, generator)
        touched = torch.autograd.grad(found.loss, case[0])[0].norm(dim=1) > 0
        assert int(touched.sum()) == 1
        return float(found.loss)

    assert loss(0) == loss(0)
    assert len({loss(seed) for seed in range(6)}) > 1
