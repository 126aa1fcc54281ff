# SPDX-License-Identifier: MIT
"""CoFiNet learns: four pairs are learned by heart."""

from __future__ import annotations

import torch
from four_pairs import four_pairs

from hybridreg.learned.cofinet.config import named_config
from hybridreg.learned.cofinet.losses import CofinetLosses
from hybridreg.learned.cofinet.network import CofinetNetwork
from hybridreg.learned.cofinet.targets import compute_targets


def test_a_hundred_steps_overfit_four_pairs() -> None:
    torch.manual_seed(0)
    network = CofinetNetwork(named_config("nano")).train()
    pairs = four_pairs(network.config, points=400, extent=8.0)
    generator = torch.Generator().manual_seed(0)
    targets = [compute_targets(p.batch.pyramid, p.transform, network.config, generator) for p in pairs]
    optimizer = torch.optim.Adam(network.parameters(), 5e-3)  # at 1e-2 the last digits decide
    rounds: list[list[CofinetLosses]] = []
    for _ in range(25):
        rounds.append([])
        for pair, target in zip(pairs, targets, strict=True):
            losses = network.losses(network.encode(pair.batch), target)
            optimizer.zero_grad()
            losses.total.backward()  # type: ignore[no-untyped-call]
            optimizer.step()
            rounds[-1].append(losses)
    first, last = rounds[0], rounds[-1]
    for before, after in zip(first, last, strict=True):
        assert float(after.coarse) < 0.5 * float(before.coarse)
        assert float(after.fine_precision) > 0.6
    assert sum(float(each.fine_precision) for each in last) > 4 * 0.65
    # Several partners a point: it cannot reach 0.
    assert sum(float(each.fine) for each in last) < 0.9 * sum(float(each.fine) for each in first)
    # And its matches lie where the true pose puts them.
    with torch.no_grad():
        found = network.eval()(pairs[0].batch).matches
    moved = found.source @ pairs[0].transform[:3, :3].t() + pairs[0].transform[:3, 3]
    away = (moved - found.target).norm(dim=1)
    assert float((away < 2.0).float().mean()) > 0.7, "of a scene of 14 m by 16 m"
    assert not network.untrained()
