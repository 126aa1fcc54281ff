# SPDX-License-Identifier: MIT
"""CoFiNet on disk: sizes, folders, published checkpoints."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch
from stacked_recordings import as_convolution, unsettle

from hybridreg.learned.cofinet.config import named_config
from hybridreg.learned.cofinet.network import CofinetNetwork
from hybridreg.learned.cofinet.official_names import UNUSED, official_name
from hybridreg.learned.network_table import network_class
from hybridreg.learned.predator.network import PredatorNetwork


@pytest.fixture(scope="module")
def kitti() -> CofinetNetwork:
    torch.manual_seed(0)
    network = CofinetNetwork(named_config("cofinet-kitti"))
    unsettle(network)
    return network.eval()


def _state(network: CofinetNetwork) -> dict[str, torch.Tensor]:
    names = {name: official_name(name) for name in network.state_dict()}
    state = {
        names[name]: as_convolution(names[name], tensor) for name, tensor in network.state_dict().items()
    }
    return state | {name: torch.tensor(1.0) for name in UNUSED}


def test_published_size(kitti: CofinetNetwork) -> None:
    # As measured on the original: two parameters that it never uses, 15 kernel points in each of 8 convolutions.
    assert sum(p.numel() for p in kitti.parameters()) == 5_481_195 - 2 - 8 * 45
    names = set(_state(kitti))
    assert len(names) == 118
    assert {
        "bin_score",
        "l_bin_score",
        "encoder.epsilon",
        "encoder.bottle.weight",
        "encoder.encoder_blocks.7.unary_shortcut.mlp.weight",
        "decoder.decoder_blocks.5.mlp.weight",
        "sattn1.attn.merge.bias",
        "cattn.mlp.3.weight",
        "l_sattn2.attn.proj.1.weight",
        "final_proj.weight",
        "l_final_proj.bias",
    } <= names


def test_small_is_small() -> None:
    network = CofinetNetwork(named_config("small"))
    assert sum(p.numel() for p in network.parameters()) <= 3_000_000
    assert network.config.padding == "masked"
    assert named_config("cofinet-kitti").padding == "point0", "the published weights were trained so"
    with pytest.raises(KeyError, match="known are cofinet-kitti, small, nano"):
        named_config("huge")


def test_a_folder_says_which_network_it_holds(tmp_path: Path) -> None:
    network = CofinetNetwork(named_config("nano"))
    unsettle(network)
    network.save_pretrained(tmp_path / "own", half=True)
    assert json.loads((tmp_path / "own" / "config.json").read_text())["network"] == "cofinet"
    again = network_class("cofinet").from_pretrained(tmp_path / "own")
    assert again.config == network.config
    assert not again.untrained()
    assert again.bin_score.dtype == torch.float32
    with pytest.raises(ValueError, match="weights of the network 'cofinet', not of 'predator'"):
        PredatorNetwork.from_pretrained(tmp_path / "own")


def test_a_published_checkpoint(kitti: CofinetNetwork, tmp_path: Path) -> None:
    torch.save({"epoch": 40, "state_dict": _state(kitti)}, tmp_path / "best_kitti.pth")
    found = CofinetNetwork.load_official(tmp_path / "best_kitti.pth")
    assert found.config == named_config("cofinet-kitti")
    assert all(
        torch.equal(a, b)
        for a, b in zip(found.state_dict().values(), kitti.state_dict().values(), strict=True)
    )
    assert CofinetNetwork(named_config("nano")).untrained() >= {"encoder", "coarse"}
    state = _state(kitti)
    del state["l_final_proj.bias"]
    torch.save({"state_dict": {**state, "extra": torch.zeros(1)}}, tmp_path / "bad.pth")
    with pytest.raises(
        ValueError, match=r"bad.pth: tensor .*final_proj.bias|project.bias is missing \(and 1 more\)"
    ):
        CofinetNetwork.load_official(tmp_path / "bad.pth")
    with pytest.raises(ValueError, match=r"has shape \(256, 1024, 1\)|tensor .* has shape"):
        CofinetNetwork.load_official(tmp_path / "best_kitti.pth", "small")
