# SPDX-License-Identifier: MIT
"""Weights on disk: safetensors beside a config.json, and checkpoints with the originals' tensor names."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save
from torch import Tensor, nn

from hybridreg.io.atomic import write_bytes, write_text
from hybridreg.io.shipped_weights import CONFIG_FILE, WEIGHTS_FILE, MissingWeights, find, names
from hybridreg.io.structured import read_json
from hybridreg.learned.geotransformer.official_names import official_name
from hybridreg.learned.network_table import DEFAULT, NETWORKS, network_class

_FLOATS = (torch.float64, torch.float32, torch.float16, torch.bfloat16)

if TYPE_CHECKING:
    from hybridreg.learned.pretrained import Pretrained


def save_pretrained(network: Pretrained, folder: str | os.PathLike[str], *, half: bool = False) -> None:
    """Write ``config.json`` and ``model.safetensors`` into a folder, each whole or not at all.

    ``half`` stores float16, half the size; a network that reads it computes in float32 all the same. A tensor that
    float16 cannot hold stays as it is: a variance over counts, or a bias so small that only zeros would be left, by
    which some networks know that they were never trained.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    # Versions before the other networks wrote a config.json without a name.
    named = {} if network.name == DEFAULT else {"network": network.name}
    text = json.dumps({**named, **network.config.to_dict()}, indent=1) + "\n"
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in network.state_dict().items()}
    if half:
        tensors = {name: _halved(tensor) for name, tensor in tensors.items()}
    # Serialised here: safetensors would replace the file by one that only its owner can read.
    write_bytes(folder / WEIGHTS_FILE, save(tensors))
    write_text(folder / CONFIG_FILE, text)


def _halved(tensor: Tensor) -> Tensor:
    if not tensor.is_floating_point():
        return tensor
    half = tensor.half()
    held = torch.equal(half.isfinite(), tensor.isfinite()) and bool(half.any()) == bool(tensor.any())
    return half if held else tensor


def from_pretrained(name_or_folder: str | os.PathLike[str], wanted: str | None = None) -> Pretrained:
    """The network of a folder, or of weights that come with the package, in evaluation mode.

    Parameters
    ----------
    wanted
        Name of the network that it must be; None takes any.

    Raises
    ------
    FileNotFoundError
        No such folder and no such name (`MissingWeights`); the message lists the names.
    ValueError
        A file is damaged, of another network than the wanted one, or a tensor is missing, superfluous, of another
        shape, not a float of 16 bits or more, not finite, or a weight of zeros only: it is named.
    """
    folder = _find(name_or_folder)
    cls, config = _read_config(folder, wanted)
    try:
        tensors = load_file(folder / WEIGHTS_FILE)
    except SafetensorError as error:
        raise ValueError(f"{folder / WEIGHTS_FILE} is damaged: {error}") from error
    network = cls(config)
    load_tensors(network, tensors, str(folder / WEIGHTS_FILE))
    return network.eval()


def read_config(name_or_folder: str | os.PathLike[str]) -> Any:
    """The configuration of a network's weights, without reading these; errors as `from_pretrained`."""
    return _read_config(_find(name_or_folder))[1]


def read_network(name_or_folder: str | os.PathLike[str]) -> tuple[str, Any]:
    """A network's name and configuration, without reading its weights; errors as `from_pretrained`."""
    cls, config = _read_config(_find(name_or_folder))
    return cls.name, config


def _read_config(folder: Path, wanted: str | None = None) -> tuple[type[Pretrained], Any]:
    try:
        name, values = _split(read_json(folder / CONFIG_FILE))
    except ValueError as error:
        raise ValueError(f"{folder / CONFIG_FILE} is damaged: {error}") from error
    if wanted is not None and name != wanted:
        raise ValueError(f"{folder} holds weights of the network {name!r}, not of {wanted!r}")
    try:
        cls = network_class(name)
        return cls, cls.config_type.from_dict(values)
    except (ValueError, TypeError, ArithmeticError) as error:
        raise ValueError(f"{folder / CONFIG_FILE} is damaged: {error}") from error


def _split(values: Any) -> tuple[str, dict[str, Any]]:
    """Name of the network, and its configuration's values."""
    if not isinstance(values, dict):
        raise ValueError(f"a table was expected, not {type(values).__name__}")
    rest = dict(values)
    name = rest.pop("network", DEFAULT)
    if not isinstance(name, str) or name not in NETWORKS:
        raise ValueError(f"unknown network {name!r}; known are {', '.join(NETWORKS)}")
    return name, rest


def find_files(name_or_folder: str | os.PathLike[str]) -> list[Path]:
    """Configuration and weights of a folder, or of a name.

    Raises
    ------
    FileNotFoundError
        As `from_pretrained`.
    """
    folder = _find(name_or_folder)
    return [folder / CONFIG_FILE, folder / WEIGHTS_FILE]


def _find(name_or_folder: str | os.PathLike[str]) -> Path:
    folder = find(name_or_folder)
    if folder is not None:
        return folder
    raise MissingWeights(
        f"no {CONFIG_FILE} and {WEIGHTS_FILE} in {os.fspath(name_or_folder)!r}, and no shipped weights "
        f"of that name; shipped are: {', '.join(names()) or 'none'}"
    )


def load_tensors(module: nn.Module, tensors: Mapping[str, Tensor], origin: str) -> None:
    """Load strictly; a ``ValueError`` names the first tensor that is wrong and how many more are."""
    expected = module.state_dict()
    wrong = [f"{name} is missing" for name in expected if name not in tensors]
    wrong += [f"{name} is not part of this network" for name in tensors if name not in expected]
    for name, tensor in tensors.items():
        if name in expected and (fault := _fault(name, tensor, expected[name])):
            wrong.append(f"{name} {fault}")
    if wrong:
        more = f" (and {len(wrong) - 1} more)" if len(wrong) > 1 else ""
        raise ValueError(f"{origin}: tensor {wrong[0]}{more}")
    module.load_state_dict(dict(tensors), strict=True)


def _fault(name: str, tensor: Tensor, expected: Tensor) -> str:
    """What is wrong with a tensor; empty if nothing is."""
    if tensor.shape != expected.shape:
        return f"has shape {tuple(tensor.shape)}, not {tuple(expected.shape)}"
    if not expected.is_floating_point():
        return "" if tensor.dtype == expected.dtype else f"is {tensor.dtype}, not {expected.dtype}"
    if tensor.dtype not in _FLOATS:
        # Integers and eight bits are quantised: meaningless without their scale, which is missing here.
        return f"is {tensor.dtype}; store it as float32, float16 or bfloat16"
    if not bool(torch.isfinite(tensor).all()):
        return "holds values that are not finite"
    if (tensor.ndim > 1 or name.endswith("weight")) and tensor.numel() > 1 and not bool(tensor.any()):
        return "holds zeros only"
    return ""


def load_official(
    path: str | os.PathLike[str], size: Any = None, network: str = DEFAULT, **options: Any
) -> Pretrained:
    """A network with one of its published checkpoints, in evaluation mode: `Pretrained.load_official` of its class.

    Parameters
    ----------
    network
        Its name; by default GeoTransformer's checkpoints are read.
    """
    return network_class(network).load_official(path, size, **options)


def load_official_tensors(
    network: nn.Module,
    tensors: Mapping[str, Tensor],
    origin: str,
    naming: Callable[[str], str] = official_name,
    unused: Collection[str] = (),
) -> None:
    """Load tensors with a checkpoint's names, strictly.

    Parameters
    ----------
    naming
        Gives the checkpoint's name for ours. Where we have a linear layer, a convolution of size one is accepted too.
    unused
        Names that every checkpoint contains but no computation uses: they must be there, and are ignored.

    Raises
    ------
    ValueError
        A tensor is missing, superfluous, of another shape or not finite: it is named.
    """
    absent = [name for name in unused if name not in tensors]
    if absent:
        raise ValueError(f"{origin}: tensor {absent[0]} is missing")
    state = network.state_dict()
    ours = {naming(name): name for name in state}
    left = set(unused)
    # Every name that is not official is kept, so that it is reported.
    given = {ours.get(name, name): tensor for name, tensor in tensors.items() if name not in left}
    load_tensors(network, {name: _as_ours(tensor, state.get(name)) for name, tensor in given.items()}, origin)


def _as_ours(tensor: Tensor, ours: Tensor | None) -> Tensor:
    if ours is None or tensor.shape[: ours.dim()] != ours.shape or tensor.numel() != ours.numel():
        return tensor
    return tensor.reshape(ours.shape)
