# SPDX-License-Identifier: MIT
"""Configurations and weights on disk."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file, save_file

from hybridreg.learned.cross3dreg.batch import Batch
from hybridreg.learned.cross3dreg.config import BackboneConfig, NetworkConfig, TransformerConfig
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.learned.geotransformer.official_names import official_name
from hybridreg.learned.weights import from_pretrained, load_official, save_pretrained


@pytest.fixture
def folder(network: RegistrationNetwork, tmp_path: Path) -> Path:
    """The small network, saved."""
    save_pretrained(network, tmp_path / "weights")
    return tmp_path / "weights"


def test_a_saved_network_comes_back(folder: Path, network: RegistrationNetwork, batch: Batch) -> None:
    loaded = from_pretrained(folder)
    assert loaded.config == network.config
    assert not loaded.training
    with torch.no_grad():
        assert torch.equal(loaded(batch).matches.weight, network(batch).matches.weight)
    assert sorted(path.name for path in folder.iterdir()) == ["config.json", "model.safetensors"]


def test_half_the_size_keeps_what_half_the_precision_cannot_hold(
    network: RegistrationNetwork, tmp_path: Path
) -> None:
    *names, tiny = [name for name, _ in network.named_parameters()][:3]
    with torch.no_grad():
        network.get_parameter(names[0]).view(-1)[0] = 1e5
        network.get_parameter(tiny).fill_(1e-9)
    save_pretrained(network, tmp_path, half=True)
    stored = load_file(tmp_path / "model.safetensors")
    assert [stored[name].dtype for name in names] == [torch.float32, torch.float16]
    assert stored[tiny].dtype == torch.float32
    assert bool((stored[tiny] == 1e-9).all())
    assert float(from_pretrained(tmp_path).get_parameter(names[0]).detach().view(-1)[0]) == 1e5


def spoil(folder: Path, **changes: torch.Tensor | None) -> None:
    """Replace or drop tensors of a saved network."""
    tensors = load_file(folder / "model.safetensors")
    for name, tensor in changes.items():
        if tensor is None:
            del tensors[name]
        else:
            tensors[name] = tensor
    save_file(tensors, folder / "model.safetensors")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"in_proj.bias": None}, "in_proj.bias is missing"),
        ({"in_proj.bias": torch.zeros(3)}, r"in_proj.bias has shape \(3,\), not \(64,\)"),
        ({"in_proj.bias": torch.full((64,), torch.nan)}, "in_proj.bias holds values that are not finite"),
        ({"in_proj.weight": torch.zeros(64, 256)}, "in_proj.weight holds zeros only"),
        (
            {"in_proj.bias": torch.zeros(64, dtype=torch.int64)},
            "in_proj.bias is torch.int64; store it as float32",
        ),
        ({"in_proj.bias": torch.zeros(64, dtype=torch.uint8)}, "in_proj.bias is torch.uint8"),
        ({"in_proj.bias": torch.zeros(64, dtype=torch.bool)}, "in_proj.bias is torch.bool"),
        ({"in_proj.bias": torch.zeros(64).to(torch.float8_e4m3fn)}, "in_proj.bias is torch.float8_e4m3fn"),
        ({"in_proj.bias": torch.zeros(64).to(torch.float8_e5m2)}, "in_proj.bias is torch.float8_e5m2"),
        (
            {"in_proj.bias": torch.full((64,), torch.inf).half()},
            "in_proj.bias holds values that are not finite",
        ),
        ({"surplus": torch.zeros(1)}, "surplus is not part of this network"),
        ({"in_proj.bias": None, "in_proj.weight": None}, "and 1 more"),
    ],
)
def test_a_wrong_tensor_is_named(folder: Path, changes: dict[str, torch.Tensor | None], message: str) -> None:
    spoil(folder, **changes)
    with pytest.raises(ValueError, match=message):
        from_pretrained(folder)


@pytest.mark.parametrize("dtype", [torch.float64, torch.float16, torch.bfloat16])
def test_other_floats_are_read(folder: Path, dtype: torch.dtype) -> None:
    spoil(folder, **{"in_proj.bias": torch.zeros(64, dtype=dtype)})
    assert from_pretrained(folder).state_dict()["in_proj.bias"].dtype == torch.float32


@pytest.mark.parametrize("spoilt", [torch.zeros_like, lambda t: t * torch.nan, lambda t: t.to(torch.int32)])
def test_a_spoilt_checkpoint_is_named(network: RegistrationNetwork, tmp_path: Path, spoilt) -> None:  # type: ignore[no-untyped-def]
    state = {official_name(name): tensor for name, tensor in network.state_dict().items()}
    name = official_name("in_proj.weight")
    torch.save({"model": {**state, name: spoilt(state[name])}}, tmp_path / "a.pth.tar")
    with pytest.raises(ValueError, match=r"in_proj\.weight (holds|is)"):
        load_official(tmp_path / "a.pth.tar", network.config)


def test_damaged_files_are_named(folder: Path) -> None:
    weights = folder / "model.safetensors"
    weights.write_bytes(weights.read_bytes()[:-100])
    with pytest.raises(ValueError, match=r"model\.safetensors is damaged"):
        from_pretrained(folder)
    (folder / "config.json").write_text("{")
    with pytest.raises(ValueError, match=r"config\.json is damaged"):
        from_pretrained(folder)


def test_an_unknown_key_is_named(folder: Path) -> None:
    values = json.loads((folder / "config.json").read_text())
    values["backbone"]["colour"] = 1
    (folder / "config.json").write_text(json.dumps(values))
    with pytest.raises(ValueError, match=r"config\.backbone: unknown keys \['colour'\]"):
        from_pretrained(folder)


def test_an_unknown_name_says_so() -> None:
    with pytest.raises(FileNotFoundError, match="no shipped weights of that name"):
        from_pretrained("no-such-weights")


@pytest.mark.parametrize("name", ["full", "nano", "geotransformer-3dmatch"])
@pytest.mark.parametrize("learned", [False, True])
def test_configurations_survive_json(name: str, learned: bool) -> None:
    config = named_config(name, omp=learned, vgam=learned)
    assert NetworkConfig.from_dict(json.loads(json.dumps(config.to_dict()))) == config


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: BackboneConfig(stages=4), "5 neighbor_limits for 4 stages"),
        (lambda: BackboneConfig(fine_stage=5), r"fine_stage 5 must lie in 1\.\.4"),
        (lambda: BackboneConfig(init_dim=16), "divisible by groups 32"),
        (lambda: TransformerConfig(blocks=("self", "croos")), "croos"),
        (lambda: TransformerConfig(hidden_dim=30), "divisible by heads"),
        (lambda: replace(named_config("nano", omp=True), image=None), "give an ImageConfig"),
    ],
)
def test_impossible_plans_are_refused(make, message: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize(
    ("name", "tensors", "parameters"),
    [("geotransformer-kitti", 316, 25_499_137), ("geotransformer-3dmatch", None, 9_829_377)],
)
def test_published_checkpoints_fit(name: str, tensors: int | None, parameters: int, tmp_path: Path) -> None:
    """The published counts, and a checkpoint of the published layout, load strictly."""
    torch.manual_seed(5)
    network = RegistrationNetwork(named_config(name))
    state = {f"module.{official_name(key)}": value for key, value in network.state_dict().items()}
    assert len(state) == len(network.state_dict())
    assert tensors in (None, len(state))
    assert sum(p.numel() for p in network.parameters()) == parameters
    file = tmp_path / "snapshot.pth.tar"
    torch.save({"epoch": 1, "iteration": 2, "model": state}, file)
    loaded = load_official(file)
    assert loaded.config == network.config
    assert all(
        torch.equal(a, b)
        for a, b in zip(loaded.state_dict().values(), network.state_dict().values(), strict=True)
    )
    del state["module.transformer.in_proj.bias"]
    torch.save({"model": state}, file)
    with pytest.raises(ValueError, match=r"tensor in_proj\.bias is missing"):
        load_official(file)


def test_a_checkpoint_with_code_in_it_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "bad.pth.tar"
    torch.save({"model": {"a": Path("x")}}, file)
    with pytest.raises(ValueError, match="can be read safely"):
        load_official(file)
    with pytest.raises(FileNotFoundError):
        load_official(tmp_path / "none.pth.tar")
