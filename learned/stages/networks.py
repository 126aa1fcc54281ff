# SPDX-License-Identifier: MIT
"""Loaded networks, kept outside of the stages so that these stay plain values."""

from __future__ import annotations

from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import torch

from hybridreg.learned.network import RegistrationNetwork
from hybridreg.learned.pretrained import network_class
from hybridreg.learned.sizes import named_config
from hybridreg.learned.untrained import untrained_parts
from hybridreg.learned.weights import find_files, from_pretrained, load_official
from hybridreg.threads import single

_DEFAULT_SIZE = "nano"
_CHECKPOINTS = (".tar", ".pth", ".pt", ".pkl")
# Networks held at a time: OMP and a matcher of other weights, each beside the one before it.
_HELD = 4


class NetworkName(NamedTuple):
    """All that tells one network from another."""

    weights: str | None  # a folder, the name of shipped weights, a checkpoint; None for random weights
    size: str | None
    device: str
    image: bool  # of a network of random weights: has it OMP and VGAM?
    network: str | None = None  # as `hybridreg.learned.pretrained` knows it; None for `RegistrationNetwork`
    options: tuple[tuple[str, Any], ...] = ()  # what a published checkpoint cannot tell


class Loaded(NamedTuple):
    """A network in evaluation mode, and which of its parts were never trained."""

    network: RegistrationNetwork
    untrained: frozenset[str]


def load(name: NetworkName) -> Loaded:
    """The network of a name, read once a process and again when its files changed.

    Raises
    ------
    FileNotFoundError
        No such weights.
    ValueError
        Damaged weights (the tensor is named), or a device that this machine lacks.
    """
    return _load(name, _stamp(name.weights))


@lru_cache(maxsize=_HELD)
def _load(name: NetworkName, stamp: tuple[int, ...]) -> Loaded:
    try:
        torch.device(name.device)
    except RuntimeError as error:
        raise ValueError(f"device={name.device!r}: {str(error).splitlines()[0]}") from error
    if name.device.startswith("cuda") and not torch.cuda.is_available():
        raise ValueError(f"device={name.device!r}: torch finds no GPU here; use device='cpu'")
    # A module draws weights when it is made; the caller's generator must not notice.
    with single(), torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(0)
        network = _make(name)
    untrained = network.untrained() if hasattr(network, "untrained") else untrained_parts(network)
    return Loaded(network.to(name.device).eval().requires_grad_(False), untrained)


def _make(name: NetworkName) -> Any:
    if name.network is not None:
        return _make_other(name)
    if name.weights is None:
        return RegistrationNetwork(named_config(name.size or _DEFAULT_SIZE, omp=name.image, vgam=name.image))
    if is_checkpoint(name.weights):
        return load_official(name.weights, name.size)
    if name.size is not None:
        raise ValueError(f"size={name.size!r}: the weights {name.weights!r} bring their own configuration")
    return from_pretrained(name.weights)


def _make_other(name: NetworkName) -> Any:
    if ":" in (name.network or ""):
        return _make_own(name)
    cls = network_class(name.network or "")
    if name.weights is None:
        return cls(cls.named_config(name.size or _DEFAULT_SIZE))
    if name.size is not None:
        raise ValueError(f"size={name.size!r}: the weights {name.weights!r} tell their own configuration")
    if is_checkpoint(name.weights):
        return cls.load_official(name.weights, **dict(name.options))
    told = [f"{key}={value!r}" for key, value in name.options if value is not None]
    if told:
        raise ValueError(f"{', '.join(told)}: the weights {name.weights!r} bring their own configuration")
    return cls.from_pretrained(name.weights)


def _make_own(name: NetworkName) -> Any:
    module, _, attribute = str(name.network).partition(":")
    cls = getattr(import_module(module), attribute)
    if name.weights is None:
        return cls.named(name.size or _DEFAULT_SIZE)
    if is_checkpoint(name.weights):
        return cls.load_official(name.weights, name.size)
    if name.size is not None:
        raise ValueError(f"size={name.size!r}: the weights {name.weights!r} bring their own configuration")
    return cls.from_pretrained(name.weights)


def is_checkpoint(weights: str) -> bool:
    """Is it the name of a published checkpoint, not of a folder?"""
    return weights.endswith(_CHECKPOINTS)


def _stamp(weights: str | None) -> tuple[int, ...]:
    if weights is None:
        return ()
    files = [Path(weights)] if is_checkpoint(weights) else find_files(weights)
    found = [file.stat() for file in files if file.is_file()]
    return tuple(n for stat in found for n in (stat.st_mtime_ns, stat.st_size))
