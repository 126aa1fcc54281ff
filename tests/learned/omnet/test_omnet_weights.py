# SPDX-License-Identifier: MIT
"""OMNet's weights, published and our own, and OMNet as an estimator."""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from measured import peak_and_estimate
from omnet_pairs import shapes

import hybridreg as hr
from hybridreg import testing
from hybridreg.learned import memory_estimate
from hybridreg.learned.fcgf.network import FcgfNetwork
from hybridreg.learned.omnet.batch import OmnetBatch
from hybridreg.learned.omnet.config import OmnetConfig, named_config
from hybridreg.learned.omnet.network import OmnetNetwork
from hybridreg.learned.omnet.official_names import official_name
from hybridreg.matches import Correspondences


def published(network: OmnetNetwork, prefix: str = "") -> dict[str, torch.Tensor]:
    layers = len(network.config.decoder)
    return {prefix + official_name(name, layers): value for name, value in network.state_dict().items()}


@pytest.fixture
def trained(tmp_path: Path) -> str:
    """A folder of weights that have been moved as a training step would."""
    torch.manual_seed(5)
    network = OmnetNetwork(named_config("nano"))
    with torch.no_grad():
        for parameter in network.parameters():
            parameter += 0.01 * torch.randn_like(parameter)
    network.save_pretrained(tmp_path / "weights")
    return str(tmp_path / "weights")


def test_names_and_shapes_are_the_published_ones(omnet_stem: Path) -> None:
    want = json.loads(omnet_stem.with_name("omnet_official_state.json").read_text())
    network = OmnetNetwork(named_config("omnet-modelnet"))
    assert {name: list(value.shape) for name, value in published(network).items()} == want
    assert sum(p.numel() for p in network.parameters()) == 53_658_148


def test_sizes() -> None:
    small = OmnetNetwork(named_config("small"))
    assert sum(p.numel() for p in small.parameters()) <= 3_000_000
    with pytest.raises(KeyError, match="known are omnet-modelnet, small, nano"):
        named_config("large")


@pytest.mark.parametrize("name", ["small", "nano"])
def test_a_checkpoint_is_read_from_its_shapes(name: str, tmp_path: Path) -> None:
    network = OmnetNetwork(dataclasses.replace(named_config(name), points=717))
    torch.save({"epoch": 3, "state_dict": published(network, "module.")}, tmp_path / "omnet.pth")
    loaded = OmnetNetwork.load_official(tmp_path / "omnet.pth")
    assert loaded.config == network.config
    assert not loaded.training
    for key, value in network.state_dict().items():
        assert torch.equal(loaded.state_dict()[key], value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"encoder.0.conv_block1.0.weight": None}, r"encoder\.0\.conv_block1\.0\.weight is missing"),
        ({"regression.0.fc_block1.0.weight": None}, r"no weights of OMNet"),
        ({"regression.2.final_fc.0.bias": None}, r"regression\.2\.pose\.bias is missing"),
        ({"fusion.1.conv_block2.0.weight": torch.zeros(3, 3, 1)}, "has shape"),
        ({"more": torch.zeros(1)}, "more is not part of this network"),
    ],
)
def test_a_wrong_tensor_is_named(
    change: dict[str, torch.Tensor | None], message: str, tmp_path: Path
) -> None:
    state: dict[str, torch.Tensor | None] = {**published(OmnetNetwork(named_config("nano"))), **change}
    torch.save({name: value for name, value in state.items() if value is not None}, tmp_path / "omnet.pth")
    with pytest.raises(ValueError, match=message):
        OmnetNetwork.load_official(tmp_path / "omnet.pth")


def test_a_saved_network_comes_back(trained: str) -> None:
    assert json.loads((Path(trained) / "config.json").read_text())["network"] == "omnet"
    loaded = OmnetNetwork.from_pretrained(trained)
    assert (
        loaded.config
        == named_config("nano")
        == OmnetConfig.from_dict(json.loads(json.dumps(loaded.config.to_dict())))
    )
    assert not loaded.training
    with pytest.raises(ValueError, match="weights of the network 'omnet', not of 'fcgf'"):
        FcgfNetwork.from_pretrained(trained)
    with pytest.raises(ValueError, match="weights of the network 'omnet', not of 'cross3dreg'"):
        hr.GeoTransformer(weights=trained).network()


@pytest.mark.parametrize("check", testing.checks(), ids=lambda check: check.__name__)
@pytest.mark.parametrize("size", ["nano", "small"])
def test_the_suite(check: testing.stages.Check, size: str) -> None:
    check(hr.OmNet(untrained=True, size=size), "estimate")


def test_random_weights_are_refused_unless_asked_for(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"OmNet: without weights.*random.*untrained=True"):
        hr.OmNet(size="nano")
    OmnetNetwork(named_config("nano")).save_pretrained(tmp_path)
    with pytest.raises(ValueError, match="random: decoder, encoder, fusion, regression of"):
        hr.OmNet.from_pretrained(tmp_path)
    with pytest.raises(ValueError, match="points=0 must be at least 1"):
        hr.OmNet(untrained=True, points=0)


def test_the_stage_is_the_network_in_metres(trained: str) -> None:
    batch, _ = shapes(1, points=200)
    source, target = (7.0 * cloud[0].double().numpy() for cloud in (batch.source, batch.target))
    pair = hr.Pair.of(source, target, source_viewpoint=(0.0, 0.0, 0.0), target_viewpoint=(0.0, 0.0, 0.0))
    scene = hr.AllPoints()(pair)
    pose = hr.OmNet(weights=trained, points=200)(scene, Correspondences.none(), np.random.default_rng(0))
    radius = max(float(np.linalg.norm(level.points, axis=1).max()) for level in (scene.source, scene.target))
    whole = [
        torch.from_numpy((level.points / radius).astype(np.float32))[None]
        for level in (scene.source, scene.target)
    ]
    with torch.inference_mode():
        want = OmnetNetwork.from_pretrained(trained)(OmnetBatch(source=whole[0], target=whole[1])).transform[
            0
        ]
    assert pose.found
    assert np.allclose(pose.T[:3, :3], want[:, :3].numpy(), atol=1e-4)
    assert np.allclose(pose.T[:3, 3], radius * want[:, 3].numpy(), atol=1e-3)


def test_a_published_checkpoint_is_a_stage(trained: str, tmp_path: Path) -> None:
    torch.save({"state_dict": published(OmnetNetwork.from_pretrained(trained))}, tmp_path / "omnet.pth")
    scene, _ = testing.sample_scene()
    one, two = (
        stage(scene, Correspondences.none(), np.random.default_rng(0))
        for stage in (hr.OmNet.load_official(tmp_path / "omnet.pth", points=256), hr.OmNet(weights=trained))
    )
    assert np.allclose(one.T, two.T)
    assert any("OMNet used 256 of" in note for note in scene.notes)


def test_what_does_not_fit_is_refused(trained: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, _ = testing.sample_scene()
    monkeypatch.setattr(memory_estimate, "available_bytes", lambda device: 10**6)
    with pytest.raises(ValueError, match="256 target and 256 source points.*use fewer with points="):
        hr.OmNet(weights=trained)(scene, Correspondences.none(), np.random.default_rng(0))


_MADE = """
from hybridreg.learned.omnet.batch import OmnetBatch
from hybridreg.learned.omnet.network import OmnetNetwork
network = OmnetNetwork.named("small")
batch = OmnetBatch(source=torch.randn(2, 6000, 3), target=torch.randn(2, 6000, 3))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is reset through /proc")
def test_the_estimate_of_memory_is_near_and_not_below() -> None:
    real, estimate = peak_and_estimate(_MADE)
    assert real <= estimate
    assert estimate - memory_estimate.SLACK <= 1.5 * real, (real, estimate)
