# SPDX-License-Identifier: MIT
"""What speaks for a superpoint being seen by both clouds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from streets import moved, street, yaw
from torch.nn import functional as F

from hybridreg.learned.cross3dreg import superpoint_evidence as module
from hybridreg.learned.cross3dreg.batch import make_batch
from hybridreg.learned.cross3dreg.network import Known, RegistrationNetwork
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.learned.cross3dreg.superpoint_evidence import SIZE, superpoint_evidence
from hybridreg.learned.training.data.frozen import FrozenFeatures

TEMPERATURE = 0.1


def drawn(seed: int, m: int = 7, n: int = 5) -> tuple[tuple, tuple, tuple]:
    generator = torch.Generator().manual_seed(seed)
    features = (torch.randn(40, 8, generator=generator), torch.randn(30, 8, generator=generator))
    owners = (
        torch.randint(0, m, (40,), generator=generator),
        torch.randint(0, n, (30,), generator=generator),
    )
    return (m, n), features, owners


@pytest.mark.parametrize("block", [1, 7, 1024])
def test_numbers_are_what_they_say(monkeypatch: pytest.MonkeyPatch, block: int) -> None:
    monkeypatch.setattr(module, "_BLOCK", block)
    sizes, features, owners = drawn(0)
    found = superpoint_evidence(sizes, features, owners, TEMPERATURE)
    f, g = (F.normalize(one, dim=1) for one in features)
    for side, scores in ((0, f @ g.T), (1, g @ f.T)):
        assert found[side].shape == (sizes[side], SIZE)
        best = scores.amax(1)
        sure = torch.log_softmax(scores / TEMPERATURE, 1).amax(1)
        for k in range(sizes[side]):
            own = owners[side] == k
            expected = (best[own].mean(), best[own].max(), sure[own].mean() / 4, sure[own].max() / 4)
            assert found[side][k, :4].tolist() == pytest.approx([float(x) for x in expected], abs=1e-4)
            assert float(found[side][k, 4]) == pytest.approx(np.log1p(int(own.sum())) / 3)


def test_a_superpoint_without_points_is_the_least_likely_one() -> None:
    sizes, features, owners = drawn(1)
    target, _ = superpoint_evidence((sizes[0] + 1, sizes[1]), features, owners, TEMPERATURE)
    assert torch.isfinite(target).all()
    assert target[-1, 1] == target[:, 1].min()
    assert target[-1, 4] == 0


def test_no_gradient_goes_back() -> None:
    sizes, (f, g), owners = drawn(2)
    target, source = superpoint_evidence(sizes, (f.requires_grad_(), g), owners, TEMPERATURE)
    assert not target.requires_grad
    assert not source.requires_grad


def test_a_mask_predictor_uses_it_and_known_evidence_is_taken() -> None:
    config = named_config("nano", omp=True, vgam=False)
    assert config.omp is not None
    config = replace(config, omp=replace(config.omp, evidence=True))
    network = RegistrationNetwork(config).eval()
    points = street(0)
    batch = make_batch(points, moved(points, yaw(30.0)), config)
    with torch.no_grad():
        encoding = network.encode(batch)
        assert encoding.evidence is not None
        logits = network.predict_overlap(encoding)
        known = Known(*network.backbone(batch.features, batch.pyramid), encoding.evidence)
        again = network.predict_overlap(network.encode(batch, known))
        other = tuple(one + 1.0 for one in encoding.evidence)
        changed = network.predict_overlap(network.encode(batch, known._replace(evidence=other)))
    assert torch.equal(logits.target, again.target)
    assert not torch.allclose(logits.target, changed.target)


def test_patches_that_are_known_are_taken_as_they_are() -> None:
    network = RegistrationNetwork(named_config("nano", omp=False, vgam=False)).eval()
    points = street(0)
    batch = make_batch(points, moved(points, yaw(30.0)), network.config)
    kept = FrozenFeatures(network, active=True)
    with torch.no_grad():
        plain = network.encode(batch)
        again = network.encode(batch, kept.of(0, batch))
    for one, other in ((plain.target, again.target), (plain.source, again.source)):
        for name in ("owner", "index", "mask"):
            assert torch.equal(getattr(one.patches, name), getattr(other.patches, name)), name
