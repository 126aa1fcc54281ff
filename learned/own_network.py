# SPDX-License-Identifier: MIT
"""What the networks beside today's have in common on disk: safetensors, and a config.json that says which it is."""

from __future__ import annotations

import json
import os
from abc import abstractmethod
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save
from torch import Tensor, nn

from hybridreg.io.atomic import write_bytes, write_text
from hybridreg.io.files import read_whole
from hybridreg.io.structured import read_json
from hybridreg.io.torch_file import parse_torch
from hybridreg.learned.untrained import untrained_parts
from hybridreg.learned.weights import find_files, load_tensors

if TYPE_CHECKING:
    from typing_extensions import Self


class OwnNetwork(nn.Module):
    """A network with a configuration of its own.

    A subclass says its ``kind``, which config.json holds under "network", and offers ``build`` and ``named``.
    """

    kind: ClassVar[str]
    config: Any

    @classmethod
    @abstractmethod
    def build(cls, values: Mapping[str, Any]) -> Self:
        """A network of random weights from a configuration's plain values."""

    @classmethod
    @abstractmethod
    def named(cls, size: str) -> Self:
        """A network of random weights of a size by name; ``KeyError`` lists the known ones."""

    @classmethod
    @abstractmethod
    def load_official(cls, path: str | os.PathLike[str], size: Any = None) -> Self:
        """A network with a published checkpoint, in evaluation mode."""

    def untrained(self) -> frozenset[str]:
        """Names of the parts that no training step has touched."""
        return untrained_parts(self)

    def save_pretrained(self, folder: str | os.PathLike[str], *, half: bool = False) -> None:
        """Write ``config.json`` and ``model.safetensors`` into a folder, each whole or not at all.

        ``half`` stores float16; a network that reads it computes in float32 all the same.
        """
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        values = {"network": self.kind, **self.config.to_dict()}
        tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in self.state_dict().items()}
        if half:
            tensors = {name: t.half() if t.is_floating_point() else t for name, t in tensors.items()}
        write_bytes(folder / "model.safetensors", save(tensors))
        write_text(folder / "config.json", json.dumps(values, indent=1) + "\n")

    @classmethod
    def from_pretrained(cls, name_or_folder: str | os.PathLike[str]) -> Self:
        """A network in evaluation mode from a folder, or by the name of weights that come with the package.

        Raises
        ------
        FileNotFoundError
            No such folder and no such name.
        ValueError
            Weights of another network, a damaged file, or a tensor that is missing, superfluous, of another shape or
            not finite.
        """
        config_file, weights_file = find_files(name_or_folder)
        try:
            values = read_json(config_file)
        except ValueError as error:
            raise ValueError(f"{config_file} is damaged: {error}") from error
        said = values.get("network", "geotransformer") if isinstance(values, dict) else None
        if said != cls.kind:
            raise ValueError(f"{config_file} is of the network {said!r}, not of {cls.kind!r}")
        try:
            network = cls.build({name: value for name, value in values.items() if name != "network"})
        except (ValueError, TypeError, ArithmeticError) as error:
            raise ValueError(f"{config_file} is damaged: {error}") from error
        try:
            tensors = load_file(weights_file)
        except SafetensorError as error:
            raise ValueError(f"{weights_file} is damaged: {error}") from error
        load_tensors(network, tensors, str(weights_file))
        return network.eval()


def load_by_names(
    network: nn.Module,
    tensors: Mapping[str, Tensor],
    official: Mapping[str, str],
    unused: Collection[str],
    origin: str,
) -> None:
    """Load tensors that bear a checkpoint's names, strictly.

    Parameters
    ----------
    official
        The checkpoint's name of each of our tensors.
    unused
        Names that the checkpoint holds and no computation reads: they must be there, and are left aside.

    Raises
    ------
    ValueError
        A tensor is missing, superfluous, of another shape or not finite: it is named.
    """
    absent = [name for name in unused if name not in tensors]
    if absent:
        raise ValueError(f"{origin}: tensor {absent[0]} is missing")
    ours = {theirs: name for name, theirs in official.items()}
    left = set(unused)
    load_tensors(network, {ours.get(n, n): t for n, t in tensors.items() if n not in left}, origin)


def read_state(path: str | os.PathLike[str], *keys: str) -> dict[str, Tensor]:
    """The state dict of a checkpoint, at the top or under one of ``keys``, without the wrapper's ``module.``.

    Raises
    ------
    FileNotFoundError
        No such file.
    ValueError
        Damaged, with anything else inside than plain values (nothing of it is run), or without a state dict.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"no checkpoint {os.fspath(path)!r}")
    content = parse_torch(read_whole(path), str(path))
    state = content
    if isinstance(content, dict):
        state = next((content[key] for key in keys if key in content), content)
    if not isinstance(state, dict) or not all(isinstance(value, torch.Tensor) for value in state.values()):
        raise ValueError(f"{path} holds no state dict, neither at the top nor under {' or '.join(keys)}")
    return {name.removeprefix("module."): tensor for name, tensor in state.items()}
