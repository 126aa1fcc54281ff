# SPDX-License-Identifier: MIT
"""OMP, VGAM and the matching against the equations of arXiv 2509.06456, written out in numpy, in float64."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from torch import nn

from hybridreg.learned.cross3dreg.config import MatchingConfig, OmpConfig, VgamConfig
from hybridreg.learned.cross3dreg.image_encoder import ImageFeatures
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.cross3dreg.overlap_predictor import OverlapPredictor
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.learned.cross3dreg.visual_geometric_attention import VisualGeometricAttention
from hybridreg.learned.layers.positions import image_grid_encoding
from hybridreg.learned.matching.superpoint_matching import match_superpoints

Array = np.ndarray[Any, np.dtype[np.float64]]
EXACT = 1e-12


def random(*shape: int, seed: int = 0) -> torch.Tensor:
    """Float64 of order one."""
    generator = torch.Generator().manual_seed(seed)
    return torch.randn(*shape, generator=generator, dtype=torch.float64)


def linear(layer: nn.Module, x: Array) -> Array:
    """What a linear layer does, from its parameters alone."""
    assert isinstance(layer, nn.Linear)
    return x @ layer.weight.detach().numpy().T + layer.bias.detach().numpy()


def softmax(scores: Array) -> Array:
    """Along rows."""
    raised = np.exp(scores - scores.max(axis=1, keepdims=True))
    return raised / raised.sum(axis=1, keepdims=True)


def tokens_of(grid: torch.Tensor, pool: int) -> Array:
    """Means of pool x pool blocks of (d, h, w), row by row."""
    d, h, w = grid.shape
    blocks = grid.numpy().reshape(d, h // pool, pool, w // pool, pool).mean(axis=(2, 4))
    return blocks.reshape(d, -1).T


def test_the_mask_is_the_printed_one_and_no_layer_norm_stands_in_it() -> None:
    """P = sigmoid(MLP(A + FFN(A + X))), A = attention of the superpoints X to the image."""
    torch.manual_seed(0)
    omp = OverlapPredictor(OmpConfig(dim=8, heads=1, formula="text", pool=2), 12, 6).double()
    assert not [module for module in omp.modules() if isinstance(module, nn.LayerNorm)]
    target, source, grid = random(7, 12), random(5, 12, seed=1), random(6, 4, 6, seed=2)
    found = omp(target, source, ImageFeatures(grid, random(1, 6, seed=3)))
    with torch.no_grad():
        tokens = tokens_of(omp.token(grid[None])[0], 2)
    for features, logits in ((target, found.target), (source, found.source)):
        X = linear(omp.point, features.numpy())
        Q, K = linear(omp.attention.query, X), linear(omp.attention.key, tokens)
        V = linear(omp.attention.value, linear(omp.value, tokens))
        A = linear(omp.attention_out, softmax(Q @ K.T / np.sqrt(8)) @ V)
        FFN = linear(omp.squeeze, np.maximum(linear(omp.expand, A + X), 0.0))
        P = 1.0 / (1.0 + np.exp(-linear(omp.logit, A + FFN)[:, 0]))
        assert np.abs(torch.sigmoid(logits).detach().numpy() - P).max() < EXACT


def test_a_mask_as_published_sees_its_own_cloud_and_the_image_alone() -> None:
    torch.manual_seed(0)
    omp = OverlapPredictor(OmpConfig(dim=8, heads=2), 12, 6).double()
    image = ImageFeatures(random(6, 4, 4), random(1, 6))
    first = omp(random(7, 12), random(5, 12, seed=1), image)
    second = omp(random(7, 12), random(9, 12, seed=4), image)
    assert torch.equal(first.target, second.target)
    other = omp(random(7, 12), random(5, 12, seed=1), ImageFeatures(random(6, 4, 4, seed=9), random(1, 6)))
    assert not torch.allclose(first.target, other.target)


@pytest.mark.parametrize("fine_dim", [4, 64])
def test_visual_geometric_attention_is_the_printed_one(fine_dim: int) -> None:
    """F' = S (V + G) + F with S = softmax((Q + E)(K + G)^T / sqrt(d')), F'' = softmax(Q K^T / sqrt(d')) V + F'."""
    torch.manual_seed(0)
    config = VgamConfig(heads=1, repeats=2, pool=2, point_position="mlp", formula="text")
    vgam = VisualGeometricAttention(config, 8, 6, fine_dim).double()
    F, points, grid = random(7, 8), 20.0 * random(7, 3, seed=1), random(6, 4, 6, seed=2)
    found = vgam(F, points, ImageFeatures(grid, random(1, 6))).detach().numpy()
    tokens = linear(vgam.token, tokens_of(grid, 2))
    at_points = vgam.position(points).detach().numpy()
    at_tokens = image_grid_encoding(2, 3, 8, torch.device("cpu")).double().numpy()
    want = F.numpy()
    for layer in vgam.layers:
        visual, own = layer.visual, layer.self_attention
        E, G = linear(visual.point, at_points), linear(visual.pixel, at_tokens)
        Q, K, V = linear(visual.query, want), linear(visual.key, tokens), linear(visual.value, tokens)
        want = softmax((Q + E) @ (K + G).T / np.sqrt(fine_dim)) @ (V + G) + want
        Q, K, V = (linear(part, want) for part in (own.query, own.key, own.value))
        want = softmax(Q @ K.T / np.sqrt(fine_dim)) @ V + want
    assert np.abs(found - want).max() < EXACT


def test_the_printed_form_has_no_gate() -> None:
    with pytest.raises(ValueError, match="no gate"):
        VgamConfig(gated=True, formula="text")


def test_a_network_is_built_of_the_printed_forms() -> None:
    config = named_config("nano", omp=True, vgam=True)
    assert config.omp is not None
    assert config.vgam is not None
    printed = replace(
        config, omp=replace(config.omp, formula="text"), vgam=replace(config.vgam, formula="text")
    )
    network = RegistrationNetwork(printed)
    names = [name for name, module in network.named_modules() if isinstance(module, nn.LayerNorm)]
    assert not [name for name in names if name.startswith("omp.") or name.startswith("vgam.layers")]
    assert type(printed).from_dict(printed.to_dict()) == printed


@pytest.mark.parametrize("length", [1.0, 30.0])
def test_raw_similarity_is_the_printed_one_where_its_exponentials_vanish_too(length: float) -> None:
    """z_ij = exp(-|f_i - g_j|^2), then z_ij / sum_j z_ij * z_ij / sum_i z_ij."""
    f, g = length * random(6, 16), length * random(8, 16, seed=1)
    found = match_superpoints(f, g, 5, unit=False)
    d = ((f[:, None] - g[None]) ** 2).sum(-1).numpy()
    rows = -d - np.log(np.exp(-(d - d.min(1, keepdims=True))).sum(1, keepdims=True)) + d.min(1, keepdims=True)
    columns = -d - np.log(np.exp(-(d - d.min(0))).sum(0)) + d.min(0)
    best = np.argsort(-(rows + columns), axis=None)[:5]
    assert list(zip(found.target.tolist(), found.source.tolist(), strict=True)) == [
        (int(i) // 8, int(i) % 8) for i in best
    ]
    assert found.score.numpy() == pytest.approx(np.exp((rows + columns).flat[best]), rel=1e-9, abs=1e-300)


def test_raw_and_unit_similarity_agree_on_features_of_length_one() -> None:
    f, g = (torch.nn.functional.normalize(random(9, 16, seed=seed), dim=1) for seed in (0, 1))
    unit, raw = match_superpoints(f, g, 20), match_superpoints(f, g, 20, unit=False)
    assert torch.equal(unit.target, raw.target)
    assert torch.equal(unit.source, raw.source)
    assert torch.allclose(unit.score, raw.score)


def test_training_never_sees_raw_features() -> None:
    config = named_config("nano")
    network = RegistrationNetwork(replace(config, matching=replace(config.matching, similarity="raw")))
    assert MatchingConfig().similarity == "unit"

    def lengths() -> torch.Tensor:
        from streets import street

        from hybridreg.learned.cross3dreg.batch import make_batch

        cloud = street(seed=0)
        with torch.no_grad():
            encoding = network.encode(make_batch(cloud, cloud, config))
            return network.attend(encoding, network.keep(encoding, None))[0].norm(dim=1)

    assert torch.allclose(network.train() and lengths(), torch.ones(()))
    assert not torch.allclose(network.eval() and lengths(), torch.ones(()), atol=0.05)
