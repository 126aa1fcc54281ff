# SPDX-License-Identifier: MIT
"""The network at the start of a run: random, or with weights taken over from another."""

from __future__ import annotations

import logging

import torch

from hybridreg.learned.network_table import network_class
from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.training.recipe import Recipe
from hybridreg.learned.weights import from_pretrained

_log = logging.getLogger(__name__)


def first_network(recipe: Recipe) -> Pretrained:
    """A network in training mode, its weights fixed by the recipe's seed.

    Raises
    ------
    ValueError
        `recipe.start` has a tensor of another shape, or no tensor that this network has.
    """
    with torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(recipe.seed)
        network = network_class(recipe.kind).seeded(recipe.network, recipe.seed)
    if recipe.start:
        _take_over(network, recipe.start)
    return network.train()


def _take_over(network: Pretrained, start: str) -> None:
    own, found = network.state_dict(), from_pretrained(start).state_dict()
    shared = {name: tensor for name, tensor in found.items() if name in own}
    wrong = [name for name, tensor in shared.items() if tensor.shape != own[name].shape]
    if wrong or not shared:
        reason = "no tensor has a name of this network's"
        if wrong:
            shapes = tuple(found[wrong[0]].shape), tuple(own[wrong[0]].shape)
            reason = (
                f"tensor {wrong[0]} has shape {shapes[0]}, not {shapes[1]}; leave network and size out of the recipe, "
                "and it takes the network of these weights"
            )
        raise ValueError(f"start={start!r}: {reason}")
    network.load_state_dict(shared, strict=False)
    fresh = sorted({name.partition(".")[0] for name in own if name not in shared})
    _log.info(
        "start=%s: %d tensors taken over; fresh parts: %s", start, len(shared), ", ".join(fresh) or "none"
    )
