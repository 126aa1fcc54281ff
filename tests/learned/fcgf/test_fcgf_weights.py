# SPDX-License-Identifier: MIT
"""FCGF's weights: published names and shapes, folders, and what is refused."""

from __future__ import annotations

import json
import sys
import types
from pathlib import Path

import pytest
import torch

from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.fcgf.batch import FcgfBatch
from hybridreg.learned.fcgf.config import FcgfConfig, FcgfLossConfig, named_config
from hybridreg.learned.fcgf.network import FcgfNetwork
from hybridreg.learned.fcgf.official_names import official_name
from hybridreg.learned.weights import from_pretrained


def parameters(config: FcgfConfig) -> int:
    return sum(p.numel() for p in FcgfNetwork(config).parameters())


def published(network: FcgfNetwork, prefix: str = "") -> dict[str, torch.Tensor]:
    return {prefix + official_name(name): value for name, value in network.state_dict().items()}


def test_names_and_shapes_are_the_published_ones(fcgf_stem: Path) -> None:
    want = json.loads(fcgf_stem.with_name("fcgf_official_state.json").read_text())
    ours = {
        name: list(value.shape) for name, value in published(FcgfNetwork(named_config("fcgf-kitti"))).items()
    }
    assert ours == want


def test_sizes() -> None:
    assert parameters(named_config("fcgf-kitti")) == 8_753_408
    assert parameters(named_config("small")) <= 3_000_000
    with pytest.raises(KeyError, match="known are fcgf-kitti, fcgf-3dmatch, small, nano"):
        named_config("large")


@pytest.mark.parametrize(
    ("made", "voxel"),
    [
        (FcgfConfig(), 0.3),
        (FcgfConfig(first_kernel=7), 0.025),
        (FcgfConfig(first_kernel=3, out_channels=16), 0.3),
        (FcgfConfig(channels=(8, 12, 16), tr_channels=(10, 14, 18), tr_kernel=2), 0.3),
    ],
)
@pytest.mark.parametrize("normalize", [True, False])
def test_a_checkpoint_is_read_from_its_shapes(
    made: FcgfConfig, voxel: float, normalize: bool, tmp_path: Path
) -> None:
    network = FcgfNetwork(made)
    torch.save({"epoch": 3, "state_dict": published(network, "module.")}, tmp_path / "fcgf.pth")
    loaded = FcgfNetwork.load_official(tmp_path / "fcgf.pth", normalize=normalize)
    assert loaded.config == FcgfConfig(**{**vars(made), "normalize": normalize, "voxel": voxel})
    assert not loaded.training
    for name, value in network.state_dict().items():
        assert torch.equal(loaded.state_dict()[name], value)


def test_normalisation_must_be_told(tmp_path: Path) -> None:
    torch.save(published(FcgfNetwork(named_config("nano"))), tmp_path / "fcgf.pth")
    with pytest.raises(ValueError, match="say normalize=True or normalize=False"):
        FcgfNetwork.load_official(tmp_path / "fcgf.pth")
    with pytest.raises(ValueError, match="settles normalize and voxel too"):
        FcgfNetwork.load_official(tmp_path / "fcgf.pth", "nano", normalize=True)
    assert FcgfNetwork.load_official(tmp_path / "fcgf.pth", "nano").config == named_config("nano")
    assert FcgfNetwork.load_official(tmp_path / "fcgf.pth", normalize=True, voxel=0.7).config.voxel == 0.7


def test_the_options_in_a_published_file_are_read_without_running_anything(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = types.ModuleType("easydict")

    class EasyDict(dict):  # type: ignore[type-arg]
        def __setattr__(self, name: str, value: object) -> None:
            super().__setattr__(name, value)
            super().__setitem__(name, value)

    EasyDict.__module__, EasyDict.__qualname__ = "easydict", "EasyDict"
    module.EasyDict = EasyDict  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "easydict", module)
    options = EasyDict()
    options.voxel_size, options.model = 0.05, "ResUNetBN2C"
    state = published(FcgfNetwork(named_config("nano")))
    torch.save({"state_dict": state, "config": options, "best_val": 0.5}, tmp_path / "fcgf.pth")
    monkeypatch.delitem(sys.modules, "easydict")
    assert FcgfNetwork.load_official(tmp_path / "fcgf.pth", normalize=True).config.voxel == 0.05


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"conv1.kernel": None}, r"conv1\.kernel is missing; these are not weights of FCGF"),
        ({"final.kernel": None}, r"final\.kernel is missing"),
        ({"conv1.kernel": torch.zeros(26, 1, 8)}, "26 offsets are not a cube"),
        ({"conv3.kernel": torch.zeros(27, 16, 24, 1)}, "which no kernel has"),
        ({"block2.norm1.bn.weight": None}, "encoder.1.block.norm1.weight is missing"),
        ({"conv3_tr.kernel": torch.zeros(27, 24, 9)}, "has shape"),
        ({"more": torch.zeros(1)}, "more is not part of this network"),
        ({"final.bias": torch.full((1, 16), torch.nan)}, "not finite"),
    ],
)
def test_a_wrong_tensor_is_named(
    change: dict[str, torch.Tensor | None], message: str, tmp_path: Path
) -> None:
    state: dict[str, torch.Tensor | None] = {**published(FcgfNetwork(named_config("nano"))), **change}
    torch.save({name: value for name, value in state.items() if value is not None}, tmp_path / "fcgf.pth")
    with pytest.raises(ValueError, match=message):
        FcgfNetwork.load_official(tmp_path / "fcgf.pth", normalize=True)


@pytest.mark.parametrize(
    "content", [{}, {"state_dict": {}}, {"state_dict": {"a": 1}}, [1, 2], {"a": Path("x")}]
)
def test_what_is_no_checkpoint_is_refused(content: object, tmp_path: Path) -> None:
    torch.save(content, tmp_path / "fcgf.pth")
    with pytest.raises(ValueError, match="holds no state dict|can be read safely"):
        FcgfNetwork.load_official(tmp_path / "fcgf.pth", normalize=True)
    with pytest.raises(FileNotFoundError, match="no checkpoint"):
        FcgfNetwork.load_official(tmp_path / "none.pth", normalize=True)


def test_a_saved_network_comes_back(nano_fcgf: FcgfNetwork, small_batch: FcgfBatch, tmp_path: Path) -> None:
    nano_fcgf.save_pretrained(tmp_path / "weights")
    assert json.loads((tmp_path / "weights" / "config.json").read_text())["network"] == "fcgf"
    loaded = FcgfNetwork.from_pretrained(tmp_path / "weights")
    assert loaded.config == nano_fcgf.config
    assert not loaded.training
    with torch.no_grad():
        assert torch.equal(loaded(small_batch).source, nano_fcgf(small_batch).source)


def test_weights_of_another_network_are_refused(nano_fcgf: FcgfNetwork, tmp_path: Path) -> None:
    nano_fcgf.save_pretrained(tmp_path)
    with pytest.raises(ValueError, match="weights of the network 'fcgf', not of 'cross3dreg'"):
        RegistrationNetwork.from_pretrained(tmp_path)
    assert isinstance(from_pretrained(tmp_path), FcgfNetwork)
    text = (tmp_path / "config.json").read_text()
    (tmp_path / "config.json").write_text(text.replace('"fcgf"', '"omnet"'))
    with pytest.raises(ValueError, match="weights of the network 'omnet', not of 'fcgf'"):
        FcgfNetwork.from_pretrained(tmp_path)
    (tmp_path / "config.json").write_text(text.replace('"stride"', '"strid"'))
    with pytest.raises(ValueError, match=r"damaged: config: unknown keys \['strid'\]"):
        FcgfNetwork.from_pretrained(tmp_path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"channels": (8,), "tr_channels": (8,)}, "1 channels: give 2 to 8"),
        ({"channels": (8, 8, 8)}, "4 tr_channels for 3 channels"),
        ({"first_kernel": 50}, "first_kernel=50 must lie in 1 to 9"),
        ({"voxel": 0.0}, "voxel=0"),
        ({"stride": 1}, "stride=1 must lie in 2 to 8"),
        ({"out_channels": 10**6}, "out_channels=1000000"),
    ],
)
def test_impossible_plans_are_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        FcgfConfig(**change)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="positives=0 must be at least 1"):
        FcgfLossConfig(positives=0)


def test_configurations_survive_json() -> None:
    for name in ("fcgf-3dmatch", "nano"):
        values = json.loads(json.dumps(named_config(name).to_dict()))
        assert FcgfConfig.from_dict(values) == named_config(name)
