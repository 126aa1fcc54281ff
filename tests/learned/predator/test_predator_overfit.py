# SPDX-License-Identifier: MIT
"""Predator learns: four pairs are learned by heart."""

from __future__ import annotations

import torch
from four_pairs import four_pairs

from hybridreg.learned.predator.config import named_config
from hybridreg.learned.predator.losses import PredatorLosses
from hybridreg.learned.predator.network import PredatorNetwork
from hybridreg.learned.predator.targets import compute_targets


def test_sixty_steps_overfit_four_pairs() -> None:
    torch.manual_seed(0)
    network = PredatorNetwork(named_config("nano")).train()
    pairs = four_pairs(network.config, points=400, extent=8.0)
    generator = torch.Generator().manual_seed(0)
    targets = [compute_targets(p.batch.pyramid, p.transform, network.config, generator) for p in pairs]
    optimizer = torch.optim.Adam(network.parameters(), 1e-2)
    rounds: list[list[PredatorLosses]] = []
    for _ in range(15):
        rounds.append([])
        for pair, target in zip(pairs, targets, strict=True):
            losses = network.losses(network(pair.batch), target)
            optimizer.zero_grad()
            losses.weighed(1.0).backward()  # type: ignore[no-untyped-call]
            optimizer.step()
            rounds[-1].append(losses)
    first, last = rounds[0], rounds[-1]
    for before, after in zip(first, last, strict=True):
        assert float(after.circle) < 0.7 * float(before.circle)
        assert float(after.overlap.loss) < 0.4 * float(before.overlap.loss)
        assert float(after.overlap.precision) > 0.95
        assert float(after.overlap.recall) > 0.85
    # Of some 300 points, each with the same place a few times among them.
    assert max(float(each.recall) for each in first) < 0.1
    assert min(float(each.recall) for each in last) > 0.2
    assert sum(float(each.recall) for each in last) > 4 * 0.3
    assert not network.untrained()
