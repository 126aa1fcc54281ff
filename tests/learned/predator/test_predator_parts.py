# SPDX-License-Identifier: MIT
"""The parts of Predator against plain reckoning, entry by entry."""

from __future__ import annotations

import dataclasses

import pytest
import torch
from four_pairs import four_pairs
from torch.nn import functional as F

from hybridreg.learned.kpfcnn.kpfcnn import KpfcnnDecoder
from hybridreg.learned.kpfcnn.kpfcnn_config import KpfcnnConfig, architecture
from hybridreg.learned.layers.instance_norm import instance_norm
from hybridreg.learned.layers.kpconv_blocks import PointInstanceNorm
from hybridreg.learned.layers.message_attention import InterleavedAttention, MessageBlock
from hybridreg.learned.losses.circle_loss import circle
from hybridreg.learned.predator.config import GraphConfig, PredatorConfig, PredatorLossConfig, named_config
from hybridreg.learned.predator.graph import EdgeConvolution, GraphLayer, nearest_others
from hybridreg.learned.predator.losses import predator_losses
from hybridreg.learned.predator.network import PredatorCloud, PredatorNetwork
from hybridreg.learned.predator.targets import PredatorTargets, compute_targets
from hybridreg.learned.pyramid.neighbors import pairs_within


def test_edges_are_centre_and_difference() -> None:
    torch.manual_seed(0)
    layer, features, points = EdgeConvolution(3, 5), torch.randn(12, 3), torch.randn(12, 3)
    neighbors = nearest_others(points, 4)
    edges = torch.stack(
        [
            torch.stack([torch.cat([features[i], features[j] - features[i]]) for j in row])
            for i, row in enumerate(neighbors)
        ]
    )
    values = layer.linear(edges)  # (12, 4, 5)
    values = (values - values.mean((0, 1))) / (values.var((0, 1), correction=0) + 1e-5).sqrt()
    expected = F.leaky_relu(values, 0.2).amax(1)
    assert torch.allclose(layer(features, neighbors), expected, atol=1e-5)


@pytest.mark.parametrize("count", [1, 2, 5, 10, 11, 12])
def test_neighbours_of_few_points(count: int) -> None:
    points = torch.randn(count, 3, generator=torch.Generator().manual_seed(0))
    found = nearest_others(points, 10)
    assert found.shape == (count, max(1, min(10, count - 1)))
    if count > 1:
        assert all(row not in each for row, each in enumerate(found.tolist()))
    assert bool(torch.isfinite(GraphLayer(4)(torch.randn(count, 4), found)).all())


def test_heads_are_interleaved() -> None:
    torch.manual_seed(0)
    attention, own, other = InterleavedAttention(6, 2), torch.randn(4, 6), torch.randn(5, 6)
    query, key, value = attention.query(own), attention.key(other), attention.value(other)
    out = torch.zeros(4, 6)
    for head in (0, 1):
        channels = [c for c in range(6) if c % 2 == head]
        weights = (query[:, channels] @ key[:, channels].t() / 3**0.5).softmax(1)
        out[:, channels] = weights @ value[:, channels]
    assert torch.allclose(attention(own, other), attention.merge(out), atol=1e-6)


def test_what_a_mask_leaves_out_might_as_well_not_be_there() -> None:
    torch.manual_seed(0)
    block = MessageBlock("cross", 8, 2)
    clouds = (torch.randn(2, 5, 8), torch.randn(2, 6, 8))
    masks = (torch.arange(5).expand(2, 5) < 3, torch.arange(6).expand(2, 6) < 4)
    found = block(clouds, masks)
    expected = block((clouds[0][:, :3], clouds[1][:, :4]))
    assert torch.allclose(found[0][:, :3], expected[0], atol=1e-5)
    assert torch.allclose(found[1][:, :4], expected[1], atol=1e-5)
    rows = torch.randn(3, 7, 4)
    mask = torch.arange(7).expand(3, 7) < 5
    assert torch.allclose(instance_norm(rows, mask)[:, :5], instance_norm(rows[:, :5]), atol=1e-5)


def test_the_target_attends_to_what_the_source_has_become() -> None:
    torch.manual_seed(0)
    block, one, two = MessageBlock("cross", 8, 2), torch.randn(5, 8), torch.randn(6, 8)
    source, target = block((one, two))
    turned = block((two, one))
    assert not torch.allclose(target, turned[0], atol=1e-4)
    assert torch.allclose(target, two + block.layer(two, source), atol=1e-6)


def test_the_norm_couples_the_clouds() -> None:
    rows = torch.randn(9, 3, generator=torch.Generator().manual_seed(0))
    whole = PointInstanceNorm()(rows, (4, 5))
    assert torch.allclose(whole, (rows - rows.mean(0)) / (rows.var(0, correction=0) + 1e-5).sqrt(), atol=1e-5)
    other = torch.cat([rows[:4], rows[4:] + 3.0])
    assert not torch.allclose(PointInstanceNorm()(other, (4, 5))[:4], whole[:4], atol=0.1)


def test_entries_that_are_neither_add_one_to_each_sum() -> None:
    generator = torch.Generator().manual_seed(0)
    distance = torch.rand(4, 4, generator=generator) * 1.4
    positive = torch.eye(4, dtype=torch.bool)
    negative = ~positive & (torch.rand(4, 4, generator=generator) > 0.4)
    config = PredatorLossConfig(log_scale=8.0)
    by_row, by_column = [], []
    for matrix, found in ((distance, by_row), (distance.t(), by_column)):
        near, far = (positive, negative) if found is by_row else (positive.t(), negative.t())
        for i in range(4):
            pull, push = 0.0, 0.0
            for j in range(4):
                d = float(matrix[i, j])
                pull += float(torch.tensor(8.0 * (d - 0.1) * max(0.0, d - 0.1) if near[i, j] else 0.0).exp())
                push += float(torch.tensor(8.0 * (1.4 - d) * max(0.0, 1.4 - d) if far[i, j] else 0.0).exp())
            if near[i].any() and far[i].any():
                found.append(float(F.softplus(torch.tensor(pull).log() + torch.tensor(push).log())) / 8.0)
    expected = (sum(by_row) / len(by_row) + sum(by_column) / len(by_column)) / 2
    assert float(circle(distance, positive, negative, config)) == pytest.approx(expected, abs=1e-5)


def _cloud(points: torch.Tensor, seed: int) -> PredatorCloud:
    generator = torch.Generator().manual_seed(seed)
    n = len(points)
    features = F.normalize(torch.randn(n, 8, generator=generator), dim=1).requires_grad_()
    overlap, saliency = (torch.rand(n, generator=generator).requires_grad_() for _ in range(2))
    return PredatorCloud(points=points, features=features, overlap=overlap, saliency=saliency)


def test_labels_are_weighed_by_the_other_share() -> None:
    points = torch.tensor([[0.0, 0, 0], [10, 0, 0], [20, 0, 0], [30, 0, 0]])
    one, two = _cloud(points, 0), _cloud(points[:2], 1)
    rows = torch.tensor([0, 1])
    targets = PredatorTargets(
        transform=torch.eye(4), source=rows, target=rows, drawn_source=rows, drawn_target=rows
    )
    losses = predator_losses((two, one), targets, PredatorLossConfig())
    scores = torch.cat([one.overlap, two.overlap]).detach()
    labels = torch.tensor([1.0, 1, 0, 0, 1, 1])
    plain = -(labels * scores.log() + (1 - labels) * (1 - scores).log())
    expected = (plain * torch.where(labels > 0, 2 / 6, 4 / 6)).mean()
    assert float(losses.overlap.loss) == pytest.approx(float(expected), abs=1e-6)
    assert losses.saliency.labels.shape == (4,)
    assert float(losses.total) == pytest.approx(float(losses.circle + losses.overlap.loss), abs=1e-6)
    with_saliency = dataclasses.replace(losses, config=PredatorLossConfig(saliency_weight=1.0))
    assert float(with_saliency.total) == pytest.approx(float(losses.weighed(1.0)), abs=1e-6)


def test_a_pair_without_overlap_has_finite_losses_and_gradients() -> None:
    points = torch.randn(6, 3, generator=torch.Generator().manual_seed(0))
    none = torch.zeros(0, dtype=torch.int64)
    targets = PredatorTargets(
        transform=torch.eye(4), source=none, target=none, drawn_source=none, drawn_target=none
    )
    one, two = _cloud(points, 0), _cloud(points + 100.0, 1)
    losses = predator_losses((two, one), targets, PredatorLossConfig())
    losses.weighed(1.0).backward()  # type: ignore[no-untyped-call]
    assert all(bool(torch.isfinite(x)) for x in (losses.total, losses.weighed(1.0), losses.recall))
    assert bool(torch.isfinite(one.overlap.grad).all())


def test_targets_follow_the_pose() -> None:
    config = named_config("nano")
    pair = four_pairs(config, points=400, extent=8.0)[1]
    found = compute_targets(pair.batch.pyramid, pair.transform, config, torch.Generator().manual_seed(0))
    target, source = pair.batch.pyramid.clouds(0)
    moved = source @ pair.transform[:3, :3].t() + pair.transform[:3, 3]
    away = torch.cdist(moved.double(), target.double())
    assert len(found.source) == int((away < config.loss.overlap_radius).sum()) > 100
    drawn = away[found.drawn_source, found.drawn_target]
    assert len(drawn) > 50
    assert float(drawn.max()) < config.loss.positive_radius - config.loss.positive_slack + 1e-6
    few = dataclasses.replace(config, loss=dataclasses.replace(config.loss, max_points=7))
    draws = [
        compute_targets(pair.batch.pyramid, pair.transform, few, torch.Generator().manual_seed(seed))
        for seed in (0, 0, 1)
    ]
    assert len(draws[0].drawn_source) == 7
    assert torch.equal(draws[0].drawn_source, draws[1].drawn_source)
    assert not torch.equal(draws[0].drawn_source, draws[2].drawn_source)


def test_pairs_within_a_radius() -> None:
    generator = torch.Generator().manual_seed(0)
    one, two = torch.rand(40, 3, generator=generator), torch.rand(30, 3, generator=generator)
    rows, columns = pairs_within(one, two, 0.3)
    expected = (torch.cdist(one.double(), two.double()) < 0.3).nonzero()
    assert torch.equal(torch.stack([rows, columns], 1), expected)
    assert len(pairs_within(one, two + 9.0, 0.3)[0]) == 0


@pytest.mark.parametrize(
    ("blocks", "message"),
    [
        (("simple", "deformable", "last_unary"), r"encoder must be some of simple.*'deformable'"),
        (("simple", "resnetb_strided", "last_unary"), r"0 nearest_upsample for 1 strided"),
        (
            ("simple", "resnetb_strided", "nearest_upsample", "unary"),
            r"last block must be the only last_unary",
        ),
        (("last_unary",), r"encoder must be some of"),
        (
            ("simple", "simple_strided", "simple_strided", *["nearest_upsample"] * 2, "last_unary"),
            r"each nearest_upsample needs a unary",
        ),
    ],
)
def test_impossible_lists_of_blocks_are_refused(blocks: tuple[str, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        KpfcnnConfig(blocks=blocks, neighbor_limits=(5, 5))


def test_configurations_that_fit_no_network_are_refused() -> None:
    with pytest.raises(ValueError, match="give one a stage"):
        KpfcnnConfig(neighbor_limits=(5, 5))
    with pytest.raises(ValueError, match="divisible by heads 3"):
        GraphConfig(dim=16, heads=3)
    with pytest.raises(ValueError, match=r"unknown graph blocks \['both'\]"):
        GraphConfig(blocks=("both",))
    with pytest.raises(ValueError, match="too narrow for 4 stages"):
        PredatorConfig(graph=GraphConfig(dim=4, heads=1))
    with pytest.raises(ValueError, match="unknown keys"):
        PredatorConfig.from_dict({"width": 3})


def test_the_decoder_halves_what_it_is_given() -> None:
    config = KpfcnnConfig(init_dim=16)
    decoder = KpfcnnDecoder(config, 50, 34)
    shapes = [tuple(tensor.shape) for tensor in decoder.state_dict().values()]
    assert shapes == [(25, 50 + 64), (12, 25 + 32), (34, 12 + 16)]
    assert KpfcnnDecoder(config, 64).dim_out == 8
    assert architecture((1, 2))[:5] == ("simple", "resnetb", "resnetb_strided", "resnetb", "resnetb")


def test_clouds_of_a_few_points_get_through() -> None:
    from hybridreg.learned.cross3dreg.batch import make_batch

    network = PredatorNetwork(named_config("nano")).eval()
    for n, m in ((1, 1), (1, 30), (12, 3)):
        clouds = [torch.randn(k, 3, generator=torch.Generator().manual_seed(k)).numpy() * 3 for k in (n, m)]
        with torch.no_grad():
            output = network(make_batch(*clouds, network.config))
        for cloud in (output.target, output.source):
            assert bool(torch.isfinite(cloud.features).all())
            assert float(cloud.sampling.sum()) == pytest.approx(1.0, abs=1e-5)
