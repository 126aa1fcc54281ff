# SPDX-License-Identifier: MIT
"""A run that begins with what other weights know."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from training_runs import MakeRecipe

from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.learned.training.initial_weights import first_network
from hybridreg.learned.weights import save_pretrained


@pytest.fixture(scope="module")
def warm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A backbone's weights, of a network without OMP and VGAM."""
    torch.manual_seed(9)
    folder = tmp_path_factory.mktemp("warm")
    save_pretrained(RegistrationNetwork(named_config("nano")), folder)
    return folder


def test_a_warm_backbone_is_taken_over(
    make_recipe: MakeRecipe, warm: Path, caplog: pytest.LogCaptureFixture
) -> None:
    fresh = first_network(make_recipe()).state_dict()
    with caplog.at_level(logging.INFO, logger="hybridreg.learned.training.initial_weights"):
        started = first_network(make_recipe(start=str(warm)))
    torch.manual_seed(9)
    known = RegistrationNetwork(named_config("nano")).state_dict()
    for name, tensor in started.state_dict().items():
        assert torch.equal(tensor, known.get(name, fresh[name])), name
    assert any(not torch.equal(known[name], fresh[name]) for name in known)
    assert started.training
    assert "fresh parts: image_encoder, omp, vgam" in caplog.text


def test_a_mismatch_names_the_tensor(make_recipe: MakeRecipe, warm: Path) -> None:
    recipe = make_recipe(network={"backbone": {"init_dim": 32}}, start=str(warm))
    with pytest.raises(ValueError, match=r"start=.*: tensor backbone\..* has shape .*, not "):
        first_network(recipe)


def test_names_that_do_not_exist_are_told(make_recipe: MakeRecipe) -> None:
    with pytest.raises(FileNotFoundError, match="no shipped weights of that name"):
        first_network(make_recipe(start="no-such-weights"))


def test_the_first_weights_follow_from_the_seed_alone(make_recipe: MakeRecipe) -> None:
    recipe = make_recipe()
    first = first_network(recipe).state_dict()
    torch.manual_seed(77)
    before = torch.get_rng_state()
    again = first_network(recipe).state_dict()
    assert torch.equal(torch.get_rng_state(), before)
    other = first_network(replace(recipe, seed=4)).state_dict()
    assert all(torch.equal(first[name], again[name]) for name in first)
    assert not torch.equal(first["in_proj.weight"], other["in_proj.weight"])
