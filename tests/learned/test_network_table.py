# SPDX-License-Identifier: MIT
"""Every network of the table offers what loading, stages and training ask for."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch

from hybridreg import registry
from hybridreg.learned.network_table import DEFAULT, NETWORKS, network_class
from hybridreg.learned.stages.network_stage import NetworkStage
from hybridreg.learned.weights import from_pretrained

NAMES = list(NETWORKS)


@pytest.mark.parametrize("name", NAMES)
def test_what_is_saved_comes_back_as_the_same_network(name: str, tmp_path: Path) -> None:
    network = network_class(name).named("nano")
    network.save_pretrained(tmp_path)
    assert json.loads((tmp_path / "config.json").read_text()).get("network", DEFAULT) == name
    for loaded in (from_pretrained(tmp_path), network_class(name).from_pretrained(tmp_path)):
        assert type(loaded) is type(network)
        assert loaded.config == network.config
        assert not loaded.training
        assert all(torch.equal(t, loaded.state_dict()[n]) for n, t in network.state_dict().items())


@pytest.mark.parametrize("name", NAMES)
def test_no_network_takes_another_ones_weights(name: str, tmp_path: Path) -> None:
    network_class(name).named("nano").save_pretrained(tmp_path)
    for other in NAMES:
        if other != name:
            with pytest.raises(ValueError, match=f"weights of the network {name!r}, not of {other!r}"):
                network_class(other).from_pretrained(tmp_path)


@pytest.mark.parametrize("name", NAMES)
def test_sizes_by_name(name: str) -> None:
    cls = network_class(name)
    assert cls.name == name
    assert {"nano", "small"} < set(cls.sizes)
    assert any(size.startswith("geotransformer-" if name == DEFAULT else name) for size in cls.sizes)
    for size in cls.sizes:
        config = cls.named_config(size)
        assert cls.config_type.from_dict(json.loads(json.dumps(config.to_dict()))) == config
    with pytest.raises(KeyError, match="unknown size 'huge'"):
        cls.named("huge")


@pytest.mark.parametrize("name", [name for name in NAMES if name != DEFAULT])
def test_small_has_three_million_parameters_at_most(name: str) -> None:
    with torch.device("meta"):
        network = network_class(name).named("small")
    assert sum(parameter.numel() for parameter in network.parameters()) <= 3_000_000


def test_random_weights_are_told_and_every_network_has_a_stage() -> None:
    served = set()
    for key in registry.BUILT_IN:
        stage = registry.load(*key.split("."))
        if issubclass(stage, NetworkStage):
            served.add(stage.kind)
            assert stage.parts & network_class(stage.kind).named("nano").untrained() or stage.image
    assert served == set(NETWORKS)


def test_an_unknown_network_is_told_with_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(KeyError, match="unknown network 'dgr'; known are cross3dreg, fcgf, predator"):
        network_class("dgr")
    network_class("omnet").named("nano").save_pretrained(tmp_path)
    values = json.loads((tmp_path / "config.json").read_text())
    (tmp_path / "config.json").write_text(json.dumps({**values, "network": "dgr"}))
    with pytest.raises(ValueError, match="damaged: unknown network 'dgr'; known are"):
        from_pretrained(tmp_path)
    (tmp_path / "config.json").write_text(json.dumps({**values, "network": ["fcgf"]}))
    with pytest.raises(ValueError, match="unknown network"):
        from_pretrained(tmp_path)
