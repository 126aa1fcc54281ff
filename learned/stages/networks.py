# SPDX-License-Identifier: MIT
"""Loaded networks, kept outside the stages so that these stay plain values."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import torch

from hybridreg.learned.checkpoints import is_checkpoint
from hybridreg.learned.network_table import network_class
from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.weights import find_files
from hybridreg.runtime.threads import single
from hybridreg.runtime.torch_settings import as_torch_begins

_DEFAULT_SIZE = "nano"
# Networks held at a time: OMP and a matcher with other weights, each with its predecessor.
_HELD = 4


class NetworkName(NamedTuple):
    """The identity of a network."""

    network: str  # as `hybridreg.learned.network_table` knows it
    weights: str | None  # a folder, the name of shipped weights, a checkpoint; None for random weights
    size: str | None
    device: str
    image: bool = False  # of a network with random weights: has it OMP and VGAM?
    told: tuple[tuple[str, Any], ...] = ()  # what a published checkpoint does not contain


class Loaded(NamedTuple):
    """A network in evaluation mode, and which of its parts were never trained."""

    network: Pretrained
    untrained: frozenset[str]


def load(name: NetworkName) -> Loaded:
    """The network of a name, read once per process and again when its files change.

    Raises
    ------
    FileNotFoundError
        No such weights.
    ValueError
        Damaged weights (the tensor is named), or a device that this machine lacks.
    """
    return _load(name, _stamp(name.weights))


def forget() -> None:
    """Release all networks."""
    _load.cache_clear()


@lru_cache(maxsize=_HELD)
def _load(name: NetworkName, stamp: tuple[int, ...]) -> Loaded:
    try:
        torch.device(name.device)
    except RuntimeError as error:
        raise ValueError(f"device={name.device!r}: {str(error).splitlines()[0]}") from error
    if name.device.startswith("cuda") and not torch.cuda.is_available():
        raise ValueError(f"device={name.device!r}: torch finds no GPU here; use device='cpu'")
    # A module draws weights when it is created; the caller's generator must not be affected.
    with single(), as_torch_begins(), torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(0)
        network = _make(name)
    untrained = network.untrained()
    try:
        network = network.to(name.device)
    except (
        RuntimeError,
        NotImplementedError,
    ) as error:  # too little memory there, or a torch built without it
        raise ValueError(f"device={name.device!r}: {str(error).splitlines()[0]}; use device='cpu'") from error
    return Loaded(network.eval().requires_grad_(False), untrained)


def _make(name: NetworkName) -> Pretrained:
    cls = network_class(name.network)
    if name.weights is None:
        parts = {"omp": True, "vgam": True} if name.image else {}
        return cls.named(name.size or _DEFAULT_SIZE, **parts)
    if is_checkpoint(name.weights):
        return cls.load_official(name.weights, name.size, **dict(name.told))
    told = [f"{key}={value!r}" for key, value in (("size", name.size), *name.told) if value is not None]
    if told:
        raise ValueError(f"{', '.join(told)}: the weights {name.weights!r} have their own configuration")
    return cls.from_pretrained(name.weights)


def _stamp(weights: str | None) -> tuple[int, ...]:
    if weights is None:
        return ()
    files = [Path(weights)] if is_checkpoint(weights) else find_files(weights)
    found = [file.stat() for file in files if file.is_file()]
    return tuple(n for stat in found for n in (stat.st_mtime_ns, stat.st_size))
