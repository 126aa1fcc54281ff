# SPDX-License-Identifier: MIT
"""Weights on disk: safetensors beside a config.json, and GeoTransformer's published checkpoints."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save
from torch import Tensor, nn

from hybridreg.io.atomic import write_bytes, write_text
from hybridreg.io.files import read_whole
from hybridreg.io.structured import read_json
from hybridreg.io.torch_file import parse_torch
from hybridreg.learned.config import NetworkConfig
from hybridreg.learned.network import RegistrationNetwork
from hybridreg.learned.official_names import official_name
from hybridreg.learned.sizes import named_config
from hybridreg.shipped_weights import CONFIG_FILE, WEIGHTS_FILE, find, names


def save_pretrained(
    network: RegistrationNetwork, folder: str | os.PathLike[str], *, half: bool = False
) -> None:
    """Write ``config.json`` and ``model.safetensors`` into a folder, each whole or not at all.

    ``half`` stores float16, half the size; a network that reads it computes in float32 all the same.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(network.config.to_dict(), indent=1) + "\n"
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in network.state_dict().items()}
    if half:
        tensors = {
            name: tensor.half() if tensor.is_floating_point() else tensor for name, tensor in tensors.items()
        }
    # Serialised here: safetensors would replace the file by one that its owner alone can read.
    write_bytes(folder / WEIGHTS_FILE, save(tensors))
    write_text(folder / CONFIG_FILE, text)


def from_pretrained(name_or_folder: str | os.PathLike[str]) -> RegistrationNetwork:
    """A network in evaluation mode from a folder, or by the name of weights that come with the package.

    Raises
    ------
    FileNotFoundError
        No such folder and no such name; the message lists the names.
    ValueError
        A file is damaged, or a tensor is missing, superfluous, of another shape or not finite: it is named.
    """
    folder = _find(name_or_folder)
    try:
        values = read_json(folder / CONFIG_FILE)
    except ValueError as error:
        raise ValueError(f"{folder / CONFIG_FILE} is damaged: {error}") from error
    if isinstance(values, dict) and "network" in values:
        raise ValueError(f"{folder / CONFIG_FILE} is of the network {values['network']!r}, not of this one")
    try:
        config = NetworkConfig.from_dict(values)
    except (ValueError, TypeError, ArithmeticError) as error:
        raise ValueError(f"{folder / CONFIG_FILE} is damaged: {error}") from error
    try:
        tensors = load_file(folder / WEIGHTS_FILE)
    except SafetensorError as error:
        raise ValueError(f"{folder / WEIGHTS_FILE} is damaged: {error}") from error
    network = RegistrationNetwork(config)
    load_tensors(network, tensors, str(folder / WEIGHTS_FILE))
    return network.eval()


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
    raise FileNotFoundError(
        f"no {CONFIG_FILE} and {WEIGHTS_FILE} in {os.fspath(name_or_folder)!r}, and no shipped weights "
        f"of that name; shipped are: {', '.join(names()) or 'none'}"
    )


def load_tensors(module: nn.Module, tensors: Mapping[str, Tensor], origin: str) -> None:
    """Load strictly; a ``ValueError`` names the first tensor that is wrong and how many more are."""
    expected = module.state_dict()
    wrong = [f"{name} is missing" for name in expected if name not in tensors]
    wrong += [f"{name} is not part of this network" for name in tensors if name not in expected]
    for name, tensor in tensors.items():
        if name in expected and tensor.shape != expected[name].shape:
            wrong.append(f"{name} has shape {tuple(tensor.shape)}, not {tuple(expected[name].shape)}")
        elif name in expected and not bool(torch.isfinite(tensor).all()):
            wrong.append(f"{name} holds values that are not finite")
    if wrong:
        more = f" (and {len(wrong) - 1} more)" if len(wrong) > 1 else ""
        raise ValueError(f"{origin}: tensor {wrong[0]}{more}")
    module.load_state_dict(dict(tensors), strict=True)


def load_official(
    path: str | os.PathLike[str], config: NetworkConfig | str | None = None
) -> RegistrationNetwork:
    """GeoTransformer with one of its published checkpoints, in evaluation mode.

    Parameters
    ----------
    path
        A ``.pth.tar`` as published, or a bare state dict saved by ``torch.save``. Read with ``weights_only``.
    config
        A configuration or its name; by default ``geotransformer-kitti`` or ``geotransformer-3dmatch``,
        whichever has the checkpoint's number of stages.

    Raises
    ------
    ValueError
        Not a checkpoint of this network: the wrong tensor is named.
    """
    tensors = _read_checkpoint(Path(path))
    if config is None:
        five = any(name.startswith("backbone.encoder5_") for name in tensors)
        config = "geotransformer-kitti" if five else "geotransformer-3dmatch"
    network = RegistrationNetwork(named_config(config) if isinstance(config, str) else config)
    load_official_tensors(network, tensors, str(path))
    return network.eval()


def load_official_tensors(network: RegistrationNetwork, tensors: Mapping[str, Tensor], origin: str) -> None:
    """Load tensors that bear the checkpoint's names, strictly."""
    # Every non-official name is kept as it is, so that it is reported.
    ours = {official_name(name): name for name in network.state_dict()}
    load_tensors(network, {ours.get(name, name): tensor for name, tensor in tensors.items()}, origin)


def _read_checkpoint(path: Path) -> dict[str, Tensor]:
    if not path.is_file():
        raise FileNotFoundError(f"no checkpoint {os.fspath(path)!r}")
    content = parse_torch(read_whole(path), str(path))
    state = content.get("model", content) if isinstance(content, dict) else None
    if not isinstance(state, dict) or not all(isinstance(value, Tensor) for value in state.values()):
        raise ValueError(f"{path} holds no state dict, neither at the top nor under 'model'")
    return {name.removeprefix("module."): tensor for name, tensor in state.items()}
