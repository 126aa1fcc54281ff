# SPDX-License-Identifier: MIT
"""What FCGF is trained with: positives, the loss in both forms, batches of several pairs; and that it learns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from streets import moved, street, yaw

from hybridreg.learned.fcgf.batch import FcgfBatch, collate, make_batch, noisy
from hybridreg.learned.fcgf.config import FcgfLossConfig, named_config
from hybridreg.learned.fcgf.losses import hardest_contrastive
from hybridreg.learned.fcgf.network import FcgfNetwork, FcgfOutput
from hybridreg.learned.fcgf.targets import FcgfTargets, compute_targets, draw, positive_pairs

NANO = named_config("nano")
DEVICES = [
    "cpu",
    pytest.param("cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU here")),
]


def made(seed: int) -> tuple[FcgfBatch, torch.Tensor]:
    # A quarter turn takes voxels to voxels; what is learned is to recognise a place that is turned.
    truth = yaw(90.0, (2.0, -2.0, 0.0))
    scene = street(seed, 260, 4.0)
    batch = make_batch(scene[:250], moved(scene[10:], np.linalg.inv(truth)), NANO)
    return batch, torch.from_numpy(truth).float()


def test_four_pairs_are_overfitted() -> None:
    torch.manual_seed(0)
    pairs = [made(seed) for seed in (1, 2, 3, 4)]
    batch, truths = collate([pair[0] for pair in pairs]), torch.stack([pair[1] for pair in pairs])
    network = FcgfNetwork(NANO).train()
    optimiser = torch.optim.SGD(network.parameters(), lr=0.1, momentum=0.8, weight_decay=1e-4)
    generator = torch.Generator().manual_seed(0)
    losses, hits = [], []
    targets = compute_targets(batch, truths, NANO, generator)
    lengths = (len(batch.source.points), len(batch.target.points))
    for _ in range(60):
        targets = draw(targets, lengths, 4, NANO.loss, generator)
        output = network(batch)
        loss = torch.stack(list(network.losses(output, targets).values())).sum()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(float(loss))
        hits.append(hit_share(batch, output, targets))
    assert hits[0] < 0.1
    assert np.mean(hits[-5:]) > 0.45
    assert np.mean(losses[-5:]) < 0.8 * losses[0]


def hit_share(batch: FcgfBatch, output: FcgfOutput, targets: FcgfTargets) -> float:
    """Of the sources that have a partner, those whose nearest feature in the other cloud of their pair is one."""
    rows = targets.positives[:, 0].unique()
    apart = torch.cdist(output.source[rows].detach(), output.target.detach())
    other_pair = batch.source.coords[rows, :1] != batch.target.coords[None, :, 0]
    nearest = apart.masked_fill(other_pair, torch.inf).argmin(1)
    n = len(output.target)
    found = torch.isin(rows * n + nearest, targets.positives[:, 0] * n + targets.positives[:, 1])
    return float(found.float().mean())


def test_positives_are_all_near_pairs() -> None:
    rng = np.random.default_rng(0)
    a, b = (torch.from_numpy(rng.uniform(0, 3, (n, 3)).astype(np.float32)) for n in (150, 130))
    found = positive_pairs(a, b, 0.6)
    want = (torch.cdist(a.double(), b.double()) < 0.6).nonzero()
    assert torch.equal(found, want)
    assert positive_pairs(a, b + 100.0, 0.6).shape == (0, 2)


def test_positives_of_a_batch_are_those_of_its_pairs() -> None:
    (one, first), (two, second) = made(1), made(2)
    generator = torch.Generator().manual_seed(0)
    both = compute_targets(collate([one, two]), torch.stack([first, second]), NANO, generator).positives
    apart = [compute_targets(b, t, NANO, generator).positives for b, t in ((one, first), (two, second))]
    moved_on = apart[1] + torch.tensor([len(one.source.points), len(one.target.points)])
    assert torch.equal(both, torch.cat([apart[0], moved_on]))
    with pytest.raises(ValueError, match="1 poses for 2 pairs"):
        compute_targets(collate([one, two]), first, NANO, generator)


def test_clouds_of_a_batch_do_not_see_each_other(nano_fcgf: FcgfNetwork) -> None:
    one, two = made(1)[0], made(2)[0]
    with torch.no_grad():
        both, alone = nano_fcgf(collate([one, two])), (nano_fcgf(one), nano_fcgf(two))
    assert torch.allclose(both.source, torch.cat([each.source for each in alone]), atol=1e-5)
    assert torch.allclose(both.target, torch.cat([each.target for each in alone]), atol=1e-5)


def targets_of(positives: list[list[int]], n: int) -> FcgfTargets:
    rows = torch.tensor(positives, dtype=torch.int64).reshape(-1, 2)
    return FcgfTargets(
        positives=rows,
        anchors=torch.arange(len(rows)),
        source_candidates=torch.arange(n),
        target_candidates=torch.arange(n),
    )


def test_the_loss_by_hand() -> None:
    # On a line: source 0, 1; target 0.5, 1.1. Positives are 0-0 and 1-1.
    source, target = torch.tensor([[0.0], [1.0]]), torch.tensor([[0.5], [1.1]])
    targets = targets_of([[0, 0], [1, 1]], 2)
    released = hardest_contrastive(source, target, targets, FcgfLossConfig())
    assert float(released.positive) == pytest.approx(((0.25 - 0.1) + 0.0) / 2)
    # The candidate nearest to source 0 is target 0, to source 1 target 1: both are known positives.
    assert released.in_target.negative.tolist() == [False, False]
    paper = hardest_contrastive(source, target, targets, FcgfLossConfig(form="paper"))
    assert float(paper.positive) == pytest.approx(((0.5 - 0.1) ** 2) / 2, rel=1e-4)
    far = torch.tensor([[0.5], [1.1], [0.3]])
    third = replace(targets, target_candidates=torch.tensor([2]))
    mined = hardest_contrastive(source, far, third, FcgfLossConfig()).in_target
    assert mined.row.tolist() == [2, 2]
    assert mined.negative.tolist() == [True, True]
    assert mined.distance.tolist() == pytest.approx([0.3, 0.7], rel=1e-4)


@pytest.mark.parametrize("positives", [[], [[0, 0]]])
def test_terms_without_members_are_nothing(positives: list[list[int]]) -> None:
    source, target = torch.randn(1, 4, requires_grad=True), torch.randn(1, 4, requires_grad=True)
    found = hardest_contrastive(source, target, targets_of(positives, 1), FcgfLossConfig())
    assert float(found.negative) == 0.0
    (found.positive + found.negative).backward()
    assert source.grad is not None
    assert bool(torch.isfinite(source.grad).all())


def test_noise_is_drawn_for_each_cloud() -> None:
    batch = collate([made(seed)[0] for seed in (1, 2, 3, 4)])
    for probability, fewest, most in ((0.0, 0, 0), (1.0, 4, 4), (0.5, 1, 3)):
        spoiled = noisy(batch, torch.Generator().manual_seed(1), probability=probability).source
        clouds = (spoiled.features - 1.0).split(list(spoiled.lengths))
        assert fewest <= sum(bool(cloud.abs().max() > 0) for cloud in clouds) <= most
        assert all(
            float(cloud.std()) == pytest.approx(0.01, rel=0.2) for cloud in clouds if bool(cloud.any())
        )


def test_a_single_voxel_has_no_statistics(nano_fcgf: FcgfNetwork) -> None:
    batch = make_batch(np.zeros((1, 3)), np.zeros((1, 3)), NANO)
    assert bool(torch.isfinite(nano_fcgf(batch).source).all())
    with pytest.raises(ValueError, match=r"2 voxels on every level.*\[1, 1, 1\]"):
        nano_fcgf.train()(batch)


@pytest.mark.parametrize("device", DEVICES)
def test_devices_agree(device: str) -> None:
    def run(where: str) -> list[torch.Tensor]:
        torch.manual_seed(0)
        network = FcgfNetwork(NANO).to(where).train()
        batch, truth = made(1)
        batch = batch.to(where)
        output = network(batch)
        targets = compute_targets(batch, truth, NANO, torch.Generator().manual_seed(0))
        torch.stack(list(network.losses(output, targets).values())).sum().backward()
        gradient = network.encoder[1].conv.kernel.grad
        assert gradient is not None
        return [output.source.detach().cpu(), gradient.cpu(), targets.positives.cpu()]

    for got, expected in zip(run(device), run("cpu"), strict=True):
        assert torch.allclose(got.double(), expected.double(), atol=1e-3)


def test_as_published_a_feature_of_zeros_is_no_number() -> None:
    released = FcgfNetwork(replace(NANO, normalize_eps=0.0)).eval()
    ours = FcgfNetwork(NANO).eval()
    for network in (released, ours):
        torch.nn.init.zeros_(network.final.kernel)
        torch.nn.init.zeros_(network.final.bias)  # type: ignore[arg-type]
    batch = made(1)[0]
    with torch.no_grad():
        assert bool(released(batch).source.isnan().all())
        assert bool((ours(batch).source == 0).all())
