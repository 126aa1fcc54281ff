# SPDX-License-Identifier: MIT
"""Targets and losses, and that neither knows a NaN."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy.spatial import cKDTree
from streets import street

from hybridreg.learned.cross3dreg.batch import Batch, make_batch
from hybridreg.learned.cross3dreg.config import LossConfig, NetworkConfig
from hybridreg.learned.cross3dreg.losses import Losses
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.learned.cross3dreg.targets import compute_targets
from hybridreg.learned.cross3dreg.training_mask import MaskJitter, training_mask
from hybridreg.learned.cross3dreg.training_step import sample_target_pairs, training_losses
from hybridreg.learned.losses.circle_loss import circle_loss
from hybridreg.learned.losses.fine_loss import assignment_loss, true_assignment
from hybridreg.learned.losses.focal_loss import focal_loss
from hybridreg.learned.matching.patch_pairs import PatchPairs


def test_overlaps_equal_brute_force(batch: Batch, nano: NetworkConfig, truth: np.ndarray) -> None:
    targets = compute_targets(batch.pyramid, torch.from_numpy(truth), nano)
    points, nodes = batch.pyramid.clouds(1), batch.pyramid.clouds(3)
    moved = [points[0].double().numpy(), (points[1].double().numpy() @ truth[:3, :3].T + truth[:3, 3])]
    owner = [cKDTree(nodes[i].numpy()).query(points[i].numpy())[1] for i in (0, 1)]
    radius = nano.matching.matching_radius
    for k in np.random.default_rng(0).choice(len(targets.target), 20, replace=False):
        i, j = int(targets.target[k]), int(targets.source[k])
        p, q = moved[0][owner[0] == i], moved[1][owner[1] == j]
        near = np.linalg.norm(p[:, None] - q[None], axis=-1) < radius
        assert float(targets.overlap[k]) == pytest.approx(
            (near.any(1).mean() + near.any(0).mean()) / 2, abs=0.1
        )
    assert len(targets.target) > 100
    assert targets.mask_target.float().mean() > 0.8
    # the wrong pose gives other pairs
    other = compute_targets(batch.pyramid, torch.eye(4), nano)
    assert set(zip(other.target.tolist(), other.source.tolist(), strict=True)) != set(
        zip(targets.target.tolist(), targets.source.tolist(), strict=True)
    )


def test_circle_loss_falls_as_features_agree() -> None:
    overlap = torch.eye(6) * 0.8
    good = torch.eye(6, 8)
    bad = torch.nn.functional.normalize(torch.ones(6, 8) + 0.01 * torch.randn(6, 8), dim=1)
    assert circle_loss(good, good, overlap, LossConfig()) < circle_loss(bad, bad, overlap, LossConfig()) / 2


@pytest.mark.parametrize(
    "overlap", [torch.zeros(4, 5), torch.ones(4, 5), torch.zeros(0, 5), torch.full((4, 5), 0.05)]
)
def test_circle_loss_without_valid_rows_is_zero(overlap: torch.Tensor) -> None:
    m, n = overlap.shape
    raw = torch.randn(m, 8, requires_grad=True)
    features = torch.nn.functional.normalize(raw, dim=1)
    loss = circle_loss(
        features, torch.nn.functional.normalize(torch.randn(n, 8), dim=1), overlap, LossConfig()
    )
    loss.backward()
    assert loss == 0
    assert torch.isfinite(raw.grad).all()  # type: ignore[arg-type]


def test_equal_features_have_finite_gradients() -> None:
    raw = torch.ones(3, 4, requires_grad=True)
    circle_loss(raw / 2, raw / 2, torch.eye(3), LossConfig()).backward()
    assert torch.isfinite(raw.grad).all()  # type: ignore[arg-type]


def test_focal_loss_by_hand() -> None:
    logits, truth = torch.tensor([0.4, -1.0]), torch.tensor([True, True])
    p = torch.sigmoid(logits)
    want = (-0.25 * (1 - p) ** 2 * p.log()).mean()
    assert torch.allclose(focal_loss(logits, truth), want)
    assert torch.allclose(focal_loss(-logits, ~truth), want)  # constant alpha treats both classes alike
    assert torch.allclose(focal_loss(-logits, ~truth, alpha_mode="balanced"), 3 * want)
    assert focal_loss(torch.tensor([200.0, -200.0]), torch.tensor([False, True])).isfinite()
    assert focal_loss(torch.zeros(0), torch.zeros(0, dtype=torch.bool)) == 0


def test_true_assignment_by_hand() -> None:
    target = torch.tensor([[0.0, 0, 0], [5, 0, 0]])
    source = torch.tensor([[0.1, 0, 0], [9, 0, 0]])
    every = torch.ones(1, 2, dtype=torch.bool)
    pairs = PatchPairs(torch.tensor([[0, 1]]), every, torch.tensor([[0, 1]]), every, torch.tensor([0]))
    labels = true_assignment(pairs, target, source, torch.eye(4), 0.5)
    assert labels.int().tolist() == [[[1, 0, 0], [0, 0, 1], [0, 1, 0]]]
    assignment = torch.full((1, 3, 3), -2.0)
    assert assignment_loss(assignment, pairs, target, source, torch.eye(4), 0.5) == 2.0


def losses_of(network: RegistrationNetwork, batch: Batch, transform: np.ndarray) -> Losses:
    """Losses of a step, after ``backward``; all must be finite."""
    targets = compute_targets(batch.pyramid, torch.from_numpy(transform), network.config)
    network.zero_grad()
    losses = training_losses(network, batch, targets, torch.Generator().manual_seed(0))
    losses.total.backward()
    assert torch.isfinite(losses.total)
    for name, parameter in network.named_parameters():
        assert parameter.grad is None or torch.isfinite(parameter.grad).all(), name
    return losses


@pytest.fixture
def trainee(nano: NetworkConfig) -> RegistrationNetwork:
    """A fresh network in training mode."""
    torch.manual_seed(2)
    return RegistrationNetwork(nano).train()


def test_every_parameter_of_an_ordinary_step_learns(
    trainee: RegistrationNetwork, batch: Batch, truth: np.ndarray
):
    trainee.image_encoder.dropout = 0.0  # type: ignore[union-attr]
    losses = losses_of(trainee, batch, truth)
    assert torch.stack([losses.coarse, losses.fine, losses.mask]).min() > 0
    unused = {name for name, p in trainee.named_parameters() if p.grad is None}
    # What a missing image would have used.
    assert unused == {"image_encoder.null", "omp.null.weight", "omp.null.bias"}


def test_losses_fall_in_a_few_steps(trainee: RegistrationNetwork, nano: NetworkConfig) -> None:
    optimizer = torch.optim.Adam(trainee.parameters(), 2e-3)
    small = make_batch(street(0, 1200, 12.0), street(0, 1200, 12.0), nano)
    seen = []
    for _ in range(12):
        seen.append(float(losses_of(trainee, small, np.eye(4)).total.detach()))
        optimizer.step()
    assert np.mean(seen[-3:]) < 0.9 * np.mean(seen[:3])


def test_no_overlap(trainee: RegistrationNetwork, batch: Batch) -> None:
    far = np.eye(4)
    far[:3, 3] = 500.0
    losses = losses_of(trainee, batch, far)
    assert losses.coarse == 0
    assert losses.fine == 0
    assert losses.mask > 0


@pytest.mark.parametrize("points", [1, 2, 3, 40])
def test_tiny_clouds(trainee: RegistrationNetwork, nano: NetworkConfig, points: int) -> None:
    rng = np.random.default_rng(points)
    cloud = rng.uniform(-0.4, 0.4, (points, 3))
    small = make_batch(cloud, cloud + 0.1, nano, subsample=False)
    assert small.pyramid.lengths[-1][0] <= 8
    losses_of(trainee, small, np.eye(4))
    trainee.eval()
    with torch.no_grad():
        output = trainee(small)
    assert all(torch.isfinite(f).all() for f in output.node_features)
    n_target, n_source = small.pyramid.lengths[-1]
    assert 0 < len(output.superpoints) <= min(n_target * n_source, nano.matching.superpoint_matches)


def test_geotransformer_trains_without_a_mask(batch: Batch, truth: np.ndarray) -> None:
    plain = RegistrationNetwork(named_config("nano")).train()
    assert losses_of(plain, batch, truth).mask == 0


def test_sampled_pairs_overlap_enough(batch: Batch, nano: NetworkConfig, truth: np.ndarray) -> None:
    targets = compute_targets(batch.pyramid, torch.from_numpy(truth), nano)
    chosen = sample_target_pairs(targets, 0.1, 16, torch.Generator().manual_seed(0))
    assert len(set(chosen.tolist())) == 16
    assert (targets.overlap[chosen] > 0.1).all()
    assert len(sample_target_pairs(targets, 1.1, 16, torch.Generator())) == 0


def test_the_training_mask_is_jittered_truth() -> None:
    truth = torch.arange(4000) < 2000
    logits = torch.where(truth, -5.0, 5.0)  # a prediction that is wrong everywhere
    rng = torch.Generator().manual_seed(0)
    kept = training_mask(truth, logits, 10_000, MaskJitter(), rng).index
    assert (kept < 2000).sum() == pytest.approx(1800, abs=60)
    assert (kept >= 2000).sum() == pytest.approx(600, abs=80)
    mixed = training_mask(truth, logits, 10_000, MaskJitter(use_predicted=1.0), rng).index
    assert (mixed >= 2000).sum() == 2000
    assert (mixed < 2000).sum() == pytest.approx(1000, abs=80)
    assert len(training_mask(truth, logits, 50, MaskJitter(), rng).index) == 50
    none = torch.zeros(5, dtype=torch.bool)
    assert len(training_mask(none, logits[:5], 50, MaskJitter(keep_negative=0.0), rng).index) == 5
