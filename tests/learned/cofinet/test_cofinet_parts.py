# SPDX-License-Identifier: MIT
"""The parts of CoFiNet against plain reckoning, entry by entry."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch
from four_pairs import four_pairs

from hybridreg.learned.cofinet.config import CofinetConfig, SelectionConfig, named_config
from hybridreg.learned.cofinet.network import CofinetNetwork
from hybridreg.learned.cofinet.patching import PatchIndex, patch_index
from hybridreg.learned.cofinet.point_transport import MASKED, alternating_sinkhorn, either_best
from hybridreg.learned.cofinet.selection import select
from hybridreg.learned.cofinet.targets import compute_targets, fine_truth, node_weights
from hybridreg.learned.cross3dreg.batch import make_batch


def test_the_slack_is_not_normalised_along_itself() -> None:
    scores = torch.randn(2, 3, 4, generator=torch.Generator().manual_seed(0))
    expected = np.zeros((2, 4, 5))
    expected[:, :3, :4] = np.exp(scores.numpy())
    expected[:, 3, :], expected[:, :, 4] = 1.0, 1.0
    for _ in range(3):
        expected[:, :3] /= expected[:, :3].sum(2, keepdims=True)
        expected[:, :, :4] /= expected[:, :, :4].sum(1, keepdims=True)
    assert np.allclose(alternating_sinkhorn(scores, 3).exp().numpy(), expected, atol=1e-5)


def test_best_of_row_or_column_with_the_slack() -> None:
    assignment = torch.tensor([[[0.6, 0.1, 0.3], [0.5, 0.2, 0.9], [0.1, 0.7, 0.0]]])
    # Row 0: column 0. Row 1: the slack. Column 0: row 0. Column 1: the slack.
    assert either_best(assignment).tolist() == [[[True, False], [False, False]]]
    with_column = assignment.clone()
    with_column[0, 1, 1] = 0.8
    assert either_best(with_column).tolist() == [[[True, False], [False, True]]]


def test_padding_gives_no_matches() -> None:
    scores = torch.randn(1, 5, 6, generator=torch.Generator().manual_seed(0)) * 4
    scores[:, 3:], scores[:, :, 4:] = MASKED, MASKED
    chosen = either_best(alternating_sinkhorn(scores, 100).exp())
    assert bool(chosen[:, :3, :4].any())
    assert not bool(chosen[:, 3:].any() or chosen[:, :, 4:].any())


def test_the_threshold_falls_until_there_are_enough() -> None:
    probability = torch.tensor([[0.5, 0.185], [0.19, 0.05]])
    nodes, tried = select(probability, SelectionConfig(min_pairs=2))
    assert [(t.threshold, t.pairs) for t in tried] == [(0.2, 1), (0.19, 1), (0.18, 3)]
    assert (nodes.source.tolist(), nodes.target.tolist()) == ([0, 0, 1], [0, 1, 0])
    assert nodes.confidence.tolist() == pytest.approx([0.5, 0.185, 0.19])


def test_the_search_for_pairs_ends() -> None:
    nodes, tried = select(torch.zeros(3, 2), SelectionConfig(min_pairs=200))
    assert len(nodes.source) == 6
    assert tried[-1].threshold == -0.01
    assert len(tried) == 22
    assert len(select(torch.full((3, 2), -1.0), SelectionConfig())[0].source) == 0
    few, _ = select(torch.rand(30, 20), SelectionConfig(threshold=0.1, max_pairs=7))
    assert len(few.source) == 7
    assert len(select(torch.rand(0, 4), SelectionConfig())[0].source) == 0


def test_patches_keep_the_first_or_the_nearest() -> None:
    points = torch.tensor([[3.0, 0, 0], [1, 0, 0], [2, 0, 0], [11, 0, 0]])
    nodes = torch.tensor([[0.0, 0, 0], [10, 0, 0], [50, 0, 0]])
    first, nearest = (patch_index(points, nodes, 2, rule) for rule in ("first", "nearest"))
    assert first.index.tolist() == [[0, 1], [3, 4], [4, 4]]
    assert nearest.index.tolist() == [[1, 2], [3, 4], [4, 4]]
    assert first.mask.tolist() == nearest.mask.tolist() == [[True, True], [True, False], [False, False]]
    assert first.filled.tolist() == [[0, 1], [3, 0], [0, 0]]
    assert first.visible.tolist() == [[True, True], [True, False], [True, False]]
    assert patch_index(points, nodes, 9, "first").index.shape == (3, 9)


def test_weights_of_superpoints() -> None:
    # Source superpoint 0 owns points 0, 1, 2, superpoint 1 owns 3; target superpoint 0 owns 0 and 1, 1 owns 2.
    owners = (torch.tensor([0, 0, 0, 1]), torch.tensor([0, 0, 1]))
    pairs = (torch.tensor([0, 0, 1]), torch.tensor([0, 1, 2]))
    found = node_weights(pairs, owners, (2, 2), 0.0)
    # By row: 2/3 and 1/3 of three pairs, times 2 of 3 points; by column: all of theirs, times all of their points.
    assert found[0, :2].tolist() == pytest.approx([4 / 9, 2 / 9])
    assert found[:2, 2].tolist() == pytest.approx([1 / 3, 1.0])
    assert found[2].tolist() == [0.0, 0.0, 0.0]
    thresholded = node_weights(pairs, owners, (2, 2), 0.3)
    assert thresholded[0].tolist() == pytest.approx([4 / 9, 0.0, 1 / 3])
    empty = node_weights(pairs, owners, (3, 2), 0.0)
    assert empty[2, 2] == 1.0, "a superpoint without points has no partner"


def test_padding_takes_a_label_away_as_released_only() -> None:
    source = torch.tensor([[0.0, 0, 0], [5, 0, 0]])
    target = torch.tensor([[0.1, 0, 0], [9, 0, 0]])
    # The patches of source point 0 and of target point 1; the empty places hold the clouds' points 0.
    sides = (PatchIndex(torch.tensor([[0, 2]]), torch.tensor([[True, False]])),) + (
        PatchIndex(torch.tensor([[1, 2]]), torch.tensor([[True, False]])),
    )
    released = fine_truth(sides, (source, target), 0.5, released=True)[0]
    right = fine_truth(sides, (source, target), 0.5, released=False)[0]
    assert released.tolist() == [[0, 0, 0], [0, 0, 0], [1, 0, 0]]
    assert right.tolist() == [[0, 0, 1], [0, 0, 0], [1, 0, 0]]


@pytest.fixture(scope="module")
def network() -> CofinetNetwork:
    torch.manual_seed(0)
    return CofinetNetwork(named_config("nano")).eval()


def _with(network: CofinetNetwork, **changes: object) -> CofinetNetwork:
    other = CofinetNetwork(dataclasses.replace(network.config, **changes))  # type: ignore[arg-type]
    other.load_state_dict(network.state_dict())
    return other.eval()


@torch.no_grad()
def test_point_0_leaks_into_patches_as_released_only(network: CofinetNetwork) -> None:
    pair = four_pairs(network.config, points=400, extent=8.0)[0]
    released = _with(network, padding="point0")
    for each, leaks in ((network, False), (released, True)):
        encoding = each.encode(pair.batch)
        patches = each.patches(encoding)
        rows = (
            (~patches[0].mask).any(1) & ~(patches[0].index == 0).any(1) & (patches[0].mask.sum(1) > 2)
        ).nonzero()
        sides = (patches[0].take(rows[:1, 0]), patches[1].take(rows[:1, 0]))
        before = each.assign_points(encoding, sides)
        features = encoding.source.point_features.clone()
        features[0] += 5.0
        changed = dataclasses.replace(
            encoding, source=dataclasses.replace(encoding.source, point_features=features)
        )
        after = each.assign_points(changed, sides)
        assert torch.allclose(before, after, atol=1e-5) != leaks


@torch.no_grad()
def test_both_forms_of_the_coarse_transport_agree(network: CofinetNetwork) -> None:
    scores = torch.randn(30, 20, generator=torch.Generator().manual_seed(0)) * 5
    log = _with(network, sinkhorn_form="log").assign_nodes(scores)
    assert torch.allclose(network.assign_nodes(scores), log, atol=1e-3)
    assert torch.allclose(log[:, :-1].exp().sum(0), torch.ones(20), atol=1e-4)


def test_a_pair_without_overlap_has_finite_losses(network: CofinetNetwork) -> None:
    pair = four_pairs(network.config, points=400, extent=8.0)[0]
    far = torch.eye(4)
    far[0, 3] = 500.0
    targets = compute_targets(pair.batch.pyramid, far, network.config, torch.Generator().manual_seed(0))
    assert targets.fine.shape[0] == 0
    network.zero_grad()
    losses = network.losses(network.encode(pair.batch), targets)
    losses.total.backward()  # type: ignore[no-untyped-call]
    assert bool(torch.isfinite(losses.total))
    assert float(losses.fine) == 0.0
    assert all(p.grad is None or bool(torch.isfinite(p.grad).all()) for p in network.parameters())


def test_targets_follow_the_pose(network: CofinetNetwork) -> None:
    config = network.config
    pair = four_pairs(config, points=400, extent=8.0)[2]
    draws = [
        compute_targets(pair.batch.pyramid, pair.transform, config, torch.Generator().manual_seed(seed))
        for seed in (0, 0, 1)
    ]
    found = draws[0]
    assert found.drawn.shape == (config.loss.pairs, 2)
    assert torch.equal(found.drawn, draws[1].drawn)
    assert not torch.equal(found.drawn, draws[2].drawn)
    assert bool((found.coarse[found.drawn[:, 0], found.drawn[:, 1]] > config.loss.min_overlap).all())
    nodes = pair.batch.pyramid.clouds(pair.batch.pyramid.stages - 1)
    moved = nodes[1] @ pair.transform[:3, :3].t() + pair.transform[:3, 3]
    away = (moved[found.drawn[:, 0]] - nodes[0][found.drawn[:, 1]]).norm(dim=1)
    assert float(away.max()) < 4.0, "superpoints of 2 m cells"
    assert bool(
        (found.fine[:, :-1, :-1].any(2) != found.fine[:, :-1, -1].bool())[found.patches[0].mask].all()
    )


@torch.no_grad()
def test_matches_come_from_the_paired_patches(network: CofinetNetwork) -> None:
    pair = four_pairs(network.config, points=400, extent=8.0)[0]
    output = network(pair.batch)
    found, nodes = output.matches, output.nodes
    assert len(found) > 50
    patches = network.patches(output.encoding)
    assert bool((patches[0].index[nodes.source[found.group]] == found.source_index[:, None]).any(1).all())
    assert bool((patches[1].index[nodes.target[found.group]] == found.target_index[:, None]).any(1).all())
    assert torch.equal(found.source, output.encoding.source.points[found.source_index])
    assert float(found.weight.min()) >= 0.0
    assert float(found.weight.max()) <= 1.0 + 1e-5


@torch.no_grad()
def test_clouds_of_a_few_points_get_through(network: CofinetNetwork) -> None:
    for n, m in ((1, 1), (1, 30), (12, 3)):
        clouds = [torch.randn(k, 3, generator=torch.Generator().manual_seed(k)).numpy() * 3 for k in (n, m)]
        for each in (network, _with(network, padding="point0")):
            assert bool(torch.isfinite(each(make_batch(*clouds, network.config)).matches.weight).all())


def test_configurations_that_fit_no_network_are_refused() -> None:
    with pytest.raises(ValueError, match=r"fine dim 2, which is dim 16 halved 3 times, must be divisible"):
        CofinetConfig(dim=16)
    with pytest.raises(ValueError, match="divisible by heads 3"):
        CofinetConfig(heads=3)
    with pytest.raises(ValueError, match=r"step=0.0 must lie in"):
        SelectionConfig(step=0.0)
    with pytest.raises(ValueError, match="expected one of 'masked', 'point0'"):
        CofinetConfig.from_dict({"padding": "zero"})
