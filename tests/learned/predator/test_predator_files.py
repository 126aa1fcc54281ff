# SPDX-License-Identifier: MIT
"""Predator on disk: sizes, folders, published checkpoints."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch
from stacked_recordings import as_convolution, made_batch, unsettle

from hybridreg.learned import weights
from hybridreg.learned.cofinet.network import CofinetNetwork
from hybridreg.learned.network_table import network_class
from hybridreg.learned.predator.config import named_config
from hybridreg.learned.predator.network import PredatorNetwork
from hybridreg.learned.predator.official_names import official_name


def checkpoint(path: Path, network: torch.nn.Module, **changes: torch.Tensor | None) -> Path:
    """A file as the authors publish them."""
    state = {
        official_name(name): as_convolution(official_name(name), t)
        for name, t in network.state_dict().items()
    }
    state.update({name: tensor for name, tensor in changes.items() if tensor is not None})
    state = {name: tensor for name, tensor in state.items() if changes.get(name, tensor) is not None}
    torch.save({"epoch": 3, "state_dict": state, "best_loss": 0.5}, path)
    return path


@pytest.fixture(scope="module")
def indoor() -> PredatorNetwork:
    torch.manual_seed(0)
    network = PredatorNetwork(named_config("predator-3dmatch"))
    unsettle(network)
    return network.eval()


@pytest.mark.parametrize(
    ("name", "parameters"),
    # As measured on the originals, without 15 kernel points in each of 11 convolutions, which are no parameters here.
    [("predator-kitti", 22_766_643 - 11 * 45), ("predator-3dmatch", 7_425_395 - 11 * 45)],
)
def test_published_sizes(name: str, parameters: int) -> None:
    network = PredatorNetwork(named_config(name))
    assert sum(p.numel() for p in network.parameters()) == parameters
    names = {official_name(name) for name in network.state_dict()}
    assert len(names) == len(network.state_dict()) == 74
    assert {
        "epsilon",
        "encoder_blocks.0.KPConv.kernel_points",
        "encoder_blocks.10.unary2.mlp.weight",
        "encoder_blocks.9.unary_shortcut.mlp.weight",
        "bottle.bias",
        "gnn.layers.0.conv3.weight",
        "gnn.layers.1.attn.proj.2.bias",
        "gnn.layers.1.mlp.3.weight",
        "proj_gnn.weight",
        "proj_score.bias",
        "decoder_blocks.5.mlp.weight",
    } <= names


def test_small_is_small() -> None:
    network = PredatorNetwork(named_config("small"))
    assert sum(p.numel() for p in network.parameters()) <= 3_000_000
    with pytest.raises(KeyError, match=r"unknown size 'huge' of Predator; known are predator-kitti"):
        named_config("huge")


def test_a_folder_says_which_network_it_holds(tmp_path: Path) -> None:
    torch.manual_seed(0)
    network = PredatorNetwork(named_config("nano"))
    unsettle(network)
    network.save_pretrained(tmp_path / "own")
    assert json.loads((tmp_path / "own" / "config.json").read_text())["network"] == "predator"
    again = network_class("predator").from_pretrained(tmp_path / "own")
    assert again.config == network.config
    assert not again.training
    batch = made_batch(network.config, 400)
    with torch.no_grad():
        assert torch.equal(again(batch).source.features, network.eval()(batch).source.features)
    assert isinstance(weights.from_pretrained(tmp_path / "own"), PredatorNetwork)
    with pytest.raises(ValueError, match="weights of the network 'predator', not of 'cofinet'"):
        CofinetNetwork.from_pretrained(tmp_path / "own")


def test_a_published_checkpoint_tells_its_configuration(indoor: PredatorNetwork, tmp_path: Path) -> None:
    found = PredatorNetwork.load_official(checkpoint(tmp_path / "indoor.pth", indoor))
    assert found.config == named_config("predator-3dmatch")
    assert not found.training
    assert all(
        torch.equal(a, b)
        for a, b in zip(found.state_dict().values(), indoor.state_dict().values(), strict=True)
    )
    assert not found.untrained()
    assert PredatorNetwork(named_config("nano")).untrained() >= {"encoder"}
    bare = {official_name(name): tensor for name, tensor in indoor.state_dict().items()}
    torch.save(bare, tmp_path / "bare.pth")
    assert PredatorNetwork.load_official(tmp_path / "bare.pth", "predator-3dmatch").config == found.config


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bottle.bias": None}, "bottle.bias is missing|bottleneck.bias is missing"),
        ({"something": torch.zeros(2)}, "something is not part of this network"),
        ({"proj_gnn.weight": torch.zeros(256, 255, 1)}, r"shape \(256, 255, 1\), not \(256, 256\)"),
        ({"epsilon": torch.tensor(float("nan"))}, "epsilon holds values that are not finite"),
        ({"encoder_blocks.0.KPConv.kernel_points": None}, "kernel_points is missing"),
        ({"encoder_blocks.0.KPConv.kernel_points": torch.zeros(15, 3)}, "holds no kernel points"),
    ],
)
def test_other_checkpoints_are_refused(
    indoor: PredatorNetwork, tmp_path: Path, changes: dict[str, torch.Tensor | None], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        PredatorNetwork.load_official(checkpoint(tmp_path / "bad.pth", indoor, **changes))
    with pytest.raises(FileNotFoundError, match=r"no checkpoint .*gone.pth"):
        PredatorNetwork.load_official(tmp_path / "gone.pth")


def test_a_checkpoint_that_runs_code_is_refused(tmp_path: Path) -> None:
    torch.save({"state_dict": {"epsilon": Path("anything")}}, tmp_path / "object.pth")
    with pytest.raises(ValueError, match=r"object.pth"):
        PredatorNetwork.load_official(tmp_path / "object.pth")


@pytest.mark.parametrize("part", ["score.bias", "epsilon"])
def test_either_sign_of_training_is_enough_in_half_precision_too(part: str, tmp_path: Path) -> None:
    network = PredatorNetwork(named_config("nano"))
    with torch.no_grad():
        network.get_parameter(part).add_(2e-8 if part == "score.bias" else 0.004)
    weights.save_pretrained(network, tmp_path, half=True)
    assert not PredatorNetwork.from_pretrained(tmp_path).untrained()
